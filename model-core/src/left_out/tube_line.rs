//! `tube-line`: a tube between a valve port and a chamber.
//!
//! Cells in a row, each a volume of gas; between them, and from the last into
//! the chamber, the gas is a mass that the pressure difference accelerates
//! against wall friction.
//!
//! ```text
//! (V_t/N) p_i' = R T (m_(i-1) - m_i),            m_0 from the valve, V_t = A_t L
//! (L/(N A_t)) m_i' = p_i - p_(i+1) - k(m_i) m_i,  p_(N+1) the chamber's
//! k = (32 mu L / (N D^2 A_t rho)) max(1, 0.0049375 Re^(3/4)),  Re = 4 |m| / (pi D mu)
//! ```
//!
//! Isothermal: the wall of a narrow tube is near (a chamber's is not).
//! Laminar friction by Hagen and Poiseuille, turbulent by Blasius in the form
//! of Richer and Hurmuzlu; they meet at Re = 1190. Four cells: with the whole
//! volume at the valve a tube of 1.6 m is told apart from a distributed one by
//! several times the noise of a pressure sensor, and the dead volumes take half
//! of the tube's. Range 0.1-3 m of 3-8 mm. Confused with valve area, dead zone
//! and dead volume (84-92 % of it is absorbed by them), with delay and spool
//! lag; bursts at two piston positions separate them. Implicit in all pressures
//! and flows at once, in quarters of a step: stable at every length and step,
//! and at 1 kHz its waves lose little by the scheme.

use crate::gas::Gas;
use crate::real::Real;

/// Dynamic viscosity of air at 293 K, Pa s (changes by 0.2 %/K, not by pressure).
const VISCOSITY_PA_S: f64 = 1.82e-5;
/// 0.158 / 32: turbulent over laminar friction per Re^(3/4).
const TURBULENT_RATIO: f64 = 0.158 / 32.0;

/// Cells of a tube.
const CELLS: usize = 4;
/// Their length in all, in cells: the first is half of one, with its middle at
/// the valve, so that every other flow has half a cell on either side.
const LENGTH_CELLS: f64 = CELLS as f64 - 0.5;
/// Parts of a step.
const PARTS: usize = 4;

/// One tube; a length of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLine<R> {
    /// Length, m.
    pub length_m: R,
    /// Inner diameter, m.
    pub diameter_m: R,
}

/// Pressures of the cells and flows out of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeState<R> {
    /// Pressures from the valve's end on, Pa.
    pressures_pa: [R; CELLS],
    /// Flows towards the chamber, kg/s.
    mass_flows_kg_per_s: [R; CELLS],
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
            pressures_pa: [pressure_pa; CELLS],
            mass_flows_kg_per_s: [R::ZERO; CELLS],
        }
    }

    /// Pressure at the valve's end, Pa.
    #[inline]
    pub fn port_pa(&self) -> R {
        self.pressures_pa[0]
    }

    /// Mean pressure over the tube's volume, Pa.
    pub fn mean_pa(&self) -> R {
        let mut sum = -self.pressures_pa[0] * R::from_f64(0.5);
        for &pressure_pa in &self.pressures_pa {
            sum += pressure_pa;
        }
        sum / R::from_f64(LENGTH_CELLS)
    }

    /// Pressure at the chamber's end, Pa.
    #[inline]
    pub fn far_pa(&self) -> R {
        self.pressures_pa[CELLS - 1]
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

    /// One step; returns what passed. `valve` is the flow into the first cell and
    /// its slope by that cell's pressure, at the cell's present pressure.
    pub fn step(
        &self,
        state: &mut TubeState<R>,
        gas: &Gas<R>,
        temperature_k: R,
        valve: (R, R),
        chamber: &TubeEnd<R>,
        dt_s: R,
    ) -> Passed<R> {
        let quarter_pi = R::from_f64(core::f64::consts::FRAC_PI_4);
        let area_m2 = quarter_pi * self.diameter_m * self.diameter_m;
        let specific = gas.gas_constant_j_per_kg_k * temperature_k;
        let cell_m = self.length_m * R::from_f64(1.0 / LENGTH_CELLS);
        let part = R::from_f64(1.0 / PARTS as f64);
        let line = Line {
            area_m2,
            specific,
            cell_m,
            diameter_m: self.diameter_m,
            pa_per_flow: dt_s * part * specific / (area_m2 * cell_m),
            inertia: cell_m / (area_m2 * dt_s * part),
        };
        let (flow, slope) = valve;
        let at_pa = state.port_pa();
        let mut end = *chamber;
        let mut passed = Passed {
            into_chamber_kg_per_s: R::ZERO,
            port_rise_pa: R::ZERO,
        };
        for _ in 0..PARTS {
            let valve_now = (flow + slope * (state.port_pa() - at_pa), slope);
            line.step(state, valve_now, &end, dt_s * part);
            let out = state.mass_flows_kg_per_s[CELLS - 1];
            end.pressure_pa += dt_s * part * end.pa_per_kg * out;
            passed.into_chamber_kg_per_s += part * out;
            passed.port_rise_pa += part * (state.port_pa() - at_pa);
        }
        passed
    }
}

