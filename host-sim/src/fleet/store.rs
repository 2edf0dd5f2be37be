//! Results: one file a job, whole or not there, however many write it at once.

use super::plan::Plan;
use super::work::{NightResult, Reference, Verdict};
use crate::output::write_whole;
use crate::text::one_line;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the results.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// What a job leaves: its result, or why it has none.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome<T> {
    /// The result.
    Done(T),
    /// In one line; the same files give the same.
    Failed(String),
}

impl<T> Outcome<T> {
    /// The result, if there is one.
    pub fn done(self) -> Option<T> {
        match self {
            Self::Done(result) => Some(result),
            Self::Failed(_) => None,
        }
    }
}

impl Store {
    /// Of a plan, made where it does not exist. The error is one line.
    pub fn of(plan: &Plan) -> Result<Self, String> {
        let folder = plan.results.join("jobs");
        fs::create_dir_all(&folder)
            .map_err(|error| format!("{}: {error}", one_line(&folder.display().to_string())))?;
        Ok(Self { folder })
    }

    /// Where a job's result is, or will be.
    pub fn path(&self, job: &str) -> PathBuf {
        self.folder.join(format!("{job}.json"))
    }

    /// A job's result; none where it has not been done, or where half of a file was left by a disk
    /// that failed: such a job is done again.
    pub fn read<T: DeserializeOwned>(&self, job: &str) -> Option<Outcome<T>> {
        let text = fs::read_to_string(self.path(job)).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// Whether a job is done.
    pub fn is_done(&self, job: &str, kind: Kind) -> bool {
        match kind {
            Kind::Reference => self.read::<Reference>(job).is_some(),
            Kind::Night => self.read::<NightResult>(job).is_some(),
            Kind::Verdict => self.read::<Verdict>(job).is_some(),
        }
    }

    /// Writes a job's result. The error is one line.
    pub fn write<T: Serialize>(&self, job: &str, outcome: &Outcome<T>) -> Result<(), String> {
        let path = self.path(job);
        let refuse = |error: String| format!("{}: {error}", shown(&path));
        let text =
            serde_json::to_string_pretty(outcome).map_err(|error| refuse(error.to_string()))?;
        write_whole(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|error| refuse(error.to_string()))
    }
}

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// The fit of an axis as it was.
    Reference,
    /// The fit of one night.
    Night,
    /// A verdict on the latest nights of an axis that changed.
    Verdict,
}

fn shown(path: &Path) -> String {
    one_line(&path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let plan = Plan {
            format: String::new(),
            results: folder.path().to_owned(),
            false_alarms_per_axis_year: 0.05,
            axes: Vec::new(),
        };
        let store = Store::of(&plan).unwrap();
        (folder, store)
    }

    #[test]
    fn prop_half_a_result_is_none() {
        let (_folder, store) = store();
        store.write("one", &Outcome::Done(7)).unwrap();
        assert_eq!(store.read::<i32>("one").unwrap().done(), Some(7));
        let text = fs::read_to_string(store.path("one")).unwrap();
        for length in 0..text.len() {
            fs::write(store.path("one"), &text[..length]).unwrap();
            assert!(store.read::<i32>("one").is_none(), "{length} bytes");
        }
    }

    #[test]
    fn prop_many_writers_leave_one_whole_result() {
        let (_folder, store) = store();
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let store = &store;
                scope.spawn(move || {
                    for _ in 0..20 {
                        store
                            .write("one", &Outcome::Done(vec![writer; 1000]))
                            .unwrap();
                        let seen = store.read::<Vec<i32>>("one").unwrap().done().unwrap();
                        assert!(seen.iter().all(|one| *one == seen[0]) && seen.len() == 1000);
                    }
                });
            }
        });
    }
}
