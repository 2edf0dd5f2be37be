//! A diagnosis in five lines.

use super::Diagnosis;
use crate::laws::Output;
use crate::signals::{self, Reading};
use crate::verdict::{FitFigures, Kind, Verdict};
use crate::words;

const NOTHING_NEEDED: &str = "The finding needs no further data. Recordings at other speeds and pressures would test it further.";

/// Finding, location, probability, proof, next experiment: a label and a line each.
pub fn five_lines(diagnosis: &Diagnosis) -> [(&'static str, String); 5] {
    let verdict = &diagnosis.verdict;
    [
        ("finding", verdict.sentence.clone()),
        ("location", places(verdict)),
        ("probability", certainty(verdict)),
        ("proof", improvement(diagnosis)),
        ("next", next(diagnosis)),
    ]
}

/// A verdict in a word or two.
pub fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::NothingMissing => "nothing missing",
        Kind::Named => "named",
        Kind::Ambiguous => "ambiguous",
        Kind::Unknown => "unknown",
        Kind::DataFault => "data fault",
        Kind::NotObservable => "not observable",
    }
}

fn places(verdict: &Verdict) -> String {
    let places: Vec<String> = verdict
        .located
        .iter()
        .map(|located| {
            format!(
                "{} ({:.0} % of its law's misfit; {})",
                words::place(&located.place),
                100.0 * located.share,
                located.when
            )
        })
        .collect();
    if places.is_empty() {
        "no misfit above the noise floor".into()
    } else {
        places.join("; ")
    }
}

/// The probabilities of the effects; where none is named they are candidates.
fn certainty(verdict: &Verdict) -> String {
    let effects = verdict.effects.iter();
    let effects: Vec<String> = effects
        .map(|effect| {
            let name = effect.effect.replace('-', " ");
            format!("{name} {}", words::percent(effect.probability))
        })
        .collect();
    let word = kind(verdict.verdict);
    match verdict.verdict {
        _ if effects.is_empty() => word.to_owned(),
        Kind::Named => effects.join(", "),
        _ => format!("{word}; candidates: {}", effects.join(", ")),
    }
}

/// Free-run errors, held out where there are any, each signal in one unit.
fn improvement(diagnosis: &Diagnosis) -> String {
    let fit = &diagnosis.verdict.fit;
    let held = !fit.refitted.free_run_held_out.is_empty();
    let of = |figures: &FitFigures, output: &Output| {
        let errors = if held {
            &figures.free_run_held_out
        } else {
            &figures.free_run_train
        };
        errors.get(output.signal).copied()
    };
    let line = |output: &Output| {
        let improved = of(&fit.improved, output)?;
        let reading = Reading::of_signal(&diagnosis.improved_rig, output.signal);
        let digits =
            |error: Option<f64>| words::digits(reading.difference(error.unwrap_or(f64::NAN)));
        Some(format!(
            "{} {} {} as given, {} refitted, {} improved",
            signals::spoken(output.signal),
            digits(of(&fit.as_given, output)),
            reading.unit,
            digits(of(&fit.refitted, output)),
            digits(Some(improved))
        ))
    };
    let outputs = diagnosis.outputs();
    let lines: Vec<String> = outputs.iter().filter_map(line).collect();
    if lines.is_empty() {
        return "nothing was fitted".into();
    }
    let which = if held {
        "held-out rms error"
    } else {
        "training rms error (no held-out recording given)"
    };
    format!("{which}: {}", lines.join("; "))
}

fn next(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let is_proved = !diagnosis.held_out.is_empty();
    let default = match verdict.verdict {
        Kind::DataFault => "Correct the recording and run again.".into(),
        Kind::NothingMissing | Kind::Named if !is_proved => {
            return "Give recordings that were not fitted with --held-out: this verdict is not proved yet.".into();
        }
        Kind::Unknown => {
            "Record the same motion at other speeds and pressures: they show what the unmodelled term depends on.".into()
        }
        Kind::Named => after_a_name(diagnosis),
        _ => NOTHING_NEEDED.into(),
    };
    verdict.next_experiment.clone().unwrap_or(default)
}

/// Something is named; the residual may hold something more.
fn after_a_name(diagnosis: &Diagnosis) -> String {
    let above = |output: Output| {
        let times = diagnosis.verdict.fit.times_the_floor(output.signal)?;
        let name = signals::spoken(output.signal);
        Some(format!("the {name} ({times:.1} times its noise floor)"))
    };
    let outputs = diagnosis.outputs().into_iter();
    let above: Vec<String> = outputs.filter_map(above).collect();
    if above.is_empty() {
        return NOTHING_NEEDED.into();
    }
    format!(
        "The finding needs no further data. A misfit above the noise floor remains in {}; no effect of the list explains it. Its cause may be numbers of the rig that are only nearly right, such as the valve's areas; recordings at other speeds and pressures may show it.",
        words::list(&above)
    )
}
