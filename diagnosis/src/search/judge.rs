//! How much a set of effects explains, and whether each of its members earns its place.

use super::evidence::{Evidence, explained_probability, is_by_chance, log_gain, probability};
use crate::effects::sensing::position_time_skew;
use crate::effects::{self, Kind, Mark};
use crate::estimate::candidates::Candidate;
use crate::estimate::fold_squares::FoldSquares;
use crate::estimate::{Bench, Fitted, Set};
use crate::fit::Presence;
use crate::laws::{Law, balance, median_step_s};
use crate::thresholds::{
    ERROR_OF_FORM, LARGER_PART, LEAST_LOAD, MATERIAL_SHARE, NEXT_TO_NOTHING, PLAIN_RATIO,
    PLAIN_RATIO_AMONG_MANY, TO_THE_NOISE, TOLD_FROM_NOUGHT,
};
use std::sync::OnceLock;

/// Growing stops when the best set of a size is not better than the best
/// smaller one by this part of its misfit, twice in a row. Far under what is
/// accepted later; it only saves time. (On long recordings, where a size takes a quarter of
/// a minute, it stops at the first that would not be plain even alone.)
const WORTH_GROWING: f64 = 0.01;

/// Cross-validated squares per output.
type Judged = Vec<FoldSquares>;

