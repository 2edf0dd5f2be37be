//! The verdict in one sentence, and what to record next.

use super::{Kind, UnknownTerm, shown};
use crate::finding::{Finding, Refuted, said};
use crate::inspect::Fault;
use crate::search::knowability;
use crate::words;

pub(super) fn sentence(
    kind: Kind,
    laws: &[Finding],
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

pub(super) fn beside_sentence(term: &UnknownTerm) -> String {
    format!(
        "No effect of the list explains a further misfit at {} ({}).",
        term.place, term.expression
    )
}

fn nothing_missing(laws: &[Finding]) -> String {
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

fn unknown_sentence(laws: &[Finding], missing: Option<&UnknownTerm>) -> String {
    let (place, when) = missing.map_or(("the model", ""), |term| {
        (term.place.as_str(), term.expression.as_str())
    });
    let mut refuted = laws.iter().filter(|law| law.is_refuted());
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

fn named_sentence(laws: &[Finding], alternatives: &[Vec<String>]) -> String {
    let named: Vec<String> = laws.iter().flat_map(|law| said::named(laws, law)).collect();
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

/// Effects that no law at hand could show, whether for want of a signal or of
/// excitation.
pub(super) fn not_observable(laws: &[Finding]) -> Vec<String> {
    let silent = shown::at_no_size(laws);
    let tried = laws.iter().flat_map(|law| law.candidates.iter());
    let effects = tried.map(|candidate| candidate.effect);
    knowability::not_observable(effects.filter(|effect| !silent.contains(effect)))
}

pub(super) fn next_experiment(kind: Kind, laws: &[Finding]) -> Option<String> {
    match kind {
        Kind::Ambiguous => laws.iter().find_map(|law| {
            let &(accepted, rival) = law.rivals.first()?;
            let names = [accepted, rival].map(|index| law.candidates[index].effect);
            Some(words::what_to_record(law.next_experiment.as_ref(), names))
        }),
        Kind::Named => {
            let unproven = laws.iter().filter(|law| law.is_unproven);
            let effects: Vec<&str> = unproven.flat_map(Finding::named).collect();
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
