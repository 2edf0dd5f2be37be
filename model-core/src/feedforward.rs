//! The inverse flow map: the command that makes the force of the gas change at
//! a wanted rate.
//!
//! ```text
//! F  = pa Aa - pb Ab,    p' = gamma (R T m' - p V') / V         per chamber, (3)
//! F' = closed + wa As(o) - wa' Ae(0) - wb As(0) + wb' Ae(o)     for an opening o towards a
//! ```
//!
//! Each weight is the flow per area of its path times the force that a flow makes;
//! the areas follow one opening, so the sum is inverted segment by segment of the
//! table, with the jump over the dead zone in it. Neglected: heat, which is slow
//! (some N/s) and left to the loop around.

use crate::axis::{Axis, PneumaticState};
use crate::chamber::Chamber;
use crate::left_out::SlewLimit;
use crate::real::Real;
use crate::valve::GasState;

/// How the force of the gas on the piston changes with the valve's areas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceRates<R> {
    /// Rate without any flow through the valve: the piston's motion and the leaks, N/s.
    pub closed_n_per_s: R,
    /// The part of it that is the leaks', N/s.
    pub leaks_n_per_s: R,
    /// Per area from the supply to port a, N/(s m2).
    pub supply_a: R,
    /// Per area from port a to the exhaust (falling force), N/(s m2).
    pub exhaust_a: R,
    /// Per area from the supply to port b (falling force), N/(s m2).
    pub supply_b: R,
    /// Per area from port b to the exhaust, N/(s m2).
    pub exhaust_b: R,
}

/// The rates that one chamber makes, in the direction in which it pushes.
struct SideRates<R> {
    supply: R,
    exhaust: R,
    motion: R,
}

/// Leaks that take the force away faster than this are made up for at rest, N/s.
const LARGE_LEAK_N_PER_S: f64 = 20.0;

impl<R: Real> ForceRates<R> {
    /// At this state of the gas and this motion of the piston.
    pub fn at(
        axis: &Axis<R>,
        gas: &PneumaticState<R>,
        supply_pressure_pa: R,
        position_m: R,
        velocity_m_per_s: R,
    ) -> Self {
        let pneumatics = &axis.pneumatics;
        let supply = GasState {
            pressure_pa: supply_pressure_pa,
            temperature_k: axis.supply_temperature_k,
        };
        let kappa = pneumatics.gas.heat_capacity_ratio;
        let per_mass = kappa * pneumatics.gas.gas_constant_j_per_kg_k;
        let side = |chamber: &Chamber<R>, gas: GasState<R>, speed: R| {
            let volume = chamber.geometry.volume_m3(position_m);
            let area = chamber.geometry.area_m2;
            let gain = area * per_mass / volume;
            let inflow = pneumatics.law.flow(R::ONE, supply, gas).mass_flow_kg_per_s;
            let outflow = pneumatics
                .law
                .flow(R::ONE, gas, pneumatics.ambient)
                .mass_flow_kg_per_s;
            SideRates {
                supply: gain * inflow * supply.temperature_k,
                exhaust: gain * outflow * gas.temperature_k,
                motion: -(kappa * gas.pressure_pa * area * speed / volume) * area,
            }
        };
        let velocity = velocity_m_per_s;
        let a = side(&pneumatics.chamber_a, gas.a.gas_state(), velocity);
        let b = side(&pneumatics.chamber_b, gas.b.gas_state(), -velocity);
        let leaks_n_per_s = pneumatics.leaks_n_per_s(gas, position_m, axis.dt_s);
        Self {
            closed_n_per_s: a.motion - b.motion + leaks_n_per_s,
            leaks_n_per_s,
            supply_a: a.supply,
            exhaust_a: a.exhaust,
            supply_b: b.supply,
            exhaust_b: b.exhaust,
        }
    }

    /// Rate with the spool at this command, with the valve's edges where the rig has them.
    pub fn at_n_per_s(&self, axis: &Axis<R>, command_v: R) -> R {
        let areas = axis.valve.areas(command_v);
        self.closed_n_per_s + self.supply_a * areas.supply_a_m2
            - self.exhaust_a * areas.exhaust_a_m2
            - self.supply_b * areas.supply_b_m2
            + self.exhaust_b * areas.exhaust_b_m2
    }

