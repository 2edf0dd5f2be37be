//! A diagnosis in five lines.

use super::verdict::{FitFigures, Kind, Verdict};
use super::{Diagnosis, words};
use crate::laws::Output;
use crate::units::shown;

const NOTHING_NEEDED: &str = "Nothing is needed for this verdict; recordings at other speeds and pressures would test it further.";

/// What, where, how sure, how much better, what next: a word and a line each.
pub fn five_lines(diagnosis: &Diagnosis) -> [(&'static str, String); 5] {
    let verdict = &diagnosis.verdict;
    [
        ("what", verdict.sentence.clone()),
        ("where", places(verdict)),
        ("how sure", certainty(verdict)),
        ("better", improvement(diagnosis)),
        ("next", next(diagnosis)),
    ]
}

fn places(verdict: &Verdict) -> String {
    let places: Vec<String> = verdict
        .located
        .iter()
        .map(|located| {
            format!(
                "{} ({:.0} % of its law's misfit; {})",
                located.place,
                100.0 * located.share,
                located.when
            )
        })
        .collect();
    if places.is_empty() {
        "nowhere".into()
    } else {
        places.join("; ")
    }
}

fn certainty(verdict: &Verdict) -> String {
    let effects: Vec<String> = verdict
        .effects
        .iter()
        .map(|effect| format!("{} {:.2}", effect.effect, effect.probability))
        .collect();
    let word = serde_json::to_value(verdict.verdict).map_or_else(
        |_| String::new(),
        |value| value.as_str().unwrap_or_default().to_owned(),
    );
    if effects.is_empty() {
        word
    } else {
        format!("{word}: {}", effects.join(", "))
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
        let unit = shown(output.unit);
        let digits = |error: Option<f64>| words::digits(error.unwrap_or(f64::NAN) * unit.per_si);
        Some(format!(
            "{} {} {} as given, {} refitted, {} improved",
            output.signal,
            digits(of(&fit.as_given, output)),
            unit.unit,
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
        "held out"
    } else {
        "training (nothing was held out)"
    };
    format!("{which}, rms of the free run: {}", lines.join("; "))
}

fn next(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let is_proved = !diagnosis.held_out.is_empty();
    let default = match verdict.verdict {
        Kind::DataFault => "Mend the recording and run again.".into(),
        Kind::NothingMissing | Kind::Named if !is_proved => {
            return "Give recordings that were not fitted to with --held-out: nothing proves this verdict yet.".into();
        }
        Kind::Unknown => {
            "Record the same motion at other speeds and pressures: the shape of the missing term will tell.".into()
        }
        Kind::Named => after_a_name(diagnosis),
        _ => NOTHING_NEEDED.into(),
    };
    verdict.next_experiment.clone().unwrap_or(default)
}

/// Something is named; what it leaves may hold something more.
fn after_a_name(diagnosis: &Diagnosis) -> String {
    let left = |output: Output| {
        let times = diagnosis.verdict.fit.times_the_floor(output.signal)?;
        Some(format!(
            "{} ({times:.1} times its noise floor)",
            output.signal
        ))
    };
    let left: Vec<String> = diagnosis.outputs().into_iter().filter_map(left).collect();
    if left.is_empty() {
        return NOTHING_NEEDED.into();
    }
    format!(
        "What is named needs nothing more. More than noise is left of {}, and no effect of the list was seen to take it away: recordings at other speeds and pressures may show which does.",
        left.join(" and ")
    )
}
