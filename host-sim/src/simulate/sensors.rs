//! From what happened to what the rig's sensors and logger would have written.
//!
//! Per signal: the effects of its sensor (lag of the pressure sensors, time skew
//! of the position), then, with a seed, the declared noise and quantum, then
//! the way back from SI to the column's unit. So the table reads back through
//! the same rig's `[signals]`; a signal that the rig does not name stands in SI
//! under the name given here.

use std::io::{self, Write};

use super::{Sample, Simulation, error, values};
use crate::random::Noise;
use crate::recording::{ColumnFault, arrange};
use crate::report::number::Rounding;
use crate::rig::{RigError, Signal};
use crate::scenario::Scenario;

/// Digits of the numbers in the table: 1e-12 of a value is far below any
/// sensor, and rounding keeps 0.1 + 0.2 from filling a line.
const DIGITS: i32 = 12;

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

/// A recording as it is written: names and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The header.
    pub names: Vec<String>,
    /// One column per name.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// Writes it as CSV with a header line.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "{}", self.names.join(","))?;
        let rows = self.columns.first().map_or(0, Vec::len);
        for row in 0..rows {
            for (place, column) in self.columns.iter().enumerate() {
                let separator = if place == 0 { "" } else { "," };
                write!(out, "{separator}{}", column[row])?;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

/// The simulation as the rig would have recorded it.
pub fn recorded(scenario: &Scenario, simulation: &Simulation) -> Result<Table, RigError> {
    let channels: Vec<(usize, &Channel)> = CHANNELS
        .iter()
        .enumerate()
        .filter(|(_, channel)| scenario.records_states || !channel.is_state)
        .collect();
    let offered: Vec<(&str, &str)> = channels
        .iter()
        .map(|(_, channel)| (channel.signal, channel.name))
        .collect();
    let arranged = arrange(&scenario.rig.signals, &offered).map_err(
        |ColumnFault {
             key,
             problem,
             expected,
         }| error(&scenario.rig_name, &key, problem, &expected),
    )?;
    let (names, columns) = arranged
        .into_iter()
        .map(|(name, place)| {
            let (stream, channel) = channels[place];
            (name, column(scenario, simulation, channel, stream))
        })
        .unzip();
    Ok(Table { names, columns })
}

fn signal<'a>(scenario: &'a Scenario, channel: &Channel) -> Option<&'a Signal> {
    scenario.rig.signals.get(channel.signal)
}

fn column(
    scenario: &Scenario,
    simulation: &Simulation,
    channel: &Channel,
    stream: usize,
) -> Vec<f64> {
    let exact: Vec<f64> = simulation.samples.iter().map(channel.value).collect();
    let sensed = sensed(scenario, simulation, channel, exact);
    let rounding = Rounding::Significant(DIGITS);
    let Some(signal) = signal(scenario, channel) else {
        return sensed
            .into_iter()
            .map(|value| rounding.apply(value))
            .collect();
    };
    let gauge_zero_pa = scenario.rig.signals.gauge_zero_pa;
    let disturbed = disturbed(scenario.noise_seed, signal, channel, stream, sensed);
    disturbed
        .into_iter()
        .map(|value| rounding.apply(signal.from_si(value, gauge_zero_pa)))
        .collect()
}

/// The effects of the sensor.
fn sensed(
    scenario: &Scenario,
    simulation: &Simulation,
    channel: &Channel,
    exact: Vec<f64>,
) -> Vec<f64> {
    let values = values(&scenario.rig);
    match channel.signal {
        "p_a" | "p_b" => {
            let lag_s = values.effect("pressure-sensor-lag", "time_constant_s", 0.0);
            lagged(exact, lag_s, scenario.sample_s)
        }
        "x" => {
            let delay_s = values.effect("position-time-skew", "delay_s", 0.0);
            delayed(simulation, exact, delay_s / scenario.sample_s)
        }
        _ => exact,
    }
}

/// A first-order lag, row by row.
fn lagged(exact: Vec<f64>, lag_s: f64, sample_s: f64) -> Vec<f64> {
    if lag_s <= 0.0 {
        return exact;
    }
    let share = 1.0 - libm::exp(-sample_s / lag_s);
    let mut shown = exact.first().copied().unwrap_or(0.0);
    let step = |pressure: f64| {
        shown += share * (pressure - shown);
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
