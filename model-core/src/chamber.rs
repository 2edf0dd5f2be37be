//! A cylinder chamber: volumes (4), heat (5), full energy balance (3), reduced
//! model (6), stop method (7).
//!
//! Pressure and temperature are the states, as in the paper:
//!
//! ```text
//! p' = -gamma p V'/V + (gamma R/V)(m_in Ts - m_out T) + ((gamma-1)/V) Q'      (3)
//! T  from p V = m R T with the mass balance                                   (3)
//! Q' = h S(x) (Tw - T)                                                        (5)
//! ```
//!
//! The step is conservative: it writes the energy balance over the step as
//! `[pV/(gamma-1)]_n^{n+1} = dt (H' + Q') - p_mean dV` and the mass balance
//! likewise, both with the same flow, so that mass and energy close to rounding
//! whatever the step. Flow and heat are taken at a predicted midpoint (second
//! order) and the flow's dependence on the pressure is implicit with a weight
//! that moves from 1/2 to 1 as the step becomes stiff: eigenvalues reach
//! 8000 1/s at the end of the stroke, and no ringing is wanted there.
//!
//! Three thermal models:
//! - [`ThermalModel::EnergyBalance`] is (3).
//! - [`ThermalModel::Polytropic`] is (6), T = Tw (p/pref)^((n-1)/n) in place of the
//!   temperature balance. With pref the supply pressure, as printed, T is below
//!   ambient at rest, and (5) then heats the sealed chamber for ever: +9 kPa/s at
//!   5 bar with h = 20. With pref the chamber's own equilibrium pressure the
//!   drift is nought; that is the cure.
//! - [`ThermalModel::PolytropicProcess`] is p V^n constant for a constant mass, what
//!   a bench engineer fits to a closed gas spring; p' = n (R T m' - p V')/V with a
//!   flow, isothermal for n = 1.
//!
//! Neglected: a temperature that varies within the chamber. A wall that is not at
//! the temperature of the surroundings, or warms, and a heat transfer that follows
//! density and flow are [`crate::left_out`], neutral by default.

use crate::gas::Gas;
use crate::left_out::{VariableHeatTransfer, WallTemperature};
use crate::math::Compensated;
use crate::real::Real;
use crate::valve::GasState;

/// The absolute pressures that a step returns, Pa.
const PRESSURE_RANGE_PA: [f64; 2] = [100.0, 1e9];
/// The temperatures that a step returns, K: far outside of what a pneumatic
/// axis reaches, so that an absurd input saturates instead of dividing by nought.
const TEMPERATURE_RANGE_K: [f64; 2] = [30.0, 3000.0];
/// A volume below this counts as this, m3: a piston beyond its dead volume (there
/// is no end stop here) must not divide by nought or turn the gas inside out.
/// 10 mm3 is far under any port's volume.
const LEAST_VOLUME_M3: f64 = 1e-8;
/// The step's effective volume is at least this part of the volume at its end.
/// It is 1 at rest and falls under this only where one step compresses the gas
/// to less than a fifth: the position jumped.
const LEAST_EFFECTIVE_SHARE: f64 = 0.1;

/// How volume and surface follow the piston.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChamberGeometry<R> {
    /// Piston area, m2.
    pub area_m2: R,
    /// Volume at zero length: ports, fittings, end of stroke, m3.
    pub dead_volume_m3: R,
    /// Length of the chamber at x = 0, m.
    pub length_at_zero_m: R,
    /// dl/dx: +1 for chamber a, -1 for chamber b, 0 for a vessel.
    pub length_per_position: R,
    /// Bore, m, for the heat-exchange surface.
    pub bore_m: R,
}

impl<R: Real> ChamberGeometry<R> {
    /// V = V0 + A l(x), (4), m3.
    #[inline]
    pub fn volume_m3(&self, position_m: R) -> R {
        let volume = self.dead_volume_m3 + self.area_m2 * self.length_m(position_m);
        volume.max(R::from_f64(LEAST_VOLUME_M3))
    }

    /// S = 2 A + pi D l(x): both end faces and the cylinder between them, m2.
    #[inline]
    pub fn surface_m2(&self, position_m: R) -> R {
        let length_m = self.length_m(position_m).max(R::ZERO);
        self.area_m2 + self.area_m2 + R::from_f64(core::f64::consts::PI) * self.bore_m * length_m
    }

