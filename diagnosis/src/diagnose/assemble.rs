//! From the diagnosis of each law to one verdict and one improved rig.

use super::candidates::{Candidate, TIMES_OF_SENSORS};
use super::equation::{Equation, Term};
use super::fitted::Fitted;
use super::proof::{self, Run, pooled};
use super::search::Evidence;
use super::unknown_term::Stand;
use super::verdict::{
    Effect, Estimate, Figures, Fit, FitFigures, Kind, Located, Parameter, Ranked, SaidEquation,
    UnknownTerm, Verdict,
};
use super::words::{self, Size};
use super::{LawDiagnosis, Model, Refuted, knowability, locate, shown, unknown_term};
use crate::fit::Presence;
use crate::inspect::Fault;
use crate::laws::Output;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::signals::Reading;
use crate::text::rounded;
use std::collections::BTreeMap;

/// An improved model that explains less than this of the energy of what was
/// missing leaves the verdict at unknown. Effects that are there were seen to
/// explain 73 % (play, whose blows fall at random) to all of it, others in the
/// place of effects of no list up to 55 %; chosen between.
const EXPLAINED: f64 = 0.65;

/// What commands between the rows would leave, over what is missed, that a reader is told of:
/// with half to four fifths of the commands left out it came to 0.6 to 8 times.
const LOST_COMMANDS: std::ops::Range<f64> = 0.3..10.0;

/// The rig with refitted parameters and named effects. What belongs to one
/// recording (a logger's skew) is no part of a rig.
pub fn improved_rig(rig: &Rig, laws: &[LawDiagnosis]) -> Rig {
    let mut improved = rig.clone();
    for law in laws {
        let model = law.for_the_rig();
        for &index in &model.set {
            for (key, value) in &law.candidates[index].switches {
                // Keys of effects always have a place.
                let _ = improved.set_value(key, *value);
            }
        }
        let mut fitted = model.shared_values();
        // A time between signals is there where the law that showed it has not taken it back.
        fitted.retain(|key, _| {
            !TIMES_OF_SENSORS.contains(&key.as_str()) || improved.value(key).is_some()
        });
        fitted
            .values_mut()
            .for_each(|value| *value = rounded(*value));
        improved = improved.with_values(&fitted);
    }
    improved
}

/// Puts the verdict together.
pub fn verdict(
    rig: &Rig,
    laws: &[LawDiagnosis],
    velocity: Option<&locate::Located>,
    faults: &[(String, Fault)],
    train: &[Recording],
    held_out: &[Recording],
) -> Verdict {
    let effects = effects(laws);
    let alternatives = alternatives(laws);
    // No law uses the velocity: beside something that is missed it is a remark.
    let (unknown_term, aside) = match unknown_term(laws) {
        None if effects.is_empty() => (velocity.and_then(term_of_velocity), None),
        of_laws => (of_laws, velocity),
    };
    let fit = fit(rig, laws, train, held_out);
    let refuted = laws.iter().any(is_refuted);
    // What is named in one law stays named, whatever else is missing in another.
    let unsolved = (refuted || unknown_term.is_some()) && !laws.iter().any(is_solved);
    let kind = kind(laws, faults, &alternatives, unsolved);
    let located = located(laws, velocity, train);
    let mut sentence = sentence(kind, laws, faults, unknown_term.as_ref(), &alternatives);
    if let (Kind::Named | Kind::Ambiguous, Some(term)) = (kind, &unknown_term) {
        sentence = format!("{sentence} {}", beside_sentence(term));
    }
    let mut notes = notes(rig, laws, &fit, train);
    notes.extend(aside.map(velocity_note));
    Verdict {
        format: "verdict/1",
        verdict: kind,
        sentence,
        located,
        effects,
        ranking: ranking(laws),
        next_experiment: next_experiment(kind, laws),
        alternatives,
        not_observable: not_observable(laws),
        would_show: shown::would_show(laws),
        unknown_term,
        fit,
        parameters: parameters(rig, laws),
        notes,
        assumed: Vec::new(),
        doubts: Vec::new(),
        seconds: laws.iter().map(|law| law.seconds).sum(),
    }
}

