//! A model fitted: the law with a set of effects, its parameters and what it leaves unexplained.

use crate::fit::Presence;
use std::collections::BTreeMap;

/// A set of candidates, by index, ascending.
pub type Set = Vec<usize>;

/// A set with one more.
pub(crate) fn with(set: &Set, candidate: usize) -> Set {
    let mut larger = set.clone();
    larger.push(candidate);
    larger.sort_unstable();
    larger
}

/// A set without one.
pub(crate) fn without(set: &Set, candidate: usize) -> Set {
    let others = set.iter().copied();
    others.filter(|&one| one != candidate).collect()
}

/// The law with a set of effects, fitted.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The effects in it.
    pub set: Set,
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Their values.
    pub values: Vec<f64>,
    /// Their standard deviations, with the correlation of the residuals counted in.
    pub standard_deviations: Vec<Option<f64>>,
    /// Which stand on a bound.
    pub at_bound: Vec<bool>,
    /// Number of shared parameters (they come first).
    pub shared: usize,
    /// Mean squared residual per output, SI squared; of a balance in the bench's noise (see
    /// `Bench::learn_noise`).
    pub mean_square: Vec<f64>,
    /// When its effect is there, if for a part of the time only.
    pub presence: Option<Presence>,
}

impl Fitted {
    /// A parameter's value by name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.get(self.place(name)?).copied()
    }

    /// Where a parameter of this name stands among the others.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|other| other == name)
    }

    /// What it misses above the noise: energy in units of the noise's, summed over the
    /// outputs.
    pub fn energy_above(&self, noise: &[f64]) -> f64 {
        let outputs = self.mean_square.iter().zip(noise);
        outputs
            .map(|(square, noise)| (square / noise.powi(2) - 1.0).max(0.0))
            .sum()
    }

    /// The shared parameters by key: what is frozen.
    pub fn shared_values(&self) -> BTreeMap<String, f64> {
        let shared = self.names.iter().zip(&self.values).take(self.shared);
        shared.map(|(name, value)| (name.clone(), *value)).collect()
    }
}
