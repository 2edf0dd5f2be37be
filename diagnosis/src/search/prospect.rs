//! What an effect would explain beside a model at the best, before any fit of it.
//!
//! A fit of long recordings takes half a second, a run without derivatives a twentieth of
//! that. So the change that an effect makes where its fits begin is taken for a straight line:
//! what the model's own parameters can take up of it is taken away ([`Refit`]), and of what
//! the model misses as much is explained as lies along the changes of all its starts. A fit
//! meets bounds and curves and may end elsewhere: this tells which effects are worth one, and
//! no more.

use crate::estimate::fitted::with;
use crate::estimate::refit::{Refit, take_away};
use crate::estimate::{Bench, Fitted, Set};
use crate::fit::law_problem::Columns;
use crate::thresholds::NEXT_TO_NOTHING;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::borrow::Borrow;

/// Changes that differ by less than this part of themselves are one.
const SAME: f64 = 1e-6;

/// So many that promise most are fitted. In 13 concealed cases the set that a few iterations of
/// every fit put first was among these, mostly the first, wherever anything was explained.
const PROMISING: usize = 6;
/// What would leave more than so many times the energy that the best would leave is not fitted,
/// unless that is next to nothing of what is missed: it may be the right one.
const FAR_FROM_BEST: f64 = 4.0;
/// Where an effect has to leave less than a tenth of what a model misses, one that is there promises
/// to leave less than this part: of 13 drawn effects straight lines left a third at the most, of one
/// beside another 0.39.
const HOPEFUL: f64 = 0.5;

/// Sets larger than their parent, which is `model` but for when an effect is there: the places
/// of all, the one that would leave least by `score` first.
pub(crate) fn order<P: Borrow<Fitted> + Sync>(
    bench: &Bench<'_>,
    model: &Fitted,
    sets: &[(Set, P)],
    score: &impl Fn(&Fitted) -> f64,
) -> Vec<usize> {
    best_first(&hopes(bench, model, sets), score)
}

/// The places of what promises most beside a model, the least by `score` first: so many that the
/// right one is among them, none that is far from the best, and none without hope.
pub(crate) fn promising(
    bench: &Bench<'_>,
    model: &Fitted,
    hopes: &[Option<Fitted>],
    score: &impl Fn(&Fitted) -> f64,
) -> Vec<usize> {
    let left = |place: &usize| {
        let hope = hopes[*place].as_ref();
        hope.map_or(f64::INFINITY, |hope| hope.energy_above(&bench.noise))
    };
    let mut order = best_first(hopes, score);
    order.truncate(PROMISING);
    let least = order.iter().map(left).fold(f64::INFINITY, f64::min);
    let worth_a_fit = far_from(least, bench, model).min(hopeful(bench, model));
    order.retain(|place| left(place) <= worth_a_fit);
    order
}

/// The energy from which a model is far from the best, which leaves `least` of what another model
/// misses.
pub(crate) fn far_from(least: f64, bench: &Bench<'_>, model: &Fitted) -> f64 {
    (FAR_FROM_BEST * least).max(NEXT_TO_NOTHING * model.energy_above(&bench.noise))
}

/// The places of sets that may stand in the place of a model, which has other effects beside `near`:
/// the one that would leave least by `score` first. Of what a model takes nearly all of, another
/// that does as well promises to.
pub(crate) fn exchangeable<P: Borrow<Fitted> + Sync>(
    bench: &Bench<'_>,
    (model, near): (&Fitted, &Fitted),
    sets: &[(Set, P)],
    score: &impl Fn(&Fitted) -> f64,
) -> Vec<usize> {
    let prospects = Prospects::new(bench, near);
    let hopes = prospects.hopes(sets);
    let missed = Fitted {
        mean_square: mean_squares(&prospects.missed),
        ..near.clone()
    };
    let missed = missed.energy_above(&bench.noise);
    let takes_all = model.energy_above(&bench.noise) < NEXT_TO_NOTHING * missed;
    let worth_a_fit = if takes_all {
        HOPEFUL * missed
    } else {
        f64::INFINITY
    };
    let mut order = best_first(&hopes, score);
    order.retain(|&place| {
        let hope = hopes[place].as_ref();
        hope.is_some_and(|hope| hope.energy_above(&bench.noise) <= worth_a_fit)
    });
    order
}

