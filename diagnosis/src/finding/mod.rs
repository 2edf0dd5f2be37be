//! What was found of a law, and what held-out recordings say of it.

mod judgement;
pub mod proof;
pub(crate) mod said;

use crate::estimate::Fitted;
use crate::estimate::candidates::{Candidate, voids};
use crate::estimate::sheet::Sheet;
use crate::laws::{Law, Output, Track};
use crate::locate::Located;
use crate::rig::Rig;
use crate::search::Evidence;
use crate::search::alone::Alone;
use crate::search::limits::Limit;
use crate::search::next_experiment::NextExperiment;
use crate::thresholds::EXPLAINED;
use crate::unlisted::equation::Equation;
use crate::unlisted::unknown_term;
use proof::{Frozen, Run};
use std::collections::BTreeMap;

/// The models of the comparison, in the order in which they are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The rig as given.
    Given,
    /// Ordinary parameters refitted.
    Refitted,
    /// With the accepted effects.
    Improved,
}

/// A moment in which the carriage left its place.
#[derive(Clone, Copy, Debug)]
pub struct BreakAway {
    /// How long it had stood, s.
    pub rest_s: f64,
    /// The force at which it left less that of the refitted model, N.
    pub refitted_n: f64,
    /// The same of the improved one.
    pub improved_n: f64,
}

/// What was found of one law.
pub struct Finding {
    /// The law.
    pub law: Law,
    /// What was tried.
    pub candidates: Vec<Candidate>,
    /// Noise of each output that the search works on, SI.
    pub noise: Vec<f64>,
    /// Noise of each output that is shown, SI.
    pub floor: Vec<f64>,
    /// The refitted baseline.
    pub baseline: Fitted,
    /// With the accepted effects.
    pub improved: Fitted,
    /// What speaks for and against each candidate.
    pub evidence: Vec<Evidence>,
    /// An accepted effect and one that would do as well.
    pub rivals: Vec<(usize, usize)>,
    /// The recording that would tell the first of these apart, as simulated.
    pub next_experiment: Option<NextExperiment>,
    /// Where the refitted baseline fails.
    pub located: Vec<Located>,
    /// Of a carriage, when it left its place in the training recordings, and what was missed.
    pub break_aways: Vec<BreakAway>,
    /// The input that would explain what the chambers' baseline misses.
    pub input: Option<Located>,
    /// What the law misses as an equation that its model does not hold.
    pub equation: Option<Equation>,
    /// What commands lost between the rows would leave, over what the baseline misses.
    pub lost_commands: Option<f64>,
    /// Whether the refitted baseline misses something that can be trusted to show it.
    pub missed: bool,
    /// Whether the improved model still misses something plainly, or a table stands for it.
    pub is_open: bool,
    /// Whether the refitted baseline leaves more than a sound model of such a rig does.
    pub(crate) is_unsound: bool,
    /// Part of what the baseline misses that the named effects explain.
    pub explained: f64,
    /// What was put into the model and held-out recordings spoke against.
    pub refuted: Option<Refuted>,
    /// Whether held-out recordings are predicted worse with the named effects, though not so
    /// plainly that this refutes them: the improved rig does not hold them.
    pub is_unproven: bool,
    /// Whether only held-out recordings show that something is missing.
    pub is_surprised: bool,
    /// Whether held-out recordings are predicted beyond the noise because the training recordings
    /// leave numbers of the rig open.
    pub leaves_numbers_open: bool,
    /// A table in the place of a force that no effect explains.
    pub term: Option<unknown_term::Term>,
    /// What the effects came to that a table was put in the place of.
    pub(crate) of_effects: Option<Box<Finding>>,
    /// Each effect of the improved model beside the model without it.
    pub alone: BTreeMap<usize, Alone>,
    /// The frozen models.
    pub frozen: Vec<Frozen>,
    /// Their runs on the training recordings, by model.
    pub train: Vec<Vec<Option<Run>>>,
    /// Their runs on the held-out recordings, by model.
    pub held_out: Vec<Vec<Option<Run>>>,
    /// What the excitation cannot show, and why.
    pub screened: Vec<String>,
    /// From which size on each candidate would have shown, where nothing does.
    pub limits: Vec<Limit>,
    /// Number of fits made.
    pub fits: usize,
    /// Work done, as seconds of a reference core (see [`crate::estimate::Bench::seconds`]).
    pub seconds: f64,
}