    /// l(x): what is left to the end at which the chamber is smallest, m.
    #[inline]
    pub fn length_m(&self, position_m: R) -> R {
        self.length_at_zero_m + self.length_per_position * position_m
    }
}

/// How the gas temperature follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ThermalModel<R> {
    /// The full balance (3).
    EnergyBalance,
    /// The reduced model (6).
    Polytropic {
        /// n while the chamber is emptied.
        expansion_index: R,
        /// n while the chamber is filled.
        compression_index: R,
        /// Pressure at which the gas has the wall's temperature, Pa.
        reference_pressure_pa: R,
    },
    /// p V^n = constant at constant mass.
    PolytropicProcess {
        /// n.
        index: R,
    },
}

/// A chamber's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chamber<R> {
    /// The gas in it.
    pub gas: Gas<R>,
    /// Volume and surface.
    pub geometry: ChamberGeometry<R>,
    /// Model of the gas temperature.
    pub thermal: ThermalModel<R>,
    /// How much of the gas temperature follows the full balance (3) in place of
    /// a reduced model: 0 leaves `thermal` as declared, 1 is (3).
    pub temperature_memory: R,
    /// h while the net flow into the chamber is nought or more, W/(m2 K).
    pub heat_transfer_charging_w_per_m2_k: R,
    /// h while it is below nought, W/(m2 K).
    pub heat_transfer_discharging_w_per_m2_k: R,
    /// Heat conductance to the wall beside h S(x), W/K: ports, end volumes and
    /// whatever surface the plain cylinder does not count.
    pub wall_conductance_w_per_k: R,
    /// Wall temperature, K, without what `wall` adds to it.
    pub wall_temperature_k: R,
    /// How the wall departs from that.
    pub wall: WallTemperature<R>,
    /// How h departs from the declared two values.
    pub heat_variation: VariableHeatTransfer<R>,
}

/// Pressure and temperature of a chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChamberState<R> {
    /// Absolute pressure, Pa.
    pub pressure_pa: Compensated<R>,
    /// Temperature, K.
    pub temperature_k: Compensated<R>,
    /// What the wall has gained since the start, K.
    pub wall_rise_k: Compensated<R>,
}

impl<R: Real> ChamberState<R> {
    /// A chamber at this pressure and temperature.
    pub fn new(pressure_pa: R, temperature_k: R) -> Self {
        Self {
            pressure_pa: Compensated::new(pressure_pa),
            temperature_k: Compensated::new(temperature_k),
            wall_rise_k: Compensated::new(R::ZERO),
        }
    }

    /// What the flow law needs.
    #[inline]
    pub fn gas_state(&self) -> GasState<R> {
        GasState {
            pressure_pa: self.pressure_pa.value,
            temperature_k: self.temperature_k.value,
        }
    }
}

/// Sum of the flows into a chamber, with derivatives by its pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChamberFlow<R> {
    /// Net mass flow in, kg/s.
    pub mass_kg_per_s: R,
    /// Net mass flow times the temperature of the gas that flows, kg K/s:
    /// m_in Ts - m_out T.
    pub mass_temperature_kg_k_per_s: R,
    /// Derivative of the mass flow by the chamber's pressure, kg/(s Pa); <= 0.
    pub mass_slope: R,
    /// Derivative of the second by the chamber's pressure, kg K/(s Pa); <= 0.
    pub mass_temperature_slope: R,
}

impl<R: Real> ChamberFlow<R> {
    /// A closed chamber.
    pub const NONE: Self = Self {
        mass_kg_per_s: R::ZERO,
        mass_temperature_kg_k_per_s: R::ZERO,
        mass_slope: R::ZERO,
        mass_temperature_slope: R::ZERO,
    };

    /// Adds a flow into the chamber: `into_kg_per_s` (negative out of it), its
    /// slope by the chamber's pressure, the temperature outside and inside.
    #[inline]
    #[must_use]
    pub fn with(self, into_kg_per_s: R, slope: R, outside_k: R, inside_k: R) -> Self {
        let temperature = if into_kg_per_s > R::ZERO {
            outside_k
        } else {
            inside_k
        };
        Self {
            mass_kg_per_s: self.mass_kg_per_s + into_kg_per_s,
            mass_temperature_kg_k_per_s: self.mass_temperature_kg_k_per_s
                + into_kg_per_s * temperature,
            mass_slope: self.mass_slope + slope,
            mass_temperature_slope: self.mass_temperature_slope + slope * temperature,
        }
    }
}