    /// Rate with the valve at its null: only the leakage flows.
    pub fn null_n_per_s(&self, axis: &Axis<R>) -> R {
        let supply = axis.valve.supply.area_m2(R::ZERO);
        let exhaust = axis.valve.exhaust.area_m2(R::ZERO);
        self.closed_n_per_s + (self.supply_a - self.supply_b) * supply
            - (self.exhaust_a - self.exhaust_b) * exhaust
    }

    /// What the force gains over what a wanted rate brings while the spool goes from one command
    /// to the one of that rate, as fast as its slew limit lets it, N (Simpson's rule).
    pub fn on_the_way_n(
        &self,
        axis: &Axis<R>,
        slew: &SlewLimit<R>,
        from_v: R,
        wanted_n_per_s: R,
    ) -> R {
        let to_v = self.command_v(axis, wanted_n_per_s);
        let time_s = slew.time_s(to_v - from_v);
        let [half, four, six] = [0.5, 4.0, 6.0].map(R::from_f64);
        let first = self.at_n_per_s(axis, from_v);
        let middle = self.at_n_per_s(axis, half * (from_v + to_v));
        let last = self.at_n_per_s(axis, to_v);
        time_s * ((first + four * middle + last) / six - last)
    }

    /// The command, with the valve's edges where the rig has them, that gives a
    /// wanted rate; the null's own rate asks for the null.
    pub fn command_v(&self, axis: &Axis<R>, wanted_n_per_s: R) -> R {
        let valve = &axis.valve;
        let supply = valve.supply.area_m2(R::ZERO);
        let exhaust = valve.exhaust.area_m2(R::ZERO);
        let null = self.null_n_per_s(axis);
        let opening_v = if wanted_n_per_s > null {
            let rest = wanted_n_per_s - self.closed_n_per_s
                + self.supply_b * supply
                + self.exhaust_a * exhaust;
            valve.opening_for_sum(self.supply_a, self.exhaust_b, rest).0
        } else {
            let rest = self.closed_n_per_s - wanted_n_per_s
                + self.supply_a * supply
                + self.exhaust_b * exhaust;
            -valve.opening_for_sum(self.supply_b, self.exhaust_a, rest).0
        };
        valve.command_for_opening_v(opening_v)
    }

