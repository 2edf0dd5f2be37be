//! Each effect of a model beside the model without it: how much of it a refit hides, and whether
//! chance explains as much.

use crate::estimate::fitted::without;
use crate::estimate::{Bench, Fitted};
use crate::search::null;
use crate::search::{Evidence, Outcome};
use std::collections::BTreeMap;

/// An effect beside the model without it, in which all else is refitted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone {
    /// How much of it the refit hides: one less the energy that is left of it over the energy
    /// that it has.
    pub masked: f64,
    /// How probable it is that chance lets any effect explain as much; none where it was not
    /// asked.
    pub by_chance: Option<f64>,
}

impl Alone {
    fn new(
        bench: &Bench<'_>,
        outcome: &Outcome,
        candidate: usize,
        without: &Fitted,
    ) -> Option<Self> {
        let improved = &outcome.improved;
        // Moments chosen to suit an effect, and a number far off in whose place one is, are
        // judged by other rules.
        let is_asked =
            |one: &Evidence| one.candidate == candidate && one.accepted && !one.is_of_strayed;
        let is_asked = improved.presence.is_none() && outcome.evidence.iter().any(is_asked);
        Some(Self {
            masked: masked_share(bench, improved, candidate, without)?,
            by_chance: is_asked.then(|| null::by_chance(bench, without, improved)),
        })
    }

    fn chance(&self) -> f64 {
        self.by_chance.unwrap_or(0.0)
    }
}

/// Each effect against the model without it; those that chance does as well are taken out, the
/// likeliest first.
pub(crate) fn against_chance(bench: &Bench<'_>, outcome: &mut Outcome) -> BTreeMap<usize, Alone> {
    loop {
        let beside = |&effect: &usize| {
            let without = model_without(bench, outcome, effect)?;
            let alone = Alone::new(bench, outcome, effect, &without)?;
            Some((effect, alone, without))
        };
        let all: Vec<(usize, Alone, Fitted)> =
            outcome.improved.set.iter().filter_map(beside).collect();
        let likeliest = all
            .iter()
            .filter(|(_, alone, _)| alone.chance() > crate::thresholds::CHANCE_ALONE)
            .max_by(|(_, a, _), (_, b, _)| a.chance().total_cmp(&b.chance()));
        let Some((effect, _, without)) = likeliest else {
            return all
                .into_iter()
                .map(|(effect, alone, _)| (effect, alone))
                .collect();
        };
        outcome.leave_to_chance(*effect, without.clone());
    }
}

/// The model that is left of the improved one.
fn model_without(bench: &Bench<'_>, outcome: &Outcome, effect: usize) -> Option<Fitted> {
    if outcome.improved.set.len() == 1 {
        Some(outcome.baseline.clone())
    } else {
        bench.without(&outcome.improved, effect)
    }
}

fn masked_share(
    bench: &Bench<'_>,
    improved: &Fitted,
    candidate: usize,
    other: &Fitted,
) -> Option<f64> {
    let switched_off = bench.restricted(improved, &without(&improved.set, candidate));
    let with = bench.residuals_of(improved);
    let energy = |model: &Fitted| -> f64 {
        bench
            .residuals_of(model)
            .iter()
            .zip(&with)
            .zip(bench.spread())
            .map(|((a, b), spread)| difference_energy(a, b) / spread.powi(2))
            .sum()
    };
    let raw = energy(&switched_off);
    (raw > 0.0).then(|| (1.0 - energy(other) / raw).clamp(0.0, 1.0))
}

fn difference_energy(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| (a - b).powi(2))
        .filter(|square| square.is_finite())
        .sum()
}
