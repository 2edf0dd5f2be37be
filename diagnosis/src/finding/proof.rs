//! The proof: frozen models against recordings, training and held out.
//!
//! A frozen model has every shared parameter fixed. What belongs to a
//! recording (its initial states, the skew of its logger) is estimated from
//! that recording, for every model alike: a recorded initial value is one noisy
//! sample, and a model must not win by where it happened to start.

use super::{Finding, Model};
use crate::estimate::candidates::{Candidate, candidates};
use crate::estimate::fold_squares::row_squares;
use crate::estimate::leaps;
use crate::estimate::misfit::left_by_a_sound_model;
use crate::estimate::sensor_noise;
use crate::estimate::{Bench, Columns, Fitted};
use crate::fit::law_problem::{FreeParameter, LawProblem, Scope, windows};
use crate::fit::presence::{Presence, refined_each};
use crate::fit::{NoiseVariance, Options, solve};
use crate::laws::{Law, Track, View, balance};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::search::intermittent;
use crate::search::mean;
use crate::thresholds::{PLAIN_DEVIATIONS, PLAIN_RATIO, REFUTED, SURPRISING};
use rayon::prelude::*;
use std::ops::Range;

/// Onsets that are tried in a recording, evenly over it.
const ONSETS_TRIED: usize = 12;

/// A model whose shared parameters are numbers.
#[derive(Clone, Debug)]
pub struct Frozen {
    /// The rig with these numbers and effects.
    pub rig: Rig,
    /// Names of the effects whose parameters belong to a recording.
    pub own: Vec<&'static str>,
    /// The effect that is there for a part of the time; when is estimated from
    /// each recording.
    pub intermittent: Option<&'static str>,
}

/// A model run against one recording.
#[derive(Clone, Debug)]
pub struct Run {
    /// Predictions by output, running free over the recording (or, for a law
    /// that is only fitted in windows, in those).
    pub predicted: Columns,
    /// Mean squared error by output, SI.
    pub free_run: Vec<f64>,
    /// The same over the horizon, each window started from data up to it.
    pub horizon: Vec<f64>,
    /// The same by window and output.
    pub windows: Vec<Vec<f64>>,
    /// Parameters of this recording that were estimated, by name.
    pub own: Vec<(String, f64)>,
    /// When the effect that comes and goes was found in it, s.
    pub spans_s: Vec<(f64, f64)>,
}

impl Frozen {
    /// A set of effects of a bench with fitted values.
    pub fn new(bench: &Bench<'_>, model: &Fitted) -> Self {
        let own = model
            .set
            .iter()
            .map(|&index| &bench.candidates[index])
            .filter(|candidate| has_own(candidate))
            .map(|candidate| candidate.effect)
            .collect();
        Self {
            rig: bench
                .switched(&model.set)
                .with_values(&model.shared_values()),
            own,
            intermittent: model.presence.as_ref().map(|presence| presence.effect),
        }
    }

    /// The rig as it was given.
    pub fn given(rig: &Rig) -> Self {
        Self {
            rig: rig.clone(),
            own: Vec::new(),
            intermittent: None,
        }
    }

    /// Runs the model against every recording of a bench. The bench's
    /// candidates supply the parameters that belong to a recording.
    pub fn run(&self, bench: &Bench<'_>, candidates: &[Candidate]) -> Vec<Option<Run>> {
        bench
            .tracks
            .iter()
            .map(|track| self.run_one(bench, candidates, track))
            .collect()
    }

    fn run_one(
        &self,
        bench: &Bench<'_>,
        candidates: &[Candidate],
        track: &Track<'_>,
    ) -> Option<Run> {
        let free: Vec<FreeParameter> = candidates
            .iter()
            .filter(|candidate| self.own.contains(&candidate.effect))
            .flat_map(|candidate| candidate.free.iter().cloned())
            .filter(|free| free.scope == Scope::PerRecording)
            .collect();
        let tracks = std::slice::from_ref(track);
        let sigma = bench.spread();
        let presence = self
            .intermittent
            .and_then(|effect| self.seen(bench.law.searched_by(), effect, &free, tracks));
        let mut problem = LawProblem {
            law: bench.law,
            rig: &self.rig,
            tracks,
            free: &free,
            sigma: &sigma,
            left_out: None,
            presence: presence.as_ref(),
        };
        let values = own_values(&mut problem)?;
        let names = problem.names();
        let (predicted, states) = problem.predict(&values).into_iter().next()?;
        let is_told = |output: &f64| output.is_finite() || bench.law.leaves_out(*output);
        if !predicted.iter().flatten().all(is_told) {
            return None;
        }
        let recorded = problem.recorded(0);
        let free_run = mean_squares(&predicted, &recorded);
        let keys: Vec<String> = free.iter().map(|free| free.key.clone()).collect();
        let windows = self.windows(&problem, (&keys, &values), &states, &recorded);
        let (horizon, windows) = averaged(&windows, recorded.len());
        Some(Run {
            free_run,
            horizon,
            windows,
            predicted,
            own: names.into_iter().zip(values).collect(),
            spans_s: presence
                .into_iter()
                .flat_map(|one| one.spans_s)
                .flatten()
                .collect(),
        })
    }

