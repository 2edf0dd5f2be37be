//! Spikes: one to three rows far outside of the rows around them, as a burst of
//! interference or a lost telegram writes them.
//!
//! A row is judged by its own neighbourhood alone, so that the number of spikes
//! does not matter. What is sampled of an axis cannot do this: over nine rows a
//! smooth signal stays near the range of its neighbours, and noise leaves it by
//! a fraction (the practice and real recordings: by 0.9 of it at the most, a
//! position gauge that jumps by 6, see `val_` tests of this room).

use super::faults::{Fault, FaultKind, fault};
use super::statistics::Run;
use super::{LISTED, SignalReport};
use crate::recording::Recording;

/// Rows on either side that a spike is compared with.
const NEIGHBOURS: usize = 4;
/// Longest spike, rows.
const LONGEST: usize = 3;
/// A spike stands this many ranges of its neighbours outside of them ...
const RANGES: f64 = 10.0;
/// ... where they lie closer together than this many deviations of the noise, of these.
const LEAST_RANGE_NOISE: f64 = 2.0;

/// The spikes of one signal: the first ones each, the others counted.
pub(super) fn spikes(
    recording: &Recording,
    report: &SignalReport,
    values: &[f64],
    ordinary: &[bool],
) -> Vec<Fault> {
    let found = find(report, values, ordinary);
    let told = |(run, excess): &(Run, f64)| {
        let said = format!(
            "has a spike of {excess:.4e} {} in {}: interference or a lost value, no motion",
            report.unit,
            match run.length {
                1 => "a single row".to_owned(),
                rows => format!("{rows} rows"),
            }
        );
        fault(recording, &report.name, FaultKind::Spike, *run, &said)
    };
    let mut faults: Vec<Fault> = found.iter().take(LISTED).map(told).collect();
    if let (Some((first, _)), Some((last, _))) = (found.get(LISTED), found.last()) {
        let run = Run {
            start: first.start,
            length: last.end() - first.start,
        };
        let said = format!("has {} more spikes", found.len() - LISTED);
        faults.push(fault(recording, &report.name, FaultKind::Spike, run, &said));
    }
    faults
}

/// Rows of each spike and how far it stands out of its neighbours.
fn find(report: &SignalReport, values: &[f64], ordinary: &[bool]) -> Vec<(Run, f64)> {
    let least_range = (LEAST_RANGE_NOISE * report.noise).max(report.quantum.unwrap_or(0.0));
    let mut found = Vec::new();
    let mut row = NEIGHBOURS;
    while row < values.len() {
        let spike = (1..=LONGEST).find_map(|length| {
            let run = Run { start: row, length };
            excess(values, ordinary, run, least_range).map(|excess| (run, excess))
        });
        row = spike.map_or(row + 1, |(run, _)| run.end());
        found.extend(spike);
    }
    found
}

/// How far all rows of a run stand on one side of their neighbours, signed, where that is
/// a spike.
fn excess(values: &[f64], ordinary: &[bool], run: Run, least_range: f64) -> Option<f64> {
    let (begin, end) = (run.start - NEIGHBOURS, run.end() + NEIGHBOURS);
    if end > values.len() || !ordinary[begin..end - 1].iter().all(|step| *step) {
        return None;
    }
    let mut around: Vec<f64> = values[begin..run.start].to_vec();
    around.extend(&values[run.end()..end]);
    around.sort_by(f64::total_cmp);
    // Another spike nearby does not count as range.
    let (low, high) = (around[1], around[around.len() - 2]);
    let least = RANGES * (high - low).max(least_range);
    let block = &values[run.start..run.end()];
    let above = block
        .iter()
        .fold(f64::INFINITY, |least, one| least.min(one - high));
    let below = block
        .iter()
        .fold(f64::INFINITY, |least, one| least.min(low - one));
    if above > least {
        Some(above)
    } else {
        (below > least).then_some(-below)
    }
}
