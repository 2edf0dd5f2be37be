//! One case from plan to judgement.
//!
//! The order is what matters: the case is drawn and (if it is to be masked) its
//! rig fitted; its files are written, without the truth; the tool reads those
//! files and nothing else; then the truth is opened, checked against its seal,
//! weighed by ablation, and the verdict is judged.

use super::judge::{Judgement, judge};
use super::masking::{Masking, masking};
use super::materiality::{Materiality, weigh};
use super::on_chip::{OnChip, tried};
use super::plan::{Concealment, Planned, Setting};
use super::refit::{Refit, Seen, refit};
use super::said::Said;
use super::seal::{BrokenSeal, Opened, Seal};
use crate::recording::Recording;
use crate::rehearsal::Rehearsals;
use crate::rig::Rig;
use crate::text::file_name;
use diagnosis::diagnose::diagnose;
use serde::{Deserialize, Serialize};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;
use truth_plant::{Case, Request};

/// Why a trial cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file cannot be written or read.
    #[error("{path}: {problem}")]
    File {
        /// The file.
        path: String,
        /// What is wrong.
        problem: String,
    },
    /// A truth is not what was sealed.
    #[error("{case}: {broken}")]
    Broken {
        /// The case.
        case: String,
        /// The hashes.
        broken: BrokenSeal,
    },
    /// The generator does not know what the plan asks for.
    #[error("{0}: the generator has no such effect")]
    Plan(String),
}

pub(super) fn file_error(path: &Path, problem: impl ToString) -> TrialError {
    TrialError::File {
        path: file_name(&path.display().to_string()),
        problem: problem.to_string(),
    }
}

/// What came of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseResult {
    /// What was planned.
    pub planned: Planned,
    /// What was published of the truth beforehand.
    pub seal: Seal,
    /// The truth.
    pub opened: Opened,
    /// Which of its effects count.
    pub materiality: Vec<Materiality>,
    /// What the fit beforehand hid, where there was one.
    pub masking: Option<Masking>,
    /// What the tool said; none if it failed.
    pub said: Option<Said>,
    /// How it failed, if it did.
    pub failure: Option<String>,
    /// The judgement; a tool that failed is right in nothing.
    pub judgement: Judgement,
    /// The true plant under the firmware's control, where an effect was named
    /// rightly.
    pub on_chip: Option<OnChip>,
    /// Wall time of the tool, s.
    pub seconds: f64,
}

fn request(planned: &Planned) -> Result<Request, TrialError> {
    let request = planned.request();
    request.ok_or_else(|| TrialError::Plan(planned.to_string()))
}

/// The seal of a planned case.
///
/// # Errors
/// If the generator does not know its effect.
pub fn seal(setting: Setting, planned: &Planned) -> Result<Seal, TrialError> {
    let truth = request(planned)?.truth();
    Ok(Opened::new(truth, setting.seed, planned.number).seal())
}

/// Runs a case in a folder, which then holds its files and the verdict.
///
/// # Errors
/// If a file cannot be written, or the truth does not fit its seal. That the
/// tool fails is no error but a result.
pub fn run(
    setting: Setting,
    planned: &Planned,
    seal: &Seal,
    folder: &Path,
    progress: &dyn Fn(&str),
) -> Result<CaseResult, TrialError> {
    let case = request(planned)?.draw();
    progress("writing the case");
    let mask = mask(planned, &case);
    let fitted = mask.as_ref().map(|mask| mask.refit.rig.to_toml());
    write_case(&case, fitted.as_ref().unwrap_or(&case.rig_toml), folder)?;
    let begin = Instant::now();
    let answer = catch_unwind(AssertUnwindSafe(|| diagnosed(&case, folder, progress)))
        .unwrap_or_else(|_| Err("the tool panicked".into()));
    let seconds = begin.elapsed().as_secs_f64();
    let opened = Opened::new(case.truth.clone(), setting.seed, planned.number);
    opened.check(seal).map_err(|broken| TrialError::Broken {
        case: planned.to_string(),
        broken,
    })?;
    let truth = serde_json::to_string_pretty(&opened).map_err(|e| file_error(folder, e))?;
    write(&folder.join("truth.json"), &(truth + "\n"))?;
    progress("weighing the truth");
    let weighed = weigh(&case);
    let masking = mask
        .zip(weighed.clean)
        .and_then(|(mask, clean)| mask.masking(&clean));
    let (said, failure) = match &answer {
        Ok(answer) => (Some(answer.said.clone()), None),
        Err(failure) => (None, Some(failure.clone())),
    };
    let judgement = judge(&opened.truth, &weighed.materiality, said.as_ref());
    let named = answer.ok().filter(|_| judgement.named_first);
    progress("controlling the true plant");
    Ok(CaseResult {
        planned: planned.clone(),
        seal: seal.clone(),
        opened,
        materiality: weighed.materiality,
        masking,
        on_chip: named.map(|answer| answer.on_chip(&case)),
        said,
        failure,
        judgement,
        seconds,
    })
}

