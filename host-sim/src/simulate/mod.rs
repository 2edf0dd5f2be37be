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
//!
//! Limits: the model has no end stops and no cushions, so the simulation ends
//! where the carriage leaves its stroke ([`Ending::EndStop`]). The bristles of
//! the friction begin relaxed, also under an initial velocity.

mod page;
mod sensors;

pub use page::page;
pub use sensors::{Table, recorded};

use crate::model::{AxisFault, Side, Values};
use crate::rig::{Rig, RigError};
use crate::scenario::{Scenario, stroke_range_m};
use model_core::axis::{Axis, AxisInputs, AxisState};
use model_core::carriage::CarriageState;
use model_core::left_out::{ChamberLeakage, DELAY_CAPACITY};
use model_core::valve::{GasState, Port};

/// Times are decimals: rounding to this many parts of a second undoes what
/// sums and products of them add, so that 0.1 s + 0.2 s is 0.3 s.
const TIME_GRID_PER_S: f64 = 1e12;
/// Halvings of the pressure interval: to the last bit of a double.
const EQUILIBRIUM_HALVINGS: u32 = 60;

/// What happened at one row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// The command from this row to the next, V.
    pub command_v: f64,
    /// Pressure of chamber a, Pa absolute.
    pub pressure_a_pa: f64,
    /// Pressure of chamber b, Pa absolute.
    pub pressure_b_pa: f64,
    /// Supply pressure, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_m_s: f64,
    /// Temperature of the gas in chamber a, K.
    pub temperature_a_k: f64,
    /// Temperature of the gas in chamber b, K.
    pub temperature_b_k: f64,
    /// Friction against +x, mean over the last step, N.
    pub friction_n: f64,
}

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

/// The time to the nearest part of the grid of decimals.
pub(crate) fn on_time_grid(time_s: f64) -> f64 {
    (time_s * TIME_GRID_PER_S).round() / TIME_GRID_PER_S
}

/// Runs a scenario.
pub fn simulate(scenario: &Scenario) -> Result<Simulation, RigError> {
    let axis = axis(scenario)?;
    check_delay(scenario, &axis)?;
    let mut run = Run {
        state: initial_state(scenario, &axis)?,
        supply_pressure_pa: scenario
            .rig
            .value("supply.pressure_Pa")
            .ok_or_else(|| rig_error(scenario, "supply.pressure_Pa", "missing", "it"))?,
        stroke_m: stroke_range_m(&scenario.rig).unwrap_or([f64::MIN, f64::MAX]),
        leak_onset_s: leak_onset_s(&scenario.rig),
        leaks: (axis.pneumatics.leak_a, axis.pneumatics.leak_b),
        scenario,
        axis,
    };
    run.all_rows()
}

fn values(rig: &Rig) -> Values<'_, f64> {
    Values {
        rig,
        keys: &[],
        replaced: &[],
    }
}

fn axis(scenario: &Scenario) -> Result<Axis<f64>, RigError> {
    let axis = values(&scenario.rig).axis(scenario.step_s());
    axis.map_err(
        |AxisFault {
             key,
             problem,
             expected,
         }| { rig_error(scenario, &key, &problem, &expected) },
    )
}

/// A delay longer than the model's memory would be cut in silence.
fn check_delay(scenario: &Scenario, axis: &Axis<f64>) -> Result<(), RigError> {
    let delay_s = values(&scenario.rig).valve_delay().delay_s;
    let longest_s = (DELAY_CAPACITY - 2) as f64 * axis.dt_s;
    if delay_s <= longest_s {
        return Ok(());
    }
    let problem = format!("{delay_s} s is more than {longest_s} s");
    let expected = format!(
        "at most {} steps of {} s: a longer step_s",
        DELAY_CAPACITY - 2,
        axis.dt_s
    );
    let key = "effects.valve-delay.delay_s";
    Err(rig_error(scenario, key, &problem, &expected))
}

/// Time at which the leaks of the chambers open, s.
fn leak_onset_s(rig: &Rig) -> f64 {
    values(rig).effect("chamber-leakage", "onset_s", f64::NEG_INFINITY)
}

