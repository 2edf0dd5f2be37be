//! Fits of a law with a set of effects: starts, steps, ends.

use super::bench::{Bench, LONG_ROWS};
use super::correlation::correlation_length;
use super::fitted::{Fitted, without};
use crate::fit::law_problem::{FreeParameter, LawProblem, Scope};
use crate::fit::{NoiseVariance, Options, Parameter, solve};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Steps, each with derivatives, that show which start leads down.
const PILOT_STEPS: usize = 6;

/// Enough to rank effects on long recordings, where a step takes a tenth of a second: the right
/// one is better by a factor, not by a per cent.
const RANKING_STEPS: usize = 3;

/// The same from the rig as given, from which everything moves: after three steps a slew limit of
/// 106 V/s was the last of 23 effects, and after six it left a thousandth of what the others did.
pub const STEPS_FROM_GIVEN: usize = 6;

/// So many starts of one effect are followed.
const MOST_STARTS: usize = 6;

/// Of several starts of one effect that is ranked, one step shows which to follow.
const FIRST_LOOK: usize = 1;

/// Enough for a fit that lacks one recording of several, from the fit to all.
const FOLD_STEPS: usize = 3;

/// A fit ends when a step brings less than this part of its cost ...
const COST_TOLERANCE: f64 = 1e-7;

/// ... on long recordings than this ...
const LONG_COST_TOLERANCE: f64 = 1e-5;

/// ... and there in a search than this: half of its time went into the last per mille.
const COARSE_COST_TOLERANCE: f64 = 1e-3;

/// A fit whose residual is below this part of the size it was weighed by is
/// weighed anew: the priors would else hold it back.
const WEIGHED_ANEW: f64 = 0.7;

/// ... this many times at the most.
const MOST_WEIGHINGS: usize = 3;

/// Enough to tell sets apart; the winner is polished afterwards.
const SEARCH_ITERATIONS: usize = 200;