/// What a step of a tube comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed<R> {
    /// Mean flow into the chamber, kg/s.
    pub into_chamber_kg_per_s: R,
    /// How far the pressure at the valve has stood above that at the step's
    /// beginning, in the mean, Pa: what the valve's flow has been depends on it.
    pub port_rise_pa: R,
}

/// A tube made ready for steps of one length.
struct Line<R> {
    area_m2: R,
    specific: R,
    cell_m: R,
    diameter_m: R,
    /// Rise of a cell's pressure over a step per flow into it, Pa s/kg.
    pa_per_flow: R,
    /// Pressure that a change of flow takes over a step, Pa s/kg.
    inertia: R,
}

impl<R: Real> Line<R> {
    /// Every pressure at the end of the step is expressed by the flows; what is
    /// left is a tridiagonal system of the flows, solved by elimination.
    fn step(&self, state: &mut TubeState<R>, valve: (R, R), end: &TubeEnd<R>, dt_s: R) {
        let rise = self.pa_per_flow;
        let (valve_flow, valve_slope) = valve;
        // p+ of the first cell = free - drop m+.
        let first_rise = rise + rise;
        let softened = R::ONE - first_rise * valve_slope;
        let free_pa = state.pressures_pa[0] + first_rise * valve_flow / softened;
        let drop = first_rise / softened;
        let mut ratio = [R::ZERO; CELLS];
        let mut right = [R::ZERO; CELLS];
        let (mut ratio_before, mut right_before) = (R::ZERO, R::ZERO);
        for cell in 0..CELLS {
            let from_pa = if cell == 0 {
                free_pa
            } else {
                state.pressures_pa[cell]
            };
            let behind = if cell == 0 { drop } else { rise };
            let last = cell + 1 == CELLS;
            let (to_pa, ahead, held) = if last {
                let held = end.resistance_pa_s_per_kg;
                (end.pressure_pa, dt_s * end.pa_per_kg, held)
            } else {
                (state.pressures_pa[cell + 1], rise, R::ZERO)
            };
            let flow = state.mass_flows_kg_per_s[cell];
            let lengths = R::from_f64(if last { 0.5 } else { 1.0 });
            let inertia = lengths * self.inertia;
            let friction = lengths * self.friction(flow, state.pressures_pa[cell]) + held;
            let lower = if cell == 0 { R::ZERO } else { rise };
            let pivot = inertia + friction + behind + ahead - lower * ratio_before;
            let given = inertia * flow + from_pa - to_pa + lower * right_before;
            ratio[cell] = if last { R::ZERO } else { ahead / pivot };
            right[cell] = given / pivot;
            (ratio_before, right_before) = (ratio[cell], right[cell]);
        }
        let mut ahead = R::ZERO;
        for cell in (0..CELLS).rev() {
            ahead = right[cell] + ratio[cell] * ahead;
            state.mass_flows_kg_per_s[cell] = ahead;
        }
        state.pressures_pa[0] = free_pa - drop * state.mass_flows_kg_per_s[0];
        for cell in 1..CELLS {
            let net = state.mass_flows_kg_per_s[cell - 1] - state.mass_flows_kg_per_s[cell];
            state.pressures_pa[cell] += rise * net;
        }
    }

    /// k of a cell at its flow, Pa s/kg.
    fn friction(&self, flow_kg_per_s: R, pressure_pa: R) -> R {
        let viscosity = R::from_f64(VISCOSITY_PA_S);
        let density = pressure_pa.max(R::from_f64(1e3)) / self.specific;
        let laminar = R::from_f64(32.0) * viscosity * self.cell_m
            / (self.diameter_m * self.diameter_m * self.area_m2 * density);
        let reynolds = flow_kg_per_s.abs() * self.diameter_m / (self.area_m2 * viscosity);
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
            let drop = state.port_pa() - 5.25e5;
            assert!((state.mass_flows_kg_per_s[CELLS - 1] - flow).abs() < 1e-8);
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
                let passed = tube.step(
                    &mut state,
                    &gas,
                    293.15,
                    (valve, -1e-9),
                    &end(chamber, per_kg),
                    1e-3,
                );
                chamber += per_kg * passed.into_chamber_kg_per_s * 1e-3;
                assert!(state.port_pa().is_finite() && chamber.abs() < 2e7);
            }
        }
    }
}
