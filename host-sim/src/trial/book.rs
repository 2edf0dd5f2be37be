//! The scorecard's file. It is written anew (beside, then renamed) after every
//! case, so that a run that is cut off leaves a valid one to go on with.

use super::plan::{Planned, Setting, plan};
use super::run::{CaseResult, TrialError, file_error};
use super::score::Score;
use super::seal::Seal;
use crate::output::write_whole;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The only format there is.
pub const FORMAT: &str = "scorecard/1";

/// All that a trial came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scorecard {
    /// "scorecard/1".
    pub format: String,
    /// What the trial is made of.
    pub setting: Setting,
    /// The seals, by case, made before the first case was run.
    pub seals: Vec<Seal>,
    /// The sums.
    pub score: Score,
    /// The sums of other tools on the same cases, by their names.
    #[serde(default)]
    pub others: BTreeMap<String, Score>,
    /// The cases, in the order of the plan.
    pub cases: Vec<CaseResult>,
}

impl Scorecard {
    /// Without a case yet.
    pub fn new(setting: Setting, seals: Vec<Seal>) -> Self {
        Self {
            format: FORMAT.into(),
            setting,
            seals,
            score: Score::default(),
            others: BTreeMap::new(),
            cases: Vec::new(),
        }
    }

    /// Reads a scorecard to go on with.
    ///
    /// # Errors
    /// If it cannot be read, or is of another trial.
    pub fn read(path: &Path, setting: Setting) -> Result<Self, TrialError> {
        let text = fs::read_to_string(path).map_err(|error| file_error(path, error))?;
        let card: Self = serde_json::from_str(&text).map_err(|error| {
            file_error(
                path,
                format!("{error}; expected a scorecard to go on with, or no file"),
            )
        })?;
        card.check(setting)
            .map_err(|problem| file_error(path, problem))?;
        Ok(card)
    }

    fn check(&self, setting: Setting) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!("format is {:?}, expected {FORMAT:?}", self.format));
        }
        if self.setting != setting {
            return Err(format!(
                "is of the trial with seed {}, expected the same seed and kind, or another file",
                self.setting.seed
            ));
        }
        let planned = plan(setting, self.cases.len());
        let same = |(case, planned): (&CaseResult, &Planned)| case.planned == *planned;
        if self.cases.iter().zip(&planned).all(same) {
            return Ok(());
        }
        Err(
            "its cases are not those of the plan: the plan has changed, expected another file"
                .into(),
        )
    }

    /// Adds a case and sums up anew.
    pub fn add(&mut self, case: CaseResult) {
        self.cases.push(case);
        self.score = Score::of(&self.cases);
        // They have not seen this case.
        self.others.clear();
    }

    /// Writes it so that no reader ever sees half of it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TrialError> {
        let text = serde_json::to_string_pretty(self).map_err(|error| file_error(path, error))?;
        write_whole(path, |out| writeln!(out, "{text}")).map_err(|error| file_error(path, error))
    }
}