impl Bench<'_> {
    /// The model fitted without one of its effects.
    pub(crate) fn without(&self, model: &Fitted, candidate: usize) -> Option<Fitted> {
        let set = without(&model.set, candidate);
        self.fit(&set, Some(&self.restricted(model, &set)))
    }

    /// Fits a set, started from a model without some of its effects. Every
    /// start of the new effects is followed for a few steps, the best to its end.
    pub fn fit(&self, set: &[usize], parent: Option<&Fitted>) -> Option<Fitted> {
        let new: Vec<usize> = set
            .iter()
            .copied()
            .filter(|index| parent.is_none_or(|parent| !parent.set.contains(index)))
            .collect();
        let count = new
            .iter()
            .map(|&index| self.candidates[index].starts.len())
            .max()
            .unwrap_or(1);
        let best = if count == 1 {
            0
        } else {
            let tried = (0..count).filter_map(|start| {
                let (cost, _) = self.fit_from(set, parent, start, None, PILOT_STEPS)?;
                Some((cost, start))
            });
            tried.min_by(|a, b| a.0.total_cmp(&b.0))?.1
        };
        let (_, fitted) = self.fit_from(set, parent, best, None, SEARCH_ITERATIONS)?;
        Some(self.weighed(fitted, self.sigma(parent)))
    }

    /// Of an effect with many starts, keeps those that leave least beside one of the models, by a
    /// run each: steps from all would take long, and where most starts see nothing of the effect
    /// (outside of a cushion, say) they lead nowhere.
    pub(crate) fn keep_best_starts(&mut self, beside: &[&Fitted]) {
        let many = (0..self.candidates.len())
            .filter(|&index| self.candidates[index].starts.len() > MOST_STARTS);
        for index in many.collect::<Vec<_>>() {
            let starts = &self.candidates[index].starts;
            let best_beside = |model: &&Fitted| {
                let left = |start: usize| {
                    let begun = self.begun(&[index], model, start);
                    let values = begun.values.clone();
                    let left = self.with_values(&begun, values).energy_above(&self.noise);
                    (left, start)
                };
                let mut left: Vec<(f64, usize)> =
                    (0..starts.len()).into_par_iter().map(left).collect();
                left.sort_by(|one, other| one.0.total_cmp(&other.0));
                left.truncate(MOST_STARTS / beside.len());
                left.into_iter().map(|(_, start)| start)
            };
            let best: BTreeSet<usize> = beside.iter().flat_map(best_beside).collect();
            let kept = best.into_iter().map(|start| starts[start].clone());
            self.candidates[index].starts = kept.collect();
        }
    }

    /// A set as a fit of it begins, from a model without some of its effects.
    pub(crate) fn begun(&self, set: &[usize], parent: &Fitted, start: usize) -> Fitted {
        let begun = self.restricted(parent, set);
        let parameters = self.parameters_of(set);
        let started = self.started(parameters, &begun.names, set, Some(parent), start);
        Fitted {
            values: started.iter().map(|parameter| parameter.start).collect(),
            ..begun
        }
    }

    /// A step from each start of the new effects, and a few more from the best of them: unfinished,
    /// to rank it among others.
    pub fn ranked(&self, set: &[usize], parent: &Fitted) -> Option<Fitted> {
        self.ranked_by(set, parent, RANKING_STEPS)
    }

    /// The same with a model that is to take another number of steps.
    pub fn ranked_by(&self, set: &[usize], parent: &Fitted, steps: usize) -> Option<Fitted> {
        let new = set.iter().filter(|index| !parent.set.contains(index));
        let starts = new.map(|&index| self.candidates[index].starts.len());
        let starts = starts.max().unwrap_or(1);
        let look = |near, start, steps| self.fit_from(set, Some(near), start, None, steps);
        if starts == 1 {
            return look(parent, 0, steps).map(|(_, fitted)| fitted);
        }
        let begun = (0..starts).filter_map(|start| look(parent, start, FIRST_LOOK));
        let (_, best) = begun.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let best = Fitted {
            // Weighed as it was begun.
            mean_square: parent.mean_square.clone(),
            ..best
        };
        look(&best, 0, steps - FIRST_LOOK).map(|(_, fitted)| fitted)
    }

    /// Runs a fit from where it stands to its end.
    pub fn finished(&self, unfinished: &Fitted) -> Option<Fitted> {
        let near = Some(unfinished);
        let (_, fitted) = self.fit_from(&unfinished.set, near, 0, None, SEARCH_ITERATIONS)?;
        Some(self.weighed(fitted, self.sigma(near)))
    }

    /// The fit with its residuals weighed by what it leaves, where it was begun
    /// with much larger ones.
    pub(super) fn weighed(&self, mut fitted: Fitted, mut sigma: Vec<f64>) -> Fitted {
        for _ in 0..MOST_WEIGHINGS {
            let left = self.sigma(Some(&fitted));
            if left
                .iter()
                .zip(&sigma)
                .all(|(left, sigma)| *left > WEIGHED_ANEW * sigma)
            {
                break;
            }
            let set = fitted.set.clone();
            let again = self.fit_from(&set, Some(&fitted), 0, None, SEARCH_ITERATIONS);
            let Some((_, again)) = again else { break };
            (fitted, sigma) = (again, left);
        }
        fitted
    }

    /// The rig as given, unfitted, judged as if it left what `like` leaves: the
    /// fair start of an effect that a refit has hidden.
    pub fn as_given(&self, like: &Fitted) -> Fitted {
        let mut given = self.restricted(like, &[]);
        let starts = self.parameters_of(&[]);
        for (value, parameter) in given.values.iter_mut().zip(starts) {
            *value = parameter.start;
        }
        given
    }

    /// Fits to the end with a fold left out.
    pub(crate) fn fit_beside(&self, model: &Fitted, fold: usize) -> Option<Fitted> {
        self.fit_from(&model.set, Some(model), 0, Some(fold), SEARCH_ITERATIONS)
            .map(|(_, fitted)| fitted)
    }

    /// Fits with a fold left out, from the full fit. Returns the values.
    pub(super) fn fit_without(&self, full: &Fitted, fold: usize) -> Option<Vec<f64>> {
        let steps = if self.is_long() {
            FOLD_STEPS
        } else {
            SEARCH_ITERATIONS
        };
        self.fit_from(&full.set, Some(full), 0, Some(fold), steps)
            .map(|(_, fitted)| fitted.values)
    }

    pub(super) fn fit_from(
        &self,
        set: &[usize],
        parent: Option<&Fitted>,
        start: usize,
        left_out: Option<usize>,
        maximum_steps: usize,
    ) -> Option<(f64, Fitted)> {
        let rig = self.switched(set);
        let free = self.free(set);
        let sigma = self.sigma(parent);
        let mut problem = LawProblem {
            law: self.law,
            rig: &rig,
            tracks: self.tracks,
            free: &free,
            sigma: &sigma,
            left_out: left_out.map(|fold| (&self.folds, fold)),
            presence: parent.and_then(|parent| self.presence_in(set, parent)),
        };
        let names = problem.names();
        let parameters = self.started(problem.parameters(), &names, set, parent, start);
        let options = Options {
            maximum_iterations: SEARCH_ITERATIONS,
            maximum_steps,
            noise: NoiseVariance::Given(1.0),
            cost_tolerance: self.cost_tolerance(set),
            ..Options::default()
        };
        let fit = if self.is_fitted_in_own_noise() {
            let starts: Vec<f64> = parameters.iter().map(|one| one.start).collect();
            let mut in_own_noise = self.in_own_noise_around(set, &starts, problem)?;
            solve(&mut in_own_noise, &parameters, &options)
        } else {
            solve(&mut problem, &parameters, &options)
        };
        let fit = fit.ok()?;
        self.count_work(fit.iterations, parameters.len());
        let residuals = self.residuals(&problem, &fit.values);
        let inflation = correlation_length(&residuals).sqrt();
        let deviation = |sd: &Option<f64>| sd.map(|sd| sd * inflation);
        let mut fitted = Fitted {
            set: set.to_vec(),
            names,
            values: fit.values,
            standard_deviations: fit.standard_deviations.iter().map(deviation).collect(),
            at_bound: fit.at_bound,
            shared: shared_count(&free),
            mean_square: Vec::new(),
            presence: problem.presence.cloned(),
        };
        fitted.mean_square = self.mean_squares(&fitted, &residuals);
        Some((fit.cost, fitted))
    }

    pub(super) fn cost_tolerance(&self, set: &[usize]) -> f64 {
        if self.ends_early(set) {
            COARSE_COST_TOLERANCE
        } else if self.is_long() || self.rows() > LONG_ROWS {
            LONG_COST_TOLERANCE
        } else {
            COST_TOLERANCE
        }
    }

    /// Starts: the parent's values where it has the parameter, else the
    /// candidate's start of this number.
    pub(super) fn started(
        &self,
        mut parameters: Vec<Parameter>,
        names: &[String],
        set: &[usize],
        parent: Option<&Fitted>,
        start: usize,
    ) -> Vec<Parameter> {
        for (parameter, name) in parameters.iter_mut().zip(names) {
            let inherited = parent.and_then(|parent| parent.value(name));
            let own = set.iter().find_map(|&index| {
                let candidate = &self.candidates[index];
                let place = candidate.free.iter().position(|free| {
                    *name == free.key || name.starts_with(&format!("{} of ", free.key))
                })?;
                let point = &candidate.starts[start.min(candidate.starts.len() - 1)];
                point.get(place).copied()
            });
            if let Some(value) = inherited.or(own) {
                parameter.start = value.clamp(parameter.lower, parameter.upper);
            }
        }
        parameters
    }

    /// The same model with other values and what it leaves with them.
    pub(crate) fn with_values(&self, model: &Fitted, values: Vec<f64>) -> Fitted {
        let mut other = Fitted {
            values,
            ..model.clone()
        };
        let residuals = self.residuals_of(&other);
        other.mean_square = self.mean_squares(&other, &residuals);
        other
    }

    /// The same model with some of its effects switched off and nothing refitted.
    pub fn restricted(&self, fitted: &Fitted, set: &[usize]) -> Fitted {
        let (names, starts) = self.with_problem(set, self.tracks, None, |problem| {
            (problem.names(), problem.parameters())
        });
        let values = names.iter().zip(&starts);
        Fitted {
            set: set.to_vec(),
            values: values
                .map(|(name, parameter)| fitted.value(name).unwrap_or(parameter.start))
                .collect(),
            standard_deviations: vec![None; names.len()],
            at_bound: vec![false; names.len()],
            shared: shared_count(&self.free(set)),
            mean_square: fitted.mean_square.clone(),
            presence: self.presence_in(set, fitted).cloned(),
            names,
        }
    }
}

