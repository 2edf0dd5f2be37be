//! Named effects, what else was tried, and what cannot be told apart.

use super::{Effect, Estimate, Ranked};
use crate::finding::{Finding, said};

/// Named effects; the same effect at two places is one.
pub(super) fn effects(laws: &[Finding]) -> Vec<Effect> {
    let mut all: Vec<Effect> = Vec::new();
    for law in laws {
        for evidence in law.evidence.iter().filter(|evidence| evidence.accepted) {
            let candidate = &law.candidates[evidence.candidate];
            let parameters = said::sizes(laws, law, candidate)
                .into_iter()
                .map(|size| {
                    let estimate = Estimate {
                        value: size.value,
                        std: size.std,
                    };
                    (size.parameter, estimate)
                })
                .collect();
            let places = candidate.places.iter().map(ToString::to_string).collect();
            let alone = law.alone.get(&evidence.candidate);
            let alone = alone.copied().unwrap_or_default();
            let effect = Effect {
                effect: candidate.effect.into(),
                form: candidate.form.map(Into::into),
                places,
                probability: evidence.probability,
                parameters,
                masked: alone.masked,
                by_chance: alone.by_chance,
                share: evidence.share,
            };
            match all.iter_mut().find(|known| known.effect == effect.effect) {
                Some(known) => merge(known, effect),
                None => all.push(effect),
            }
        }
    }
    all.sort_by(|a, b| {
        b.probability
            .total_cmp(&a.probability)
            .then(b.share.total_cmp(&a.share))
    });
    all
}

fn merge(known: &mut Effect, other: Effect) {
    known.places.extend(other.places);
    known.parameters.extend(other.parameters);
    known.probability = known.probability.max(other.probability);
    known.masked = known.masked.max(other.masked);
    let by_chance = [known.by_chance, other.by_chance];
    known.by_chance = by_chance.into_iter().flatten().reduce(f64::max);
    known.share = known.share.max(other.share);
}

pub(super) fn ranking(laws: &[Finding]) -> Vec<Ranked> {
    let mut all: Vec<Ranked> = laws
        .iter()
        .flat_map(|law| {
            law.evidence.iter().map(|evidence| {
                let candidate = &law.candidates[evidence.candidate];
                Ranked {
                    effect: candidate.effect.into(),
                    form: candidate.form.map(Into::into),
                    places: candidate.places.iter().map(ToString::to_string).collect(),
                    probability: evidence.probability,
                    gain: evidence.gain,
                    declined: evidence.reason(),
                }
            })
        })
        .collect();
    all.sort_by(|a, b| {
        b.probability
            .total_cmp(&a.probability)
            .then(b.gain.total_cmp(&a.gain))
    });
    all
}

/// Pairs of names: an effect that may be at either of two places is one alternative.
pub(super) fn alternatives(laws: &[Finding]) -> Vec<Vec<String>> {
    let mut pairs: Vec<Vec<String>> = Vec::new();
    for law in laws {
        for &(accepted, rival) in &law.rivals {
            let name = |index: usize| law.candidates[index].effect.to_owned();
            let pair = vec![name(accepted), name(rival)];
            if !pairs.contains(&pair) {
                pairs.push(pair);
            }
        }
    }
    pairs
}
