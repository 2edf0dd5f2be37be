//! Channels that are sampled more slowly than the rows come and repeated in
//! between: a slow bus, a second logger, a held value.
//!
//! Where a channel changes by several quanta it would change in the next row
//! too; one that is held never does. Of the practice and real recordings at most
//! a third of such steps follow on a row without a change; a held channel has
//! them all. Thirty steps of one third each come to 95 % by chance once in 1e13.

use super::SignalReport;
use super::fault::{Fault, FaultKind, at_odds_as};
use super::statistics::quantile;
use crate::recording::Recording;

/// Steps that are judged are so many quanta long.
const LARGE_STEP_QUANTA: f64 = 3.0;
/// Fewer of them say nothing.
const LEAST_STEPS: usize = 30;
/// Share of them before which the channel must have held.
const HELD_SHARE: f64 = 0.95;

/// A channel that holds each value for several rows.
pub(super) fn held(
    recording: &Recording,
    report: &SignalReport,
    values: &[f64],
    rate_hz: f64,
) -> Option<Fault> {
    let rows = rows_held(values)?;
    let step_s = 1.0 / rate_hz;
    let said = format!(
        "changes only in every {rows} rows: it is sampled at about {:.4} Hz and repeated at {rate_hz:.4} Hz, \
         on average {:.2} ms late; record all channels at one rate, or keep the rows in which it is new",
        rate_hz / rows as f64,
        0.5e3 * (rows - 1) as f64 * step_s,
    );
    Some(at_odds_as(FaultKind::Held, recording, &report.name, &said))
}

/// For how many rows each value is held.
fn rows_held(values: &[f64]) -> Option<usize> {
    let changes: Vec<(usize, f64)> = values
        .windows(2)
        .enumerate()
        .map(|(row, pair)| (row + 1, (pair[1] - pair[0]).abs()))
        .filter(|(_, step)| *step > 0.0)
        .collect();
    let mut sizes: Vec<f64> = changes.iter().map(|(_, step)| *step).collect();
    let quantum = quantile(&mut sizes, 0.001);
    let mut gaps: Vec<f64> = changes
        .windows(2)
        .filter(|pair| pair[1].1 >= LARGE_STEP_QUANTA * quantum)
        .map(|pair| (pair[1].0 - pair[0].0) as f64)
        .collect();
    if gaps.len() < LEAST_STEPS {
        return None;
    }
    let usual = quantile(&mut gaps, 0.5);
    let held = gaps.iter().filter(|gap| **gap >= 2.0).count();
    (usual >= 2.0 && held as f64 >= HELD_SHARE * gaps.len() as f64).then_some(usual as usize)
}
