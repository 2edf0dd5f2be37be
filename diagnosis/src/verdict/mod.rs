//! The verdict file, as `contracts/verdict.md` lays it down.

pub(crate) mod assemble;
mod effects;
mod figures;
pub(crate) mod notes;
mod place;
pub(crate) mod remarks;
mod sentence;
mod shown;
mod unlisted;

use crate::inspect::Doubt;
use crate::laws::needs::Assumed;
use crate::unlisted::equation::{Equation, Term};
use serde::Serialize;
use std::collections::BTreeMap;

/// What the tool says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The model explains the recordings to the noise.
    NothingMissing,
    /// Effects are named.
    Named,
    /// Effects are named, and others would explain as much.
    Ambiguous,
    /// Something is missing that no effect of the list explains.
    Unknown,
    /// The recordings themselves are at fault.
    DataFault,
    /// These signals drive no law of this rig, or would show no effect in any size.
    NotObservable,
}

/// A value with its standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation; null where the data leave it open.
    pub std: Option<f64>,
}

/// Where the misfit of the refitted baseline sits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// Place.
    pub place: String,
    /// Part of the whole misfit above the noise.
    pub share: f64,
    /// Signals that show it.
    pub signals: Vec<String>,
    /// Recording, from, to.
    pub intervals_s: Vec<(String, f64, f64)>,
    /// In words.
    pub when: String,
}

/// A named effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// Name.
    pub effect: String,
    /// Form, where there are several.
    pub form: Option<String>,
    /// Where it acts.
    pub places: Vec<String>,
    /// Probability that it is there.
    pub probability: f64,
    /// Its parameters.
    pub parameters: BTreeMap<String, Estimate>,
    /// How much of it a refit of the ordinary parameters would have hidden.
    pub masked: f64,
    /// How probable it is that chance lets the best of all effects explain as much, by
    /// repetitions in which nothing is missing; null where that was not asked.
    pub by_chance: Option<f64>,
    /// Part of what the refitted baseline missed that it accounts for.
    pub share: f64,
}

/// A candidate that was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// Name.
    pub effect: String,
    /// Form, where there are several.
    pub form: Option<String>,
    /// Where it would act.
    pub places: Vec<String>,
    /// Probability that it is there.
    pub probability: f64,
    /// Gain in log-likelihood on data left out of the fit.
    pub gain: f64,
    /// Why it was declined; null if it was not.
    pub declined: Option<String>,
}

/// From which size on the recordings would have shown an effect that they do not show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WouldShow {
    /// Name.
    pub effect: String,
    /// Form, where there are several.
    pub form: Option<String>,
    /// Where it would act.
    pub places: Vec<String>,
    /// Its sizes at the limit, SI, by parameter; null where no size would have shown.
    pub from: Option<BTreeMap<String, f64>>,
    /// From which sizes on it matters, by parameter, where that is known.
    pub matters_from: BTreeMap<String, f64>,
    /// Whether it could be there in a size that matters.
    pub hides: bool,
}

/// Errors per signal.
pub type Figures = BTreeMap<String, f64>;

/// Errors of one model on the two halves of the data.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FitFigures {
    /// Normalised over the horizon, training recordings.
    pub train: Figures,
    /// Normalised over the horizon, held-out recordings.
    pub held_out: Figures,
    /// Root mean square of the free run, SI, training recordings.
    pub free_run_train: Figures,
    /// Root mean square of the free run, SI, held-out recordings.
    pub free_run_held_out: Figures,
}

/// The models compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Fit {
    /// The rig as given.
    pub as_given: FitFigures,
    /// Ordinary parameters refitted: the honest baseline.
    pub refitted: FitFigures,
    /// With the named effects.
    pub improved: FitFigures,
    /// What noise alone would leave.
    pub noise_floor: FitFigures,
}

/// Held-out error over the noise floor from which a reader is told.
const UNEXPLAINED: f64 = 2.0;

impl Fit {
    /// How many times the noise floor the free run of the improved model leaves of a signal in
    /// held-out recordings, where that is so much that a reader is told.
    pub(crate) fn times_the_floor(&self, signal: &str) -> Option<f64> {
        let of = |figures: &FitFigures| figures.free_run_held_out.get(signal).copied();
        let times = of(&self.improved)? / of(&self.noise_floor)?;
        (times > UNEXPLAINED).then_some(times)
    }
}

/// One parameter through the three models.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// In the rig file.
    pub given: Option<f64>,
    /// Refitted without effects.
    pub refitted: Option<f64>,
    /// Refitted with the named effects.
    pub improved: Option<f64>,
    /// Standard deviation of the last.
    pub std: Option<f64>,
    /// Whether the last ended at the bound of what the number may be: the model may lack
    /// something else.
    pub at_bound: bool,
}

/// A missing term that no effect of the list explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnknownTerm {
    /// Where.
    pub place: String,
    /// What it depends on.
    pub of: Vec<String>,
    /// In words.
    pub expression: String,
    /// Unit.
    pub unit: String,
    /// Variable, value, standard deviation.
    pub table: Vec<(f64, f64, f64)>,
    /// The same as an equation; null where none was found.
    pub equation: Option<SaidEquation>,
}

/// A missing term as an equation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SaidEquation {
    /// The equation with its numbers.
    pub text: String,
    /// Its numbers, SI: the variable, and which of the numbers of its term.
    pub parameters: BTreeMap<String, Estimate>,
    /// Unit of what it gives.
    pub unit: String,
    /// Part of the misfit's energy above the noise that it explains in samples that it was not
    /// fitted to.
    pub share: f64,
    /// Forms that would do as well as its first term.
    pub rivals: Vec<String>,
}

impl SaidEquation {
    pub(crate) fn of(equation: &Equation) -> Self {
        let numbers = equation.terms.iter().flat_map(Term::numbers);
        let estimate = |(value, deviation): (f64, f64)| Estimate {
            value,
            std: deviation.is_finite().then_some(deviation),
        };
        Self {
            text: equation.text(),
            parameters: numbers
                .map(|(name, number)| (name, estimate(number)))
                .collect(),
            unit: equation.unit.into(),
            share: equation.share,
            rivals: equation.rivals.clone(),
        }
    }
}

/// The verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// "verdict/1".
    pub format: &'static str,
    /// The verdict in a word.
    pub verdict: Kind,
    /// In one sentence.
    pub sentence: String,
    /// Where.
    pub located: Vec<Located>,
    /// What.
    pub effects: Vec<Effect>,
    /// Everything tried.
    pub ranking: Vec<Ranked>,
    /// Sets that these recordings cannot tell apart.
    pub alternatives: Vec<Vec<String>>,
    /// What to record to tell them apart, or to rule out what could hide.
    pub next_experiment: Option<String>,
    /// Candidates that these signals cannot show.
    pub not_observable: Vec<String>,
    /// What a law in which nothing is missing would have shown.
    pub would_show: Vec<WouldShow>,
    /// What no effect of the list explains.
    pub unknown_term: Option<UnknownTerm>,
    /// The proof.
    pub fit: Fit,
    /// Parameters before and after.
    pub parameters: BTreeMap<String, Parameter>,
    /// Remarks a reader should know.
    pub notes: Vec<String>,
    /// Numbers that the rig does not state and a law used.
    pub assumed: Vec<Assumed>,
    /// Remarks on data and rig that were tested, held-out recordings included.
    pub doubts: Vec<Doubt>,
    /// Work done, as seconds of a reference core: the same from run to run.
    pub seconds: f64,
}
