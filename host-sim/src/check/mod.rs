//! A rig against its recordings, all remarks at once: what is wrong with the file, which laws run
//! and what the others lack, what is assumed, what is taken as exact, and what the recordings are
//! worth by [`mod@diagnosis::inspect`].

mod display;
mod needs;

use crate::laws::needs::Assumed;
use serde::Serialize;

pub use needs::{Lack, LawCheck};

use crate::recording::Recording;
use crate::rig::{Rig, RigError};
use diagnosis::inspect::{Inspection, SignalReport, inspect, lateness};

/// The findings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// `check/1`.
    pub format: &'static str,
    /// The rig file.
    pub rig: String,
    /// Whether fits and diagnoses can use rig and recordings.
    pub usable: bool,
    /// Faults of the rig file, one line each.
    pub rig_faults: Vec<String>,
    /// The laws that the rig describes.
    pub laws: Vec<LawCheck>,
    /// Values in use that the rig does not state.
    pub assumed: Vec<Assumed>,
    /// Numbers without an entry in `[uncertainty]`, which no fit moves.
    pub exact: Vec<String>,
    /// Numbers far from what is typical, one line each.
    pub unusual: Vec<String>,
    /// Each recording.
    pub recordings: Vec<RecordingCheck>,
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingCheck {
    /// The file.
    pub recording: String,
    /// Why it cannot be read, one line.
    pub error: Option<String>,
    /// Number of rows.
    pub rows: usize,
    /// Rows per second.
    pub rate_hz: f64,
    /// Faults, one line each.
    pub faults: Vec<String>,
    /// Remarks, one line each.
    pub remarks: Vec<String>,
    /// Columns that the rig does not name.
    pub unused_columns: Vec<String>,
    /// Noise of each signal.
    pub noise: Vec<NoiseCheck>,
}

/// Declared noise against measured, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoiseCheck {
    /// The signal.
    pub signal: String,
    /// Its unit.
    pub unit: &'static str,
    /// What the rig states.
    pub declared: Option<f64>,
    /// What the rows show.
    pub measured: f64,
    /// False where the resolution hides the noise: it is at most the figure.
    pub visible: bool,
}

impl Check {
    /// The findings on a rig file, before any recording.
    pub fn of_rig(name: &str, rig: &Rig, faults: &[RigError]) -> Self {
        let laws = needs::laws(rig);
        let runs = laws.iter().any(|law| law.lacks.is_empty());
        Self {
            format: "check/1",
            rig: name.into(),
            usable: faults.is_empty() && runs,
            rig_faults: faults.iter().map(ToString::to_string).collect(),
            laws,
            assumed: crate::laws::needs::assumed(rig),
            exact: exact(rig),
            unusual: unusual(rig),
            recordings: Vec::new(),
        }
    }

    /// Adds what a recording shows, or why it cannot be read.
    pub fn add(&mut self, rig: &Rig, name: &str, recording: Result<Recording, String>) {
        let checked = match recording {
            // What a faulty rig file says of the recordings is not to be believed.
            Ok(recording) if !self.rig_faults.is_empty() => RecordingCheck::read(name, &recording),
            Ok(recording) => {
                let mut checked = RecordingCheck::of(name, inspect(rig, &recording));
                checked.remarks.extend(lateness::remarks(rig, &recording));
                checked
            }
            Err(error) => RecordingCheck::unreadable(name, error),
        };
        self.usable &= checked.error.is_none() && checked.faults.is_empty();
        self.recordings.push(checked);
    }
}

impl RecordingCheck {
    /// A recording that was read and not judged.
    fn read(name: &str, recording: &Recording) -> Self {
        Self {
            error: None,
            rows: recording.len(),
            remarks: recording.remarks.clone(),
            rate_hz: 1.0 / crate::laws::median_step_s(&recording.time_s),
            ..Self::unreadable(name, String::new())
        }
    }

    fn unreadable(name: &str, error: String) -> Self {
        Self {
            recording: name.into(),
            error: Some(error),
            rows: 0,
            rate_hz: 0.0,
            faults: Vec::new(),
            remarks: Vec::new(),
            unused_columns: Vec::new(),
            noise: Vec::new(),
        }
    }

    fn of(name: &str, inspection: Inspection) -> Self {
        let noise = inspection.signals.iter().filter(|one| one.name != "u");
        Self {
            recording: name.into(),
            error: None,
            rows: inspection.rows,
            rate_hz: inspection.timing.rate_hz,
            faults: inspection
                .faults
                .iter()
                .map(|fault| fault.sentence.clone())
                .collect(),
            remarks: inspection.notes.clone(),
            unused_columns: inspection.unused_columns.clone(),
            noise: noise.map(NoiseCheck::of).collect(),
        }
    }
}

impl NoiseCheck {
    fn of(signal: &SignalReport) -> Self {
        Self {
            signal: signal.name.clone(),
            unit: signal.unit,
            declared: signal.declared_noise,
            measured: signal.noise,
            visible: signal.noise_visible,
        }
    }
}

/// How many times above or below what is typical a number is remarked on: a wrong unit is off by a
/// hundred or more, and typical ranges span twenty.
const UNUSUAL: f64 = 10.0;

/// Numbers that are far from the typical ones of their keys.
fn unusual(rig: &Rig) -> Vec<String> {
    let keys = rig.value_keys().into_iter();
    let of_axis = keys.filter(|key| !key.starts_with("horizon."));
    let said = of_axis.filter_map(|key| {
        let facts = crate::rig::describe(&key)?;
        let (low, high) = typical_range(facts.typical)?;
        let size = rig.value(&key)?.abs();
        let is_off = size > UNUSUAL * high || size > 0.0 && size * UNUSUAL < low;
        is_off.then(|| {
            format!(
                "{key} = {} {} is far from typical ({}): is the unit right?",
                crate::text::plain(size, 4),
                facts.unit,
                facts.typical
            )
        })
    });
    said.collect()
}

/// The numbers of "0.05 to 2": positive ones only, as others have no size to compare with.
fn typical_range(typical: &str) -> Option<(f64, f64)> {
    let (low, high) = typical.split_once(" to ").unwrap_or((typical, typical));
    let number = |text: &str| text.split_whitespace().next()?.parse::<f64>().ok();
    let (low, high) = (number(low)?, number(high)?);
    let words = typical
        .split_whitespace()
        .filter(|word| word.parse::<f64>().is_err());
    let is_bare = words.filter(|word| *word != "to").count() == 0;
    (is_bare && low > 0.0 && high >= low).then_some((low, high))
}

/// Numbers that a person measured or guessed and gave no deviation.
fn exact(rig: &Rig) -> Vec<String> {
    let keys = rig.value_keys().into_iter();
    keys.filter(|key| !key.starts_with("horizon."))
        .filter(|key| rig.uncertainty_sd(key).is_none())
        .collect()
}