/// Volume at the start and the end of a step, and the surface in its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke<R> {
    start_m3: R,
    end_m3: R,
    surface_m2: R,
}

/// What was exchanged over a step: where the flow was asked for, and how to read
/// any share of it (flow there, plus its slope times `beyond_pa`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange<R> {
    /// Mean net mass flow into the chamber, kg/s.
    pub mass_kg_per_s: R,
    /// The gas as the flow saw it in the predicted middle of the step.
    pub middle: GasState<R>,
    /// The effective pressure of the step less that of `middle`, Pa.
    pub beyond_pa: R,
}

/// Change of the states over a (part of a) step.
struct Change<R> {
    pressure_pa: R,
    temperature_k: R,
    mean_flow_kg_per_s: R,
    beyond_pa: R,
    heat_w: R,
}

/// What acts on the gas over a (part of a) step.
struct Action<'a, R> {
    stroke: &'a Stroke<R>,
    flow: &'a ChamberFlow<R>,
    wall_rise_k: R,
    dt_s: R,
    /// Weight of the end of the step in the flow's pressure.
    weight: R,
}

impl<R: Real> Chamber<R> {
    /// The piston's way over one step.
    #[inline]
    pub fn stroke(&self, start_m: R, end_m: R) -> Stroke<R> {
        let middle = (start_m + end_m) * R::from_f64(0.5);
        Stroke {
            start_m3: self.geometry.volume_m3(start_m),
            end_m3: self.geometry.volume_m3(end_m),
            surface_m2: self.geometry.surface_m2(middle),
        }
    }

    /// One step. `flow` gives the flow into the chamber at a gas state; it is
    /// asked twice, at the start and at the predicted middle of the step.
    /// Returns the mean net mass flow over the step, kg/s.
    #[inline]
    pub fn step(
        &self,
        state: &mut ChamberState<R>,
        stroke: &Stroke<R>,
        flow: impl Fn(GasState<R>) -> ChamberFlow<R>,
        dt_s: R,
    ) -> R {
        self.exchange(state, stroke, flow, dt_s).mass_kg_per_s
    }

    /// The step, telling what was exchanged.
    #[inline]
    pub fn exchange(
        &self,
        state: &mut ChamberState<R>,
        stroke: &Stroke<R>,
        flow: impl Fn(GasState<R>) -> ChamberFlow<R>,
        dt_s: R,
    ) -> Exchange<R> {
        let first_half = Stroke {
            end_m3: (stroke.start_m3 + stroke.end_m3) * R::from_f64(0.5),
            ..*stroke
        };
        let middle = self.predict(state, &first_half, &flow, dt_s);
        self.complete(state, middle, stroke, flow, dt_s)
    }

    /// First part of a step of `dt_s`: the gas in the middle of it, predicted with the flow of
    /// its start, from the piston's way up to there.
    #[inline]
    pub fn predict(
        &self,
        state: &mut ChamberState<R>,
        first_half: &Stroke<R>,
        flow: impl Fn(GasState<R>) -> ChamberFlow<R>,
        dt_s: R,
    ) -> GasState<R> {
        saturate(state);
        let start = state.gas_state();
        let (_, start_flow) = self.flow_at(start, &flow);
        let first = Action {
            stroke: first_half,
            flow: &start_flow,
            wall_rise_k: state.wall_rise_k.value,
            dt_s: dt_s * R::from_f64(0.5),
            weight: R::ONE,
        };
        let change = self.advance(start, start, &first);
        saturated(GasState {
            pressure_pa: start.pressure_pa + change.pressure_pa,
            temperature_k: start.temperature_k + change.temperature_k,
        })
    }

    /// Second part of a step: all of it, with flow and heat of its predicted middle.
    #[inline]
    pub fn complete(
        &self,
        state: &mut ChamberState<R>,
        middle: GasState<R>,
        stroke: &Stroke<R>,
        flow: impl Fn(GasState<R>) -> ChamberFlow<R>,
        dt_s: R,
    ) -> Exchange<R> {
        let (seen, middle_flow) = self.flow_at(middle, &flow);
        let whole = Action {
            stroke,
            flow: &middle_flow,
            wall_rise_k: state.wall_rise_k.value,
            dt_s,
            weight: self.implicit_weight(stroke, &middle_flow, dt_s),
        };
        let change = self.advance(state.gas_state(), middle, &whole);
        state.pressure_pa.add(change.pressure_pa);
        state.temperature_k.add(change.temperature_k);
        self.wall.step(&mut state.wall_rise_k, change.heat_w, dt_s);
        saturate(state);
        Exchange {
            mass_kg_per_s: change.mean_flow_kg_per_s,
            middle: seen,
            beyond_pa: change.beyond_pa,
        }
    }