/// Fits sets and judges them by cross-validation, each once.
pub(crate) struct Judge<'a> {
    pub(crate) bench: &'a Bench<'a>,
    pub(crate) baseline: &'a Fitted,
    pub(crate) judged: Vec<((Set, Option<Presence>), Judged)>,
    pub(crate) fitted: Vec<Fitted>,
    /// Ranked only, by some steps of a fit or by what they promise.
    pub(crate) ranked: Vec<Fitted>,
    /// What each effect alone promises beside the baseline, once that was asked for.
    pub(crate) hoped: OnceLock<Vec<Option<Fitted>>>,
    /// Sets and values that were grown, with what came of each.
    pub(crate) grown: Vec<(Set, Vec<f64>, Vec<Fitted>)>,
    pub(crate) fits: usize,
    /// The least misfit that is looked at, in units of the noise's energy ...
    told_from_noise: f64,
    /// ... and by which chance would change that of single events.
    told_of_events: f64,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(bench: &'a Bench<'a>, baseline: &'a Fitted) -> Self {
        Self {
            bench,
            baseline,
            judged: Vec::new(),
            fitted: vec![baseline.clone()],
            ranked: Vec::new(),
            hoped: OnceLock::new(),
            grown: Vec::new(),
            fits: 0,
            told_from_noise: bench.told_from_noise(baseline),
            told_of_events: bench.told_of_events(baseline),
        }
    }

    /// The same beside a lower baseline, with what was fitted; what effects promised was promised
    /// beside the other.
    pub(crate) fn beside<'b>(self, lower: &'b Fitted) -> Judge<'b>
    where
        'a: 'b,
    {
        let is_larger = |fitted: &Fitted| !fitted.set.is_empty();
        let fitted = self.fitted.into_iter().filter(is_larger);
        Judge {
            fitted: std::iter::once(lower.clone()).chain(fitted).collect(),
            ranked: self.ranked,
            fits: self.fits,
            ..Judge::new(self.bench, lower)
        }
    }

    /// Whether an effect alone may have done no more than lead out of the hollow in which the
    /// baseline had ended: beside a lower one, none leaves next to nothing. Forces have so many
    /// hollows that it always may.
    pub(crate) fn is_led_out_of_a_hollow_alone(&self, singles: &[Fitted], lower: &Fitted) -> bool {
        let left = singles.iter().map(|single| self.left(single));
        let least = left.fold(f64::INFINITY, f64::min);
        !self.tells_by_prospects() || least > NEXT_TO_NOTHING * self.left(lower)
    }

    /// Sum over the outputs of the log of the RMS misfit; the noise is its floor,
    /// unless that was set and not declared: below it forms can be told apart, down to
    /// what a single break-away can be made to fit by.
    pub(crate) fn score(&self, fitted: &Fitted) -> f64 {
        let floor = if self.bench.law == Law::Balance {
            TO_THE_NOISE
        } else {
            1.0
        };
        fitted
            .mean_square
            .iter()
            .zip(&self.bench.noise)
            .map(|(square, noise)| 0.5 * square.max(floor * noise * noise).ln())
            .sum()
    }

    /// Whether a larger set brings so much that a still larger one may be tried.
    pub(crate) fn is_worth_growing(&mut self, best: &Fitted, larger: &Fitted) -> bool {
        if self.bench.is_long() {
            self.ratio(larger, best) <= PLAIN_RATIO
        } else {
            self.score(best) - self.score(larger) > WORTH_GROWING
        }
    }

    /// Sizes without a gain after which growing stops: where a size takes long,
    /// the first.
    pub(crate) fn patience(&self) -> usize {
        if self.bench.is_long() { 1 } else { 2 }
    }

    /// Energy that a model leaves above the noise.
    pub(crate) fn left(&self, fitted: &Fitted) -> f64 {
        fitted.energy_above(&self.bench.noise)
    }

    /// Whether nothing is left that would be material: noise, or so small a part
    /// of what the baseline misses that no further effect could be accepted, and not
    /// so much that another effect may well be in it.
    pub(crate) fn is_explained(&self, fitted: &Fitted) -> bool {
        let is_small = self.left(fitted) < MATERIAL_SHARE * self.left(self.baseline);
        let is_of_form = self.bench.leaves_no_more_than_a_form(fitted);
        self.is_noise(fitted) || is_small && is_of_form && self.explains_events(fitted)
    }

    /// Whether single events are explained as well: the rows of what an effect explains are many,
    /// and a break-away tells of what none of them does.
    fn explains_events(&self, fitted: &Fitted) -> bool {
        let outputs = 0..self.bench.noise.len();
        let above = |fitted: &Fitted, output: usize| {
            fitted.mean_square[output] / self.bench.noise[output].powi(2) - 1.0
        };
        outputs
            .filter(|&output| self.bench.is_of_events(output))
            .all(|output| {
                let material = MATERIAL_SHARE * above(self.baseline, output);
                let told = self.told_from_noise.max(self.told_of_events);
                above(fitted, output) < material.max(told)
            })
    }

    /// Whether all but a little is explained by a load in its play: its blows, which no model
    /// meets, are what is left.
    pub(crate) fn leaves_blows(&self, fitted: &Fitted) -> bool {
        let mut effects = fitted.set.iter().map(|&one| &self.bench.candidates[one]);
        effects.any(|effect| effect.is_rough) && self.takes_the_rest(fitted, self.baseline)
    }

    /// Whether a model leaves next to nothing of what is missing, or no more than the form of an
    /// effect. What comes and goes has to: its moments were chosen to suit it, each with two
    /// numbers. (A force that swings with time was friction by pressure in 22 short spans, which
    /// took three quarters of it; in trials what does come and go took 99 % and more.)
    pub(crate) fn leaves_little(&self, fitted: &Fitted) -> bool {
        self.takes_the_rest(fitted, self.baseline) || self.bench.leaves_no_more_than_a_form(fitted)
    }

    /// Whether nothing in a model may stand for an effect that comes and goes. Two that are there
    /// always can imitate one that is not, but not so well.
    pub(crate) fn is_there_always(&self, fitted: &Fitted) -> bool {
        let is_no_imitation = fitted.set.len() < 2
            || self.left(fitted) < NEXT_TO_NOTHING * MATERIAL_SHARE * self.left(self.baseline);
        self.is_explained(fitted) && is_no_imitation || self.leaves_blows(fitted)
    }

    /// Whether what a model leaves is noise, in every output.
    pub(crate) fn is_noise(&self, fitted: &Fitted) -> bool {
        let outputs = fitted.mean_square.iter().zip(&self.bench.noise);
        outputs
            .into_iter()
            .all(|(square, noise)| square / noise.powi(2) - 1.0 < self.told_from_noise)
    }

    /// Whether one of two models with as many effects leaves less, be it little.
    pub(crate) fn leads(&self, model: &Fitted, other: &Fitted) -> bool {
        self.score(other) - self.score(model) > WORTH_GROWING
    }

    /// A candidate that is not needed beside the accepted ones, with what it
    /// brings alone to the data it was fitted to, or promises to.
    pub(crate) fn needless(&self, candidate: usize) -> Evidence {
        let alone = |fitted: &&Fitted| fitted.set == [candidate];
        let hoped = self.hoped.get().into_iter().flatten().flatten();
        let fitted = self.fitted.iter().chain(&self.ranked).chain(hoped);
        let gain = fitted
            .filter(alone)
            .map(|fitted| self.score(self.baseline) - self.score(fitted))
            .fold(0.0, f64::max);
        Evidence::needless(candidate, self.bench.folds.count as f64 * gain)
    }

    fn judged(&mut self, model: &Fitted) -> Judged {
        let key = (model.set.clone(), model.presence.clone());
        if let Some((_, known)) = self.judged.iter().find(|(known, _)| *known == key) {
            return known.clone();
        }
        // With tens of thousands of rows to some twenty parameters, data in and
        // out of the fit are missed alike; and what one recording alone excites
        // cannot be learnt from the others.
        let judged = if self.bench.is_long() {
            self.bench.by_fold(model)
        } else {
            self.fits += self.bench.folds.count;
            self.bench.cross_validate(model)
        };
        self.judged.push((key, judged.clone()));
        judged
    }

    /// Energy of the misfit above the noise, per output.
    fn misfit(&self, squares: &FoldSquares, output: usize) -> f64 {
        let noise = self.bench.noise[output].powi(2);
        (squares.mean() - noise).max(self.told_from_noise * noise)
    }

    /// Best over the outputs of the RMS error of one model over another's.
    pub(crate) fn ratio(&mut self, model: &Fitted, other: &Fitted) -> f64 {
        let (mine, theirs) = (self.judged(model), self.judged(other));
        if self.bench.is_long() {
            // Where both come down to the noise, what they leave is compared.
            let to_noise = self.is_noise(model) && self.is_noise(other);
            let left = |judged: &Judged| -> f64 {
                let outputs = judged.iter().enumerate();
                outputs
                    .map(|(output, squares)| {
                        let left = if to_noise {
                            squares.mean()
                        } else {
                            self.misfit(squares, output)
                        };
                        left / self.bench.noise[output].powi(2)
                    })
                    .sum()
            };
            return (left(&mine) / left(&theirs)).sqrt();
        }
        (0..mine.len())
            .map(|output| {
                (self.misfit(&mine[output], output) / self.misfit(&theirs[output], output)).sqrt()
            })
            .fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn evidence(
        &mut self,
        with: &Fitted,
        without: &Fitted,
        candidate: usize,
    ) -> Evidence {
        let (mine, theirs) = (self.judged(with), self.judged(without));
        let (helped, share) = self.most_helped(&mine, &theirs);
        let ratio =
            (self.misfit(&mine[helped], helped) / self.misfit(&theirs[helped], helped)).sqrt();
        let better = mine[helped]
            .beside(&theirs[helped])
            .filter(|(mine, theirs)| mine < theirs)
            .count();
        let folds = mine[helped].beside(&theirs[helped]).count();
        let at_bound = self.stands_on_bound(with, candidate);
        let is_sampling = self.is_sampling(with, candidate);
        let is_negligible = self.bench.is_negligible(with, candidate);
        let is_told = !is_sampling && !is_negligible;
        let gain = log_gain(&mine[helped], &theirs[helped]);
        let to_the_noise = self.takes_down_to_the_noise(with, without);
        let is_material = share >= MATERIAL_SHARE
            || to_the_noise
            || self.takes_more_than_a_form(with, without, helped);
        let is_chance = self.bench.is_of_events(helped) && self.is_chance(with, without);
        let is_plain = !at_bound
            && !is_chance
            && gain > 0.0
            && is_material
            && if self.bench.is_long() {
                ratio <= plain_ratio(self.rivals(with, helped, is_told))
            } else {
                ratio <= PLAIN_RATIO || (better == folds && ratio < 1.0)
            };
        let probability = if self.bench.is_long() {
            explained_probability(ratio, if to_the_noise { 1.0 } else { share })
        } else {
            probability(&mine[helped], &theirs[helped], is_plain && is_told, share)
        };
        let is_told = is_told && self.is_told_from_imprecision(with, without, probability);
        Evidence {
            candidate,
            probability,
            ratio,
            share,
            folds_better: (better, folds),
            gain,
            at_bound,
            is_chance,
            accepted: is_plain && is_told,
            is_sampling: is_plain && is_sampling,
            is_negligible: is_plain && is_negligible,
            ..Evidence::default()
        }
    }

    /// The output that an effect helps most, and by which part of what is missed there.
    fn most_helped(&self, mine: &Judged, theirs: &Judged) -> (usize, f64) {
        let missing = |output: usize| {
            let noise = self.bench.noise[output].powi(2);
            (self.baseline.mean_square[output] - noise).max(self.told_from_noise * noise)
        };
        let improvement = |output: usize| {
            let energy = self.misfit(&theirs[output], output) - self.misfit(&mine[output], output);
            energy / missing(output)
        };
        // Where nothing is missed, nothing can be shown to be there.
        let missed = |output: &usize| self.bench.may_miss(self.baseline, *output);
        let helped = (0..mine.len())
            .filter(missed)
            .max_by(|&a, &b| improvement(a).total_cmp(&improvement(b)))
            .unwrap_or(0);
        (helped, improvement(helped))
    }

    /// A wrong effect nibbles at what the form of another leaves, but hardly down to the
    /// noise: what does is material however much larger another effect is.
    fn takes_down_to_the_noise(&self, with: &Fitted, without: &Fitted) -> bool {
        self.bench.is_long()
            && !self.is_noise(without)
            && (self.is_noise(with) || self.takes_the_rest(with, without))
    }

    /// Among how many others an effect is to be plain.
    fn rivals(&self, with: &Fitted, helped: usize, is_told: bool) -> usize {
        // What is not named cannot be named wrongly: it need only help.
        let others = if is_told { with.set.len() - 1 } else { 0 };
        // Creep is too near to sticking to be met to its noise by any form: what shows in it
        // alone is to take most of it away, as among others.
        let is_creep = self.bench.law == Law::Balance && helped == balance::CREEPING;
        others + usize::from(is_told && is_creep)
    }

    /// Whether an effect is told from a valve and gauges that are only nearly known. What those
    /// leave, any effect lowers a little: one that is there takes it down to the noise; or next to
    /// all of it where it is little, and where it is more than they leave, so much that the
    /// effect was there more often than not.
    fn is_told_from_imprecision(&self, with: &Fitted, without: &Fitted, probability: f64) -> bool {
        if !self.bench.is_nearly_known() || !self.bench.misses_plainly(with) {
            return true;
        }
        if self.bench.is_unsound(without) {
            probability >= LARGER_PART
        } else {
            self.takes_the_rest(with, without)
        }
    }

    /// Whether next to nothing is left of what was.
    fn takes_the_rest(&self, with: &Fitted, without: &Fitted) -> bool {
        self.left(with) <= NEXT_TO_NOTHING * self.left(without)
    }

    /// Whether it takes away more of an output than the form of another effect leaves.
    fn takes_more_than_a_form(&self, with: &Fitted, without: &Fitted, output: usize) -> bool {
        let taken = self.bench.excess(without, output) - self.bench.excess(with, output);
        self.bench.is_long() && taken > ERROR_OF_FORM
    }

    /// Whether chance lowers the squares of single events as far as the numbers do that one model
    /// has more than the other.
    fn is_chance(&self, with: &Fitted, without: &Fitted) -> bool {
        let more = with.shared.saturating_sub(without.shared);
        is_by_chance(self.bench.squared_at_events([without, with]), more)
    }

    /// Whether an effect that is nothing but a shift in time is no more than the
    /// order in which a logger reads its channels: a row and a half of skew; half a
    /// row of any shift where one logger served a whole axis at a steady rate.
    fn is_sampling(&self, model: &Fitted, candidate: usize) -> bool {
        let effect = self.bench.candidates[candidate].effect;
        let is_axis = self.bench.rig.valve.is_some();
        let is_shift = effects::effect(effect).is_some_and(|one| one.kind == Kind::ShiftInTime);
        if !is_shift || !is_axis && effect != position_time_skew::EFFECT.name {
            return false;
        }
        let prefix = format!("effects.{effect}.");
        let rows = self.bench.tracks.iter();
        let row_s = rows
            .map(|track| median_step_s(&track.recording.time_s))
            .fold(0.0, f64::max);
        let sampling = if is_axis { 0.5 } else { 1.5 };
        let shifts = model.names.iter().zip(&model.values);
        shifts
            .filter(|(name, _)| name.starts_with(&prefix))
            .all(|(_, shift)| shift.abs() < sampling * row_s)
    }

    /// Whether every parameter of the effect stands on a bound, or a decisive one, or it is a
    /// load of no mass.
    fn stands_on_bound(&self, model: &Fitted, candidate: usize) -> bool {
        let free = &self.bench.candidates[candidate].free;
        let mut own = self.at_bound(model, candidate);
        !free.is_empty()
            && (own.all(|(_, at_bound)| at_bound)
                || self.is_another(model, candidate)
                || self.is_nought(model, candidate)
                || is_no_load(self.bench, model, candidate))
    }

    /// Whether every size of an effect is nought within what it is known to: whatever it explains,
    /// some other number does. A size beside a number that gives the effect its shape is not asked:
    /// a small one that grows at once and a large one that grows slowly leave the same, so that it
    /// is known badly, however plain it is that there is one.
    fn is_nought(&self, model: &Fitted, candidate: usize) -> bool {
        let Candidate { free, marks, .. } = &self.bench.candidates[candidate];
        if free.iter().any(|free| is_decisive(&free.key)) {
            return false;
        }
        let is_nought = |(key, mark): &(String, Mark)| {
            let Some(place) = model.place(key).filter(|_| matches!(mark, Mark::From(_))) else {
                return false;
            };
            let known_to = model.standard_deviations[place].unwrap_or(0.0);
            model.values[place].abs() < known_to
        };
        !marks.is_empty() && marks.iter().all(is_nought)
    }

    /// Whether a decisive number of an effect stands on its bound: a play of nought is
    /// a compliance, a stiction that grows at once a static level, a fitting no tube.
    pub(crate) fn is_another(&self, model: &Fitted, candidate: usize) -> bool {
        let mut own = self.at_bound(model, candidate);
        own.any(|(name, at_bound)| at_bound && is_decisive(name))
    }

    /// The effect's parameters, and which stand on a bound.
    fn at_bound<'m>(
        &'m self,
        model: &'m Fitted,
        candidate: usize,
    ) -> impl Iterator<Item = (&'m str, bool)> {
        let free = &self.bench.candidates[candidate].free;
        let all = model.names.iter().map(String::as_str);
        all.zip(model.at_bound.iter().copied())
            .filter(move |(name, _)| free.iter().any(|free| name.starts_with(&free.key)))
    }
}

