//! What a tool said: the part of a verdict file that is judged.
//!
//! Read from the text of the file, so that any tool that writes `verdict/1` (or
//! these keys of it) is judged by the same rules. A number that is no number
//! stands as `null` there.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The verdict in a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Word {
    /// The model explains the recordings.
    #[default]
    NothingMissing,
    /// Effects are named.
    Named,
    /// Effects are named, and others would explain as much.
    Ambiguous,
    /// Something is missing that has no name.
    Unknown,
    /// The recordings are at fault.
    DataFault,
    /// The signals drive no law.
    NotObservable,
}

impl Word {
    /// As it stands in a verdict.
    pub fn name(self) -> &'static str {
        match self {
            Self::NothingMissing => "nothing-missing",
            Self::Named => "named",
            Self::Ambiguous => "ambiguous",
            Self::Unknown => "unknown",
            Self::DataFault => "data-fault",
            Self::NotObservable => "not-observable",
        }
    }
}

/// A place with its part of the misfit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Located {
    /// Place.
    pub place: String,
    /// Part of the misfit.
    pub share: Option<f64>,
}

/// A value with its standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Value, SI.
    pub value: Option<f64>,
    /// Standard deviation.
    #[serde(default)]
    pub std: Option<f64>,
}

/// A named effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// Name.
    pub effect: String,
    /// Where it acts.
    #[serde(default)]
    pub places: Vec<String>,
    /// Probability that it is there.
    pub probability: Option<f64>,
    /// Its sizes.
    #[serde(default)]
    pub parameters: BTreeMap<String, Size>,
    /// How much of it the tool says a refit would have hidden.
    #[serde(default)]
    pub masked: Option<f64>,
}

/// A candidate that was tried.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// Name.
    pub effect: String,
    /// Probability that it is there.
    pub probability: Option<f64>,
}

/// A missing term without a name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnknownTerm {
    /// Where.
    pub place: String,
    /// What it depends on.
    #[serde(default)]
    pub of: Vec<String>,
    /// As an equation.
    #[serde(default)]
    pub equation: Option<SaidEquation>,
}

/// A missing term as an equation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SaidEquation {
    /// Its numbers, each by variable and name.
    #[serde(default)]
    pub parameters: BTreeMap<String, Size>,
}

/// Errors per signal.
pub type Figures = BTreeMap<String, Option<f64>>;

/// Errors of one model on the held-out recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitFigures {
    /// Normalised, over the horizon.
    #[serde(default)]
    pub held_out: Figures,
    /// Root mean square of the free run, SI.
    #[serde(default)]
    pub free_run_held_out: Figures,
}

/// The models compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The rig as given.
    #[serde(default)]
    pub as_given: FitFigures,
    /// Ordinary parameters refitted.
    #[serde(default)]
    pub refitted: FitFigures,
    /// With the named effects.
    #[serde(default)]
    pub improved: FitFigures,
    /// What noise alone would leave.
    #[serde(default)]
    pub noise_floor: FitFigures,
}

/// What a tool said.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// In a word.
    pub verdict: Word,
    /// In a sentence.
    #[serde(default)]
    pub sentence: String,
    /// Where the misfit sits, the largest first.
    #[serde(default)]
    pub located: Vec<Located>,
    /// What is missing, the surest first.
    #[serde(default)]
    pub effects: Vec<Named>,
    /// Everything tried.
    #[serde(default)]
    pub ranking: Vec<Ranked>,
    /// Sets that cannot be told apart.
    #[serde(default)]
    pub alternatives: Vec<Vec<String>>,
    /// Candidates that the signals cannot show.
    #[serde(default)]
    pub not_observable: Vec<String>,
    /// What has no name.
    #[serde(default)]
    pub unknown_term: Option<UnknownTerm>,
    /// The proof.
    #[serde(default)]
    pub fit: Fit,
    /// Time that the tool says it took, s.
    #[serde(default)]
    pub seconds: Option<f64>,
}

impl Said {
    /// Reads a verdict.
    ///
    /// # Errors
    /// If it has no verdict, or a key has another type than a verdict's.
    pub fn of(verdict: &impl Serialize) -> serde_json::Result<Self> {
        serde_json::from_value(serde_json::to_value(verdict)?)
    }

    /// Whether it says that something is missing.
    pub fn claims(&self) -> bool {
        matches!(
            self.verdict,
            Word::Named | Word::Ambiguous | Word::Unknown | Word::DataFault
        )
    }

    /// The effects that it names; a verdict that names none has none, whatever
    /// else stands in it.
    pub fn named(&self) -> &[Named] {
        match self.verdict {
            Word::Named | Word::Ambiguous => &self.effects,
            _ => &[],
        }
    }

    /// Where it says that something is missing: at the first effect it names,
    /// else where the nameless term is, else where most of the misfit is.
    pub fn places(&self) -> Vec<&str> {
        if let Some(first) = self
            .named()
            .first()
            .filter(|first| !first.places.is_empty())
        {
            return first.places.iter().map(String::as_str).collect();
        }
        if !self.claims() {
            return Vec::new();
        }
        let term = self.unknown_term.as_ref().map(|term| term.place.as_str());
        let most = self.located.first().map(|located| located.place.as_str());
        term.or(most).into_iter().collect()
    }

    /// The largest probability that it gives each effect that it tried or named.
    pub fn probabilities(&self) -> BTreeMap<&str, f64> {
        let tried = self
            .ranking
            .iter()
            .map(|one| (&one.effect, one.probability));
        let named = self
            .named()
            .iter()
            .map(|one| (&one.effect, one.probability));
        let mut largest: BTreeMap<&str, f64> = BTreeMap::new();
        for (effect, probability) in tried.chain(named) {
            if let Some(probability) = probability {
                let known = largest.entry(effect).or_insert(probability);
                *known = known.max(probability);
            }
        }
        largest
    }
}