    /// The gas as the flow sees it, and the flow: in the reduced model at the temperature of
    /// the chamber being filled or, where that flow empties it, of its being emptied.
    #[inline]
    fn flow_at(
        &self,
        at: GasState<R>,
        flow: &impl Fn(GasState<R>) -> ChamberFlow<R>,
    ) -> (GasState<R>, ChamberFlow<R>) {
        let filled = self.seen(at, R::ZERO);
        let filling = flow(filled);
        let reduced = matches!(self.thermal, ThermalModel::Polytropic { .. });
        if !reduced || filling.mass_kg_per_s >= R::ZERO {
            return (filled, filling);
        }
        let emptied = self.seen(at, filling.mass_kg_per_s);
        (emptied, flow(emptied))
    }

    /// The change from `start`, with flow and heat as at `at`.
    fn advance(&self, start: GasState<R>, at: GasState<R>, action: &Action<'_, R>) -> Change<R> {
        let Action {
            stroke,
            flow,
            dt_s,
            weight,
            ..
        } = *action;
        let gamma = self.gas.heat_capacity_ratio;
        let minus = gamma - R::ONE;
        let constant = self.gas.gas_constant_j_per_kg_k;
        let grown = stroke.end_m3 - stroke.start_m3;
        let heat_w = self.heat_w(at, action);
        let work_index = self.work_index();
        // (gamma-1) H' = gamma R sum(m T), linear in the pressure about `at`; a
        // polytropic process holds its heat in the index here as well.
        let enthalpy = work_index * constant * dt_s;
        let apart = start.pressure_pa - at.pressure_pa;
        let source = enthalpy
            * (flow.mass_temperature_kg_k_per_s + flow.mass_temperature_slope * apart)
            + minus * heat_w * dt_s;
        let stiffness = stroke.end_m3 + (work_index - R::ONE) * grown * R::from_f64(0.5)
            - weight * enthalpy * flow.mass_temperature_slope;
        let stiffness = stiffness.max(stroke.end_m3 * R::from_f64(LEAST_EFFECTIVE_SHARE));
        let pressure_pa = (source - work_index * start.pressure_pa * grown) / stiffness;
        let beyond_pa = apart + weight * pressure_pa;
        let mean_flow = flow.mass_kg_per_s + flow.mass_slope * beyond_pa;
        let mass_kg = start.pressure_pa * stroke.start_m3 / (constant * start.temperature_k);
        // T+ = p+ V+ / (R m+), written in increments: exactly nought at rest.
        let rise = pressure_pa / start.pressure_pa;
        let growth = grown / stroke.start_m3;
        let fill = dt_s * mean_flow / mass_kg;
        let temperature_k =
            start.temperature_k * (rise + growth + rise * growth - fill) / (R::ONE + fill);
        Change {
            pressure_pa,
            temperature_k,
            mean_flow_kg_per_s: mean_flow,
            beyond_pa,
            heat_w,
        }
    }

    /// Weight of the end of the step in the flow's pressure: 1/2 (second order)
    /// while the step resolves the eigenvalue, 1 - 1/z beyond: never rings.
    fn implicit_weight(&self, stroke: &Stroke<R>, flow: &ChamberFlow<R>, dt_s: R) -> R {
        let stiffness = -self.work_index()
            * self.gas.gas_constant_j_per_kg_k
            * flow.mass_temperature_slope
            * dt_s
            / stroke.end_m3;
        if stiffness > R::from_f64(2.0) {
            R::ONE - R::ONE / stiffness
        } else {
            R::from_f64(0.5)
        }
    }

