//! A diagnosis in five lines.

use super::verdict::{FitFigures, Kind, Verdict};
use super::{Diagnosis, words};

/// What, where, how sure, how much better, what next: a word and a line each.
pub fn five_lines(diagnosis: &Diagnosis) -> [(&'static str, String); 5] {
    let verdict = &diagnosis.verdict;
    [
        ("what", verdict.sentence.clone()),
        ("where", places(verdict)),
        ("how sure", certainty(verdict)),
        ("better", improvement(verdict)),
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

/// Free-run errors, held out where there are any.
fn improvement(verdict: &Verdict) -> String {
    let fit = &verdict.fit;
    let held = !fit.refitted.free_run_held_out.is_empty();
    let pick = |figures: &FitFigures| {
        if held {
            figures.free_run_held_out.clone()
        } else {
            figures.free_run_train.clone()
        }
    };
    let (given, refitted, improved) = (
        pick(&fit.as_given),
        pick(&fit.refitted),
        pick(&fit.improved),
    );
    let line = |(signal, after): (&String, &f64)| {
        let before = refitted.get(signal).copied().unwrap_or(f64::NAN);
        let first = given.get(signal).copied().unwrap_or(f64::NAN);
        format!(
            "{signal} rms {} as given, {} refitted, {} improved",
            words::digits(first),
            words::digits(before),
            words::digits(*after)
        )
    };
    if improved.is_empty() {
        return "nothing was fitted".into();
    }
    let lines: Vec<String> = improved.iter().map(line).collect();
    let which = if held {
        "held out"
    } else {
        "training (nothing was held out)"
    };
    format!("{which}, free run, SI: {}", lines.join("; "))
}

fn next(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let is_proved = !diagnosis.held_out.is_empty();
    let default = match verdict.verdict {
        Kind::DataFault => "Mend the recording and run again.",
        Kind::NothingMissing | Kind::Named if !is_proved => {
            return "Give recordings that were not fitted to with --held-out: nothing proves this verdict yet.".into();
        }
        Kind::Unknown => {
            "Record the same motion at other speeds and pressures: the shape of the missing term will tell."
        }
        _ => {
            "Nothing is needed for this verdict; recordings at other speeds and pressures would test it further."
        }
    };
    verdict
        .next_experiment
        .clone()
        .unwrap_or_else(|| default.into())
}
