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

mod bank;

use super::candidates::Candidate;
use super::fitted::{Bench, Fitted};
use super::search::PLAIN_RATIO;
use crate::closed_loop::{Course, HostController, control_task, run};
use crate::fit::Prior;
use crate::fit::law_problem::{FreeParameter, LawProblem, Scope};
use crate::laws::{Law, Track, median_step_s};
use crate::motion::Motion;
use crate::plant::{Plant, PlantSettings, Seen, seen};
use crate::random::Noise;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::scenario::stroke_range_m;
use bank::{Excitation, Experiment, Place, SetUp};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Repetitions of an experiment, each way round.
const REPETITIONS: u64 = 6;
/// How many experiments are repeated at most, and the power that ends the search.
const REPEATED: usize = 3;
const SURE_POWER: f64 = 0.9;

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
pub fn find(bench: &Bench<'_>, models: [&Fitted; 2]) -> Option<NextExperiment> {
    let bank = match bench.law {
        Law::Chambers if bench.rig.valve.is_some() && bench.rig.cylinder.is_some() => {
            bank::OF_CHAMBERS
        }
        Law::Balance => bank::OF_CARRIAGE,
        _ => return None,
    };
    let rivals = Rivals { bench, models };
    let tried = bank.par_iter().filter_map(|experiment| {
        let times = rivals.both_ways(experiment, 0)?;
        Some((experiment, times))
    });
    let mut tried: Vec<(&Experiment, [f64; 2])> = tried.collect();
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
    fn both_ways(&self, experiment: &Experiment, seed: u64) -> Option<[f64; 2]> {
        Some([
            self.times(experiment, (0, 1), seed)?,
            self.times(experiment, (1, 0), seed)?,
        ])
    }

    /// The experiment again and again, with other noise and other sizes of the effect.
    fn repeated(&self, experiment: &Experiment, times: [f64; 2]) -> NextExperiment {
        let repeated: Vec<[f64; 2]> = (1..=REPETITIONS)
            .into_par_iter()
            .filter_map(|seed| self.both_ways(experiment, seed))
            .collect();
        let all = repeated.iter().flatten();
        NextExperiment {
            text: experiment.text,
            times,
            repetitions: 2 * repeated.len(),
            told: all.filter(|times| **times > 1.0 / PLAIN_RATIO).count(),
        }
    }

    /// How many times as much the other model leaves of an experiment on the true one.
    fn times(
        &self,
        experiment: &Experiment,
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
        experiment: &Experiment,
        model: &Fitted,
        recordings: &[Recording],
    ) -> Option<Vec<f64>> {
        let set_up = experiment.set_up();
        let rig = set_up.applied(&self.rig_of(model, 0));
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
        experiment: &Experiment,
        model: &Fitted,
        seed: u64,
    ) -> Option<Vec<Recording>> {
        let rig = experiment.set_up().applied(&self.rig_of(model, seed));
        let stroke_m = stroke_range_m(&rig)?;
        let place = Place::within(stroke_m);
        let step_s = median_step_s(&self.bench.tracks.first()?.recording.time_s);
        match &experiment.excitation {
            Excitation::Clamped {
                places,
                seconds,
                command,
            } => {
                let command = command(rig.value("valve.null_V")?);
                let times_s = times(*seconds, step_s);
                let driven = |share: &f64| {
                    let at_m = stroke_m[0] + share * (stroke_m[1] - stroke_m[0]);
                    let position_m = vec![at_m; times_s.len()];
                    let command_v = times_s.iter().map(|&time| command.at(time)).collect();
                    self.chambers(&rig, &times_s, position_m, command_v, seed)
                };
                places.iter().map(driven).collect()
            }
            Excitation::ByHand {
                seconds,
                frequencies_hz,
            } => {
                let times_s = times(*seconds, step_s);
                let position_m = times_s
                    .iter()
                    .map(|&time| by_hand(time, *seconds, frequencies_hz, place));
                let position_m = position_m.collect();
                let command_v = vec![rig.value("valve.null_V")?; times_s.len()];
                Some(vec![
                    self.chambers(&rig, &times_s, position_m, command_v, seed)?,
                ])
            }
            Excitation::Tracked { motion, .. } => Some(vec![tracked(&rig, &motion(place), seed)?]),
        }
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

impl Experiment {
    fn set_up(&self) -> SetUp {
        match &self.excitation {
            Excitation::Tracked { set_up, .. } => *set_up,
            Excitation::Clamped { .. } | Excitation::ByHand { .. } => SetUp::AS_IT_IS,
        }
    }
}

impl SetUp {
    /// The rig with the change, as far as it has the numbers.
    fn applied(self, rig: &Rig) -> Rig {
        let ambient_pa = rig.ambient_pressure_pa();
        let sign = if self.is_turned { -1.0 } else { 1.0 };
        let changed = |key: &str, change: &dyn Fn(f64) -> f64| {
            rig.value(key).map(|value| (key.to_owned(), change(value)))
        };
        let values = [
            changed("carriage.mass_kg", &|mass_kg| mass_kg + self.payload_kg),
            changed("carriage.external_force_N", &|force_n| sign * force_n),
            changed("effects.constant-force.force_N", &|force_n| sign * force_n),
            changed("supply.pressure_Pa", &|pressure_pa| {
                ambient_pa + self.supply * (pressure_pa - ambient_pa)
            }),
        ];
        rig.with_values(&values.into_iter().flatten().collect())
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

/// The controller, which knows the rig, moving its load; none where it trips or runs into an
/// end: an experiment that nobody would get to record.
fn tracked(rig: &Rig, motion: &Motion, seed: u64) -> Option<Recording> {
    let mut plant = Plant::new(rig, PlantSettings::at(motion.start_m(), seed)).ok()?;
    let mut drive = HostController::new(control_task(rig).ok()?);
    let course = Course::whole(motion.clone(), PlantSettings::TICK_S);
    let run = run(&mut plant, &mut drive, &course).ok()?;
    if run.first_fault().is_some() || run.end_stop.is_some() {
        return None;
    }
    let column = |value: fn(&Seen) -> f64| -> Vec<f64> {
        run.rows
            .iter()
            .map(|row| value(&seen(&row.sample.codes)))
            .collect()
    };
    let signals = [
        ("x", column(|seen| seen.position_m)),
        ("v", column(|seen| seen.velocity_m_s)),
        ("p_a", column(|seen| seen.pressure_a_pa)),
        ("p_b", column(|seen| seen.pressure_b_pa)),
        (
            "u",
            run.rows.iter().map(|row| row.truth.command_v).collect(),
        ),
    ];
    let signals = signals.map(|(name, column)| (name.to_owned(), column));
    let time_s = run.rows.iter().map(|row| row.truth.time_s).collect();
    Some(Recording::from_signals("simulated", time_s, signals.into()))
}

fn times(seconds: f64, step_s: f64) -> Vec<f64> {
    let rows = (seconds / step_s).round() as usize;
    (0..=rows).map(|row| row as f64 * step_s).collect()
}

/// Equal times at each frequency, whole periods or not: a hand does not begin anew.
fn by_hand(time_s: f64, seconds: f64, frequencies_hz: &[f64], place: Place) -> f64 {
    let each_s = seconds / frequencies_hz.len() as f64;
    let turns: f64 = frequencies_hz
        .iter()
        .enumerate()
        .map(|(number, frequency_hz)| {
            frequency_hz * (time_s - number as f64 * each_s).clamp(0.0, each_s)
        })
        .sum();
    place.middle_m + place.half_stroke_m * libm::sin(std::f64::consts::TAU * turns)
}

#[cfg(test)]
mod tests {
    use super::super::{candidates, drawn, search};
    use super::*;
    use truth_plant::{Kind, Strength};

    /// Fits two effects to a case that holds the first, and looks for what tells them apart.
    fn found(law: Law, (effect, rival): (&str, &str), strength: Strength) -> NextExperiment {
        let (rig, recordings) = drawn::of_kind(Kind::Single, 5, strength, effect);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(law, &rig, &tracks);
        let baseline = search::baseline(&bench).expect("it is fitted");
        bench.candidates = candidates::candidates(law, &rig, &tracks, 1.0);
        let model = |effect: &str| {
            let mut candidates = bench.candidates.iter();
            let place = candidates.position(|candidate| candidate.effect == effect);
            let set = [place.expect("it is tried")];
            bench.fit(&set, Some(&baseline)).expect("it is fitted")
        };
        find(&bench, [&model(effect), &model(rival)]).expect("the axis has a bank")
    }

    /// A force from outside and a friction that depends on the direction are one as good as the
    /// other however the axis is moved: only turning the drive tells them apart.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_force_is_told_from_a_friction_by_turning_the_drive() {
        let pair = ("constant-force", "direction-dependent-friction");
        let experiment = found(Law::Balance, pair, Strength::Weak);
        assert!(
            experiment.text.contains("turned end for end"),
            "{experiment:?}"
        );
        assert!(experiment.power() > 0.9, "{experiment:?}");
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_delay_is_told_from_a_late_spool_by_what_is_fast() {
        let pair = ("valve-delay", "spool-dynamics");
        let experiment = found(Law::Chambers, pair, Strength::Medium);
        assert!(experiment.text.contains("clamped"), "{experiment:?}");
        assert!(experiment.power() > 0.9, "{experiment:?}");
    }

    /// Nothing tells a model from itself.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_a_model_is_not_told_from_itself() {
        let pair = ("constant-force", "constant-force");
        let experiment = found(Law::Balance, pair, Strength::Weak);
        assert_eq!((experiment.told, experiment.times), (0, [1.0, 1.0]));
    }
}
