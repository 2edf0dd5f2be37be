//! From the diagnosis of each law to one verdict and one improved rig.

use super::{Kind, Verdict, effects, figures, notes, place, sentence, shown, unlisted};
use crate::estimate::candidates::TIMES_OF_SENSORS;
use crate::finding::Finding;
use crate::inspect::Fault;
use crate::locate;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::text::rounded;

/// The rig with refitted parameters and named effects. What belongs to one
/// recording (a logger's skew) is no part of a rig.
pub fn improved_rig(rig: &Rig, laws: &[Finding]) -> Rig {
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
    laws: &[Finding],
    velocity: Option<&locate::Located>,
    faults: &[(String, Fault)],
    train: &[Recording],
    held_out: &[Recording],
) -> Verdict {
    let effects = effects::effects(laws);
    let alternatives = effects::alternatives(laws);
    // No law uses the velocity: beside something that is missed it is a remark.
    let (unknown_term, aside) = match unlisted::unknown_term(laws) {
        None if effects.is_empty() => (velocity.and_then(unlisted::term_of_velocity), None),
        of_laws => (of_laws, velocity),
    };
    let fit = figures::fit(rig, laws, train, held_out);
    let refuted = laws.iter().any(Finding::is_refuted);
    // What is named in one law stays named, whatever else is missing in another.
    let unsolved = (refuted || unknown_term.is_some()) && !laws.iter().any(Finding::is_solved);
    let kind = kind(laws, faults, &alternatives, unsolved);
    let located = place::located(laws, velocity, train);
    let mut sentence = sentence::sentence(kind, laws, faults, unknown_term.as_ref(), &alternatives);
    if let (Kind::Named | Kind::Ambiguous, Some(term)) = (kind, &unknown_term) {
        sentence = format!("{sentence} {}", sentence::beside_sentence(term));
    }
    let mut notes = notes::notes(rig, laws, &fit, train);
    notes.extend(aside.map(unlisted::velocity_note));
    Verdict {
        format: "verdict/1",
        verdict: kind,
        sentence,
        located,
        effects,
        ranking: effects::ranking(laws),
        next_experiment: sentence::next_experiment(kind, laws),
        alternatives,
        not_observable: sentence::not_observable(laws),
        would_show: shown::would_show(laws),
        unknown_term,
        fit,
        parameters: figures::parameters(rig, laws),
        notes,
        assumed: Vec::new(),
        doubts: Vec::new(),
        seconds: laws.iter().map(|law| law.seconds).sum(),
    }
}

fn kind(
    laws: &[Finding],
    faults: &[(String, Fault)],
    alternatives: &[Vec<String>],
    unknown: bool,
) -> Kind {
    let named = laws.iter().any(Finding::has_named);
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