/// Whether an effect is another one without this number.
fn is_decisive(name: &str) -> bool {
    let mut parts = name.splitn(3, '.').skip(1);
    let effect = parts.next().and_then(effects::effect);
    let known = effect.zip(parts.next());
    known
        .and_then(|(effect, key)| effect.parameter(key))
        .is_some_and(|known| known.is_decisive)
}

/// Whether the mass of a load is nought within what it is known to, or next to nothing beside
/// the carriage's, or it is on a spring that may as well be rigid. With spring and damper free,
/// such a load is bent to whatever one creep or break-away misses: 0.3 +- 0.2 kg behind 5 +- 11 N/mm
/// was named, with 0.69, where nothing was missing, and 0.74 +- 0.05 kg behind 956 +- 949 N/mm. (Of
/// loads that are there the spring is known to a fiftieth and better.)
pub(crate) fn is_no_load(bench: &Bench<'_>, model: &Fitted, candidate: usize) -> bool {
    let free = &bench.candidates[candidate].free;
    let number = |suffix: &str| {
        let free = free.iter().find(|free| free.key.ends_with(suffix))?;
        let place = model.place(&free.key)?;
        let known_to = model.standard_deviations[place].unwrap_or(0.0);
        Some((model.values[place], known_to))
    };
    let Some((mass_kg, known_to_kg)) = number(".load_mass_kg") else {
        return false;
    };
    let moving_kg = bench.rig.value("carriage.mass_kg").unwrap_or(0.0);
    let is_light = mass_kg < (TOLD_FROM_NOUGHT * known_to_kg).max(LEAST_LOAD * moving_kg);
    let is_in_play = number(".gap_m").is_some();
    let spring = number(".stiffness_N_m").filter(|_| !is_in_play);
    is_light || spring.is_some_and(|(stiffness, known_to)| stiffness < TOLD_FROM_NOUGHT * known_to)
}

