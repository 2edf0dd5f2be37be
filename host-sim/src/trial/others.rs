//! Other tools on the same cases: their verdicts, written beside the case's
//! files, judged by the same rules, truths and materiality.

use super::judge::judge;
use super::run::{CaseResult, TrialError, file_error};
use super::said::Said;
use super::score::Score;
use std::fs;
use std::path::Path;

/// The score of a tool that has written `NAME.json` into the case folders. A
/// case without that file is one in which it failed.
///
/// # Errors
/// If it has written none, or one that is no verdict.
pub fn other(cases: &[CaseResult], root: &Path, name: &str) -> Result<Score, TrialError> {
    let file = format!("{name}.json");
    let mut judged = Vec::with_capacity(cases.len());
    for case in cases {
        let path = root.join(case.planned.folder()).join(&file);
        judged.push(rejudged(case, read(&path)?));
    }
    if judged.iter().all(|case| case.said.is_none()) {
        let problem = format!("no case folder holds a {file}, expected one from each case");
        return Err(file_error(root, problem));
    }
    Ok(Score::of(&judged))
}

fn read(path: &Path) -> Result<Option<Said>, TrialError> {
    if !path.exists() {
        return Ok(None);
    }
    let text = fs::read_to_string(path).map_err(|error| file_error(path, error))?;
    let said = serde_json::from_str(&text);
    said.map(Some).map_err(|error| file_error(path, error))
}

fn rejudged(case: &CaseResult, said: Option<Said>) -> CaseResult {
    CaseResult {
        judgement: judge(&case.opened.truth, &case.materiality, said.as_ref()),
        seconds: said
            .as_ref()
            .and_then(|said| said.seconds)
            .unwrap_or(f64::NAN),
        failure: said.is_none().then(|| "no verdict was written".into()),
        said,
        ..case.clone()
    }
}
