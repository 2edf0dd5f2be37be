//! The jobs of a fleet, each named by what it works on: the same files give the same names, and work
//! that is done under a name is never done again.

use super::manifest::{self, Manifest};
use crate::hash;
use crate::text::one_line;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The form of the jobs' results: with another one all is done anew.
const FORM: &str = "pneuma fleet 1";
/// Digits of a job's name: 96 bits.
const NAME_DIGITS: usize = 24;

/// All work on a fleet.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Plan {
    /// `fleet-plan/1`.
    pub format: String,
    /// Where results go.
    pub results: PathBuf,
    /// Changes said of an axis that has none, a year.
    pub false_alarms_per_axis_year: f64,
    /// The axes.
    pub axes: Vec<AxisPlan>,
}

/// The work on an axis.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct AxisPlan {
    /// Its name.
    pub name: String,
    /// Its group; empty where it has none.
    pub group: String,
    /// Its rig file.
    pub rig: Input,
    /// The job of the fit to its reference.
    pub reference_job: String,
    /// How many of the nights are its reference.
    pub reference: usize,
    /// All nights, in their order.
    pub nights: Vec<Night>,
}

/// A night's work.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Night {
    /// The job.
    pub job: String,
    /// The recording.
    pub recording: Input,
    /// Days since the axis' first night; its number where the files' names hold no dates.
    pub day: f64,
    /// The date in the file's name.
    pub date: Option<String>,
}

/// A file as it was when the plan was made.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Input {
    /// Where it is.
    pub path: PathBuf,
    /// Its SHA-256.
    pub sha256: String,
}

impl Input {
    fn of(path: PathBuf) -> Result<Self, String> {
        let sha256 = sha256_of(&path)?;
        Ok(Self { path, sha256 })
    }

    /// Refuses a file that is another one by now: one that was still being written, say.
    ///
    /// # Errors
    /// In one line.
    pub fn check(&self) -> Result<(), String> {
        if sha256_of(&self.path)? == self.sha256 {
            return Ok(());
        }
        let shown = one_line(&self.path.display().to_string());
        Err(format!(
            "{shown}: has changed since the plan was made, expected the same file: run `pneuma fleet plan` again"
        ))
    }
}

/// SHA-256 of a file; the error is one line.
fn sha256_of(path: &Path) -> Result<String, String> {
    let shown = || one_line(&path.display().to_string());
    let (_, sha256) = hash::of_file(path).map_err(|error| format!("{}: {error}", shown()))?;
    Ok(sha256)
}

/// The name of a job of a kind that works on these.
pub fn job_name(kind: &str, works_on: &[&str]) -> String {
    hash::of_texts(&[&[FORM, kind], works_on].concat())[..NAME_DIGITS].to_owned()
}

impl Plan {
    /// The work that a manifest asks for, by the files as they are now. The error is one line.
    pub fn of(manifest: &Manifest) -> Result<Self, String> {
        let axes = manifest.axes.iter().map(plan_axis);
        Ok(Self {
            format: "fleet-plan/1".into(),
            results: manifest.fleet.results.clone(),
            false_alarms_per_axis_year: manifest.fleet.false_alarms_per_axis_year,
            axes: axes.collect::<Result<_, String>>()?,
        })
    }
}

fn plan_axis(axis: &manifest::Axis) -> Result<AxisPlan, String> {
    let refuse = |problem: String| format!("axis \"{}\": {problem}", one_line(&axis.name));
    let rig = Input::of(axis.rig.clone()).map_err(refuse)?;
    let found = glob::glob(&axis.recordings).map_err(|error| refuse(error.to_string()))?;
    let mut files: Vec<PathBuf> = found
        .filter_map(Result::ok)
        .filter(|path| path.is_file())
        .collect();
    if files.len() <= axis.reference {
        let shown = one_line(&axis.recordings);
        return Err(refuse(format!(
            "{shown}: {} recordings, expected more than the {} of its reference",
            files.len(),
            axis.reference
        )));
    }
    let dated: Option<Vec<Date>> = files.iter().map(|path| Date::in_name(path)).collect();
    if dated.is_some() {
        files.sort_by_key(|path| (Date::in_name(path), path.clone()));
    } else {
        files.sort();
    }
    let inputs = files.into_iter().map(Input::of);
    let inputs: Vec<Input> = inputs.collect::<Result<_, String>>().map_err(refuse)?;
    let mut works_on = vec![rig.sha256.as_str()];
    works_on.extend(
        inputs[..axis.reference]
            .iter()
            .map(|one| one.sha256.as_str()),
    );
    let reference_job = job_name("reference", &works_on);
    let first_day = Date::in_name(&inputs[0].path).filter(|_| dated.is_some());
    let night = |(number, recording): (usize, Input)| {
        let date = Date::in_name(&recording.path).filter(|_| dated.is_some());
        let day = date
            .zip(first_day)
            .map(|(date, first)| date.days_since(first));
        Night {
            job: job_name("night", &[&reference_job, &recording.sha256]),
            day: day.unwrap_or(number as f64),
            date: date.map(|date| date.0.to_string()),
            recording,
        }
    };
    Ok(AxisPlan {
        name: axis.name.clone(),
        group: axis.group.clone(),
        nights: inputs.into_iter().enumerate().map(night).collect(),
        reference: axis.reference,
        rig,
        reference_job,
    })
}

/// A date in a file's name: `2026-11-30` or `20261130`, wherever it stands.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
struct Date(jiff::civil::Date);

impl Date {
    fn in_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().into_owned();
        let starts = name.char_indices().map(|(start, _)| start);
        starts.filter_map(|start| Self::at(&name, start)).next()
    }

    fn at(name: &str, start: usize) -> Option<Self> {
        let follows_digit = name[..start].ends_with(|one: char| one.is_ascii_digit());
        let parse = |length: usize, form: &str| {
            let text = name.get(start..start + length)?;
            let next = name[start + length..].chars().next();
            let ends = !next.is_some_and(|one| one.is_ascii_digit());
            let date = jiff::civil::Date::strptime(form, text).ok();
            date.filter(|_| ends && !follows_digit).map(Self)
        };
        parse(10, "%Y-%m-%d").or_else(|| parse(8, "%Y%m%d"))
    }

    fn days_since(self, first: Self) -> f64 {
        let days = first.0.until(self.0).map(|span| span.get_days());
        days.map_or(0.0, f64::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_date_is_found_wherever_it_stands_in_a_name() {
        let date = |name: &str| Date::in_name(Path::new(name)).map(|date| date.0.to_string());
        assert_eq!(date("x/run_2026-11-30_night.csv").unwrap(), "2026-11-30");
        assert_eq!(date("20261130T2200.csv").unwrap(), "2026-11-30");
        assert_eq!(date("run-120261130.csv"), None);
        assert_eq!(date("run-7.csv"), None);
        let day = |text: &str| Date::in_name(Path::new(text)).unwrap();
        assert!((day("2027-03-01.csv").days_since(day("2026-11-30.csv")) - 91.0).abs() < 1e-12);
    }

    #[test]
    fn prop_a_job_is_named_by_what_it_works_on() {
        assert_eq!(
            job_name("night", &["a", "b"]),
            job_name("night", &["a", "b"])
        );
        assert_ne!(job_name("night", &["a", "b"]), job_name("night", &["ab"]));
        assert_ne!(job_name("night", &["a"]), job_name("verdict", &["a"]));
    }
}
