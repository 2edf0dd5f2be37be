//! What to record next: safe experiments simulated with two fits that the recordings at hand
//! cannot tell apart.
//!
//! Each experiment of the `bank` is recorded in simulation from either model, with the noise
//! that the rig declares. Then both models are fitted to it, begun from where they stand, with
//! what the present recordings say of every number as its prior. They are told apart where the
//! other model leaves plainly more than the one it was recorded from: the same rule by which
//! rivals are found (`search::PLAIN_RATIO`), with what either leaves of the recordings at hand
//! counted in, so that a model whose form is a little wrong does not promise too much.
//!
//! The experiment that tells best the less favourable way round is repeated with
//! other noise and other sizes of the effect, drawn from its deviations: the part of these that
//! is told apart is the expected power. What tells well once may do so by chance: where the
//! repetitions are not told, the next best are repeated too, and the most powerful is chosen.
//!
//! Limits: deviations are taken without their correlations, which leaves the rival more room
//! than it has and makes the power a cautious one. Only whole axes have a bank.

use crate::estimate::candidates::Candidate;
use crate::estimate::{Bench, Fitted};
use crate::fit::Prior;
use crate::fit::law_problem::{FreeParameter, LawProblem, Scope};
use crate::laws::{Law, Track, median_step_s};
use crate::random::Noise;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::thresholds::PLAIN_RATIO;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Repetitions of an experiment, each way round.
const REPETITIONS: u64 = 6;
/// How many experiments are repeated at most, and the power that ends the search.
const REPEATED: usize = 3;
const SURE_POWER: f64 = 0.9;

/// The experiments that an axis can make, of each law.
pub trait Bank: Sync {
    /// Those that may tell two models of a law apart.
    fn of(&self, law: Law) -> &[Box<dyn Experiment>];
}

/// A safe recording that anybody with such an axis can make.
pub trait Experiment: Send + Sync {
    /// What to do: a sentence without its full stop.
    fn text(&self) -> &'static str;

    /// The rig with what the experiment changes about it, as far as it has the numbers.
    fn set_up(&self, rig: &Rig) -> Rig;

    /// What a rig, already set up, would record every `step_s`. None where it lacks a number
    /// that the experiment needs, and where nobody would get to record it: the axis trips, or
    /// runs into an end.
    fn recorded(&self, rig: &Rig, step_s: f64, seed: u64) -> Option<Vec<Recorded>>;
}

/// A recording of an experiment.
pub enum Recorded {
    /// Every signal.
    Whole(Recording),
    /// Piston and command are given; the chambers answer.
    Driven {
        /// s.
        time_s: Vec<f64>,
        /// Of the piston, m.
        position_m: Vec<f64>,
        /// Of the valve, V.
        command_v: Vec<f64>,
    },
}

/// No experiments.
impl Bank for () {
    fn of(&self, _: Law) -> &[Box<dyn Experiment>] {
        &[]
    }
}

/// The experiment that tells two models apart best.
#[derive(Clone, Debug, PartialEq)]
pub struct NextExperiment {
    /// What to record: a sentence without its full stop.
    pub text: &'static str,
    /// How many times as much the second model leaves where the first is true, and the
    /// other way round (root mean squares).
    pub times: [f64; 2],
    /// Simulated repetitions.
    pub repetitions: usize,
    /// How many of them tell the two apart.
    pub told: usize,
}

/// Looks for the experiment that tells `models` apart best. None where no experiment of the
/// bank can be simulated with this rig.
pub fn find(bank: &dyn Bank, bench: &Bench<'_>, models: [&Fitted; 2]) -> Option<NextExperiment> {
    let rivals = Rivals { bench, models };
    let tried = bank.of(bench.law).par_iter().filter_map(|experiment| {
        let experiment = experiment.as_ref();
        let times = rivals.both_ways(experiment, 0)?;
        Some((experiment, times))
    });
    let mut tried: Vec<(&dyn Experiment, [f64; 2])> = tried.collect();
    let worse = |times: &[f64; 2]| times[0].min(times[1]);
    tried.sort_by(|a, b| worse(&b.1).total_cmp(&worse(&a.1)));
    let mut best: Option<NextExperiment> = None;
    for (experiment, times) in tried.into_iter().take(REPEATED) {
        let repeated = rivals.repeated(experiment, times);
        if best
            .as_ref()
            .is_none_or(|best| repeated.power() > best.power())
        {
            best = Some(repeated);
        }
        if best.as_ref().is_some_and(|best| best.power() > SURE_POWER) {
            break;
        }
    }
    best
}

