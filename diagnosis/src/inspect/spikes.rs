//! Spikes: one to three rows far outside of the rows around them, as a burst of
//! interference or a lost telegram writes them.
//!
//! A row is judged by its own neighbourhood alone, so that neither the number of
//! spikes nor the slope of the signal matters: it is compared with the line through
//! the rows before and after it, in units of what those scatter about that line.
//! What is sampled of an axis stays within ten of them (all practice, shop-floor and
//! real recordings; a laser gauge with lost readings reaches 25), a burst of 1.5 bar
//! on a gauge with 0.25 kPa of noise is 380.

use super::fault::{Fault, FaultKind, fault};
use super::statistics::{Run, as_float};
use super::{LISTED, SignalReport};
use crate::recording::Recording;

/// Rows on either side that a spike is compared with.
const NEIGHBOURS: usize = 4;
/// Longest spike, rows.
const LONGEST: usize = 3;
/// A spike stands so many times the scatter of its neighbours off their line ...
const TIMES_SCATTER: f64 = 50.0;
/// ... which is at least so many deviations of the noise: of eight draws the third largest.
const LEAST_SCATTER_NOISE: f64 = 1.5;
/// Neighbours that may be spikes themselves.
const SPOILED: usize = 2;

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

/// Rows of each spike and how far it stands off its neighbours' line.
fn find(report: &SignalReport, values: &[f64], ordinary: &[bool]) -> Vec<(Run, f64)> {
    // A quiet part of a recording shows less noise than the sensor has.
    let noise = report.noise.max(report.declared_noise.unwrap_or(0.0));
    let least = (LEAST_SCATTER_NOISE * noise)
        .max(report.quantum.unwrap_or(0.0))
        .max(report.declared_resolution.unwrap_or(0.0));
    let mut found = Vec::new();
    found.extend(at_an_end(values, ordinary, least, true));
    let mut row = NEIGHBOURS;
    while row < values.len() {
        let spike = (1..=LONGEST).find_map(|length| {
            let run = Run { start: row, length };
            excess(values, ordinary, run, least).map(|excess| (run, excess))
        });
        row = spike.map_or(row + 1, |(run, _)| run.end());
        found.extend(spike);
    }
    found.extend(at_an_end(values, ordinary, least, false));
    found
}

/// A spike among the first or the last rows, against the line of the rows further in. Motion may
/// begin there: what is extrapolated is to be exceeded twice as far.
fn at_an_end(
    values: &[f64],
    ordinary: &[bool],
    least_scatter: f64,
    is_first: bool,
) -> Option<(Run, f64)> {
    let last = values.len().checked_sub(4 * NEIGHBOURS)? + 4 * NEIGHBOURS - 1;
    // From the inside out, counted from the end in question.
    (0..NEIGHBOURS).rev().find_map(|outside| {
        let (row, begin) = if is_first {
            (outside, outside + 1)
        } else {
            (last - outside, last - outside - 2 * NEIGHBOURS)
        };
        let (middle, end) = (begin + NEIGHBOURS, begin + 2 * NEIGHBOURS);
        let steps = begin.min(row)..(end - 1).max(row);
        if !ordinary[steps].iter().all(|step| *step) {
            return None;
        }
        let inner = [
            (begin, &values[begin..middle]),
            (middle, &values[middle..end]),
        ];
        let line = Line::through(inner[0], inner[1]);
        let off = |row: usize| values[row] - line.at(row);
        let mut scatter: Vec<f64> = (begin..end).map(|row| off(row).abs()).collect();
        scatter.sort_by(|one, other| other.total_cmp(one));
        let least = 2.0 * TIMES_SCATTER * scatter[SPOILED].max(least_scatter);
        let run = Run {
            start: row,
            length: 1,
        };
        (off(row).abs() > least).then(|| (run, off(row)))
    })
}

/// How far the rows of a run stand off the line of their neighbours, all on one side,
/// where that is a spike.
fn excess(values: &[f64], ordinary: &[bool], run: Run, least_scatter: f64) -> Option<f64> {
    let (begin, end) = (run.start - NEIGHBOURS, run.end() + NEIGHBOURS);
    if end > values.len() || !ordinary[begin..end - 1].iter().all(|step| *step) {
        return None;
    }
    let line = Line::through(
        (begin, &values[begin..run.start]),
        (run.end(), &values[run.end()..end]),
    );
    let off = |row: usize| values[row] - line.at(row);
    let mut scatter: Vec<f64> = (begin..run.start)
        .chain(run.end()..end)
        .map(|row| off(row).abs())
        .collect();
    scatter.sort_by(|one, other| other.total_cmp(one));
    let least = TIMES_SCATTER * scatter[SPOILED].max(least_scatter);
    let first = off(run.start);
    let is_spike = (run.start..run.end()).all(|row| off(row) * first.signum() > least);
    is_spike.then_some(first)
}

/// The line through the medians of two stretches of rows.
struct Line {
    row: f64,
    value: f64,
    slope: f64,
}

impl Line {
    fn through(before: (usize, &[f64]), after: (usize, &[f64])) -> Self {
        let middle = |(first, rows): (usize, &[f64])| {
            let mut sorted = rows.to_vec();
            sorted.sort_by(f64::total_cmp);
            let half = sorted.len() / 2;
            let median = 0.5 * (sorted[half - 1] + sorted[half]);
            (as_float(first) + 0.5 * as_float(rows.len() - 1), median)
        };
        let (before, after) = (middle(before), middle(after));
        Self {
            row: before.0,
            value: before.1,
            slope: (after.1 - before.1) / (after.0 - before.0),
        }
    }

    fn at(&self, row: usize) -> f64 {
        self.value + self.slope * (as_float(row) - self.row)
    }
}
