//! What a score run comes to: errors of the measured position against the reference of the board.

use super::programs::{MOVE_S, SWING_HZ};
use crate::recording::{Recording, RecordingError};
use crate::rig::Rig;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where the load should be, a column of the board's recordings.
const REFERENCE: &str = "reference_m";
/// The end of a move that counts as rest, s.
const REST_S: f64 = 1.0;

/// A reference that has not changed for so long stands, s.
const STANDS_S: f64 = 0.1;

/// Errors, mm.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
pub struct Score {
    /// The largest in the last second after a move.
    pub at_rest_mm: f64,
    /// The largest in a sine, its first period left out.
    pub in_sine_mm: f64,
    /// Its root mean square.
    pub in_sine_rms_mm: f64,
}

/// A score run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Time since the begin of the experiment, s.
    pub time_s: Vec<f64>,
    /// Measured less reference, mm; NaN where there is none.
    pub error_mm: Vec<f64>,
    reference_m: Vec<f64>,
}

/// Why a run cannot be scored; one line.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It cannot be read as text.
    #[error("{0}")]
    Text(std::io::Error),
    /// It is not one of a board.
    #[error("{0}: has no position or no reference_m of a board")]
    NotOfABoard(String),
}

impl Run {
    /// Reads a recording of `pneuma board run`.
    ///
    /// # Errors
    /// If it is none.
    pub fn read(path: &Path, rig: &Rig) -> Result<Self, ScoreError> {
        let recording = Recording::read(path, &rig.signals)?;
        let text = std::fs::read_to_string(path).map_err(ScoreError::Text)?;
        let not_of_a_board = || ScoreError::NotOfABoard(path.display().to_string());
        let position_m = recording.signal("x").ok_or_else(not_of_a_board)?;
        let references = references(&text, &recording.line).ok_or_else(not_of_a_board)?;
        let begin = references.iter().position(|one| one.is_finite());
        let begin_s = recording.time_s[begin.ok_or_else(not_of_a_board)?];
        let error = |(position, reference): (&f64, &f64)| 1e3 * (position - reference);
        Ok(Self {
            time_s: recording.time_s.iter().map(|time| time - begin_s).collect(),
            error_mm: position_m.iter().zip(&references).map(error).collect(),
            reference_m: references,
        })
    }

    /// Its score: rests are where the reference has stood for so long, sines where it moves. (At a
    /// peak two samples of a sine may be the same: that is no rest.)
    pub fn score(&self) -> Score {
        let (mut at_rest_mm, mut in_sine_mm) = (0.0_f64, 0.0_f64);
        let (mut squares, mut rows) = (0.0, 0_usize);
        let mut changed_s = f64::NEG_INFINITY;
        let mut moves_since_s = None;
        for row in 1..self.time_s.len() {
            let (time_s, error_mm) = (self.time_s[row], self.error_mm[row].abs());
            if !error_mm.is_finite() {
                continue;
            }
            if self.reference_m[row].to_bits() != self.reference_m[row - 1].to_bits() {
                changed_s = time_s;
                if time_s - *moves_since_s.get_or_insert(time_s) > 1.0 / SWING_HZ {
                    in_sine_mm = in_sine_mm.max(error_mm);
                    squares += error_mm * error_mm;
                    rows += 1;
                }
            } else if time_s - changed_s > STANDS_S {
                moves_since_s = None;
                if time_s - changed_s.max(0.0) > MOVE_S - REST_S {
                    at_rest_mm = at_rest_mm.max(error_mm);
                }
            }
        }
        Score {
            at_rest_mm,
            in_sine_mm,
            in_sine_rms_mm: (squares / rows.max(1) as f64).sqrt(),
        }
    }
}

/// The board's reference at these lines of its recording; an empty cell asks for nothing.
fn references(text: &str, lines: &[u32]) -> Option<Vec<f64>> {
    let rows: Vec<&str> = text.lines().collect();
    let header = rows.iter().find(|row| !row.starts_with('#'))?;
    let column = header.split(',').position(|name| name == REFERENCE)?;
    let of_line = |line: &u32| {
        let cell = rows.get(*line as usize - 1)?.split(',').nth(column)?;
        Some(cell.parse().unwrap_or(f64::NAN))
    };
    lines.iter().map(of_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rest with 0.02 mm behind it, and a sine that is 0.3 mm late in its second period.
    #[test]
    fn val_rests_and_sines_are_told_apart() {
        let (mut time_s, mut error_mm, mut reference_m) = (Vec::new(), Vec::new(), Vec::new());
        for tick in 0..9000 {
            let time = f64::from(tick) * 1e-3;
            time_s.push(time);
            if time <= 2.5 {
                reference_m.push(0.05);
                error_mm.push(if time < 1.0 { 40.0 } else { 0.02 });
            } else {
                reference_m.push(0.05 + 0.03 * (std::f64::consts::PI * (time - 2.5)).sin());
                error_mm.push(if time < 4.5 { 2.0 } else { -0.3 });
            }
        }
        let run = Run {
            time_s,
            error_mm,
            reference_m,
        };
        let score = run.score();
        assert!((score.at_rest_mm - 0.02).abs() < 1e-12, "{score:?}");
        assert!((score.in_sine_mm - 0.3).abs() < 1e-12, "{score:?}");
        assert!((score.in_sine_rms_mm - 0.3).abs() < 1e-12, "{score:?}");
    }
}