impl NextExperiment {
    /// Part of the repetitions that tell the models apart.
    pub fn power(&self) -> f64 {
        self.told as f64 / self.repetitions.max(1) as f64
    }
}

/// Two models of one law that explain the same recordings.
struct Rivals<'a> {
    bench: &'a Bench<'a>,
    models: [&'a Fitted; 2],
}

impl Rivals<'_> {
    /// How many times as much the other model leaves, with either as the truth.
    fn both_ways(&self, experiment: &dyn Experiment, seed: u64) -> Option<[f64; 2]> {
        Some([
            self.times(experiment, (0, 1), seed)?,
            self.times(experiment, (1, 0), seed)?,
        ])
    }

    /// The experiment again and again, with other noise and other sizes of the effect.
    fn repeated(&self, experiment: &dyn Experiment, times: [f64; 2]) -> NextExperiment {
        let repeated: Vec<[f64; 2]> = (1..=REPETITIONS)
            .into_par_iter()
            .filter_map(|seed| self.both_ways(experiment, seed))
            .collect();
        let all = repeated.iter().flatten();
        NextExperiment {
            text: experiment.text(),
            times,
            repetitions: 2 * repeated.len(),
            told: all.filter(|times| **times > 1.0 / PLAIN_RATIO).count(),
        }
    }

    /// How many times as much the other model leaves of an experiment on the true one.
    fn times(
        &self,
        experiment: &dyn Experiment,
        (truth, other): (usize, usize),
        seed: u64,
    ) -> Option<f64> {
        let recordings = self.recorded(experiment, self.models[truth], seed)?;
        let left = |model: usize| self.left(experiment, self.models[model], &recordings);
        let (truth, other) = (left(truth)?, left(other)?);
        let times = other.iter().zip(&truth).map(|(other, truth)| other / truth);
        Some(times.fold(0.0, f64::max).sqrt())
    }

    /// What a model leaves of each output of new recordings once fitted to them, squared, in
    /// units of the noise and at least that. Counted in is what the models leave of the present
    /// recordings, and how far the model had to go from what those say.
    fn left(
        &self,
        experiment: &dyn Experiment,
        model: &Fitted,
        recordings: &[Recording],
    ) -> Option<Vec<f64>> {
        let rig = experiment.set_up(&self.rig_of(model, 0));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(self.bench.law, &rig, &tracks);
        let known = |free: &FreeParameter| self.known(free, model, &rig);
        bench.ordinary = self.bench.ordinary.iter().map(known).collect();
        bench.candidates = self.bench.candidates.clone();
        for candidate in &mut bench.candidates {
            candidate.free = candidate.free.iter().map(known).collect();
        }
        bench.noise.clone_from(&self.bench.noise);
        let unnamed = Fitted {
            names: Vec::new(),
            values: Vec::new(),
            presence: None,
            ..model.clone()
        };
        let begun = bench.restricted(&unnamed, &model.set);
        let fitted = bench.finished(&begun)?;
        let rows: usize = recordings.iter().map(Recording::len).sum();
        let contradiction = bench.contradiction(&fitted) / rows.max(1) as f64;
        let outputs = fitted.mean_square.iter().zip(self.form_error());
        let left = |((left, form), noise): ((&f64, f64), &f64)| {
            (left.max(noise.powi(2)) + form) / noise.powi(2) + contradiction
        };
        Some(outputs.zip(&bench.noise).map(left).collect())
    }

    /// What the better model leaves above the noise of each output, squared.
    fn form_error(&self) -> Vec<f64> {
        let [one, other] = self.models.map(|model| model.mean_square.iter());
        one.zip(other)
            .zip(&self.bench.noise)
            .map(|((one, other), noise)| (one.min(*other) - noise.powi(2)).max(0.0))
            .collect()
    }

    /// A parameter with what the present recordings say of it.
    fn known(&self, free: &FreeParameter, model: &Fitted, rig: &Rig) -> FreeParameter {
        let mut known = free.clone();
        let (Some(place), Scope::Shared) = (model.place(&free.key), free.scope) else {
            return known;
        };
        let here = rig.value(&free.key).unwrap_or(model.values[place]);
        let parameter = &mut known.parameter;
        let shift = here - model.values[place];
        parameter.start = here;
        parameter.lower = parameter.lower.min(here);
        parameter.upper = parameter.upper.max(here);
        parameter.prior = match (model.standard_deviations[place], parameter.prior) {
            (Some(standard_deviation), _) => Some(Prior {
                mean: here,
                standard_deviation,
            }),
            (None, Some(prior)) => Some(Prior {
                mean: prior.mean + shift,
                ..prior
            }),
            (None, None) => None,
        };
        known
    }

    /// The rig that a model says there is; with a seed, one with other sizes of its effects
    /// that the present recordings allow.
    fn rig_of(&self, model: &Fitted, seed: u64) -> Rig {
        let mut values = model.shared_values();
        if seed > 0 {
            let mut noise = Noise::new(seed, 0);
            for candidate in model.set.iter().map(|&index| &self.bench.candidates[index]) {
                draw(candidate, model, &mut values, &mut noise);
            }
        }
        self.bench.switched(&model.set).with_values(&values)
    }

    /// The experiment as the rig of a model would record it.
    fn recorded(
        &self,
        experiment: &dyn Experiment,
        model: &Fitted,
        seed: u64,
    ) -> Option<Vec<Recording>> {
        let rig = experiment.set_up(&self.rig_of(model, seed));
        let step_s = median_step_s(&self.bench.tracks.first()?.recording.time_s);
        let recorded = experiment.recorded(&rig, step_s, seed)?;
        let whole = |one: Recorded| match one {
            Recorded::Whole(recording) => Some(recording),
            Recorded::Driven {
                time_s,
                position_m,
                command_v,
            } => self.chambers(&rig, &time_s, position_m, command_v, seed),
        };
        recorded.into_iter().map(whole).collect()
    }

    /// What the chambers' sensors would show of a position and a command.
    fn chambers(
        &self,
        rig: &Rig,
        times_s: &[f64],
        position_m: Vec<f64>,
        command_v: Vec<f64>,
        seed: u64,
    ) -> Option<Recording> {
        let law = self.bench.law;
        let recorded = |name: &str| {
            let mut tracks = self.bench.tracks.iter();
            tracks.all(|track| track.recording.signal(name).is_some())
        };
        // Until they are predicted the pressures are what they are where nothing flows.
        let still = |name: &str| {
            let supply_pa = rig.value("supply.pressure_Pa").unwrap_or_default();
            let pressure_pa = if name == "p_s" {
                supply_pa
            } else {
                0.7 * supply_pa
            };
            (name.to_owned(), vec![pressure_pa; times_s.len()])
        };
        let pressures = ["p_a", "p_b", "p_s"]
            .into_iter()
            .filter(|name| recorded(name));
        let mut signals: BTreeMap<String, Vec<f64>> = pressures.map(still).collect();
        signals.insert("x".into(), position_m);
        signals.insert("u".into(), command_v);
        let mut recording = Recording::from_signals("simulated", times_s.to_vec(), signals);
        let predicted = {
            let tracks = [Track::new(&recording)];
            let sigma = vec![1.0; law.outputs(rig).len()];
            let problem = LawProblem {
                law,
                rig,
                tracks: &tracks,
                free: &[],
                sigma: &sigma,
                left_out: None,
                presence: None,
            };
            let starts: Vec<f64> = problem
                .parameters()
                .iter()
                .map(|state| state.start)
                .collect();
            problem.predict_recording(0, &starts)
        };
        for (stream, (output, column)) in law.outputs(rig).iter().zip(predicted).enumerate() {
            let mut noise = Noise::new(seed, 1 + stream as u64);
            let sensed = |value: f64| value + self.bench.noise[stream] * noise.normal();
            let column: Vec<f64> = column.into_iter().map(sensed).collect();
            if column.iter().any(|value| !value.is_finite()) {
                return None;
            }
            recording.signals.insert(output.signal.into(), column);
        }
        Some(recording)
    }
}

/// Other sizes of an effect, within its deviations and bounds.
fn draw(
    candidate: &Candidate,
    model: &Fitted,
    values: &mut BTreeMap<String, f64>,
    noise: &mut Noise,
) {
    for free in &candidate.free {
        let Some(place) = model.place(&free.key) else {
            continue;
        };
        let deviation = model.standard_deviations[place].unwrap_or(0.0);
        let drawn = model.values[place] + deviation * noise.normal();
        let (lower, upper) = (free.parameter.lower, free.parameter.upper);
        values.insert(free.key.clone(), drawn.max(lower).min(upper));
    }
}