fn rig_error(scenario: &Scenario, key: &str, problem: &str, expected: &str) -> RigError {
    error(&scenario.rig_name, key, problem.into(), expected)
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

fn initial_state(scenario: &Scenario, axis: &Axis<f64>) -> Result<AxisState<f64>, RigError> {
    let initial = scenario.initial;
    let middle = stroke_range_m(&scenario.rig).map_or(0.0, |[low, high]| 0.5 * (low + high));
    let pressure_pa = |declared: Option<f64>, side: Side| match declared {
        Some(pressure_pa) => Ok(pressure_pa),
        None => equilibrium_pa(scenario, axis, side),
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

/// The pressure at which the valve at its null lets in as much as it and the
/// chamber's leak let out, with all gas at the temperature of the surroundings.
fn equilibrium_pa(scenario: &Scenario, axis: &Axis<f64>, side: Side) -> Result<f64, RigError> {
    let inflow = |pressure_pa| net_inflow_kg_per_s(scenario, axis, side, pressure_pa);
    let ambient_pa = axis.pneumatics.ambient.pressure_pa;
    let supply_pa = scenario
        .rig
        .value("supply.pressure_Pa")
        .unwrap_or(ambient_pa);
    if inflow(ambient_pa) <= 0.0 && inflow(supply_pa) >= 0.0 {
        let key = format!("initial.pressure_{}_Pa", side.letter());
        let expected = "a pressure, as the valve at its null lets nothing in or out";
        return Err(error(&scenario.name, &key, "missing".into(), expected));
    }
    let (mut low, mut high) = (ambient_pa, supply_pa);
    for _ in 0..EQUILIBRIUM_HALVINGS {
        let middle = 0.5 * (low + high);
        if inflow(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}

fn net_inflow_kg_per_s(scenario: &Scenario, axis: &Axis<f64>, side: Side, pressure_pa: f64) -> f64 {
    let pneumatics = &axis.pneumatics;
    let ambient = pneumatics.ambient;
    let gas = |pressure_pa| GasState {
        pressure_pa,
        temperature_k: ambient.temperature_k,
    };
    let areas = axis.valve.areas(axis.valve.null_v);
    let (port, leak) = match side {
        Side::A => (Port::A, &pneumatics.leak_a),
        Side::B => (Port::B, &pneumatics.leak_b),
    };
    let (supply_m2, exhaust_m2) = match port {
        Port::A => (areas.supply_a_m2, areas.exhaust_a_m2),
        Port::B => (areas.supply_b_m2, areas.exhaust_b_m2),
    };
    let supply_pa = scenario
        .rig
        .value("supply.pressure_Pa")
        .unwrap_or(pressure_pa);
    let law = &axis.valve.law;
    let chamber = gas(pressure_pa);
    let leak_outflow = if leak_onset_s(&scenario.rig) <= 0.0 {
        leak.outflow(&pneumatics.law, chamber, ambient).0
    } else {
        0.0
    };
    law.flow(supply_m2, gas(supply_pa), chamber)
        .mass_flow_kg_per_s
        - law.flow(exhaust_m2, chamber, ambient).mass_flow_kg_per_s
        - leak_outflow
}

// the run

struct Run<'a> {
    scenario: &'a Scenario,
    axis: Axis<f64>,
    state: AxisState<f64>,
    supply_pressure_pa: f64,
    stroke_m: [f64; 2],
    leak_onset_s: f64,
    /// The leaks of both chambers once open.
    leaks: (ChamberLeakage<f64>, ChamberLeakage<f64>),
}

impl Run<'_> {
    fn all_rows(&mut self) -> Result<Simulation, RigError> {
        let rows = self.scenario.rows();
        let mut samples = Vec::with_capacity(rows);
        let mut ending = Ending::Complete;
        for row in 0..rows {
            let time_s = on_time_grid(row as f64 * self.scenario.sample_s);
            let command_v = self.scenario.command.at(time_s);
            samples.push(self.sample(time_s, command_v));
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
        let inputs = AxisInputs {
            command_v,
            supply_pressure_pa: self.supply_pressure_pa,
        };
        let [low, high] = self.stroke_m;
        for step in 1..=self.scenario.steps_per_sample {
            let time_s = on_time_grid(time_s + f64::from(step) * self.axis.dt_s);
            self.open_leaks(time_s);
            self.axis.step(&mut self.state, &inputs);
            if !self.state.is_finite() {
                let problem = format!("the states became infinite at {time_s} s");
                let expected = "a shorter one, or a rig with possible numbers";
                return Err(error(&self.scenario.name, "step_s", problem, expected));
            }
            let position_m = self.state.carriage.position_m.value;
            if !(low..=high).contains(&position_m) {
                return Ok(Some(Ending::EndStop { time_s, position_m }));
            }
        }
        Ok(None)
    }

    /// The leaks by the part of the step to `end_s` for which they are open.
    fn open_leaks(&mut self, end_s: f64) {
        let open = ((end_s - self.leak_onset_s) / self.axis.dt_s).clamp(0.0, 1.0);
        self.axis.pneumatics.leak_a = self.leaks.0.scaled(open);
        self.axis.pneumatics.leak_b = self.leaks.1.scaled(open);
    }

    fn sample(&self, time_s: f64, command_v: f64) -> Sample {
        let AxisState {
            pneumatics,
            carriage,
            ..
        } = &self.state;
        let chambers = &self.axis.pneumatics;
        let a = chambers.chamber_a.seen(pneumatics.a.gas_state(), 0.0);
        let b = chambers.chamber_b.seen(pneumatics.b.gas_state(), 0.0);
        Sample {
            time_s,
            command_v,
            pressure_a_pa: a.pressure_pa,
            pressure_b_pa: b.pressure_pa,
            supply_pressure_pa: self.supply_pressure_pa,
            position_m: carriage.position_m.value,
            velocity_m_s: carriage.velocity_m_per_s,
            temperature_a_k: a.temperature_k,
            temperature_b_k: b.temperature_k,
            friction_n: carriage.friction_n,
        }
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
            "stopped at {time_s} s: the carriage left its stroke at x = {:.1} mm, and the model has \
             no end stops; start elsewhere, shorten duration_s or turn the command back earlier",
            1e3 * position_m
        ))
    }
}
