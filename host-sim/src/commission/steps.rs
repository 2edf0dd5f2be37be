//! The steps in their order, and what is done of them.

use super::score::Score;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io;
use std::path::Path;

/// A step.
#[derive(Clone, Copy, Debug, Deserialize, Eq, Ord, PartialEq, PartialOrd, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// What the board says of itself.
    Board,
    /// The rig file's numbers to the board.
    Settings,
    /// Which way round the axis answers.
    Wiring,
    /// Pulses of the valve about the middle of the stroke, recorded: no loop is needed for them.
    Exploration,
    /// What those say of the rig file's numbers.
    FirstModel,
    /// The score with the rig file as it is.
    ScoreBefore,
    /// Varied motion, recorded three times.
    Recordings,
    /// What the rig file leaves out.
    Diagnosis,
    /// The improved rig's numbers to the board.
    ImprovedSettings,
    /// The score with it.
    ScoreAfter,
    /// The acceptance sheet.
    Sheet,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Board,
        Self::Settings,
        Self::Wiring,
        Self::Exploration,
        Self::FirstModel,
        Self::ScoreBefore,
        Self::Recordings,
        Self::Diagnosis,
        Self::ImprovedSettings,
        Self::ScoreAfter,
        Self::Sheet,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Settings => "settings",
            Self::Wiring => "wiring",
            Self::Exploration => "exploration",
            Self::FirstModel => "first-model",
            Self::ScoreBefore => "score-before",
            Self::Recordings => "recordings",
            Self::Diagnosis => "diagnosis",
            Self::ImprovedSettings => "improved-settings",
            Self::ScoreAfter => "score-after",
            Self::Sheet => "sheet",
        }
    }

    /// What it does, for a person.
    pub fn text(self) -> &'static str {
        match self {
            Self::Board => "What the board says of itself.",
            Self::Settings => {
                "The rig file's numbers go to the board, with a slower loop until the axis is known; nothing moves."
            }
            Self::Wiring => {
                "Pulses of the valve that the load hardly feels, then a swing of 1 mm about where it is, \
                 within 2 mm that the board keeps: what is the wrong way round is named."
            }
            Self::Exploration => {
                "Pulses of the valve about the middle of the stroke, recorded: what the axis does of itself. \
                 The load goes there first; it stays off both ends."
            }
            Self::FirstModel => {
                "What the pulses say of the rig file's numbers, for the loop of what follows; nothing moves."
            }
            Self::ScoreBefore => {
                "Moves and a sine, as the rig file has the axis: how far the load is from its reference."
            }
            Self::Recordings => {
                "Varied motion, recorded three times: two runs to learn from, one to judge by."
            }
            Self::Diagnosis => "What the rig file leaves out; nothing moves.",
            Self::ImprovedSettings => {
                "The improved rig's numbers go to the board and are stored; nothing moves."
            }
            Self::ScoreAfter => "The same moves and sine with them.",
            Self::Sheet => "The acceptance sheet.",
        }
    }
}

/// What is done.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Progress {
    /// The steps.
    pub done: Vec<Step>,
    /// Which program the board runs.
    pub firmware: Option<String>,
    /// The verdict's sentence.
    pub verdict: Option<String>,
    /// The score with the rig file as it was ...
    pub before: Option<Score>,
    /// ... and with the improved one.
    pub after: Option<Score>,
}

impl Progress {
    /// Reads it; nothing is done where there is no such file.
    ///
    /// # Errors
    /// If there is one that cannot be read.
    pub fn read(path: &Path) -> io::Result<Self> {
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = fs::read_to_string(path)?;
        serde_json::from_str(&text).map_err(io::Error::other)
    }

    /// The first step that is not done.
    pub fn next(&self) -> Option<Step> {
        Step::ALL.into_iter().find(|step| !self.done.contains(step))
    }

    /// As if this step and all behind it were not done.
    pub fn again_from(&mut self, step: Step) {
        self.done.retain(|done| *done < step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_way_is_gone_on_with_where_it_was_left() {
        let mut progress = Progress::default();
        assert_eq!(progress.next(), Some(Step::Board));
        progress.done = Step::ALL[..7].to_vec();
        assert_eq!(progress.next(), Some(Step::Diagnosis));
        progress.again_from(Step::ScoreBefore);
        assert_eq!(progress.next(), Some(Step::ScoreBefore));
        let text = serde_json::to_string(&progress).expect("JSON");
        assert_eq!(
            serde_json::from_str::<Progress>(&text).expect("it comes back"),
            progress
        );
        for (place, step) in Step::ALL.into_iter().enumerate() {
            assert_eq!(step as usize, place);
            let word = serde_json::to_string(&step).expect("JSON");
            assert_eq!(word, format!("\"{}\"", step.name()));
        }
    }
}
