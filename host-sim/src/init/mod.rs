//! A first rig file from a data sheet and a recording.
//!
//! * `sheet`: what a data sheet says, and the commented rig file made of it.
//! * `valves`: valves by type, the typical shape of a valve's area.
//! * `columns`: which column is which signal, guessed and confirmed.
//!
//! Typical values are marked as typical in the file and get wide deviations: a fit may move them,
//! and an honest diagnosis counts on that.

mod columns;
mod sheet;
mod valves;

use std::path::Path;

pub use columns::Guess;
pub use sheet::{DataSheet, SignalLine};

use crate::board::recorder::recorded_signals;
use crate::plant::usual_noise_and_step;
use crate::recording::Recording;
use crate::rig::{Rig, nominal_flow_of_conductance};
use columns::{Preview, Scale};
use diagnosis::inspect::{SignalReport, inspect};

/// b where a data sheet states none.
pub const TYPICAL_B: f64 = valves::TYPICAL_B;

/// Name, nominal flow in l/min of the valve of a type; `None` for one that is not listed.
pub fn valve_by_type(name: &str) -> Option<(&'static str, f64)> {
    valves::by_name(name).map(|valve| (valve.name, valve.nominal_flow_l_min))
}

/// The types that are listed.
pub fn valve_types() -> Vec<&'static str> {
    valves::CATALOGUE.iter().map(|valve| valve.name).collect()
}

/// The nominal flow that a sonic conductance in l/(s bar), the unit of data sheets, amounts to, l/min.
pub fn nominal_flow_of(conductance_l_s_bar: f64, b: f64) -> f64 {
    /// 1 l/(s bar) in m3/(s Pa).
    const M3_S_PA: f64 = 1e-8;
    nominal_flow_of_conductance(conductance_l_s_bar * M3_S_PA, b)
}

/// A recording's columns as guessed, and what its motion says of the axis.
#[derive(Debug)]
pub struct Columns {
    preview: Preview,
    /// The guesses.
    pub guesses: Vec<Guess>,
}

impl Columns {
    /// Guesses the columns of a file.
    ///
    /// # Errors
    /// One line where the file is no table with a header.
    pub fn of(path: &Path, sheet: &DataSheet) -> Result<Self, String> {
        let preview = Preview::read(path)?;
        let guesses = preview.guesses(Scale {
            stroke_m: sheet.stroke_m,
            supply_pa: sheet.supply_pa.0,
            ambient_pa: sheet.ambient_pa,
        });
        Ok(Self { preview, guesses })
    }

    /// The header names.
    pub fn names(&self) -> &[String] {
        &self.preview.names
    }

    /// Takes over from the recording what it shows of the axis: the side that feeds chamber A and
    /// the place where x is 0.
    pub fn complete(&self, sheet: &mut DataSheet) {
        if let Some(above) = self.preview.moves_up_above(&self.guesses, sheet.null_v) {
            sheet.feeds_a_above_null = (above, "by the recording: command against motion");
        }
        if let Some([least_m, most_m]) = self.preview.travel_m(&self.guesses) {
            // A sensor's zero may be a little off the end.
            let beyond_end_m = 0.02 * sheet.stroke_m;
            if least_m < -beyond_end_m {
                sheet.zero_is_mid_stroke = (true, "by the recording: x goes below 0");
            } else if most_m > 0.5 * sheet.stroke_m + beyond_end_m {
                sheet.zero_is_mid_stroke =
                    (false, "by the recording: x goes beyond half of the stroke");
            }
        }
    }
}

/// The signals of a controller board, as `pneuma board run` records them: typical noise, and the
/// resolution of the board's converters.
pub fn of_a_board(sensor: PositionSensor) -> Vec<SignalLine> {
    let line = |(signal, column, unit): (&str, &str, &str)| {
        let usual = usual_noise_and_step(signal);
        let stated =
            |of: fn(&PositionSensor) -> Option<f64>| (signal == "x").then(|| of(&sensor)).flatten();
        let noise = stated(|sensor| sensor.noise_m).map(|noise| (noise, "as stated"));
        let resolution = stated(|sensor| sensor.resolution_m);
        SignalLine {
            guess: Guess {
                signal: signal.into(),
                column: column.into(),
                unit: unit.into(),
                why: "recorded by the board".into(),
            },
            noise: noise.or(usual.map(|[noise, _]| (noise, "typical"))),
            resolution: resolution.or(usual.map(|[_, step]| step)),
        }
    };
    recorded_signals().map(line).collect()
}

/// What the data sheet of a position sensor states, m.
#[derive(Clone, Copy, Debug, Default)]
pub struct PositionSensor {
    /// Standard deviation of the noise.
    pub noise_m: Option<f64>,
    /// Resolution.
    pub resolution_m: Option<f64>,
}

/// Signals with the noise and resolution that the recording shows; those that a data sheet states
/// go first.
///
/// # Errors
/// One line where the recording cannot be read by these columns.
pub fn measured(
    path: &Path,
    guesses: &[Guess],
    sensor: PositionSensor,
) -> Result<Vec<SignalLine>, String> {
    let plain = |guess: &Guess| SignalLine {
        guess: guess.clone(),
        noise: None,
        resolution: None,
    };
    let mut lines: Vec<SignalLine> = guesses.iter().map(plain).collect();
    let text = sheet::signals_file(&lines);
    let rig = Rig::parse(&text, "the columns").map_err(|error| error.to_string())?;
    let recording = Recording::read(path, &rig.signals).map_err(|error| error.to_string())?;
    let inspection = inspect(&rig, &recording);
    for line in &mut lines {
        let signal = line.guess.signal.as_str();
        let Some(report) = inspection.signal(signal) else {
            continue;
        };
        let PositionSensor {
            noise_m,
            resolution_m,
        } = if signal == "x" {
            sensor
        } else {
            PositionSensor::default()
        };
        line.noise = noise_m
            .map(|noise| (noise, "as stated"))
            .or_else(|| measured_noise(report));
        line.resolution = resolution_m.or(report.quantum);
    }
    Ok(lines)
}

/// The command is known as it is sent. Noise under a quantum is that of rounding.
fn measured_noise(report: &SignalReport) -> Option<(f64, &'static str)> {
    if report.name == "u" {
        return None;
    }
    match report.quantum {
        _ if report.noise_visible => Some((report.noise, "measured in the recording")),
        Some(quantum) => Some((
            quantum / 12_f64.sqrt(),
            "of rounding; hidden in the resolution",
        )),
        None => None,
    }
}