    /// What the model misses at the break-aways of a recording, N, with the effect that comes and
    /// goes in these spans: NaN in rows without one.
    fn missed_at_break_aways(&self, track: &Track<'_>, spans_s: &[(f64, f64)]) -> Vec<f64> {
        let presence = self.intermittent.map(|effect| Presence {
            effect,
            spans_s: vec![spans_s.to_vec()],
        });
        let problem = LawProblem {
            law: Law::Balance,
            rig: &self.rig,
            tracks: std::slice::from_ref(track),
            free: &[],
            sigma: &balance::own_noise_n(0.0),
            left_out: None,
            presence: presence.as_ref(),
        };
        // A balance is to be nought.
        problem
            .predict_recording(0, &[])
            .swap_remove(balance::BREAKAWAY)
    }

    /// When an effect is there in a recording: where the model with it predicts
    /// better than the one without.
    fn seen(
        &self,
        law: Law,
        effect: &'static str,
        free: &[FreeParameter],
        tracks: &[Track<'_>],
    ) -> Option<Presence> {
        let sigma = sensor_noise::of_outputs(law, &self.rig, tracks);
        let basis = LawProblem {
            law,
            rig: &self.rig,
            tracks,
            free,
            sigma: &sigma,
            left_out: None,
            presence: None,
        };
        let squares = |presence: Option<&Presence>| {
            let mut problem = LawProblem { presence, ..basis };
            let values = own_values(&mut problem)?;
            let predicted = problem.predict_in_windows(&values, self.rig.horizon_s());
            Some(row_squares(predicted.first()?, &basis.recorded(0), &sigma))
        };
        let nowhere = Presence::nowhere(effect, tracks.len());
        let (with, without) = (squares(None)?, squares(Some(&nowhere))?);
        let gain = |_: usize, row: usize| without[row] - with[row];
        let least = intermittent::worth_two_ends(with.len());
        let seen = Presence::of_gains(effect, tracks, gain, |_| least);
        let at = |spans_s: &[(f64, f64)]| Presence {
            effect,
            spans_s: vec![spans_s.to_vec()],
        };
        let fitted = |spans_s: &[(f64, f64)]| {
            let presence = at(spans_s);
            own_values(&mut LawProblem {
                presence: Some(&presence),
                ..basis
            })
        };
        let cost = |values: &[f64], spans_s: &[(f64, f64)]| {
            let presence = at(spans_s);
            let problem = LawProblem {
                presence: Some(&presence),
                ..basis
            };
            let predicted = problem.predict_recording(0, values);
            let squares = row_squares(&predicted, &basis.recorded(0), &sigma);
            squares.iter().sum::<f64>()
        };
        let seen_or_not = [seen.spans_s, nowhere.spans_s].into_iter().flatten();
        let begun = seen_or_not.chain(self.onsets(effect, tracks));
        let tried = begun.filter_map(|spans_s| {
            let values = fitted(&spans_s)?;
            Some((cost(&values, &spans_s), spans_s, values))
        });
        let (_, begun, values) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let refined = refined_each(&begun, |spans_s| cost(&values, spans_s));
        Some(at(&refined))
    }

    /// Spans to begin from: a weak effect does not show within a window, and may come and stay; an
    /// offset of a gauge comes where the gauge leaps.
    fn onsets(&self, effect: &str, tracks: &[Track<'_>]) -> impl Iterator<Item = Vec<(f64, f64)>> {
        let time_s = &tracks[0].recording.time_s;
        let from = |part: usize| time_s[time_s.len() * part / ONSETS_TRIED];
        let stays = (0..ONSETS_TRIED).map(|part| vec![(from(part), f64::INFINITY)]);
        let leaps = if effect == leaps::OFFSET {
            leaps::of_gauges(&self.rig, tracks)
        } else {
            Vec::new()
        };
        let all: Vec<Vec<(f64, f64)>> = leaps.into_iter().flatten().chain(stays).collect();
        all.into_iter()
    }

    /// Squares and their number by output, in windows of the rig's horizon. Each window
    /// starts from the free run's states up to then, with what was measured of them put in
    /// from the rows up to then.
    fn windows(
        &self,
        problem: &LawProblem<'_>,
        (keys, own): (&[String], &[f64]),
        states: &Columns,
        recorded: &[&[f64]],
    ) -> Vec<Vec<(f64, usize)>> {
        let track = &problem.tracks[0];
        let of_window = |rows: Range<usize>| {
            let own = (keys, &own[..keys.len()]);
            let start = problem.window_start((0, rows.start), own, states, View::UpToNow);
            let first = rows.start;
            let mut sums = vec![(0.0, 0_usize); recorded.len()];
            let mut add = |row: usize, outputs: &[f64], _: &[f64]| {
                for ((sum, output), column) in sums.iter_mut().zip(outputs).zip(recorded) {
                    if row > first && output.is_finite() {
                        sum.0 += (output - column[row]).powi(2);
                        sum.1 += 1;
                    }
                }
            };
            problem.predict_rows((0, rows), own, &start, &mut add);
            sums
        };
        let windows = windows(&track.recording.time_s, self.rig.horizon_s());
        windows.into_iter().map(of_window).collect()
    }
}

/// Mean squares by output, over all windows and in each: infinite in one without a finite
/// prediction.
fn averaged(windows: &[Vec<(f64, usize)>], outputs: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mean = |(sum, count): (f64, usize)| sum / count.max(1) as f64;
    let over_all = |output: usize| {
        let sums = windows.iter().map(|window| window[output]);
        mean(sums.fold((0.0, 0), |all, one| (all.0 + one.0, all.1 + one.1)))
    };
    let in_each = |window: &Vec<(f64, usize)>| {
        let of_output = |&(sum, count): &(f64, usize)| match count {
            0 => f64::INFINITY,
            _ => mean((sum, count)),
        };
        window.iter().map(of_output).collect()
    };
    let all = (0..outputs).map(over_all).collect();
    (all, windows.iter().map(in_each).collect())
}

/// What held-out recordings say of what was put into a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Said {
    /// Nothing against it.
    Nothing,
    /// They are predicted worse with it, by so few windows that this says nothing either.
    WorseByChance,
    /// They are predicted worse with it.
    Worse,
}

/// What held-out recordings say of what was put into a law. Where the signal hangs on chance (a
/// carriage that sticks, a load in its play) a few windows are most of the squares: a model that
/// is plainly better in the typical window (or as good, where it need not be better) is not
/// refuted by those, nor are effects by what the windows vary by. (A rise of the stiction by 39 N
/// took the break-aways of four recordings from 2.4 times their noise down to it; in a fifth the
/// carriage left within 0.2 N of its stiction, once.) `sound` is what a sound model leaves of
/// each output beside the noise, mean squares, SI.
pub(crate) fn said(law: &Finding, sound: &[f64], held_out: &[Recording]) -> Said {
    let is_typical = || typical_ratio(law).is_some_and(|ratio| ratio < refuting(law));
    if law.improved.set.is_empty() || hangs_on_chance(law) && is_typical() {
        return Said::Nothing;
    }
    // A table, and moments that were chosen, are to be borne out: by break-aways, if these alone show it.
    let is_to_be_borne_out =
        law.term.is_some() || law.improved.presence.is_some() && !law.is_of_rests();
    let deviations = match worse_by(law) {
        Some(deviations) if hangs_on_chance(law) && !is_to_be_borne_out => deviations,
        _ if refutes(law, sound, held_out) => return Said::Worse,
        _ => return Said::Nothing,
    };
    // Recordings that were not given say nothing.
    let over_horizon = ratio(law, |run| &run.horizon, held_out);
    if over_horizon.is_none_or(|ratio| ratio <= REFUTED) {
        Said::Nothing
    } else if deviations < PLAIN_DEVIATIONS {
        Said::WorseByChance
    } else {
        Said::Worse
    }
}

/// Whether held-out recordings are predicted worse with what was put into a law than without:
/// by all of its signals together, each in units of its noise and at least that, and over the
/// horizon and in the free run on balance. A slow effect shows in the free run alone, and over
/// the horizon a skew of one file drowns it. Where a signal does not hang on chance, no single
/// one may be predicted worse either, by a table not even over the horizon alone: what is missing
/// does not make a prediction worse.
fn refutes(law: &Finding, sound: &[f64], held_out: &[Recording]) -> bool {
    let does_harm = || {
        worsens_on_balance(law, sound, held_out)
            || law.term.is_some() && worsens_a_signal(law, held_out)
    };
    if !hangs_on_chance(law) && does_harm() {
        return true;
    }
    let horizon = ratio(law, |run| &run.horizon, held_out);
    let free_run = ratio(law, |run| &run.free_run, held_out);
    match (horizon, free_run) {
        (Some(horizon), Some(free_run)) => horizon * free_run > REFUTED.powi(2),
        // A model that cannot be run is none; recordings that were not given refute nothing.
        _ => !held_out.is_empty(),
    }
}

/// Error of the improved model over that of the refitted one, all signals together.
fn ratio(law: &Finding, squares: Squares, held_out: &[Recording]) -> Option<f64> {
    let total = |model| Some(energies(law, model, squares, held_out)?.iter().sum::<f64>());
    Some((total(Model::Improved)? / total(Model::Refitted)?).sqrt())
}

/// The error in the typical window, over that of the refitted model, below which a few others
/// refute nothing. An effect in the place of a strayed number predicts what the number did.
fn refuting(law: &Finding) -> f64 {
    let accepted = law.evidence.iter().filter(|evidence| evidence.accepted);
    let mut found_otherwise = accepted.clone().filter(|evidence| !evidence.is_of_strayed);
    if accepted.count() > 0 && found_otherwise.next().is_none() {
        REFUTED
    } else {
        PLAIN_RATIO
    }
}

/// Whether some signal alone is predicted worse, over the horizon and in the free run on balance:
/// beyond what a sound model leaves of it, within which two models are told apart by where their
/// nearly known numbers came to rest. (A throttle at one chamber took 54 kPa down to the noise there
/// and was refuted by the other's, 0.43 kPa instead of 0.39.)
fn worsens_on_balance(law: &Finding, sound: &[f64], held_out: &[Recording]) -> bool {
    let worse = |squares: Squares| -> Option<Vec<(f64, bool)>> {
        let left = energies(law, Model::Improved, squares, held_out)?.into_iter();
        let told = left.zip(sound.iter().zip(&law.floor));
        let told = told.map(|(left, (sound, floor))| left > 1.0 + sound / floor.powi(2));
        let ratios = ratios(law, squares, held_out)?;
        Some(ratios.into_iter().zip(told).collect())
    };
    let both = worse(|run| &run.horizon).zip(worse(|run| &run.free_run));
    both.is_some_and(|(horizon, free_run)| {
        let mut signals = horizon.iter().zip(&free_run);
        signals.any(|(horizon, free_run)| {
            (horizon.1 || free_run.1) && horizon.0 * free_run.0 > REFUTED.powi(4)
        })
    })
}

/// Whether held-out recordings show some signal to be predicted worse over the horizon with
/// what was put into a law than without.
pub(crate) fn worsens_a_signal(law: &Finding, held_out: &[Recording]) -> bool {
    let ratios = ratios(law, |run| &run.horizon, held_out);
    ratios.is_some_and(|ratios| ratios.iter().any(|ratio| *ratio > REFUTED.powi(2)))
}

/// Part of the energy that the refitted model misses of held-out recordings, above the noise and
/// in its units, that the improved one explains: over the horizon or in the free run, whichever is
/// more. `None` where nothing is missed plainly.
pub(crate) fn explained(law: &Finding, held_out: &[Recording]) -> Option<f64> {
    let of = |squares: Squares| {
        let missed = energies(law, Model::Refitted, squares, held_out)?;
        let left = energies(law, Model::Improved, squares, held_out)?;
        let is_missed = missed.iter().any(|energy| *energy > SURPRISING.powi(2));
        let above = |energies: &[f64]| energies.iter().map(|energy| energy - 1.0).sum::<f64>();
        is_missed.then(|| 1.0 - above(&left) / above(&missed))
    };
    let shares = [of(|run| &run.horizon), of(|run| &run.free_run)];
    shares.into_iter().flatten().reduce(f64::max)
}

/// The same of the break-aways of held-out recordings, for an effect that they alone show: in how
/// long a carriage sticks it hangs on chance. They are known to what the improved model leaves of
/// those of the training recordings, as that is what it says of them.
pub(crate) fn explained_at_break_aways(law: &Finding, tracks: &[Track<'_>]) -> Option<f64> {
    let missed_n = |model: Model| {
        let runs = law.held_out[model as usize].iter().zip(tracks);
        let of_run = |(run, track): (&Option<Run>, &Track<'_>)| {
            let spans_s = run.as_ref().map_or(&[][..], |run| &run.spans_s);
            law.frozen[model as usize].missed_at_break_aways(track, spans_s)
        };
        runs.flat_map(of_run).collect::<Vec<f64>>()
    };
    let left = law.break_aways.iter().map(|event| event.improved_n.powi(2));
    let left_n = mean(&left.collect::<Vec<f64>>()).sqrt();
    let noise_n = law.noise[balance::BREAKAWAY].min(left_n);
    let pairs = missed_n(Model::Refitted)
        .into_iter()
        .zip(missed_n(Model::Improved));
    let told = pairs.filter(|(refitted_n, improved_n)| (refitted_n + improved_n).is_finite());
    let energies = told.map(|(refitted_n, improved_n)| {
        [refitted_n, improved_n].map(|missed_n| (missed_n / noise_n).powi(2) - 1.0)
    });
    let energies: Vec<[f64; 2]> = energies.collect();
    let above = |model: usize| energies.iter().map(|of| of[model]).sum::<f64>();
    let plainly = (SURPRISING.powi(2) - 1.0) * energies.len() as f64;
    (above(0) > plainly).then(|| 1.0 - above(1) / above(0))
}

/// Whether held-out recordings are predicted worse with what was put into a law than without, over
/// the horizon or in the free run.
pub(crate) fn is_worse(law: &Finding, held_out: &[Recording]) -> bool {
    let squares: [Squares; 2] = [|run| &run.horizon, |run| &run.free_run];
    let ratios = squares.map(|squares| ratio(law, squares, held_out));
    ratios.into_iter().flatten().any(|ratio| ratio > REFUTED)
}

/// Whether held-out recordings show that something is missing where the training recordings
/// are explained: what they alone excite, beyond what a sound model leaves. Not asked of a law
/// whose shown signal hangs on chance (a carriage that sticks).
pub(crate) fn surprises(
    law: &Finding,
    rig: &Rig,
    tracks: &[Track<'_>],
    held_out: &[Recording],
) -> bool {
    if law.missed || hangs_on_chance(law) {
        return false;
    }
    let runs = &law.held_out[Model::Improved as usize];
    is_beyond_sound(law, rig, tracks, (runs, held_out))
}

/// Whether numbers that the training recordings leave open explain what the held-out ones surprise
/// by: refitted to all of them, the same model leaves of these no more than a sound one does.
pub(crate) fn is_of_open_numbers(
    law: &Finding,
    rig: &Rig,
    tracks: &[Track<'_>],
    (train, held_out): (&[Recording], &[Recording]),
) -> bool {
    let all: Vec<Track<'_>> = train.iter().chain(held_out).map(Track::new).collect();
    let mut bench = Bench::new(law.law, rig, &all);
    bench.noise.clone_from(&law.noise);
    bench.candidates.clone_from(&law.candidates);
    let Some(fitted) = bench.fit(&law.improved.set, None) else {
        return false;
    };
    let own = candidates(law.law, rig, tracks, 1.0);
    let runs = Frozen::new(&bench, &fitted).run(&Bench::new(law.law, rig, tracks), &own);
    !is_beyond_sound(law, rig, tracks, (&runs, held_out))
}

/// Whether runs leave more of the held-out recordings than a sound model does.
fn is_beyond_sound(
    law: &Finding,
    rig: &Rig,
    tracks: &[Track<'_>],
    (runs, held_out): (&[Option<Run>], &[Recording]),
) -> bool {
    let Some(energies) = energies_of(runs, &law.floor, |run| &run.free_run, held_out) else {
        return false;
    };
    let sound = left_by_a_sound_model(law.law, rig, tracks).into_iter();
    let sound = sound
        .zip(&law.floor)
        .map(|(left, floor)| left / floor.powi(2));
    let mut outputs = energies.into_iter().zip(sound);
    outputs.any(|(energy, sound)| energy > SURPRISING.powi(2) + sound)
}

/// Whether the signal that a law is shown by is not the one that it is searched by, because
/// small causes have large effects in it.
fn hangs_on_chance(law: &Finding) -> bool {
    law.law.searched_by() != law.law
}

/// Error of the improved model over that of the refitted one in the typical window of the
/// held-out recordings: in the geometric mean, above the noise.
fn typical_ratio(law: &Finding) -> Option<f64> {
    let pairs = energies_of_windows(law)?.into_iter().flatten();
    let logs: Vec<f64> = pairs
        .map(|[mine, theirs]| ((mine + 1.0) / (theirs + 1.0)).ln())
        .collect();
    Some((0.5 * mean(&logs)).exp())
}

/// What the improved and the refitted model leave of each output in each window of the held-out
/// recordings, in units of the noise.
fn energies_of_windows(law: &Finding) -> Option<Vec<Vec<[f64; 2]>>> {
    let improved = held_out_windows(law, Model::Improved)?;
    let refitted = held_out_windows(law, Model::Refitted)?;
    let of_window = |(mine, theirs): (&Vec<f64>, &Vec<f64>)| {
        let outputs = mine.iter().zip(theirs).zip(&law.floor);
        let pairs =
            outputs.map(|((mine, theirs), floor)| [mine, theirs].map(|e| e / floor.powi(2)));
        pairs.collect()
    };
    Some(improved.into_iter().zip(refitted).map(of_window).collect())
}

/// By how much the windows of the held-out recordings are predicted worse by the improved model,
/// in standard deviations of their sum as they vary among themselves.
fn worse_by(law: &Finding) -> Option<f64> {
    let windows = energies_of_windows(law)?.into_iter();
    let worse = windows.map(|window| window.iter().map(|[mine, theirs]| mine - theirs).sum());
    Some(deviations_of_sum(&worse.collect::<Vec<f64>>()))
}

/// A sum in standard deviations of it: nought of nothing.
fn deviations_of_sum(terms: &[f64]) -> f64 {
    let sum: f64 = terms.iter().sum();
    let mean = sum / terms.len().max(1) as f64;
    let spread = terms.iter().map(|term| (term - mean).powi(2)).sum::<f64>();
    sum / spread.sqrt().max(f64::MIN_POSITIVE)
}

/// Mean squares by output of each window of the held-out recordings.
fn held_out_windows(law: &Finding, model: Model) -> Option<Vec<&Vec<f64>>> {
    let runs = law.held_out.get(model as usize)?.iter();
    let runs: Option<Vec<&Run>> = runs.map(Option::as_ref).collect();
    Some(runs?.into_iter().flat_map(|run| &run.windows).collect())
}

/// Where a signal hangs on chance, in how few windows of the held-out recordings most of what the
/// improved model leaves of it is, and of how many.
pub(crate) fn windows_of_most(law: &Finding, output: usize) -> Option<(usize, usize)> {
    if !hangs_on_chance(law) {
        return None;
    }
    let windows = held_out_windows(law, Model::Improved)?;
    let squares: Vec<f64> = windows.iter().map(|window| window[output]).collect();
    Some((fewest(&squares), squares.len()))
}

/// How many of so many squares make nine tenths of their sum, at the least.
fn fewest(squares: &[f64]) -> usize {
    const MOST: f64 = 0.9;
    let mut falling = squares.to_vec();
    falling.sort_by(|a, b| b.total_cmp(a));
    let most = MOST * falling.iter().sum::<f64>();
    let mut before = 0.0;
    let is_needed = |square: &&f64| {
        let is_needed = before < most;
        before += **square;
        is_needed
    };
    falling.iter().take_while(is_needed).count()
}

/// Mean squares of a run, by output.
type Squares = fn(&Run) -> &Vec<f64>;

/// What a model leaves of each output of the held-out recordings: mean squares in units of the
/// noise, and at least that.
fn energies(
    law: &Finding,
    model: Model,
    squares: Squares,
    held_out: &[Recording],
) -> Option<Vec<f64>> {
    let runs = law.held_out.get(model as usize)?;
    energies_of(runs, &law.floor, squares, held_out)
}

/// The same of runs.
fn energies_of(
    runs: &[Option<Run>],
    floor: &[f64],
    squares: Squares,
    held_out: &[Recording],
) -> Option<Vec<f64>> {
    let of_output = |(output, floor): (usize, &f64)| {
        let error = pooled(runs, held_out, |run| squares(run)[output])?;
        Some((error / floor).powi(2).max(1.0))
    };
    floor.iter().enumerate().map(of_output).collect()
}

/// What the improved model leaves of each output over what the refitted one leaves.
fn ratios(law: &Finding, squares: Squares, held_out: &[Recording]) -> Option<Vec<f64>> {
    let of = |model| energies(law, model, squares, held_out);
    let pairs = of(Model::Improved)?.into_iter().zip(of(Model::Refitted)?);
    Some(pairs.map(|(mine, theirs)| mine / theirs).collect())
}

/// Root of the mean over recordings, weighted by their rows.
pub(crate) fn pooled(
    runs: &[Option<Run>],
    recordings: &[Recording],
    square: impl Fn(&Run) -> f64,
) -> Option<f64> {
    let (mut sum, mut rows) = (0.0, 0.0);
    for (run, recording) in runs.iter().zip(recordings) {
        let weight = recording.len() as f64;
        sum += weight * run.as_ref().map(&square)?;
        rows += weight;
    }
    (rows > 0.0).then(|| (sum / rows).sqrt())
}

fn has_own(candidate: &Candidate) -> bool {
    candidate
        .free
        .iter()
        .any(|free| free.scope == Scope::PerRecording)
}

/// Estimates what belongs to the recording: twice, the second time with the
/// residual's own size as the weight against the priors.
fn own_values(problem: &mut LawProblem<'_>) -> Option<Vec<f64>> {
    let mut parameters = problem.parameters();
    if parameters.is_empty() {
        return Some(Vec::new());
    }
    let options = Options {
        noise: NoiseVariance::Given(1.0),
        maximum_iterations: 40,
        cost_tolerance: 1e-6,
        ..Options::default()
    };
    let first = solve(problem, &parameters, &options).ok()?;
    for (parameter, value) in parameters.iter_mut().zip(&first.values) {
        parameter.start = *value;
    }
    let predicted = problem.predict(&first.values);
    let squares = mean_squares(&predicted[0].0, &problem.recorded(0));
    let sigma: Vec<f64> = squares
        .iter()
        .map(|square| square.sqrt().max(1e-12))
        .collect();
    let mut second = LawProblem {
        sigma: &sigma,
        ..*problem
    };
    Some(solve(&mut second, &parameters, &options).ok()?.values)
}

fn mean_squares(predicted: &Columns, recorded: &[&[f64]]) -> Vec<f64> {
    predicted
        .iter()
        .zip(recorded)
        .map(|(column, seen)| {
            let squares = column.iter().zip(*seen).map(|(p, r)| (p - r).powi(2));
            let (sum, count) = squares
                .filter(|square| square.is_finite())
                .fold((0.0, 0_usize), |(sum, count), square| {
                    (sum + square, count + 1)
                });
            sum / count.max(1) as f64
        })
        .collect()
}

/// Every frozen model against every recording.
pub(crate) fn runs(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    frozen: &[Frozen],
) -> Vec<Vec<Option<Run>>> {
    let bench = Bench::new(law, rig, tracks);
    let own = candidates(law, rig, tracks, 1.0);
    let run = |model: &Frozen| model.run(&bench, &own);
    frozen.par_iter().map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_single_window_is_one_deviation_and_many_are_more() {
        let mut terms = vec![0.0; 48];
        assert!(deviations_of_sum(&terms).abs() < 1e-12);
        terms[7] = 100.0;
        assert!((deviations_of_sum(&terms) - 1.0).abs() < 0.02);
        terms[20..24].fill(100.0);
        assert!(deviations_of_sum(&terms) > PLAIN_DEVIATIONS);
        assert!(deviations_of_sum(&[]).abs() < 1e-12);
    }

    #[test]
    fn prop_the_fewest_are_the_largest() {
        assert_eq!(fewest(&[1.0, 88.0, 1.0, 3.0, 7.0]), 2);
        assert_eq!(fewest(&[1.0; 10]), 9);
        assert_eq!(fewest(&[0.0, 5.0]), 1);
        assert_eq!(fewest(&[]), 0);
    }
}