fn shared_count(free: &[FreeParameter]) -> usize {
    let shared = free.iter().filter(|free| free.scope == Scope::Shared);
    shared.count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::estimate::candidates;
    use crate::estimate::candidates::Candidate;
    use crate::fit::Presence;
    use crate::laws::{Law, Track, balance};
    use crate::search;
    use truth_plant::{Kind, Request, Strength};

    /// Recordings that begin with a step: a spool that is late follows the command before
    /// it for a while. Begun from the first command, a fit of either was off by 20 times
    /// the noise, and its numbers by 1 to 3 %.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_a_late_spool_begins_with_the_command_before() {
        for effect in ["spool-dynamics", "slew-limit"] {
            let (rig, recordings) = drawn::of_kind(Kind::Single, 5, Strength::Strong, effect);
            let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
            let mut bench = Bench::new(Law::Chambers, &rig, &tracks);
            let baseline = search::baseline(&bench).expect("it is fitted");
            bench.candidates = candidates::candidates(Law::Chambers, &rig, &tracks, 1.0);
            let named = |candidate: &Candidate| candidate.effect == effect;
            let set = [bench
                .candidates
                .iter()
                .position(named)
                .expect("it is tried")];
            let model = bench.fit(&set, Some(&bench.as_given(&baseline)));
            let left = model.expect("it is fitted").mean_square;
            for (left, noise) in left.iter().zip(&bench.noise) {
                assert!(*left < 1.5 * noise * noise, "{effect}: {left} of {noise}");
            }
        }
    }

    /// A strong cushion whose fit ended 3 mm too long, with a needle six times too wide (case 59 of
    /// the trial of seed 27).
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_a_cushion_is_begun_where_it_shows() {
        let (rig, recordings) =
            drawn::of_kind(Kind::Single, 1_402_017_269, Strength::Strong, "end-cushion");
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (mut bench, baseline) = drawn::chambers(&rig, &tracks);
        bench.keep_best_starts(&[&baseline]);
        let cushion = drawn::tried(&bench, "end-cushion", "chamber-a");
        assert!(bench.candidates[cushion].starts.len() <= MOST_STARTS);
        let model = bench.walked(bench.fit(&[cushion], Some(&baseline)).unwrap());
        let found = |key: &str| model.value(&format!("effects.end-cushion.{key}")).unwrap();
        assert!((found("needle_area_m2") / 1.991e-7 - 1.0).abs() < 0.02);
        assert!(
            (found("length_m") - 0.024).abs() < 3e-4,
            "{}",
            found("length_m")
        );
        assert!(bench.leaves_no_more_than_a_form(&model));
    }

    /// A force that comes while the carriage slides is in a balance by the part of its bump that
    /// lies behind. Rows of the one model or the other left 1.7 times the noise where a force
    /// of 8 N came and went, and every effect left that.
    #[test]
    fn val_a_balance_over_an_end_has_its_part_of_the_force() {
        const FORCE_N: f64 = 2.0;
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let mut candidates = bench.candidates.iter();
        let force = candidates.position(|one| one.effect == "constant-force");
        let mut model = bench.fit(&[force.unwrap()], Some(&baseline)).unwrap();
        let place = model.place("effects.constant-force.force_N").unwrap();
        model.values[place] = FORCE_N;
        let residuals = |spans_s: Vec<(f64, f64)>| {
            let mut spans = Presence::nowhere("constant-force", tracks.len());
            spans.spans_s[0] = spans_s;
            let presence = Some(spans);
            let model = Fitted {
                presence,
                ..model.clone()
            };
            bench.residuals_of(&model)[0][0].clone()
        };
        let without = residuals(Vec::new());
        let sliding = |row: &usize| without[*row - 10].is_finite() && without[*row].is_finite();
        let row = (50..without.len()).find(sliding).unwrap();
        let with = residuals(vec![(recordings[0].time_s[row], f64::INFINITY)]);
        // The integral of (1 - s^2)^3 from s on, over the whole; 21 rows are half a bump.
        let odd = |s: f64| s - s.powi(3) + 0.6 * s.powi(5) - s.powi(7) / 7.0;
        let part = |s: f64| (odd(1.0) - odd(s.clamp(-1.0, 1.0))) / (2.0 * odd(1.0));
        let mut rows = (0..without.len()).filter(|&row| without[row].is_finite());
        assert!(rows.all(|here| {
            let part = part((row as f64 - 0.5 - here as f64) / 21.0);
            ((with[here] - without[here]).abs() - FORCE_N * part).abs() < 0.01 * FORCE_N
        }));
    }

    /// 2.9 ms that the chambers had 0.2 ms off were a load on a spring to the balance of forces, which
    /// knows such a time to 10 us.
    #[test]
    fn regress_the_balance_mends_a_time_that_the_chambers_have_shown() {
        let request = Request::new(5, Kind::Single).with_noise(1.0);
        let request = request.with_effect("position-time-skew").unwrap();
        let request = request.with_strength(Strength::Medium);
        let truth_s = request.draw().truth.effects[0].parameters["delay_s"];
        let (rig, recordings) = drawn::read(&request);
        let (key, shown_s) = ("effects.position-time-skew.delay_s", truth_s + 2e-4);
        let mut rig = rig.with_values(&[(key.to_owned(), shown_s)].into());
        rig.uncertainty.insert(key.to_owned(), 2.5e-4 / shown_s);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let bench = Bench::new(Law::Balance, &rig, &tracks);
        let baseline = search::baseline(&bench).expect("it is fitted");
        let found_s = baseline.value(key).expect("it is free");
        assert!((found_s - truth_s).abs() < 2e-5, "{found_s} of {truth_s}");
    }

    /// Behind a noisy position a load with a strong damper is a noisy force. Read off
    /// that, none of the 23 break-aways of this case told anything: nothing was missed.
    #[test]
    fn regress_no_load_makes_a_break_away_silent() {
        let request = Request::new(5, Kind::Nothing).with_noise(10.0);
        let (rig, recordings) = drawn::read(&request);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(Law::Balance, &rig, &tracks);
        let rigid = search::baseline(&bench).expect("it is fitted");
        bench.candidates = candidates::candidates(Law::Balance, &rig, &tracks, 1.0);
        let is_load = |candidate: &Candidate| candidate.effect == "load-compliance";
        let load = bench.candidates.iter().position(is_load);
        let set = [load.expect("it is tried")];
        let mut loaded = bench.ranked(&set, &rigid).expect("it is fitted");
        let numbers = loaded.names.iter().zip(&mut loaded.values);
        for (name, value) in numbers {
            match name.as_str() {
                "effects.load-compliance.damping_Ns_m" => *value = 4900.0,
                "effects.load-compliance.load_mass_kg" => *value = 2.0,
                _ => {}
            }
        }
        let events = |model: &Fitted| -> usize {
            let columns = &bench.residuals_of(model)[balance::BREAKAWAY];
            let told = columns.iter().flatten().filter(|value| value.is_finite());
            told.count()
        };
        assert!(events(&rigid) >= 5);
        assert_eq!(events(&loaded), events(&rigid));
    }
}
