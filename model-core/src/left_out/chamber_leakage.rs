//! `chamber-leakage`: gas lost from a chamber to the surroundings.
//!
//! Two forms, which may be present together:
//!
//! ```text
//! laminar gap   m' = K (p^2 - p0^2)            a band or seal gap, Poiseuille
//! orifice       m' = flow law (1) with area A  a hole, a cracked fitting
//! ```
//!
//! A is the geometric area of an orifice with the discharge coefficient (2) of the flow law:
//! the effective area, by which leaks are often stated, is 0.82 of it.
//!
//! The slotted, band-sealed drive of the paper loses gas this way by design;
//! the paper neglects it. Typical K: 0.5-5 e-16 kg/(s Pa^2). Confused with
//! heat exchange late in a decay (the leak settles at p0, heat at a pressure
//! above) and, on an axis, with the valve's critical ratio. A long dwell at
//! closed valve separates them; laminar and orifice differ below about twice
//! the ambient pressure, and by the curvature of the decay above it.

use crate::real::Real;
use crate::valve::{FlowLaw, GasState, OrificeFlow};

/// Leakage of one chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChamberLeakage<R> {
    /// K, kg/(s Pa^2); 0 is neutral.
    pub laminar_kg_per_s_pa2: R,
    /// Orifice area, m2; 0 is neutral.
    pub orifice_area_m2: R,
}

impl<R: Real> ChamberLeakage<R> {
    /// No leak.
    pub const NEUTRAL: Self = Self {
        laminar_kg_per_s_pa2: R::ZERO,
        orifice_area_m2: R::ZERO,
    };

    /// Whether there is a leak at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.orifice_area_m2 != R::ZERO || self.laminar_kg_per_s_pa2 != R::ZERO
    }

    /// The same leak, open to this part.
    #[must_use]
    pub fn scaled(&self, share: R) -> Self {
        Self {
            laminar_kg_per_s_pa2: self.laminar_kg_per_s_pa2 * share,
            orifice_area_m2: self.orifice_area_m2 * share,
        }
    }

    /// Flow out of the chamber and its slope by the chamber's pressure.
    #[inline]
    pub fn outflow(&self, law: &FlowLaw<R>, chamber: GasState<R>, ambient: GasState<R>) -> (R, R) {
        if !self.is_present() {
            return (R::ZERO, R::ZERO);
        }
        let OrificeFlow {
            mass_flow_kg_per_s,
            slope_1_kg_per_s_pa,
            ..
        } = law.flow(self.orifice_area_m2, chamber, ambient);
        let (p, p0) = (chamber.pressure_pa, ambient.pressure_pa);
        let laminar = self.laminar_kg_per_s_pa2 * (p - p0) * (p + p0);
        let slope = self.laminar_kg_per_s_pa2 * (p + p);
        (mass_flow_kg_per_s + laminar, slope_1_kg_per_s_pa + slope)
    }
}