/// The affected recordings with the rig as drawn, and the rig fitted to them.
struct Mask {
    affected: Seen,
    refit: Refit,
}

impl Mask {
    fn masking(&self, clean: &Refit) -> Option<Masking> {
        masking(&self.affected, &self.refit, clean).ok()
    }
}

/// The fit that hides the effect, if it is so planned and gives a rig.
fn mask(planned: &Planned, case: &Case) -> Option<Mask> {
    if planned.concealment != Concealment::Masked {
        return None;
    }
    let affected = Seen::of(case).ok()?;
    let refit = refit(&affected).ok()?;
    Rig::parse(&refit.rig.to_toml(), "rig.toml").ok()?;
    Some(Mask { affected, refit })
}

fn write_case(case: &Case, rig_toml: &str, folder: &Path) -> Result<(), TrialError> {
    fs::create_dir_all(folder).map_err(|error| file_error(folder, error))?;
    write(&folder.join("rig.toml"), rig_toml)?;
    for (name, text) in case.train.iter().chain(&case.held_out) {
        write(&folder.join(name), text)?;
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), TrialError> {
    fs::write(path, text).map_err(|error| file_error(path, error))
}

/// What the tool gave.
struct Answer {
    said: Said,
    given: Rig,
    refitted: Rig,
    improved: Rig,
}

impl Answer {
    fn on_chip(&self, case: &Case) -> OnChip {
        let try_rig = |rig: &Rig| tried(case.plant(), rig);
        OnChip {
            given: try_rig(&self.given),
            refitted: try_rig(&self.refitted),
            improved: try_rig(&self.improved),
        }
    }
}

/// The tool as the command line runs it: files in, verdict out.
fn diagnosed(case: &Case, folder: &Path, progress: &dyn Fn(&str)) -> Result<Answer, String> {
    let rig = Rig::read(folder.join("rig.toml")).map_err(|error| error.to_string())?;
    let read = |files: &[(String, String)]| -> Result<Vec<Recording>, String> {
        let one = |(name, _): &(String, String)| {
            let path: PathBuf = folder.join(name);
            let mut recording =
                Recording::read(path, &rig.signals).map_err(|error| error.to_string())?;
            recording.name.clone_from(name);
            Ok(recording)
        };
        files.iter().map(one).collect()
    };
    let train = read(&case.train)?;
    let diagnosis = diagnose(
        &rig,
        train,
        || read(&case.held_out),
        &Rehearsals::all(),
        progress,
    )?;
    let put = |name: &str, text: String| {
        fs::write(folder.join(name), text).map_err(|error| error.to_string())
    };
    put("improved.toml", diagnosis.improved_rig.to_toml())?;
    let verdict = serde_json::to_string_pretty(&diagnosis.verdict).map_err(|e| e.to_string())?;
    put("verdict.json", verdict + "\n")?;
    let refitted = diagnosis
        .verdict
        .parameters
        .iter()
        .filter_map(|(key, one)| Some((key.clone(), one.refitted?)))
        .filter(|(key, _)| rig.value(key).is_some())
        .collect();
    Ok(Answer {
        said: Said::of(&diagnosis.verdict).map_err(|error| error.to_string())?,
        refitted: rig.with_values(&refitted),
        improved: diagnosis.improved_rig,
        given: rig,
    })
}