/// What must be brought down to this for something to be plain, beside so many
/// others. Beside others more is asked: what the form of one effect leaves wrong,
/// another can always nibble at, but one that is there takes away most of what is left.
pub(crate) fn plain_ratio(others: usize) -> f64 {
    if others > 0 {
        PLAIN_RATIO_AMONG_MANY
    } else {
        PLAIN_RATIO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::laws::Track;
    use truth_plant::{Kind, Request};

    /// A load of 0.74 +- 0.05 kg behind 956 +- 949 N/mm was named where nothing that matters was
    /// missing.
    #[test]
    fn regress_a_load_on_a_spring_that_may_be_rigid_is_none() {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let is_none = |effect: &str, known_to_n_per_m: f64| {
            let load = drawn::tried(&bench, effect, "force-balance");
            let mut model = bench.begun(&[load], &baseline, 0);
            let numbers = [
                ("load_mass_kg", 0.74, 0.05),
                ("stiffness_N_m", 956e3, known_to_n_per_m),
            ];
            for (number, value, known_to) in numbers {
                let place = model.place(&format!("effects.{effect}.{number}")).unwrap();
                model.values[place] = value;
                model.standard_deviations[place] = Some(known_to);
            }
            is_no_load(&bench, &model, load)
        };
        assert!(is_none("load-compliance", 949e3));
        assert!(!is_none("load-compliance", 20e3));
        assert!(
            !is_none("load-backlash", 949e3),
            "in its play it is the way that counts"
        );
    }

    /// A friction of 0.04 +- 0.14 N/bar was kept beside a load in its play, with 0.95.
    #[test]
    fn regress_a_size_of_nought_within_its_deviation_is_none() {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let seal = drawn::tried(&bench, "pressure-dependent-friction", "force-balance");
        let model = bench.fit(&[seal], Some(&baseline)).unwrap();
        let judge = Judge::new(&bench, &baseline);
        let sized = |deviations: [f64; 2]| {
            let mut model = model.clone();
            let marks = bench.candidates[seal].marks.iter();
            for ((key, mark), deviations) in marks.zip(deviations) {
                let place = model.place(key).unwrap();
                model.values[place] = deviations * mark.size();
                model.standard_deviations[place] = Some(mark.size());
            }
            judge.is_nought(&model, seal)
        };
        assert!(sized([0.3, -0.9]));
        assert!(!sized([0.3, 2.0]));
    }
}
