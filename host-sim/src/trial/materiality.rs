//! Truth by ablation: an effect counts if taking it out of the plant changes
//! what an honestly refitted model misses of the held-out recordings.
//!
//! The plant with this effect alone and the plant without any are recorded with
//! the same references and noise; the rig's ordinary numbers are fitted to the
//! training recordings of each; the held-out recordings are predicted. So an
//! effect that ordinary numbers imitate completely is immaterial: a model
//! without it is as good. In a pair each effect is judged as if it were alone.
//!
//! What was drawn at a tenth of the least that an engineer would care about does
//! not count, even where good sensors show it: a delay of 0.2 ms doubles the
//! energy of the misfit of the pressures (measured), which is then 0.4 kPa.

use super::refit::{Misfit, Refit, Seen, refit};
use serde::{Deserialize, Serialize};
use truth_plant::{Case, Strength, TrueEffect};

/// Part of the energy of the misfit without the effect that must come on top
/// with it. A tenth of the energy is where the diagnosis itself begins to look.
const MATERIAL: f64 = 0.10;
/// What chance adds to it, in deviations: the energy of `n` independent
/// residuals varies by sqrt(2/n).
const CHANCE_DEVIATIONS: f64 = 3.0;

/// Whether an effect counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Materiality {
    /// The effect.
    pub effect: String,
    /// It counts.
    pub material: bool,
    /// The output that it shows in most, relative to what is needed.
    pub output: String,
    /// Energy of that output's held-out misfit with the effect over that without.
    pub energy_ratio: f64,
    /// The ratio from which it is material.
    pub needed: f64,
}

/// The effects of a case weighed.
#[derive(Clone, Debug)]
pub struct Weighed {
    /// By effect.
    pub materiality: Vec<Materiality>,
    /// The refit of the plant without effects; none if it has no answer.
    pub clean: Option<Refit>,
}

/// Weighs every effect of a case by taking it out.
pub fn weigh(case: &Case) -> Weighed {
    let effects = &case.truth.effects;
    let bare = effects
        .iter()
        .try_fold(case.clone(), |case, effect| case.without(&effect.name));
    let clean = bare.as_ref().and_then(refitted);
    let weighed = |effect: &TrueEffect| {
        let with = alone(case, effect).as_ref().and_then(refitted);
        match (&with, &clean) {
            (Some(with), Some(clean)) => {
                let mut weighed = materiality(&effect.name, with, clean);
                weighed.material &= is_cared_about(effect);
                weighed
            }
            _ => by_strength(effect),
        }
    };
    Weighed {
        materiality: effects.iter().map(weighed).collect(),
        clean,
    }
}

fn refitted(case: &Case) -> Option<Refit> {
    refit(&Seen::of(case).ok()?).ok()
}

/// The case with one of its effects only, and its rig as drawn.
fn alone(case: &Case, effect: &TrueEffect) -> Option<Case> {
    let others = case.truth.effects.iter();
    others
        .filter(|one| one.name != effect.name)
        .try_fold(case.clone(), |case, other| case.without(&other.name))
}

fn is_cared_about(effect: &TrueEffect) -> bool {
    effect.strength > Strength::Immaterial
}

/// Where the refit has no answer, what was drawn decides.
fn by_strength(effect: &TrueEffect) -> Materiality {
    Materiality {
        effect: effect.name.clone(),
        material: is_cared_about(effect),
        output: "the refit has no answer; by the strength drawn".into(),
        energy_ratio: 1.0,
        needed: 1.0,
    }
}

/// Compares the refitted model's misfit with the effect and without any: whether
/// the effect shows.
pub fn materiality(effect: &str, with: &Refit, without: &Refit) -> Materiality {
    let pairs = with.held_out.iter().filter_map(|with| {
        let without = without
            .held_out
            .iter()
            .find(|one| one.output == with.output)?;
        compared(with, without)
    });
    let excess = |one: &(String, f64, f64)| (one.1 - 1.0) / (one.2 - 1.0);
    let most = pairs.max_by(|a, b| excess(a).total_cmp(&excess(b)));
    let (output, energy_ratio, needed) = most.unwrap_or_default();
    Materiality {
        effect: effect.to_owned(),
        material: !output.is_empty() && energy_ratio > needed,
        output,
        energy_ratio,
        needed,
    }
}

/// Output, ratio of the energies, ratio that is material.
fn compared(with: &Misfit, without: &Misfit) -> Option<(String, f64, f64)> {
    if without.mean_square <= 0.0 || with.independent < 1.0 || without.independent < 1.0 {
        return None;
    }
    let variance = |misfit: &Misfit| 2.0 / misfit.independent;
    let chance = CHANCE_DEVIATIONS * (variance(with) + variance(without)).sqrt();
    let ratio = with.mean_square / without.mean_square;
    Some((with.output.clone(), ratio, 1.0 + MATERIAL.max(chance)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;

    fn refit(mean_square: f64, independent: f64) -> Refit {
        Refit {
            rig: Rig::default(),
            train: Vec::new(),
            held_out: vec![Misfit {
                output: "chambers p_a 1".into(),
                mean_square,
                independent,
            }],
        }
    }

    #[test]
    fn prop_a_change_counts_above_the_floor_and_above_chance() {
        let judged = |with: f64, count| materiality("e", &refit(with, count), &refit(4.0, count));
        assert!(judged(8.0, 400.0).material);
        assert!(!judged(4.2, 4e5).material);
        assert!(judged(4.6, 4e5).material);
        // Of ten residuals a factor of two may be chance.
        assert!(!judged(8.0, 10.0).material);
        assert!(!materiality("e", &refit(1.0, 0.0), &refit(4.0, 100.0)).material);
    }
}