/// The most energy that an effect may promise to leave beside a model. Of what a valve that is
/// nearly known leaves, one that is told from it takes next to all.
pub(crate) fn hopeful(bench: &Bench<'_>, model: &Fitted) -> f64 {
    if !bench.is_nearly_known() || bench.is_unsound(model) {
        return f64::INFINITY;
    }
    HOPEFUL * model.energy_above(&bench.noise)
}

/// The places of what is hoped for, the least by `score` first.
fn best_first(hopes: &[Option<Fitted>], score: &impl Fn(&Fitted) -> f64) -> Vec<usize> {
    let hoped = |hope: &Option<Fitted>| hope.as_ref().map_or(f64::INFINITY, score);
    let hoped: Vec<f64> = hopes.iter().map(hoped).collect();
    let mut order: Vec<usize> = (0..hopes.len()).collect();
    order.sort_by(|&one, &other| hoped[one].total_cmp(&hoped[other]));
    order
}

/// The parent of each set with what the set would leave at the best; `None` where it makes no
/// change.
pub(crate) fn hopes<P: Borrow<Fitted> + Sync>(
    bench: &Bench<'_>,
    model: &Fitted,
    sets: &[(Set, P)],
) -> Vec<Option<Fitted>> {
    Prospects::new(bench, model).hopes(sets)
}

/// A model, and what it misses beyond its own parameters.
pub(crate) struct Prospects<'a> {
    pub(crate) refit: Refit<'a>,
    missed: Vec<Columns>,
}

/// What effects change in the predictions of a model beyond its own parameters, a direction for
/// each of their starts.
pub(crate) struct Directions {
    pub(crate) changes: Vec<Vec<Columns>>,
    inverse: DMatrix<f64>,
}

impl Directions {
    /// `None` where they change nothing.
    pub(crate) fn new(refit: &Refit<'_>, changes: Vec<Vec<Columns>>) -> Option<Self> {
        let alike = DMatrix::from_fn(changes.len(), changes.len(), |row, column| {
            refit.product(&changes[row], &changes[column])
        });
        let largest = alike.diagonal().max();
        let inverse = alike
            .pseudo_inverse(SAME * largest.max(f64::MIN_POSITIVE))
            .ok()?;
        Some(Self { changes, inverse })
    }

    /// How much of each direction is in something that has this in common with them.
    fn shares(&self, in_common: Vec<f64>) -> DVector<f64> {
        &self.inverse * DVector::from_vec(in_common)
    }

    /// The energy along all directions of something that has this in common with them.
    pub(crate) fn energy(&self, in_common: Vec<f64>) -> f64 {
        let in_common = DVector::from_vec(in_common);
        in_common.dot(&(&self.inverse * &in_common))
    }
}

impl<'a> Prospects<'a> {
    pub(crate) fn new(bench: &'a Bench<'a>, model: &'a Fitted) -> Self {
        let refit = Refit::new(bench, model, bench.sigma(Some(model)));
        let missed = refit.left_of(&bench.recorded());
        Self { refit, missed }
    }

    /// The parent of each set with what the set would leave at the best; `None` where it makes no
    /// change.
    fn hopes<P: Borrow<Fitted> + Sync>(&self, sets: &[(Set, P)]) -> Vec<Option<Fitted>> {
        let hope = |(set, parent): &(Set, P)| {
            let parent = parent.borrow();
            Some(Fitted {
                mean_square: self.left_by(set, parent)?,
                ..parent.clone()
            })
        };
        sets.par_iter().map(hope).collect()
    }