/// What was put into a law and held-out recordings speak against.
#[derive(Clone, Debug)]
pub struct Refuted {
    /// The effects or the table, in words.
    pub what: String,
    /// How predictions are with it, in words.
    pub how: &'static str,
}

impl Model {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Given, Self::Refitted, Self::Improved];
}

impl Finding {
    /// What the improved model leaves of held-out recordings: predicted less recorded, by
    /// output, recording and row.
    pub(crate) fn left_of_held_out(&self, tracks: &[Track<'_>], rig: &Rig) -> Vec<Vec<Vec<f64>>> {
        let runs = &self.held_out[Model::Improved as usize];
        let of_output = |(number, output): (usize, &Output)| {
            let of_track = |(run, track): (&Option<Run>, &Track<'_>)| {
                let predicted = run.as_ref().map_or(&[][..], |run| &run.predicted[number]);
                let recorded = track.recorded(output).iter();
                predicted.iter().zip(recorded).map(|(p, r)| p - r).collect()
            };
            runs.iter().zip(tracks).map(of_track).collect()
        };
        let outputs = self.law.outputs(rig);
        outputs.iter().enumerate().map(of_output).collect()
    }

    /// Whether break-aways alone show what was put in.
    pub(crate) fn is_of_rests(&self) -> bool {
        let is_of_rests = |index: &usize| self.candidates[*index].is_of_rests;
        !self.improved.set.is_empty() && self.improved.set.iter().all(is_of_rests)
    }

    /// The names of the accepted effects.
    pub(crate) fn named(&self) -> impl Iterator<Item = &'static str> {
        let accepted = self.evidence.iter().filter(|one| one.accepted);
        accepted.map(|one| self.candidates[one.candidate].effect)
    }

    /// How well the rig file keeps the deviations that it states, by the numbers of this law.
    pub(crate) fn sheet(&self, rig: &Rig) -> Sheet {
        let mut sheet = Sheet::default();
        let model = self.for_the_rig();
        let numbers = model.names.iter().zip(&model.values).take(model.shared);
        for ((key, &found), &known_to) in numbers.zip(&model.standard_deviations) {
            if !voids(&self.candidates, &model.set).any(|void| void == key) {
                sheet.take_up(rig, key, found, known_to);
            }
        }
        sheet
    }

    /// The model that goes into the improved rig.
    pub fn for_the_rig(&self) -> &Fitted {
        if self.is_unproven {
            &self.baseline
        } else {
            &self.improved
        }
    }

    /// A law of which effects are named.
    pub(crate) fn has_named(&self) -> bool {
        self.evidence.iter().any(|evidence| evidence.accepted)
    }

    /// A law whose named effects explain what it misses.
    pub(crate) fn is_solved(&self) -> bool {
        self.has_named() && is_enough(self.explained)
    }

    /// A law whose misfit is material, and no effect explains it. What is left of an output that
    /// alone says nothing, as creep, does not count.
    pub(crate) fn is_unexplained(&self) -> bool {
        self.missed && self.is_open && !is_enough(self.explained) && !self.evidence.is_empty()
    }

    /// Effects without a name, as they explain too little: then they must do no harm either.
    pub(crate) fn is_unnamed(&self) -> bool {
        self.is_unexplained() && self.term.is_none() && !self.improved.set.is_empty()
    }

    /// Held-out recordings spoke against effects with a name that explained what is missed.
    pub(crate) fn is_refuted(&self) -> bool {
        self.missed && self.evidence.iter().any(|evidence| evidence.is_refuted)
    }
}

/// Part of the baseline's energy above the noise that the effects explain, each
/// output counted in its own noise.
pub(crate) fn explained(baseline: &Fitted, improved: &Fitted, noise: &[f64]) -> f64 {
    let missed = baseline.energy_above(noise).max(f64::MIN_POSITIVE);
    1.0 - improved.energy_above(noise) / missed
}

/// Whether effects that explain this part may be named.
pub(crate) fn is_enough(explained: f64) -> bool {
    explained >= EXPLAINED
}
