//! A channel that cannot be true, where, and why.

use serde::Serialize;

use super::SignalReport;
use super::statistics::Run;
use crate::recording::Recording;

/// What kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// One value from the first row to the last.
    Dead,
    /// One value for a stretch in which it must have changed.
    Frozen,
    /// Cut off at the end of the sensor's range.
    Saturated,
    /// Leaps away and back.
    Dropout,
    /// Stands out for a row or a few.
    Spike,
    /// Sampled more slowly than the rows come, and repeated.
    Held,
    /// Averaged over many rows by the logger.
    Smoothed,
    /// Goes further from one row to the next than an axis can.
    Leap,
    /// At odds with another channel or with the rig.
    Inconsistent,
}

/// A channel that cannot be true, where, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// The kind.
    pub kind: FaultKind,
    /// The signal.
    pub signal: String,
    /// First line of the file concerned.
    pub first_line: u32,
    /// Last line of the file concerned.
    pub last_line: u32,
    /// First instant, s.
    pub from_s: f64,
    /// Last instant, s.
    pub to_s: f64,
    /// The finding as a sentence, with lines and figures.
    pub sentence: String,
}

/// Below this a change of the signal is no motion.
pub(super) fn floor(report: &SignalReport) -> f64 {
    20.0 * report.noise.max(report.quantum.unwrap_or(0.0))
}

/// A fault of the whole recording.
pub(super) fn at_odds_as(
    kind: FaultKind,
    recording: &Recording,
    signal: &str,
    said: &str,
) -> Fault {
    let run = Run {
        start: 0,
        length: recording.len(),
    };
    fault(recording, signal, kind, run, said)
}

pub(super) fn fault(
    recording: &Recording,
    signal: &str,
    kind: FaultKind,
    run: Run,
    said: &str,
) -> Fault {
    let (first, last) = (run.start, run.end().max(run.start + 1) - 1);
    let (first_line, last_line) = (recording.line[first], recording.line[last]);
    let (from_s, to_s) = (recording.time_s[first], recording.time_s[last]);
    Fault {
        kind,
        signal: signal.into(),
        first_line,
        last_line,
        from_s,
        to_s,
        sentence: format!(
            "lines {first_line} to {last_line} ({from_s:.3} to {to_s:.3} s): {signal} {said}."
        ),
    }
}