    /// The command at rest: the null while the force may stay as it is, a flow that
    /// changes it at the wanted rate where it may not. What the valve itself leaks at its
    /// null is let be; other leaks are made up for, where nothing else is wanted only if they
    /// are large: what smaller ones do is corrected now and then.
    pub fn rest_command_v(&self, axis: &Axis<R>, wanted_n_per_s: Option<R>) -> R {
        let let_be = self.null_n_per_s(axis) - self.leaks_n_per_s;
        match wanted_n_per_s {
            Some(rate) => self.command_v(axis, let_be + rate),
            None if self.leaks_n_per_s.abs() > R::from_f64(LARGE_LEAK_N_PER_S) => {
                self.command_v(axis, let_be)
            }
            None => axis.valve.null_v,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::ValveDrive;
    use crate::paper;

    fn gas(pressure_pa: f64) -> GasState<f64> {
        GasState {
            pressure_pa,
            temperature_k: 293.15,
        }
    }

    /// The rate that the axis' own pneumatics show over a short step.
    fn rate_of_the_axis(
        axis: &Axis<f64>,
        start: &PneumaticState<f64>,
        command_v: f64,
        position_m: f64,
        velocity_m_per_s: f64,
    ) -> f64 {
        let dt_s = 1e-6;
        let mut state = *start;
        let drive = ValveDrive {
            areas: axis.valve.areas(command_v),
            supply: gas(7e5),
        };
        let to_m = position_m + dt_s * velocity_m_per_s;
        axis.pneumatics
            .step(&mut state, Some(&drive), position_m, to_m, dt_s);
        let force = |state: &PneumaticState<f64>| {
            axis.carriage
                .drive_n(state.a.pressure_pa.value, state.b.pressure_pa.value)
        };
        (force(&state) - force(start)) / dt_s
    }

    fn shows_what_was_asked(axis: &Axis<f64>) {
        for (a_pa, b_pa) in [(5e5, 5e5), (6.5e5, 3e5), (2e5, 6e5)] {
            let state = PneumaticState::at_rest(gas(a_pa), gas(b_pa));
            let rates = ForceRates::at(axis, &state, 7e5, 0.1, 0.2);
            for wanted in [-1500.0, -300.0, 400.0, 1500.0] {
                let command_v = rates.command_v(axis, wanted);
                let shown = rate_of_the_axis(axis, &state, command_v, 0.1, 0.2);
                assert!((shown - wanted).abs() < 2.0, "{wanted}: {shown}");
            }
        }
    }

    #[test]
    fn val_the_axis_shows_the_rate_that_was_asked_for() {
        let mut axis = paper::axis::<f64>();
        for feeds_a_above_null in [true, false] {
            axis.valve.feeds_a_above_null = feeds_a_above_null;
            shows_what_was_asked(&axis);
        }
    }

    /// A leak of half a square millimetre past the piston takes some hundred newtons in a
    /// second: not counted, it stood as an error of the force.
    #[test]
    fn val_leaks_are_made_up_for() {
        let mut axis = leaking();
        shows_what_was_asked(&axis);
        axis.pneumatics.leak_b.laminar_kg_per_s_pa2 = 1e-15;
        axis.pneumatics.leak_a.orifice_area_m2 = 1e-7;
        shows_what_was_asked(&axis);
    }

    /// The spool's way in ten thousand steps, the rate summed up.
    #[test]
    fn val_what_comes_on_the_way_is_the_sum_of_the_rates() {
        let axis = paper::axis::<f64>();
        let v_per_s = 50.0;
        let slew = SlewLimit {
            rising_per_s: v_per_s,
            falling_per_s: v_per_s,
        };
        let state = PneumaticState::at_rest(gas(6e5), gas(4e5));
        let rates = ForceRates::at(&axis, &state, 7e5, 0.05, 0.1);
        for (from_v, wanted) in [(7.5, 0.0), (6.0, 800.0), (4.6, -2000.0), (4.0, 1500.0)] {
            let to_v = rates.command_v(&axis, wanted);
            let steps = 10_000;
            let on_the_way = (0..steps).map(|step| {
                let way = (f64::from(step) + 0.5) / f64::from(steps);
                rates.at_n_per_s(&axis, from_v + way * (to_v - from_v)) - wanted
            });
            let time_s = (to_v - from_v).abs() / v_per_s;
            let sum_n = on_the_way.sum::<f64>() * time_s / f64::from(steps);
            let found_n = rates.on_the_way_n(&axis, &slew, from_v, wanted);
            // Simpson's three points, over a table with a dead zone.
            assert!(
                (found_n - sum_n).abs() < 0.15 * sum_n.abs() + 0.2,
                "{found_n} {sum_n}"
            );
        }
    }

    fn leaking() -> Axis<f64> {
        let mut axis = paper::axis::<f64>();
        axis.pneumatics.piston_leak.orifice_area_m2 = 5e-7;
        axis
    }

    #[test]
    fn val_a_leaking_piston_is_held_at_rest() {
        let axis = leaking();
        let state = PneumaticState::at_rest(gas(5.5e5), gas(4.5e5));
        let rates = ForceRates::at(&axis, &state, 7e5, 0.1, 0.0);
        let tight = paper::axis::<f64>();
        let of_the_valve = ForceRates::at(&tight, &state, 7e5, 0.1, 0.0).null_n_per_s(&tight);
        assert!(rates.leaks_n_per_s < -100.0);
        for wanted_n_per_s in [None, Some(-100.0), Some(0.0), Some(100.0)] {
            let command_v = rates.rest_command_v(&axis, wanted_n_per_s);
            let drift = rate_of_the_axis(&axis, &state, command_v, 0.1, 0.0);
            let expected = of_the_valve + wanted_n_per_s.unwrap_or(0.0);
            assert!((drift - expected).abs() < 2.0, "{drift}");
        }
    }

    #[test]
    fn prop_a_force_that_may_stay_leaves_the_valve_at_its_null() {
        let axis = paper::axis::<f64>();
        let state = PneumaticState::at_rest(gas(5e5), gas(5e5));
        let rates = ForceRates::at(&axis, &state, 7e5, 0.0, 0.0);
        assert!((rates.rest_command_v(&axis, None) - 5.0).abs() < 1e-12);
        assert!(rates.rest_command_v(&axis, Some(50.0)) > 5.3);
        assert!(rates.rest_command_v(&axis, Some(-50.0)) < 4.7);
    }
}
