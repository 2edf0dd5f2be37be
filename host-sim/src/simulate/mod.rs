//! A rig's axis run through a scenario.
//!
//! Responsibilities: build the axis of `model-core` from the rig, find where it
//! rests, step it, and turn what happened into a recording as the rig's sensors
//! would have written it ([`recorded`]) and into a page ([`page()`]).
//!
//! * Within a row the command is held and the axis takes
//!   [`Scenario::steps_per_sample`] steps.
//! * Effects of the rig act: those of the plant in the axis, those of the
//!   sensors in what is recorded.
//! * The supply pressure is the rig's, constant.
//! * How far the rig's uncertainty spreads it is shown by many runs ([`ensemble`]).
//! * How far the step falsifies it is estimated by a second run at half of it
//!   ([`integration_error`]).
//!
//! Limits: the model has no end stops and no cushions, so the simulation ends
//! where the carriage leaves its stroke ([`Ending::EndStop`]). The bristles of
//! the friction begin relaxed, also under an initial velocity.

pub mod ensemble;
mod page;
mod sensors;

pub use page::page;
pub use sensors::recorded;

pub use crate::plant::Sample;

use crate::model::{AxisFault, Side};
use crate::plant::{World, axis, equilibrium_pa, supply_pressure_pa};
use crate::rig::RigError;
use crate::scenario::{Scenario, on_time_grid, stroke_range_m};
use model_core::axis::{Axis, AxisState};
use model_core::carriage::CarriageState;

/// How a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// At the end of the scenario.
    Complete,
    /// Where the carriage left its stroke.
    EndStop {
        /// When, s.
        time_s: f64,
        /// Where, m.
        position_m: f64,
    },
}

/// A simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// The rows, before any sensor.
    pub samples: Vec<Sample>,
    /// How it ended.
    pub ending: Ending,
}

/// What the integration step costs: the largest differences from the exact solution of the
/// model's equations, as a run at half the step lets them be estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegrationError {
    /// Of the position, m.
    pub position_m: f64,
    /// Of either chamber's pressure, Pa.
    pub pressure_pa: f64,
}

/// Of an error of second order three quarters go when the step is halved: the whole of it is
/// this many times what changes.
const WHOLE_OF_CHANGE: f64 = 4.0 / 3.0;

/// Estimates the error of a simulation, up to where it ended.
///
/// Richardson's estimate, for a scheme of second order. Where the laws switch within a step
/// (a break-away, a contact) it is one of size.
pub fn integration_error(
    scenario: &Scenario,
    simulation: &Simulation,
) -> Result<IntegrationError, RigError> {
    let mut finer = scenario.clone();
    finer.steps_per_sample *= 2;
    let halved = simulate(&finer)?;
    let change = |value: fn(&Sample) -> f64| {
        let pairs = simulation.samples.iter().zip(&halved.samples);
        let most = pairs.fold(0.0_f64, |most, (one, other)| {
            most.max((value(one) - value(other)).abs())
        });
        WHOLE_OF_CHANGE * most
    };
    Ok(IntegrationError {
        position_m: change(|sample| sample.position_m),
        pressure_pa: f64::max(
            change(|sample| sample.pressure_a_pa),
            change(|sample| sample.pressure_b_pa),
        ),
    })
}

/// Runs a scenario.
pub fn simulate(scenario: &Scenario) -> Result<Simulation, RigError> {
    let axis =
        axis(&scenario.rig, scenario.step_s()).map_err(|fault| rig_fault(scenario, fault))?;
    let supply_pressure_pa =
        supply_pressure_pa(&scenario.rig).map_err(|fault| rig_fault(scenario, fault))?;
    let state = initial_state(scenario, &axis, supply_pressure_pa)?;
    let mut run = Run {
        world: World::new(&scenario.rig, axis, state, supply_pressure_pa),
        stroke_m: stroke_range_m(&scenario.rig).unwrap_or([f64::MIN, f64::MAX]),
        scenario,
    };
    run.all_rows()
}

/// A fault of the rig as an error of the scenario's rig file.
fn rig_fault(scenario: &Scenario, fault: AxisFault) -> RigError {
    error(
        &scenario.rig_name,
        &fault.key,
        fault.problem,
        &fault.expected,
    )
}

fn error(file: &str, key: &str, problem: String, expected: &str) -> RigError {
    RigError {
        file: file.into(),
        line: None,
        key: Some(key.into()),
        problem,
        expected: expected.into(),
    }
}

// where it rests

