//! Leaps from one row to the next that no axis can make.
//!
//! A step is a leap where it lies far outside of the steps before and after it.
//! (The practice and real recordings: by 4.6 times their range at the most, rows
//! after a gap aside; a lost stretch of 150 rows: by 24 to 121 times.)
//!
//! * Several signals leap in the same row: rows are missing there, whatever the
//!   time column says. (Both pressures alone do where the valve is thrown open for a row or two: where the
//!   command has just moved they are not judged. A loop that chatters to 10 V for a millisecond moved
//!   them by 14 kPa.)
//! * The position leaps and the velocity does not add up to it, or the rows before and after move
//!   by far less: counts were lost.
//!
//! A pressure or a force that leaps alone is not judged here.

use super::SignalReport;
use super::fault::{Fault, FaultKind, fault};
use super::statistics::{Run, path};
use crate::recording::Recording;

/// Steps on either side that a step is compared with.
const NEIGHBOURS: usize = 3;
/// A leap lies so many ranges of its neighbours outside of them ...
const RANGES: f64 = 10.0;
/// ... where they lie closer together than so many deviations of the noise, of these.
const LEAST_RANGE_NOISE: f64 = 3.0;
/// Slower recordings have whole strokes between two rows.
const LEAST_RATE_HZ: f64 = 200.0;
/// A command has moved where it goes through this part of its whole range within a few rows.
const COMMANDED: f64 = 0.05;
/// Part of a leap that the velocity must account for to agree with it.
const ACCOUNTED_FOR: f64 = 0.5;

/// Rows in which the recording leaps.
pub(super) fn leaps(
    recording: &Recording,
    signals: &[&SignalReport],
    ordinary: &[bool],
    rate_hz: f64,
) -> Vec<Fault> {
    if rate_hz < LEAST_RATE_HZ {
        return Vec::new();
    }
    let of_signal = |name: &'static str| -> Vec<(usize, &'static str, f64)> {
        let report = signals.iter().find(|report| report.name == name);
        let (Some(report), Some(values)) = (report, recording.signal(name)) else {
            return Vec::new();
        };
        let found = find(report, values, ordinary);
        found.map(|(row, by)| (row, name, by)).collect()
    };
    let mut all: Vec<(usize, &str, f64)> = ["x", "v", "p_a", "p_b"]
        .into_iter()
        .flat_map(of_signal)
        .collect();
    all.sort_by_key(|(row, ..)| *row);
    let rows = all.chunk_by(|one, other| one.0 == other.0);
    rows.filter_map(|leaps| told(recording, leaps)).collect()
}

/// Rows that are entered by a leap, and its size.
fn find<'v>(
    report: &SignalReport,
    values: &'v [f64],
    ordinary: &'v [bool],
) -> impl Iterator<Item = (usize, f64)> + use<'v> {
    let least_range = (LEAST_RANGE_NOISE * report.noise).max(report.quantum.unwrap_or(0.0));
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    (NEIGHBOURS..steps.len().saturating_sub(NEIGHBOURS)).filter_map(move |place| {
        let around = place - NEIGHBOURS..place + NEIGHBOURS + 1;
        if !ordinary[around.clone()].iter().all(|step| *step) {
            return None;
        }
        let others = around
            .filter(|other| *other != place)
            .map(|other| steps[other]);
        let (low, high) = others.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), step| {
            (low.min(step), high.max(step))
        });
        let step = steps[place];
        let outside = (step - high).max(low - step);
        (outside > RANGES * (high - low).max(least_range)).then_some((place + 1, step))
    })
}

fn told(recording: &Recording, leaps: &[(usize, &str, f64)]) -> Option<Fault> {
    let (row, signal, by) = *leaps.first()?;
    let run = Run {
        start: row - 1,
        length: 2,
    };
    let are_pressures = leaps
        .iter()
        .all(|(_, name, _)| matches!(*name, "p_a" | "p_b"));
    if are_pressures && is_commanded(recording, row) {
        return None;
    }
    if leaps.len() > 1 {
        let names: Vec<&str> = leaps.iter().map(|(_, name, _)| *name).collect();
        let said = format!(
            "leaps by {by:.4e} within one row, and so do {}: rows are missing here although the time goes on",
            names[1..].join(" and ")
        );
        return Some(fault(recording, signal, FaultKind::Leap, run, &said));
    }
    if signal != "x" {
        return None;
    }
    let Some(speed) = recording.signal("v") else {
        let said = format!(
            "leaps by {by:.4e} m within one row, far more than in the rows before and after: counts were lost, or the reading slipped"
        );
        return Some(fault(recording, signal, FaultKind::Leap, run, &said));
    };
    let way_m = path(&recording.time_s[row - 1..=row], &speed[row - 1..=row]);
    (way_m.abs() < ACCOUNTED_FOR * by.abs()).then(|| {
        let said = format!(
            "leaps by {by:.4e} m within one row while v adds up to {way_m:.1e} m: counts were lost, or the reading slipped"
        );
        fault(recording, signal, FaultKind::Leap, run, &said)
    })
}

/// Whether the command moved shortly before a row.
fn is_commanded(recording: &Recording, row: usize) -> bool {
    let Some(command) = recording.signal("u") else {
        return false;
    };
    let range = |values: &[f64]| {
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(*value), high.max(*value))
            });
        high - low
    };
    let before = row.saturating_sub(NEIGHBOURS)..row + 1;
    range(&command[before]) > COMMANDED * range(command)
}

#[cfg(test)]
mod tests {
    use crate::inspect::inspect;
    use crate::recording::Recording;
    use crate::rig::Rig;

    /// Pressures that step up and down at one row, with a command that is thrown open there or not.
    fn faults(thrown_v: f64) -> usize {
        let rig = "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\n\
                   u = { column = \"u\", unit = \"V\" }\np_a = { column = \"a\", unit = \"Pa(abs)\" }\n\
                   p_b = { column = \"b\", unit = \"Pa(abs)\" }\n";
        let rig = Rig::parse(rig, "rig.toml").expect("a rig");
        let mut random = crate::random::Noise::new(4, 0);
        let rows = 2000;
        let time_s = (0..rows).map(|row| f64::from(row) * 1e-3).collect();
        let pressure = |sign: f64, random: &mut crate::random::Noise| -> Vec<f64> {
            let level = |row: i32| if row < 1250 { 0.0 } else { sign * 1.4e4 };
            (0..rows)
                .map(|row| 5e5 + level(row) + 250.0 * random.normal())
                .collect()
        };
        let (a, b) = (pressure(1.0, &mut random), pressure(-1.0, &mut random));
        let command = |row: i32| match row {
            1249 => 5.0 + thrown_v,
            row => 5.0 + 0.3 * f64::from(row / 100 % 2),
        };
        let signals = [
            ("u", (0..rows).map(command).collect()),
            ("p_a", a),
            ("p_b", b),
        ];
        let signals = signals.map(|(name, values)| (name.to_owned(), values));
        let recording = Recording::from_signals("r", time_s, signals.into());
        let found = inspect(&rig, &recording).faults;
        let leaps = found
            .iter()
            .filter(|one| one.sentence.contains("rows are missing"));
        leaps.count()
    }

    #[test]
    fn regress_pressures_that_the_valve_has_thrown_are_no_missing_rows() {
        assert_eq!(faults(5.0), 0);
        assert_eq!(faults(0.0), 1);
    }
}
