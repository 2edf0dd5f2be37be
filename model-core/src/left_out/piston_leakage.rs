//! `piston-leakage`: gas that passes the piston from one chamber to the other.
//!
//! ```text
//! laminar gap   m' = K (pa^2 - pb^2)            a worn seal, Poiseuille
//! orifice       m' = flow law (1) with area A   a nick, a cracked piston
//! ```
//!
//! The gas carries the temperature of the chamber that it leaves. Typical:
//! K 0.5-5 e-16 kg/(s Pa^2), 0.13-1.3 l/min at 0.5 bar; it matters from about
//! 0.1 l/min, half a kilopascal per second in the middle of the stroke. Confused
//! with the valve's closed paths (dead zone, leakage area) and heat exchange, which
//! hide 52-87 % of it; what separates is a held piston with the valve at its null:
//! the difference of the pressures decays while their sum stays.
//!
//! One flow is taken for both chambers through the whole step, so that what one
//! loses the other gets. It is the flow at the step's start, softened by how fast it
//! would level the pressures out: a leak of any size levels them at the most.

use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// The leak between the chambers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PistonLeakage<R> {
    /// K, kg/(s Pa^2); 0 is neutral.
    pub laminar_kg_per_s_pa2: R,
    /// Orifice area, m2; 0 is neutral.
    pub orifice_area_m2: R,
}

/// Gas on its way past the piston.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<R> {
    /// Mean flow over the step into one of the chambers, kg/s.
    pub into_kg_per_s: R,
    /// Temperature of the gas that crosses, K.
    pub temperature_k: R,
}

impl<R: Real> PistonLeakage<R> {
    /// A tight piston.
    pub const NEUTRAL: Self = Self {
        laminar_kg_per_s_pa2: R::ZERO,
        orifice_area_m2: R::ZERO,
    };

    /// Whether there is a leak at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.laminar_kg_per_s_pa2 > R::ZERO || self.orifice_area_m2 > R::ZERO
    }

    /// The flow from a into b over one step. `pa_per_kg` is the sum over both chambers of how
    /// much their pressure changes per mass that comes or goes.
    pub fn crossing(
        &self,
        law: &FlowLaw<R>,
        (a, b): (GasState<R>, GasState<R>),
        pa_per_kg: R,
        dt_s: R,
    ) -> Crossing<R> {
        let conductance = self.laminar_kg_per_s_pa2 * (a.pressure_pa + b.pressure_pa)
            + law.conductance(self.orifice_area_m2, a, b);
        let apart_pa = a.pressure_pa - b.pressure_pa;
        let upstream = if apart_pa < R::ZERO { b } else { a };
        // How much of the difference one explicit step would level out, and the
        // mean over the step: trapezoid, and from 2 on all of it at the most.
        let levelled = conductance * pa_per_kg * dt_s;
        let softened = R::ONE + (levelled * R::from_f64(0.5)).max(levelled - R::ONE);
        Crossing {
            into_kg_per_s: conductance * apart_pa / softened,
            temperature_k: upstream.temperature_k,
        }
    }
}