fn kind(
    laws: &[LawDiagnosis],
    faults: &[(String, Fault)],
    alternatives: &[Vec<String>],
    unknown: bool,
) -> Kind {
    let named = laws.iter().any(has_named);
    if !faults.is_empty() {
        Kind::DataFault
    } else if laws.is_empty() {
        Kind::NotObservable
    } else if unknown {
        Kind::Unknown
    } else if !named && shown::is_blind(laws) {
        Kind::NotObservable
    } else if !named {
        Kind::NothingMissing
    } else if alternatives.is_empty() {
        Kind::Named
    } else {
        Kind::Ambiguous
    }
}

/// Name of a parameter without its effect's prefix and its recording.
fn short_name(name: &str) -> &str {
    let key = name.split(" of ").next().unwrap_or(name);
    key.rsplit_once('.').map_or(key, |(_, short)| short)
}

/// Fitted sizes of a candidate's parameters, by the last law that they were free in: what the
/// chambers have shown of sensors the forces may know better.
fn sizes(laws: &[LawDiagnosis], law: &LawDiagnosis, candidate: &Candidate) -> Vec<Size> {
    let has_it = |law: &&LawDiagnosis| {
        let mut free = candidate.free.iter();
        free.any(|free| law.improved.place(&free.key).is_some())
    };
    let law = laws.iter().rev().find(has_it).unwrap_or(law);
    let (fitted, times) = (&law.improved, times_the_noise(law));
    fitted
        .names
        .iter()
        .zip(&fitted.values)
        .zip(&fitted.standard_deviations)
        .filter(|((name, _), _)| {
            candidate
                .free
                .iter()
                .any(|free| **name == free.key || name.starts_with(&format!("{} of ", free.key)))
        })
        .map(|((name, &value), &std)| Size {
            effect: candidate.effect.to_owned(),
            parameter: short_name(name).to_owned(),
            value,
            std: std.map(|std| std * times),
        })
        .collect()
}

/// What a law leaves of its outputs, in units of their noise, rms and 1 at the least: what is not
/// explained moves the numbers as noise of that size would (Birge's ratio).
fn times_the_noise(law: &LawDiagnosis) -> f64 {
    let squares = law.improved.mean_square.iter().zip(&law.noise);
    let squares: Vec<f64> = squares
        .map(|(square, noise)| square / (noise * noise))
        .filter(|square| square.is_finite())
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    mean.max(1.0).sqrt()
}