    /// What a set changes that its parent lacks, its new effects each where their fits begin.
    pub(crate) fn directions(&self, set: &[usize], parent: &Fitted) -> Option<Directions> {
        let bench = self.refit.bench;
        let change = |new: usize, start: usize| {
            let begun = bench.begun(&with(&parent.set, new), parent, start);
            self.refit
                .left_of(&bench.predicted_on(&begun, bench.tracks))
        };
        let new = set.iter().filter(|index| !parent.set.contains(index));
        let starts =
            new.flat_map(|&new| (0..bench.candidates[new].starts.len()).map(move |at| (new, at)));
        let changes = starts.map(|(new, start)| change(new, start)).collect();
        Directions::new(&self.refit, changes)
    }

    /// What each direction has in common with what is missed.
    pub(crate) fn in_common(&self, directions: &Directions) -> Vec<f64> {
        let changes = directions.changes.iter();
        changes
            .map(|change| self.refit.product(change, &self.missed))
            .collect()
    }

    /// What a set would leave at the best, by output: mean squares, SI. `None` where it makes
    /// no change.
    fn left_by(&self, set: &[usize], parent: &Fitted) -> Option<Vec<f64>> {
        let directions = self.directions(set, parent)?;
        let shares = directions.shares(self.in_common(&directions));
        let mut left = self.missed.clone();
        for (change, share) in directions.changes.iter().zip(&shares) {
            for (left, change) in left.iter_mut().zip(change) {
                take_away(left, change, *share);
            }
        }
        Some(mean_squares(&left))
    }
}

/// Of columns by recording and output, the mean square of each output.
fn mean_squares(columns: &[Columns]) -> Vec<f64> {
    let outputs = columns.first().map_or(0, Vec::len);
    let of_output = |output: usize| {
        let rows = columns.iter().flat_map(|recording| &recording[output]);
        let finite = rows.filter(|value| value.is_finite());
        let (sum, count) = finite.fold((0.0, 0_usize), |(sum, count), v| (sum + v * v, count + 1));
        sum / count.max(1) as f64
    };
    (0..outputs).map(of_output).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::laws::Track;
    use truth_plant::{Kind, Request, Strength};

    /// A spool with play before a sensor that is off: beside the play the sensor promises
    /// most, and as much as its fit keeps.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_the_second_of_two_effects_promises_what_it_keeps() {
        let request = Request::new(2_981_860_632, Kind::Pair).with_noise(1.0);
        let (rig, recordings) = drawn::read(&request.with_strength(Strength::Medium));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::chambers(&rig, &tracks);
        let effect = |place: usize| bench.candidates[place].effect;
        let count = bench.candidates.len();
        let play = (0..count)
            .find(|&place| effect(place) == "valve-hysteresis")
            .unwrap();
        let model = bench
            .fit(&[play], Some(&bench.as_given(&baseline)))
            .unwrap();
        let beside = |other: usize| {
            let mut set = vec![play, other];
            set.sort_unstable();
            (set, &model)
        };
        let others = (0..count).filter(|&other| other != play);
        let sets: Vec<(Set, &Fitted)> = others.map(beside).collect();
        let score = |fitted: &Fitted| fitted.energy_above(&bench.noise);
        let best = &sets[order(&bench, &model, &sets, &score)[0]].0;
        assert!(
            best.iter()
                .any(|&place| effect(place) == "pressure-sensor-offset")
        );
        let promised = Prospects::new(&bench, &model)
            .left_by(best, &model)
            .unwrap();
        let kept = bench.fit(best, Some(&model)).unwrap().mean_square;
        for (promised, kept) in promised.iter().zip(&kept) {
            let ratio = (promised / kept).sqrt();
            assert!((0.9..1.1).contains(&ratio), "{promised} Pa2, kept {kept}");
        }
    }
}
