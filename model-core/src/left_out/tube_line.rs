//! `tube-line`: a tube between a valve port and a chamber.
//!
//! Lumped: the tube's volume as a node at the valve, its gas as a mass that the
//! pressure difference accelerates against wall friction.
//!
//! ```text
//! V_t pt' = gamma R T (m_valve - m_line),   V_t = A_t L
//! (L/A_t) m_line' = pt - pc - k(m_line) m_line
//! k = (32 mu L / (D^2 A_t rho)) max(1, 0.0049375 Re^(3/4)),  Re = 4 |m| / (pi D mu)
//! ```
//!
//! Laminar friction by Hagen and Poiseuille, turbulent by Blasius in the form
//! of Richer and Hurmuzlu; they meet at Re = 1190. Valid below about half the
//! first wave resonance c/(4 L) (85 Hz for 1 m). Range 0.1-3 m of 3-8 mm.
//! Confused with valve area, dead zone and dead volume (84-92 % of it is
//! absorbed by them), with delay and spool lag; bursts at two piston positions
//! separate them. Implicit in node pressure, flow and chamber pressure: stable
//! at every length and step.

use crate::gas::Gas;
use crate::real::Real;

/// Dynamic viscosity of air at 293 K, Pa s (changes by 0.2 %/K, not by pressure).
const VISCOSITY_PA_S: f64 = 1.82e-5;
/// 0.158 / 32: turbulent over laminar friction per Re^(3/4).
const TURBULENT_RATIO: f64 = 0.158 / 32.0;

/// One tube; a length of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLine<R> {
    /// Length, m.
    pub length_m: R,
    /// Inner diameter, m.
    pub diameter_m: R,
}

/// Node pressure and line flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeState<R> {
    /// Pressure at the valve's end, Pa.
    pub pressure_pa: R,
    /// Flow towards the chamber, kg/s.
    pub mass_flow_kg_per_s: R,
}

/// What the line opens into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeEnd<R> {
    /// The chamber's pressure, Pa.
    pub pressure_pa: R,
    /// Its rise per mass let in, Pa/kg.
    pub pa_per_kg: R,
    /// What stands between tube and chamber, Pa s/kg; usually nothing.
    pub resistance_pa_s_per_kg: R,
}

impl<R: Real> TubeState<R> {
    /// Gas at rest.
    pub fn at_rest(pressure_pa: R) -> Self {
        Self {
            pressure_pa,
            mass_flow_kg_per_s: R::ZERO,
        }
    }
}

impl<R: Real> TubeLine<R> {
    /// No tube; the diameter is that of the usual hose, ready for a fit.
    pub fn neutral() -> Self {
        Self {
            length_m: R::ZERO,
            diameter_m: R::from_f64(0.004),
        }
    }

    /// Whether there is a tube at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.length_m > R::ZERO
    }

    /// One step. `valve` is the flow into the node and its slope by the node's
    /// pressure, at the node's present pressure.
    pub fn step(
        &self,
        state: &mut TubeState<R>,
        gas: &Gas<R>,
        temperature_k: R,
        valve: (R, R),
        chamber: &TubeEnd<R>,
        dt_s: R,
    ) {
        let quarter_pi = R::from_f64(core::f64::consts::FRAC_PI_4);
        let area_m2 = quarter_pi * self.diameter_m * self.diameter_m;
        let specific = gas.gas_constant_j_per_kg_k * temperature_k;
        let node_pa_per_kg = gas.heat_capacity_ratio * specific / (area_m2 * self.length_m);
        let (valve_flow, valve_slope) = valve;
        // pt+ = free + drop * m+, from the node's balance with m+ still unknown.
        let softened = R::ONE - dt_s * node_pa_per_kg * valve_slope;
        let free = state.pressure_pa + dt_s * node_pa_per_kg * valve_flow / softened;
        let drop = dt_s * node_pa_per_kg / softened;
        let inertia = self.length_m / area_m2 / dt_s;
        let friction = self.friction(state, area_m2, specific) + chamber.resistance_pa_s_per_kg;
        let flow = (inertia * state.mass_flow_kg_per_s + free - chamber.pressure_pa)
            / (inertia + friction + drop + dt_s * chamber.pa_per_kg);
        state.mass_flow_kg_per_s = flow;
        state.pressure_pa = free - drop * flow;
    }

    /// k at the present flow, Pa s/kg.
    fn friction(&self, state: &TubeState<R>, area_m2: R, specific: R) -> R {
        let viscosity = R::from_f64(VISCOSITY_PA_S);
        let density = state.pressure_pa.max(R::from_f64(1e3)) / specific;
        let laminar = R::from_f64(32.0) * viscosity * self.length_m
            / (self.diameter_m * self.diameter_m * area_m2 * density);
        let reynolds = state.mass_flow_kg_per_s.abs() * self.diameter_m / (area_m2 * viscosity);
        // Re^(3/4) = sqrt(Re sqrt(Re))
        let turbulent = (reynolds * reynolds.sqrt()).sqrt() * R::from_f64(TURBULENT_RATIO);
        laminar * turbulent.max(R::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end<R: Real>(pressure_pa: R, pa_per_kg: R) -> TubeEnd<R> {
        TubeEnd {
            pressure_pa,
            pa_per_kg,
            resistance_pa_s_per_kg: R::ZERO,
        }
    }

    #[test]
    fn val_steady_pressure_drop_of_one_metre_of_4_mm_tube() {
        // Dossier P1: 61 kPa/m at 5 g/s, 3.7 kPa/m at 1 g/s (4 mm, about 6 bar).
        let gas = Gas::new(1.4, 287.0);
        let tube = TubeLine {
            length_m: 1.0,
            diameter_m: 0.004,
        };
        for (flow, expected) in [(1e-3, 3.7e3), (5e-3, 61e3)] {
            let mut state = TubeState::at_rest(6e5);
            for _ in 0..5000 {
                tube.step(
                    &mut state,
                    &gas,
                    293.15,
                    (flow, 0.0),
                    &end(5.25e5, 0.0),
                    1e-3,
                );
            }
            let drop = state.pressure_pa - 5.25e5;
            assert!((state.mass_flow_kg_per_s - flow).abs() < 1e-8);
            assert!(
                (0.75..1.25).contains(&(drop / expected)),
                "{drop} at {flow}"
            );
        }
    }

    #[test]
    fn prop_stable_from_a_millimetre_to_ten_metres() {
        let gas = Gas::new(1.4_f32, 287.0);
        for length_m in [1e-3_f32, 0.02, 0.5, 10.0] {
            let tube = TubeLine {
                length_m,
                diameter_m: 0.004,
            };
            let mut state = TubeState::at_rest(5e5);
            let mut chamber = 5e5_f32;
            let per_kg = 1.4 * 287.0 * 293.0 / 2e-5;
            for step in 0..2000 {
                let valve = if (step / 50) % 2 == 0 { 5e-3 } else { -5e-3 };
                tube.step(
                    &mut state,
                    &gas,
                    293.15,
                    (valve, -1e-9),
                    &end(chamber, per_kg),
                    1e-3,
                );
                chamber += per_kg * state.mass_flow_kg_per_s * 1e-3;
                assert!(state.pressure_pa.is_finite() && chamber.abs() < 2e7);
            }
        }
    }
}
