//! The campaign in words.

use super::case::Case;
use super::run::{Moment, Outcome};
use super::wiring::{FirstStart, Wiring};
use firmware::fault::{DESCRIPTIONS, Fault};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The fault list as a table.
pub fn fault_list() -> String {
    let mut text = String::from(
        "| code | fault | how it is seen | detail | acknowledged | what to do |\n\
         |---:|---|---|---|---|---|\n",
    );
    for description in &DESCRIPTIONS {
        let fault = description.fault;
        let leaves = match (fault.is_standing(), fault.ends_with_settings()) {
            (false, _) => "yes",
            (true, false) => "no: reset",
            (true, true) => "after new settings, or reset",
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {leaves} | {} |",
            description.fault.code(),
            description.name,
            description.seen,
            description.detail,
            description.remedy,
        );
    }
    text
}

/// Reaction times: a row per case, a column per moment (median/worst in ticks).
pub fn reaction_table(results: &[(Case, Moment, Outcome)], cases: &[Case]) -> String {
    let mut text = String::from("| what happens | runs | not seen | said |");
    for moment in Moment::ALL {
        let _ = write!(text, " {} |", moment_name(moment));
    }
    text.push_str(" astray, mm |\n|---|---:|---:|---|");
    text.push_str(&"---:|".repeat(Moment::ALL.len() + 1));
    text.push('\n');
    for case in cases {
        let of_case: Vec<&(Case, Moment, Outcome)> = results
            .iter()
            .filter(|(candidate, _, _)| candidate == case)
            .collect();
        let not_seen = of_case
            .iter()
            .filter(|(_, _, outcome)| outcome.ticks.is_none())
            .count();
        let said = of_case.iter().filter_map(|(_, _, outcome)| outcome.fault);
        let _ = write!(
            text,
            "| {} | {} | {not_seen} | {} |",
            case.name,
            of_case.len(),
            names(said)
        );
        for moment in Moment::ALL {
            let ticks = of_case
                .iter()
                .filter(|(_, candidate, _)| *candidate == moment)
                .filter_map(|(_, _, outcome)| outcome.ticks)
                .collect();
            let _ = write!(text, " {} |", median_and_worst(ticks));
        }
        let astray_m = of_case
            .iter()
            .map(|(_, _, outcome)| outcome.astray_m)
            .fold(0.0, f64::max);
        let _ = writeln!(text, " {:.1} |", 1e3 * astray_m);
    }
    text
}

/// The names of faults, each once, in the order of the alphabet.
fn names(faults: impl Iterator<Item = Fault>) -> String {
    let name = |fault: Fault| DESCRIPTIONS[usize::from(fault.code()) - 1].name;
    let all: BTreeSet<&str> = faults.map(name).collect();
    all.into_iter().collect::<Vec<_>>().join(", ")
}

/// First starts of an axis that is wired so, at this supply, bar gauge: a row.
pub fn wiring_row(wiring: Wiring, gauge_bar: f64, starts: &[FirstStart]) -> String {
    let seen = || starts.iter().filter_map(|start| start.fault);
    let worst_mm = |way: fn(&FirstStart) -> f64| 1e3 * starts.iter().map(way).fold(0.0, f64::max);
    format!(
        "| {} | {gauge_bar} | {} | {} | {} | {} | {:.2} | {:.2} |\n",
        wiring.name(),
        starts.len(),
        starts.len() - seen().count(),
        names(seen().map(|(fault, _)| fault)),
        median_and_worst(seen().map(|(_, ticks)| ticks).collect()),
        worst_mm(|start| start.had_gone_m),
        worst_mm(|start| start.went_m),
    )
}

fn median_and_worst(mut ticks: Vec<u32>) -> String {
    ticks.sort_unstable();
    match (ticks.get(ticks.len() / 2), ticks.last()) {
        (Some(median), Some(worst)) if median == worst => format!("{worst}"),
        (Some(median), Some(worst)) => format!("{median} / {worst}"),
        _ => "-".into(),
    }
}

fn moment_name(moment: Moment) -> &'static str {
    match moment {
        Moment::Rest => "at rest",
        Moment::Accelerating => "accelerating",
        Moment::Cruising => "cruising",
        Moment::Reversing => "reversing",
        Moment::Hold => "holding",
    }
}