    /// (5), W, with the temperature that the thermal model sees.
    fn heat_w(&self, at: GasState<R>, action: &Action<'_, R>) -> R {
        let net_flow_kg_per_s = action.flow.mass_kg_per_s;
        let declared = if net_flow_kg_per_s >= R::ZERO {
            self.heat_transfer_charging_w_per_m2_k
        } else {
            self.heat_transfer_discharging_w_per_m2_k
        };
        let share = match self.thermal {
            // The process's index holds its heat already.
            ThermalModel::PolytropicProcess { .. } => self.temperature_memory,
            _ => R::ONE,
        };
        let seen = self.seen(at, net_flow_kg_per_s);
        let coefficient =
            self.heat_variation
                .coefficient(declared, &self.gas, seen, net_flow_kg_per_s);
        let conductance = coefficient * action.stroke.surface_m2 + self.wall_conductance_w_per_k;
        let conductance = self.wall.softened(conductance, action.dt_s);
        share * conductance * (self.wall_k() + action.wall_rise_k - seen.temperature_k)
    }

    /// The wall's temperature at the start, K.
    #[inline]
    fn wall_k(&self) -> R {
        let coldest = R::from_f64(TEMPERATURE_RANGE_K[0]);
        (self.wall_temperature_k + self.wall.offset_k).max(coldest)
    }

    /// The gas as the flow of the next step sees it at its start, within the ranges
    /// that a step returns.
    pub fn offered(&self, state: &ChamberState<R>) -> GasState<R> {
        self.seen(saturated(state.gas_state()), R::ZERO)
    }

    /// The gas state with the temperature that flow and heat see: the state's
    /// own in the full balance, that of (6) in the reduced model.
    #[inline]
    pub fn seen(&self, at: GasState<R>, net_flow_kg_per_s: R) -> GasState<R> {
        let ThermalModel::Polytropic {
            expansion_index,
            compression_index,
            reference_pressure_pa,
        } = self.thermal
        else {
            return at;
        };
        let index = if net_flow_kg_per_s >= R::ZERO {
            compression_index
        } else {
            expansion_index
        };
        let exponent = (index - R::ONE) / index;
        let reduced = self.wall_k() * (at.pressure_pa / reference_pressure_pa).powf(exponent);
        GasState {
            temperature_k: reduced + self.temperature_memory * (at.temperature_k - reduced),
            ..at
        }
    }

    /// The exponent of the volume in the work term.
    fn work_index(&self) -> R {
        let gamma = self.gas.heat_capacity_ratio;
        match self.thermal {
            ThermalModel::PolytropicProcess { index } => {
                index + self.temperature_memory * (gamma - index)
            }
            _ => gamma,
        }
    }
}

/// The gas state within the ranges that a step returns; NaN stays NaN.
fn saturated<R: Real>(gas: GasState<R>) -> GasState<R> {
    let [least, most] = PRESSURE_RANGE_PA.map(R::from_f64);
    let [coldest, hottest] = TEMPERATURE_RANGE_K.map(R::from_f64);
    GasState {
        pressure_pa: gas.pressure_pa.clamp(least, most),
        temperature_k: gas.temperature_k.clamp(coldest, hottest),
    }
}

/// The same of a chamber, without touching a sum that is within its range.
fn saturate<R: Real>(state: &mut ChamberState<R>) {
    let reached = state.gas_state();
    let limited = saturated(reached);
    if limited.pressure_pa != reached.pressure_pa {
        state.pressure_pa = Compensated::new(limited.pressure_pa);
    }
    if limited.temperature_k != reached.temperature_k {
        state.temperature_k = Compensated::new(limited.temperature_k);
    }
}

