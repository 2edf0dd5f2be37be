//! The seal on a truth: its hash is made known before the tool runs, the truth
//! itself is opened afterwards and must fit.

use super::digest;
use crate::hash;
use serde::{Deserialize, Serialize};
use truth_plant::Truth;

/// What is published of a truth beforehand: enough to prove later that it was
/// not changed, and (as the salt cannot be guessed from it) no more.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seal {
    /// SHA-256 of salt and truth, hexadecimal.
    pub sha256: String,
}

/// What is published when the truth is opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    /// What the truth was hashed with.
    pub salt: String,
    /// The truth.
    pub truth: Truth,
}

/// A truth does not fit its seal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the truth does not fit its seal: sealed as {sealed}, opened as {opened}")]
pub struct BrokenSeal {
    /// The hash that was published.
    pub sealed: String,
    /// The hash of what was opened.
    pub opened: String,
}

impl Opened {
    /// A truth with the salt of its place in a trial.
    pub fn new(truth: Truth, trial_seed: u64, number: usize) -> Self {
        Self {
            salt: digest::salt(trial_seed, number),
            truth,
        }
    }

    /// Its seal.
    pub fn seal(&self) -> Seal {
        Seal {
            sha256: hash::of_texts(&[&self.salt, &canonical(&self.truth)]),
        }
    }

    /// Checks that this is what was sealed.
    ///
    /// # Errors
    /// If it is not.
    pub fn check(&self, seal: &Seal) -> Result<(), BrokenSeal> {
        let opened = self.seal();
        if opened == *seal {
            return Ok(());
        }
        Err(BrokenSeal {
            sealed: seal.sha256.clone(),
            opened: opened.sha256,
        })
    }
}

/// One line of JSON, keys in alphabetical order, numbers as short as they read
/// back the same.
fn canonical(truth: &Truth) -> String {
    // A map of this library is ordered by key. What cannot be written (there is
    // no such truth) seals as nothing and is caught when it is opened.
    serde_json::to_value(truth).map_or_else(|_| String::new(), |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use truth_plant::{Kind, draw};

    #[test]
    fn prop_a_seal_holds_for_its_truth_alone() {
        let case = draw(11, Kind::Single);
        let opened = Opened::new(case.truth, 1, 0);
        let seal = opened.seal();
        assert_eq!(seal.sha256.len(), 64);
        assert_eq!(opened.check(&seal), Ok(()));
        let mut another = opened.clone();
        another.truth.noise = 2.0;
        assert!(another.check(&seal).is_err());
        let mut salted = opened.clone();
        salted.salt.push('0');
        assert!(salted.check(&seal).is_err());
    }

    #[test]
    fn prop_a_truth_that_went_through_a_file_fits_its_seal() {
        let case = draw(12, Kind::Pair);
        let opened = Opened::new(case.truth, 1, 1);
        let text = serde_json::to_string_pretty(&opened).unwrap();
        let read: Opened = serde_json::from_str(&text).unwrap();
        assert_eq!(read.check(&opened.seal()), Ok(()));
    }
}
