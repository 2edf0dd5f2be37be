//! From what happened to what the rig's sensors and logger would have written.
//!
//! Per signal: the effects of its sensor (lag and offset of the pressure sensors, time skew
//! of the position), then, with a seed, the declared noise and quantum, then
//! the way back from SI to the column's unit ([`Table`]).

use super::{Sample, Simulation};
use crate::effects::sensing::{position_time_skew, pressure_sensor_lag};
use crate::gauge::Gauge;
use crate::lag::followed;
use crate::model::{Side, Values};
use crate::random::Noise;
use crate::recording::{Output, Table};
use crate::rig::{RigError, Signal};
use crate::scenario::Scenario;

/// One column that a simulation can write.
struct Channel {
    /// The name when the rig does not say.
    name: &'static str,
    /// The signal of the rig.
    signal: &'static str,
    value: fn(&Sample) -> f64,
    /// Recorded always, or with the states only.
    is_state: bool,
}

#[rustfmt::skip]
const CHANNELS: &[Channel] = &[
    Channel { name: "t_s", signal: "t", value: |sample| sample.time_s, is_state: false },
    Channel { name: "u_V", signal: "u", value: |sample| sample.command_v, is_state: false },
    Channel { name: "p_a_Pa", signal: "p_a", value: |sample| sample.pressure_a_pa, is_state: false },
    Channel { name: "p_b_Pa", signal: "p_b", value: |sample| sample.pressure_b_pa, is_state: false },
    Channel { name: "p_s_Pa", signal: "p_s", value: |sample| sample.supply_pressure_pa, is_state: false },
    Channel { name: "x_m", signal: "x", value: |sample| sample.position_m, is_state: false },
    Channel { name: "v_m_s", signal: "v", value: |sample| sample.velocity_m_s, is_state: false },
    Channel { name: "T_a_K", signal: "temperature_a", value: |sample| sample.temperature_a_k, is_state: true },
    Channel { name: "T_b_K", signal: "temperature_b", value: |sample| sample.temperature_b_k, is_state: true },
    // No signal: the force of a test bench is another one.
    Channel { name: "friction_N", signal: "", value: |sample| sample.friction_n, is_state: true },
];

/// The simulation as the rig would have recorded it.
pub fn recorded(scenario: &Scenario, simulation: &Simulation) -> Result<Table, RigError> {
    let outputs: Vec<Output> = CHANNELS
        .iter()
        .enumerate()
        .filter(|(_, channel)| scenario.records_states || !channel.is_state)
        .map(|(stream, channel)| Output {
            name: channel.name,
            signal: channel.signal,
            values: values_si(scenario, simulation, channel, stream),
        })
        .collect();
    Table::new(&scenario.rig, &scenario.rig_name, &outputs)
}

/// What the logger takes from the sensor.
fn values_si(
    scenario: &Scenario,
    simulation: &Simulation,
    channel: &Channel,
    stream: usize,
) -> Vec<f64> {
    let exact: Vec<f64> = simulation.samples.iter().map(channel.value).collect();
    let sensed = sensed(scenario, simulation, channel, exact);
    match scenario.rig.signals.get(channel.signal) {
        Some(signal) => disturbed(scenario.noise_seed, signal, channel, stream, sensed),
        None => sensed,
    }
}

/// The effects of the sensor.
fn sensed(
    scenario: &Scenario,
    simulation: &Simulation,
    channel: &Channel,
    exact: Vec<f64>,
) -> Vec<f64> {
    let values = Values::of(&scenario.rig);
    match channel.signal {
        "p_a" | "p_b" => {
            let lag_s = pressure_sensor_lag::time_constant_s(&values);
            let gauge = Gauge::of(&values, side_of(channel.signal));
            let shown = lagged(exact, lag_s, scenario.sample_s).into_iter();
            shown
                .map(|pressure_pa| gauge.shows_pa(pressure_pa))
                .collect()
        }
        "x" => {
            let delay_s = position_time_skew::delay_s(&values);
            delayed(simulation, exact, delay_s / scenario.sample_s)
        }
        _ => exact,
    }
}

fn side_of(pressure_signal: &str) -> Side {
    if pressure_signal == Side::A.pressure_signal() {
        Side::A
    } else {
        Side::B
    }
}

/// A first-order lag, row by row.
fn lagged(exact: Vec<f64>, lag_s: f64, sample_s: f64) -> Vec<f64> {
    let mut before = exact.first().copied().unwrap_or(0.0);
    let mut shown = before;
    let step = |pressure: f64| {
        shown = followed(shown, (before, pressure), lag_s, sample_s);
        before = pressure;
        shown
    };
    exact.into_iter().map(step).collect()
}

/// The value of so many rows ago, linear between rows and level beyond the ends.
fn delayed(simulation: &Simulation, exact: Vec<f64>, delay_rows: f64) -> Vec<f64> {
    if delay_rows.abs() <= 0.0 {
        return exact;
    }
    let last = simulation.samples.len().saturating_sub(1) as f64;
    let at = |row: usize| {
        let place = (row as f64 - delay_rows).clamp(0.0, last);
        let below = place.floor();
        let above = (below + 1.0).min(last);
        let (low, high) = (exact[below as usize], exact[above as usize]);
        low + (place - below) * (high - low)
    };
    (0..exact.len()).map(at).collect()
}

/// With a seed: the declared noise, then the declared quantum. Time is exact.
fn disturbed(
    seed: Option<u64>,
    signal: &Signal,
    channel: &Channel,
    stream: usize,
    sensed: Vec<f64>,
) -> Vec<f64> {
    let Some(seed) = seed.filter(|_| channel.signal != "t") else {
        return sensed;
    };
    let mut noise = Noise::new(seed, stream as u64);
    let deviation = signal.noise.unwrap_or(0.0);
    let disturb = |value: f64| {
        let noisy = value + deviation * noise.normal();
        match signal.resolution {
            Some(quantum) => (noisy / quantum).round() * quantum,
            None => noisy,
        }
    };
    sensed.into_iter().map(disturb).collect()
}