/// The stop method (7): the mean gas temperature at a time, from the pressure
/// then and the pressure that the sealed chamber reaches at last.
///
/// Valid while leakage over the relaxation is small against the thermal change;
/// wants five time constants, 3-8 s.
pub fn stop_method_temperature_k<R: Real>(
    pressure_pa: R,
    settled_pressure_pa: R,
    wall_temperature_k: R,
) -> R {
    pressure_pa / settled_pressure_pa * wall_temperature_k
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const AMBIENT_K: f64 = 293.15;

    fn chamber(thermal: ThermalModel<f64>) -> Chamber<f64> {
        Chamber {
            thermal,
            ..paper::axis::<f64>().pneumatics.chamber_a
        }
    }

    fn energy_j(chamber: &Chamber<f64>, state: &ChamberState<f64>, x: f64) -> f64 {
        state.pressure_pa.value * chamber.geometry.volume_m3(x)
            / (chamber.gas.heat_capacity_ratio - 1.0)
    }

    fn mass_kg(chamber: &Chamber<f64>, state: &ChamberState<f64>, x: f64) -> f64 {
        state.pressure_pa.value * chamber.geometry.volume_m3(x)
            / (chamber.gas.gas_constant_j_per_kg_k * state.temperature_k.value)
    }

    #[test]
    fn prop_sealed_chamber_at_rest_does_not_drift() {
        for thermal in [
            ThermalModel::EnergyBalance,
            ThermalModel::PolytropicProcess { index: 1.2 },
            ThermalModel::Polytropic {
                expansion_index: 1.11,
                compression_index: 1.18,
                reference_pressure_pa: 5.25e5,
            },
        ] {
            let chamber = chamber(thermal);
            let mut state = ChamberState::new(5.25e5, AMBIENT_K);
            let stroke = chamber.stroke(0.0, 0.0);
            for _ in 0..100_000 {
                chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
            }
            assert_eq!(state, ChamberState::new(5.25e5, AMBIENT_K));
        }
    }

    /// A chamber that is emptied without heat: the gas leaves with the temperature of the
    /// expansion's index, one that is filled does not ask for it.
    #[test]
    fn val_the_expansion_index_acts_on_the_flow_out() {
        let end_pa = |expansion_index: f64, area_m2: f64, outside_pa: f64| {
            let adiabatic = Chamber {
                heat_transfer_charging_w_per_m2_k: 0.0,
                heat_transfer_discharging_w_per_m2_k: 0.0,
                ..chamber(ThermalModel::Polytropic {
                    expansion_index,
                    compression_index: 1.18,
                    reference_pressure_pa: 5.25e5,
                })
            };
            let law = paper::axis::<f64>().pneumatics.law;
            let outside = GasState {
                pressure_pa: outside_pa,
                temperature_k: AMBIENT_K,
            };
            let flow = |gas: GasState<f64>| {
                let out = law.flow(area_m2, gas, outside);
                let into = -out.mass_flow_kg_per_s;
                let slope = -out.slope_1_kg_per_s_pa;
                ChamberFlow::NONE.with(into, slope, AMBIENT_K, gas.temperature_k)
            };
            let mut state = ChamberState::new(4e5, AMBIENT_K);
            let stroke = adiabatic.stroke(0.0, 0.0);
            for _ in 0..100 {
                adiabatic.step(&mut state, &stroke, flow, 1e-3);
            }
            state.pressure_pa.value
        };
        let (slow, fast) = (end_pa(1.05, 1e-6, 1e5), end_pa(1.35, 1e-6, 1e5));
        // p' goes with T / sqrt(T): gas that is colder by 3 K to 20 K takes pressure with it
        // more slowly by some hundredths.
        let fallen = (4e5 - fast) / (4e5 - slow);
        assert!((0.93..0.99).contains(&fallen), "{fast} against {slow} Pa");
        assert_eq!(
            end_pa(1.05, 1e-6, 7e5).to_bits(),
            end_pa(1.35, 1e-6, 7e5).to_bits()
        );
    }

    #[test]
    fn val_reduced_model_with_the_supply_as_reference_drifts_as_derived() {
        // With n = 1.11, pref = 7 bar and h = 20 the sealed
        // chamber at 5.25 bar rises by about 9 kPa in the first second.
        let mut chamber = chamber(ThermalModel::Polytropic {
            expansion_index: 1.11,
            compression_index: 1.11,
            reference_pressure_pa: 7e5,
        });
        chamber.heat_transfer_charging_w_per_m2_k = 20.0;
        let mut state = ChamberState::new(5.25e5, AMBIENT_K);
        let stroke = chamber.stroke(0.0, 0.0);
        for _ in 0..1000 {
            chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
        }
        let rise = state.pressure_pa.value - 5.25e5;
        assert!((8e3..10e3).contains(&rise), "rose by {rise} Pa");
    }

    #[test]
    fn prop_mass_and_energy_close_to_rounding() {
        let chamber = chamber(ThermalModel::EnergyBalance);
        let mut state = ChamberState::new(5.25e5, 300.0);
        let dt = 1e-3;
        let (mut mass, mut energy) = (
            mass_kg(&chamber, &state, 0.0),
            energy_j(&chamber, &state, 0.0),
        );
        let mut x = 0.0;
        for step in 0..5000 {
            let next = 0.1 * libm::sin(f64::from(step + 1) * dt * 6.0);
            // A constant inflow, a heat of nought: every joule is accounted for.
            let adiabatic = Chamber {
                heat_transfer_charging_w_per_m2_k: 0.0,
                heat_transfer_discharging_w_per_m2_k: 0.0,
                ..chamber
            };
            let before = state.pressure_pa.value;
            let stroke = adiabatic.stroke(x, next);
            let flow = ChamberFlow::NONE.with(1e-4, 0.0, AMBIENT_K, 0.0);
            let mean = adiabatic.step(&mut state, &stroke, |_| flow, dt);
            let work = 0.5
                * (before + state.pressure_pa.value)
                * (chamber.geometry.volume_m3(next) - chamber.geometry.volume_m3(x));
            mass += mean * dt;
            energy +=
                chamber.gas.heat_capacity_at_constant_pressure() * AMBIENT_K * 1e-4 * dt - work;
            x = next;
        }
        assert!((mass_kg(&chamber, &state, x) / mass - 1.0).abs() < 1e-12);
        assert!((energy_j(&chamber, &state, x) / energy - 1.0).abs() < 1e-12);
    }

    #[test]
    fn val_closed_processes_follow_their_power_laws() {
        for (thermal, index) in [
            (ThermalModel::PolytropicProcess { index: 1.2 }, 1.2),
            (ThermalModel::EnergyBalance, 1.4),
        ] {
            let chamber = Chamber {
                heat_transfer_charging_w_per_m2_k: 0.0,
                ..chamber(thermal)
            };
            let mut state = ChamberState::new(5e5, AMBIENT_K);
            let steps = 2000;
            let x = |step: i32| -0.2 * f64::from(step) / f64::from(steps);
            for step in 0..steps {
                let stroke = chamber.stroke(x(step), x(step + 1));
                chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
            }
            let ratio = chamber.geometry.volume_m3(0.0) / chamber.geometry.volume_m3(-0.2);
            let expected = 5e5 * ratio.powf(index);
            assert!((state.pressure_pa.value / expected - 1.0).abs() < 1e-6);
            assert!(
                (state.temperature_k.value / (AMBIENT_K * ratio.powf(index - 1.0)) - 1.0).abs()
                    < 1e-6
            );
        }
    }

    #[test]
    fn prop_full_memory_turns_a_reduced_model_into_the_full_balance() {
        let full = chamber(ThermalModel::EnergyBalance);
        let reduced = Chamber {
            temperature_memory: 1.0,
            ..chamber(ThermalModel::Polytropic {
                expansion_index: 1.11,
                compression_index: 1.18,
                reference_pressure_pa: 7e5,
            })
        };
        let run = |chamber: &Chamber<f64>| {
            let mut state = ChamberState::new(4e5, 280.0);
            for step in 0..500 {
                let stroke = chamber.stroke(1e-4 * f64::from(step), 1e-4 * f64::from(step + 1));
                chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
            }
            state.pressure_pa.value
        };
        assert!((run(&full) - run(&reduced)).abs() < 1e-6);
    }

    #[test]
    fn regress_a_position_that_jumps_leaves_a_gas() {
        // A spike of a position sensor, there and back, and a piston driven past
        // its dead volume: every model comes out with a pressure and temperature.
        for thermal in [
            ThermalModel::EnergyBalance,
            ThermalModel::PolytropicProcess { index: 1.2 },
            ThermalModel::Polytropic {
                expansion_index: 1.11,
                compression_index: 1.18,
                reference_pressure_pa: 5.25e5,
            },
        ] {
            let chamber = chamber(thermal);
            let mut state = ChamberState::new(5.25e5, AMBIENT_K);
            for way in [(-0.24, 0.25), (0.25, -0.24), (-0.24, -0.5), (-0.5, 0.0)] {
                let stroke = chamber.stroke(way.0, way.1);
                chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
                let pressure_pa = state.pressure_pa.value;
                assert!((100.0..=1e9).contains(&pressure_pa), "{pressure_pa} Pa");
                assert!((30.0..=3000.0).contains(&state.temperature_k.value));
            }
        }
    }

    #[test]
    fn val_stop_method_recovers_the_temperature() {
        let chamber = chamber(ThermalModel::EnergyBalance);
        let mut state = ChamberState::new(5e5, 320.0);
        let stroke = chamber.stroke(0.0, 0.0);
        for _ in 0..60_000 {
            chamber.step(&mut state, &stroke, |_| ChamberFlow::NONE, 1e-3);
        }
        let found = stop_method_temperature_k(5e5, state.pressure_pa.value, AMBIENT_K);
        assert!((found - 320.0).abs() < 1e-3, "found {found}");
    }
}