fn initial_state(
    scenario: &Scenario,
    axis: &Axis<f64>,
    supply_pressure_pa: f64,
) -> Result<AxisState<f64>, RigError> {
    let initial = scenario.initial;
    let middle = stroke_range_m(&scenario.rig).map_or(0.0, |[low, high]| 0.5 * (low + high));
    let pressure_pa = |declared: Option<f64>, side: Side| match declared {
        Some(pressure_pa) => Ok(pressure_pa),
        None => equilibrium_pa(&scenario.rig, axis, supply_pressure_pa, side).ok_or_else(|| {
            let key = format!("initial.pressure_{}_Pa", side.letter());
            let expected = "a pressure, as the valve at its null lets nothing in or out";
            error(&scenario.name, &key, "missing".into(), expected)
        }),
    };
    let position_m = initial.position_m.unwrap_or(middle);
    let mut state = AxisState::at_rest(
        position_m,
        pressure_pa(initial.pressure_a_pa, Side::A)?,
        pressure_pa(initial.pressure_b_pa, Side::B)?,
        initial.temperature_k.unwrap_or(axis.supply_temperature_k),
        initial.command_v.unwrap_or(axis.valve.null_v),
    );
    state.carriage = CarriageState::new(position_m, initial.velocity_m_s.unwrap_or(0.0));
    Ok(state)
}

// the run

struct Run<'a> {
    scenario: &'a Scenario,
    world: World,
    stroke_m: [f64; 2],
}

impl Run<'_> {
    fn all_rows(&mut self) -> Result<Simulation, RigError> {
        let rows = self.scenario.rows();
        let mut samples = Vec::with_capacity(rows);
        let mut ending = Ending::Complete;
        for row in 0..rows {
            let time_s = on_time_grid(row as f64 * self.scenario.sample_s);
            let command_v = self.scenario.command.at(time_s);
            samples.push(self.world.sample(time_s, command_v));
            if row + 1 == rows {
                break;
            }
            if let Some(stop) = self.advance(time_s, command_v)? {
                ending = stop;
                break;
            }
        }
        Ok(Simulation { samples, ending })
    }

    /// One row's time; the end stop, if the carriage reaches one.
    fn advance(&mut self, time_s: f64, command_v: f64) -> Result<Option<Ending>, RigError> {
        let [low, high] = self.stroke_m;
        for step in 1..=self.scenario.steps_per_sample {
            let time_s = on_time_grid(time_s + f64::from(step) * self.world.axis.dt_s);
            self.world.step(command_v, time_s);
            if !self.world.state.is_finite() {
                let problem = format!("the states became infinite at {time_s} s");
                let expected = "a shorter one, or a rig with possible numbers";
                return Err(error(&self.scenario.name, "step_s", problem, expected));
            }
            let position_m = self.world.state.carriage.position_m.value;
            if !(low..=high).contains(&position_m) {
                return Ok(Some(Ending::EndStop { time_s, position_m }));
            }
        }
        Ok(None)
    }
}

// what it says

/// What a person wants to know of a simulation first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyFigures {
    /// Highest speed, m/s, and when, s.
    pub peak_speed_m_s: (f64, f64),
    /// From the lowest to the highest position, m.
    pub travel_m: f64,
    /// Lowest gas temperature, K, and when, s.
    pub lowest_temperature_k: (f64, f64),
    /// In which chamber.
    pub coldest: Side,
}

impl Simulation {
    /// Key figures.
    pub fn key_figures(&self) -> KeyFigures {
        let most = |value: &dyn Fn(&Sample) -> f64| {
            let pairs = self
                .samples
                .iter()
                .map(|sample| (value(sample), sample.time_s));
            pairs.fold((f64::NEG_INFINITY, 0.0), |best, pair| {
                if pair.0 > best.0 { pair } else { best }
            })
        };
        let cold = |side: Side| {
            most(&|sample| match side {
                Side::A => -sample.temperature_a_k,
                Side::B => -sample.temperature_b_k,
            })
        };
        let coldest = if cold(Side::A).0 >= cold(Side::B).0 {
            Side::A
        } else {
            Side::B
        };
        let (negative_k, time_s) = cold(coldest);
        KeyFigures {
            peak_speed_m_s: most(&|sample| sample.velocity_m_s.abs()),
            travel_m: most(&|sample| sample.position_m).0 + most(&|sample| -sample.position_m).0,
            lowest_temperature_k: (-negative_k, time_s),
            coldest,
        }
    }

    /// What a person must be told besides, if anything.
    pub fn note(&self) -> Option<String> {
        let Ending::EndStop { time_s, position_m } = self.ending else {
            return None;
        };
        Some(format!(
            "stopped at {time_s} s: the carriage reached the end of its stroke at x = {:.1} mm, and the model has \
             no end stops; start elsewhere, shorten duration_s or turn the command back earlier",
            1e3 * position_m
        ))
    }
}
