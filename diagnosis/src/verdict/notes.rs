//! What a reader must know beside the verdict.

use super::{Fit, FitFigures, place, shown};
use crate::finding::{Finding, Refuted, proof, said};
use crate::laws::Output;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::signals::Reading;
use crate::words;

/// What commands between the rows would leave, over what is missed, that a reader is told of:
/// with half to four fifths of the commands left out it came to 0.6 to 8 times.
const LOST_COMMANDS: std::ops::Range<f64> = 0.3..10.0;

/// What held-out data leave open, where something is named.
fn unexplained_notes(rig: &Rig, laws: &[Finding], fit: &Fit) -> Vec<String> {
    if laws.iter().all(|law| law.improved.set.is_empty()) {
        return Vec::new();
    }
    let note = |law: &Finding, (number, output): (usize, Output)| {
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
    let of_law = |law: &Finding| {
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
fn worse_than_given_notes(rig: &Rig, laws: &[Finding], fit: &Fit) -> Vec<String> {
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

fn refuted_note(law: &Finding) -> Option<String> {
    let Refuted { what, how } = law.refuted.as_ref()?;
    Some(format!(
        "refuted by held-out data: the prediction of the {} is {how} with {what} than without; the improved rig does not contain it",
        law.law.title()
    ))
}

pub(crate) fn unproven_note(law: &Finding) -> Option<String> {
    law.is_unproven.then(|| {
        format!(
            "not confirmed by held-out data: the prediction of the {} is worse with {} than without, but in so few windows that this may be chance; the improved rig does not contain it",
            law.law.title(),
            said::what_was_put_in(law)
        )
    })
}

pub(super) fn notes(rig: &Rig, laws: &[Finding], fit: &Fit, train: &[Recording]) -> Vec<String> {
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
            let there = place::spans(law, index, train);
            // The same effect at another place is there at the same times.
            if place == 0 && !there.is_empty() {
                let share = 100.0 * place::share_of_time(&there, train);
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

/// Where nothing explains what a law misses: what commands that were given between the rows
/// would leave.
fn lost_commands_note(law: &Finding) -> Option<String> {
    let share = law
        .lost_commands
        .filter(|share| LOST_COMMANDS.contains(share));
    share.filter(|_| law.is_unexplained()).map(|share| {
        format!(
            "commands given between the rows would cause about {share:.1} times the misfit of the {}: was the command logged as often as it was given?",
            law.law.title()
        )
    })
}