/// Named effects; the same effect at two places is one.
fn effects(laws: &[LawDiagnosis]) -> Vec<Effect> {
    let mut all: Vec<Effect> = Vec::new();
    for law in laws {
        for evidence in law.evidence.iter().filter(|evidence| evidence.accepted) {
            let candidate = &law.candidates[evidence.candidate];
            let parameters = sizes(laws, law, candidate)
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

fn ranking(laws: &[LawDiagnosis]) -> Vec<Ranked> {
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
fn alternatives(laws: &[LawDiagnosis]) -> Vec<Vec<String>> {
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

fn located(
    laws: &[LawDiagnosis],
    velocity: Option<&locate::Located>,
    train: &[Recording],
) -> Vec<Located> {
    let inputs = laws.iter().filter_map(|law| law.input.as_ref());
    let mut all: Vec<Located> = laws
        .iter()
        .flat_map(|law| law.located.iter())
        .chain(inputs)
        .chain(velocity)
        .map(|located| Located {
            place: located.place.into(),
            share: located.share,
            signals: vec![located.signal.into()],
            intervals_s: located.intervals.clone(),
            when: located.when.clone(),
        })
        .collect();
    // A sensor named as the culprit is a place of its own.
    for law in laws {
        let rivals = law.rivals.iter().map(|(_, rival)| rival);
        for &index in law.improved.set.iter().chain(rivals) {
            for place in &law.candidates[index].places {
                if !all.iter().any(|located| located.place == *place) {
                    all.push(implied(law, index, place, train));
                }
            }
        }
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    // What two laws show of one sensor is said once.
    let mut said: Vec<Located> = Vec::new();
    for located in all {
        let is_said = |one: &Located| one.place == located.place && one.when == located.when;
        if !said.iter().any(is_said) {
            said.push(located);
        }
    }
    said
}

/// A place that shows only through an effect that was named there.
fn implied(law: &LawDiagnosis, index: usize, place: &str, train: &[Recording]) -> Located {
    let (share, found_through) = match &law.term {
        Some(term) => (term.explained(), term.stand.phrase()),
        None => {
            let mut evidence = law.evidence.iter();
            let own = evidence.find(|evidence| evidence.candidate == index);
            let share = own.map_or(0.0, |evidence| evidence.share.clamp(0.0, 1.0));
            (share, law.candidates[index].effect.to_owned())
        }
    };
    let signal = place.strip_prefix("sensor.").unwrap_or("");
    Located {
        place: place.to_owned(),
        share,
        signals: if signal.is_empty() {
            Vec::new()
        } else {
            vec![signal.to_owned()]
        },
        intervals_s: spans(law, index, train),
        when: format!("inferred from {found_through}"),
    }
}

/// When an effect is there, if for a part of the time only.
fn presence(law: &LawDiagnosis, candidate: usize) -> Option<&Presence> {
    let presence = law.improved.presence.as_ref()?;
    (presence.effect == law.candidates[candidate].effect).then_some(presence)
}

/// The spans in which it is there, by recording.
fn spans(law: &LawDiagnosis, candidate: usize, train: &[Recording]) -> Vec<(String, f64, f64)> {
    let Some(presence) = presence(law, candidate) else {
        return Vec::new();
    };
    let recordings = presence.spans_s.iter().zip(train);
    let named = |(spans_s, recording): (&Vec<(f64, f64)>, &Recording)| {
        let end = recording.time_s.last().copied().unwrap_or(f64::INFINITY);
        let name = recording.name.clone();
        let span = move |&(from, to): &(f64, f64)| (name.clone(), from, to.min(end));
        spans_s.iter().map(span).collect::<Vec<_>>()
    };
    recordings.flat_map(named).collect()
}

/// The part of the recorded time in which it is there.
fn share_of_time(spans: &[(String, f64, f64)], train: &[Recording]) -> f64 {
    let length = |recording: &Recording| {
        let time = &recording.time_s;
        time.last().unwrap_or(&0.0) - time.first().unwrap_or(&0.0)
    };
    let all: f64 = train.iter().map(length).sum();
    spans.iter().map(|(_, from, to)| to - from).sum::<f64>() / all.max(f64::MIN_POSITIVE)
}

/// Part of the baseline's energy above the noise that the effects explain, each
/// output counted in its own noise.
pub(super) fn explained(baseline: &Fitted, improved: &Fitted, noise: &[f64]) -> f64 {
    let missed = baseline.energy_above(noise).max(f64::MIN_POSITIVE);
    1.0 - improved.energy_above(noise) / missed
}

/// Whether effects that explain this part may be named.
pub(super) fn is_enough(explained: f64) -> bool {
    explained >= EXPLAINED
}

/// A law of which effects are named.
pub(super) fn has_named(law: &LawDiagnosis) -> bool {
    law.evidence.iter().any(|evidence| evidence.accepted)
}

/// A law whose named effects explain what it misses.
fn is_solved(law: &LawDiagnosis) -> bool {
    has_named(law) && is_enough(law.explained)
}

/// A law whose misfit is material, and no effect explains it. What is left of an output that
/// alone says nothing, as creep, does not count.
pub(super) fn is_unexplained(law: &LawDiagnosis) -> bool {
    law.missed && law.is_open && !is_enough(law.explained) && !law.evidence.is_empty()
}

/// Effects without a name, as they explain too little: then they must do no harm either.
pub(super) fn is_unnamed(law: &LawDiagnosis) -> bool {
    is_unexplained(law) && law.term.is_none() && !law.improved.set.is_empty()
}

/// Held-out recordings spoke against effects with a name that explained what is missed.
fn is_refuted(law: &LawDiagnosis) -> bool {
    law.missed && law.evidence.iter().any(|evidence| evidence.is_refuted)
}

/// A law whose misfit is material and unexplained: the missing term as a table
/// over the variable that explains most of it.
fn unknown_term(laws: &[LawDiagnosis]) -> Option<UnknownTerm> {
    let is_open = |law: &&LawDiagnosis| is_unexplained(law) || law.is_surprised;
    let law = laws.iter().find(is_open)?;
    // An input that explains both chambers says more than either chamber.
    let by_share =
        |one: &&locate::Located, other: &&locate::Located| one.share.total_cmp(&other.share);
    let located = law.input.as_ref().or(law.located.iter().max_by(by_share))?;
    let ask =
        |input: &locate::Located| format!("requires another {}: {}", input.quantity, input.when);
    let Some(term) = &law.term else {
        let expression = law.input.as_ref().map_or(located.when.clone(), ask);
        return as_tabled(
            located,
            with_equation(expression, law),
            law.equation.as_ref(),
        );
    };
    let phrase = term.stand.phrase();
    let left = percent(1.0 - term.share);
    // An input that is left beside a table explains more.
    let (place, expression) = match &law.input {
        Some(input) => (
            input.place,
            format!(
                "{}; {phrase}, reduces it to {left} in data that were not fitted",
                ask(input)
            ),
        ),
        None => (
            term.stand.place(),
            format!(
                "is described by {phrase}, which reduces it to {left} in data that were not fitted"
            ),
        ),
    };
    let tabled = match &term.stand {
        Stand::Table(shape) => UnknownTerm {
            place: place.into(),
            of: vec![shape.variable().0.into()],
            expression,
            unit: shape.quantity().1.into(),
            table: unknown_term::table(*shape, &law.candidates[term.candidate], &law.improved),
            equation: None,
        },
        Stand::Equation(equation) => of_equation(equation, place, expression),
    };
    Some(tabled)
}

/// An expression, and the equation of a law.
fn with_equation(expression: String, law: &LawDiagnosis) -> String {
    match &law.equation {
        None => expression,
        Some(equation) => format!(
            "{expression}; {} explains {} of it in data that were not fitted",
            equation.text(),
            words::percent(equation.share)
        ),
    }
}

/// What an equation describes; its table is the course of its first term.
fn of_equation(equation: &Equation, place: &str, expression: String) -> UnknownTerm {
    let course = equation.terms.first().map(Term::course);
    let points = course.into_iter().flatten();
    UnknownTerm {
        place: place.into(),
        of: equation
            .variables()
            .iter()
            .map(ToString::to_string)
            .collect(),
        expression,
        unit: equation.unit.into(),
        table: points.map(|(at, value)| (at, value, 0.0)).collect(),
        equation: Some(SaidEquation::of(equation)),
    }
}

/// What is located, as a table over the variable that explains most of it.
fn as_tabled(
    located: &locate::Located,
    expression: String,
    equation: Option<&Equation>,
) -> Option<UnknownTerm> {
    let variable = located.variables.first()?;
    Some(UnknownTerm {
        place: located.place.into(),
        of: vec![variable.name.into()],
        expression,
        unit: located.quantity_unit.into(),
        equation: equation.map(SaidEquation::of),
        table: variable
            .bins
            .iter()
            .map(|bin| (bin.x, bin.mean, bin.sd / (bin.count.max(1) as f64).sqrt()))
            .collect(),
    })
}

/// What the position says of the velocity.
fn term_of_velocity(velocity: &locate::Located) -> Option<UnknownTerm> {
    as_tabled(
        velocity,
        format!("{}: {}", velocity.quantity, velocity.when),
        None,
    )
}

/// The same beside what the laws miss.
fn velocity_note(velocity: &locate::Located) -> String {
    format!(
        "recorded velocity and position differ by {} m/s rms ({}); no law uses the velocity",
        words::digits(velocity.rms),
        velocity.when
    )
}

/// A part in per cent; one that is hardly there is not called nought.
fn percent(part: f64) -> String {
    if part < 0.01 {
        "less than 1 %".into()
    } else {
        format!("{:.0} %", 100.0 * part)
    }
}

/// Figures of every model, training and held out.
fn fit(rig: &Rig, laws: &[LawDiagnosis], train: &[Recording], held_out: &[Recording]) -> Fit {
    let figures = |model: Model| {
        let mut figures = FitFigures::default();
        for law in laws {
            let outputs = law.law.outputs(rig);
            for (index, output) in outputs.iter().enumerate() {
                let name = output.signal.to_owned();
                let trained = &law.train[model as usize];
                let held = law.held_out.get(model as usize);
                let none = Vec::new();
                let held = held.unwrap_or(&none);
                let error = |runs: &[Option<Run>],
                             pick: fn(&Run) -> &Vec<f64>,
                             recordings: &[Recording]| {
                    pooled(runs, recordings, |run| pick(run)[index])
                };
                let normal = |recordings: &[Recording]| spread(recordings, output.signal);
                let put = |figures: &mut Figures, value: Option<f64>, by: Option<f64>| {
                    if let (Some(value), Some(by)) = (value, by) {
                        figures.insert(name.clone(), value / by);
                    }
                };
                put(
                    &mut figures.train,
                    error(trained, |run| &run.horizon, train),
                    normal(train),
                );
                put(
                    &mut figures.held_out,
                    error(held, |run| &run.horizon, held_out),
                    normal(held_out),
                );
                put(
                    &mut figures.free_run_train,
                    error(trained, |run| &run.free_run, train),
                    Some(1.0),
                );
                put(
                    &mut figures.free_run_held_out,
                    error(held, |run| &run.free_run, held_out),
                    Some(1.0),
                );
            }
        }
        figures
    };
    Fit {
        as_given: figures(Model::Given),
        refitted: figures(Model::Refitted),
        improved: figures(Model::Improved),
        noise_floor: noise_floor(rig, laws, train, held_out),
    }
}

fn spread(recordings: &[Recording], signal: &str) -> Option<f64> {
    let all: Vec<f64> = recordings
        .iter()
        .filter_map(|recording| recording.signal(signal))
        .flatten()
        .copied()
        .collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / all.len().max(1) as f64;
    (variance > 0.0).then(|| variance.sqrt())
}

fn noise_floor(
    rig: &Rig,
    laws: &[LawDiagnosis],
    train: &[Recording],
    held_out: &[Recording],
) -> FitFigures {
    let mut figures = FitFigures::default();
    for law in laws {
        for (output, &noise) in law.law.outputs(rig).iter().zip(&law.floor) {
            let name = output.signal.to_owned();
            if let Some(by) = spread(train, output.signal) {
                figures.train.insert(name.clone(), noise / by);
                figures.free_run_train.insert(name.clone(), noise);
            }
            if let Some(by) = spread(held_out, output.signal) {
                figures.held_out.insert(name.clone(), noise / by);
                figures.free_run_held_out.insert(name, noise);
            }
        }
    }
    figures
}

fn parameters(rig: &Rig, laws: &[LawDiagnosis]) -> BTreeMap<String, Parameter> {
    let mut all = BTreeMap::new();
    for law in laws {
        let (improved, times) = (law.for_the_rig(), times_the_noise(law));
        let (before, after) = (law.baseline.shared_values(), improved.shared_values());
        for key in before.keys().chain(after.keys()) {
            let index = improved.place(key);
            let parameter = Parameter {
                given: rig.value(key),
                refitted: before.get(key).copied(),
                improved: after.get(key).copied(),
                std: index
                    .and_then(|index| improved.standard_deviations[index])
                    .map(|std| std * times),
                at_bound: index.is_some_and(|index| improved.at_bound[index]),
            };
            all.insert(key.clone(), parameter);
        }
    }
    all
}

/// What held-out data leave open, where something is named.
fn unexplained_notes(rig: &Rig, laws: &[LawDiagnosis], fit: &Fit) -> Vec<String> {
    if laws.iter().all(|law| law.improved.set.is_empty()) {
        return Vec::new();
    }
    let note = |law: &LawDiagnosis, (number, output): (usize, Output)| {
        let signal = output.signal;
        let times = fit.times_the_floor(signal)?;
        let left = format!(
            "{}: the held-out misfit is {times:.1} times the noise floor",
            crate::signals::titled(signal)
        );
        let most = proof::windows_of_most(law, number).map(|(few, all)| {
            let window_s = rig.horizon_s();
            format!(", 90 % of it in {few} of {all} windows of {window_s} s")
        });
        Some(left + &most.unwrap_or_default())
    };
    let of_law = |law: &LawDiagnosis| {
        let outputs = law.law.outputs(rig).into_iter().enumerate();
        let notes: Vec<String> = outputs.filter_map(|one| note(law, one)).collect();
        notes
    };
    laws.iter().flat_map(of_law).collect()
}

/// A refit is remarked on from this factor on by which it is worse than the rig file in held-out data:
/// where both are at the noise they differ by a few per cent.
const WORSE_THAN_GIVEN: f64 = 2.0;

/// Signals that the rig file as given predicts better than its refit, in held-out data.
fn worse_than_given_notes(rig: &Rig, laws: &[LawDiagnosis], fit: &Fit) -> Vec<String> {
    let outputs = laws.iter().flat_map(|law| law.law.outputs(rig));
    let note = |output: Output| {
        let of = |figures: &FitFigures| figures.free_run_held_out.get(output.signal).copied();
        let (given, improved) = (of(&fit.as_given)?, of(&fit.improved)?);
        (improved > WORSE_THAN_GIVEN * given).then(|| {
            let reading = Reading::of_signal(rig, output.signal);
            let [improved, given] =
                [improved, given].map(|error| words::digits(reading.difference(error)));
            format!(
                "{}: in held-out data the rig file as given is better, {given} {unit} against {improved} {unit}; \
                 what was refitted of its law hangs on events that the training recordings hold few of",
                crate::signals::titled(output.signal),
                unit = reading.unit,
            )
        })
    };
    outputs.filter_map(note).collect()
}

fn refuted_note(law: &LawDiagnosis) -> Option<String> {
    let Refuted { what, how } = law.refuted.as_ref()?;
    Some(format!(
        "refuted by held-out data: the prediction of the {} is {how} with {what} than without; the improved rig does not contain it",
        law.law.title()
    ))
}

pub(super) fn unproven_note(law: &LawDiagnosis) -> Option<String> {
    law.is_unproven.then(|| {
        format!(
            "not confirmed by held-out data: the prediction of the {} is worse with {} than without, but in so few windows that this may be chance; the improved rig does not contain it",
            law.law.title(),
            what_was_put_in(law)
        )
    })
}

fn notes(rig: &Rig, laws: &[LawDiagnosis], fit: &Fit, train: &[Recording]) -> Vec<String> {
    let mut notes: Vec<String> = laws.iter().flat_map(|law| law.screened.clone()).collect();
    notes.extend(laws.iter().filter_map(refuted_note));
    notes.extend(laws.iter().filter_map(unproven_note));
    notes.extend(shown::hidden_note(laws));
    notes.extend(laws.iter().filter_map(lost_commands_note));
    notes.extend(unexplained_notes(rig, laws, fit));
    notes.extend(worse_than_given_notes(rig, laws, fit));
    for law in laws {
        for (place, &index) in law.improved.set.iter().enumerate() {
            let candidate = &law.candidates[index];
            let there = spans(law, index, train);
            // The same effect at another place is there at the same times.
            if place == 0 && !there.is_empty() {
                let share = 100.0 * share_of_time(&there, train);
                let one = |(name, from, to): &(String, f64, f64)| {
                    format!("{from:.2} to {to:.2} s of {name}")
                };
                let list: Vec<String> = there.iter().map(one).collect();
                let in_the_rig = if law.is_unproven {
                    ""
                } else {
                    "; the improved rig contains it as permanent"
                };
                notes.push(format!(
                    "{} is present {share:.0} % of the time: {}{in_the_rig}",
                    candidate.effect,
                    list.join(", ")
                ));
            }
            let own: Vec<String> = law
                .improved
                .names
                .iter()
                .zip(&law.improved.values)
                .filter(|(name, _)| name.contains(" of ") && name.contains(candidate.effect))
                .map(|(name, value)| {
                    let recording = name
                        .rsplit_once(" of ")
                        .map_or("", |(_, recording)| recording);
                    format!("{} s in {recording}", words::digits(*value))
                })
                .collect();
            if !own.is_empty() {
                notes.push(format!(
                    "{} is a property of each recording and not part of the improved rig: {}",
                    candidate.effect,
                    own.join(", ")
                ));
            }
        }
    }
    notes
}

/// Effects that no law at hand could show, whether for want of a signal or of
/// excitation.
fn not_observable(laws: &[LawDiagnosis]) -> Vec<String> {
    let silent = shown::at_no_size(laws);
    let tried = laws.iter().flat_map(|law| law.candidates.iter());
    let effects = tried.map(|candidate| candidate.effect);
    knowability::not_observable(effects.filter(|effect| !silent.contains(effect)))
}

fn next_experiment(kind: Kind, laws: &[LawDiagnosis]) -> Option<String> {
    match kind {
        Kind::Ambiguous => laws.iter().find_map(|law| {
            let &(accepted, rival) = law.rivals.first()?;
            let names = [accepted, rival].map(|index| law.candidates[index].effect);
            Some(words::what_to_record(law.next_experiment.as_ref(), names))
        }),
        Kind::Named => {
            let unproven = laws.iter().filter(|law| law.is_unproven);
            let effects: Vec<&str> = unproven.flat_map(LawDiagnosis::named).collect();
            words::bearing_out(&effects)
        }
        Kind::NothingMissing | Kind::NotObservable if !laws.is_empty() => {
            let hidden = shown::hidden(laws);
            (!hidden.is_empty()).then(|| words::ruling_out(&hidden))
        }
        Kind::NotObservable => Some(
            "Record the signals that a law of this rig needs: position and a chamber pressure for the chambers, \
             position with force or both pressures for the carriage, command and position for an actuator."
                .into(),
        ),
        _ => None,
    }
}

fn sentence(
    kind: Kind,
    laws: &[LawDiagnosis],
    faults: &[(String, Fault)],
    missing: Option<&UnknownTerm>,
    alternatives: &[Vec<String>],
) -> String {
    match kind {
        Kind::DataFault => {
            let more = if faults.len() > 1 {
                format!(" (and {} more)", faults.len() - 1)
            } else {
                String::new()
            };
            let first = faults.first();
            let text = first.map_or_else(String::new, |(name, fault)| {
                format!("{name}: {}", fault.sentence)
            });
            format!(
                "The recordings are faulty: {}{more}.",
                text.trim_end_matches('.')
            )
        }
        Kind::NotObservable if !laws.is_empty() => {
            "These recordings cannot show any effect of the list in any size: no statement about omitted physics is possible.".into()
        }
        Kind::NotObservable => {
            "The recorded signals drive no law of this rig: no statement about its physics is possible.".into()
        }
        Kind::NothingMissing => nothing_missing(laws),
        Kind::Unknown => unknown_sentence(laws, missing),
        Kind::Named | Kind::Ambiguous => named_sentence(laws, alternatives),
    }
}

fn beside_sentence(term: &UnknownTerm) -> String {
    format!(
        "No effect of the list explains a further misfit at {} ({}).",
        term.place, term.expression
    )
}

fn nothing_missing(laws: &[LawDiagnosis]) -> String {
    if laws.iter().any(|law| law.missed) {
        return "No relevant physics is missing: no effect improves the prediction materially."
            .into();
    }
    let (silent, tried) = (shown::at_no_size(laws).len(), shown::tried(laws).len());
    let nothing = if silent == 0 {
        "No physics is missing".to_owned()
    } else {
        let shown = tried - silent;
        format!(
            "No physics is missing among the {shown} of {tried} effects that these recordings can show"
        )
    };
    format!("{nothing}: the refitted model explains the recordings to the noise floor.")
}

fn unknown_sentence(laws: &[LawDiagnosis], missing: Option<&UnknownTerm>) -> String {
    let (place, when) = missing.map_or(("the model", ""), |term| {
        (term.place.as_str(), term.expression.as_str())
    });
    let mut refuted = laws.iter().filter(|law| is_refuted(law));
    if let Some(Refuted { what, .. }) = refuted.find_map(|law| law.refuted.as_ref()) {
        return format!(
            "Unknown physics is missing: the held-out data refute what the training data suggest ({what})."
        );
    }
    if laws.iter().any(|law| law.is_surprised) {
        return format!(
            "The model explains the training recordings to the noise floor, but not the held-out recordings: an effect at {place} is not excited in training (misfit: {when}); train on these recordings as well."
        );
    }
    format!(
        "Unknown physics is missing at {place}: no effect of the list explains the misfit ({when})."
    )
}

/// Where nothing explains what a law misses: what commands that were given between the rows
/// would leave.
fn lost_commands_note(law: &LawDiagnosis) -> Option<String> {
    let share = law
        .lost_commands
        .filter(|share| LOST_COMMANDS.contains(share));
    share.filter(|_| is_unexplained(law)).map(|share| {
        format!(
            "commands given between the rows would cause about {share:.1} times the misfit of the {}: was the command logged as often as it was given?",
            law.law.title()
        )
    })
}

/// The named effects of a law, or its table, in words.
pub fn what_was_put_in(law: &LawDiagnosis) -> String {
    if let Some(term) = &law.term {
        return term.stand.phrase();
    }
    let named = named(std::slice::from_ref(law), law);
    if named.is_empty() {
        return "effects too small to name".into();
    }
    words::list(&named)
}

fn named(laws: &[LawDiagnosis], law: &LawDiagnosis) -> Vec<String> {
    let accepted = law.evidence.iter().filter(|evidence| evidence.accepted);
    let name = |evidence: &Evidence| {
        let candidate = &law.candidates[evidence.candidate];
        let now_and_then = if presence(law, evidence.candidate).is_some() {
            ", part of the time"
        } else {
            ""
        };
        let name = words::named(candidate, &sizes(laws, law, candidate));
        format!("{name}{now_and_then}")
    };
    accepted.map(name).collect()
}

fn named_sentence(laws: &[LawDiagnosis], alternatives: &[Vec<String>]) -> String {
    let named: Vec<String> = laws.iter().flat_map(|law| named(laws, law)).collect();
    let rivals: Vec<String> = alternatives
        .iter()
        .map(|pair| pair.join(" from "))
        .collect();
    let doubt = if rivals.is_empty() {
        String::new()
    } else {
        format!(
            "; these recordings cannot distinguish {}",
            rivals.join(", nor ")
        )
    };
    format!("The model omits {}{doubt}.", words::list(&named))
}
