//! Channels of one recording that are late against each other.
//!
//! Position and command against pressures by the energy balance of the chambers
//! ([`crate::valve_flow::lateness`]), velocity against position by kinematics. Each is a remark and no
//! fault: a gauge on a long line, a field bus and a logger that reads in turns do the same, and the
//! diagnosis says which number to correct.

use crate::laws::{Track, median_step_s};
use crate::model::Side;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::valve_flow::{Late, at_row, lateness};

/// What heat exchange and guessed volumes do to a time, one standard deviation, s.
const BALANCE_S: f64 = 0.5e-3;
/// No shorter time is remarked on, s ...
const LEAST_S: f64 = 4.0 * BALANCE_S;
/// ... nor one shorter than this many rows: a logger reads its channels in turns.
const LEAST_ROWS: f64 = 1.5;
/// A time is told from nought by so many of its deviations ...
const DEVIATIONS: f64 = 5.0;
/// ... and where it explains this part of what the balance is off by: what else is missing (a tube,
/// a spool, heat) is taken up by a shift in time in smaller part.
const EXPLAINED: f64 = 1.0 / 3.0;
/// ... and where the balance then closes to within what noise and 5 % of the flow allow (healthy axes
/// leave 0.1 to 0.7 of that, a shift in time in the place of a slow spool 2.0 to 2.4).
const CLOSED: f64 = 1.0;
/// Length of a window over which velocity is integrated, s.
const WINDOW_S: f64 = 0.02;
/// No shift of a velocity is longer, s.
const WITHIN_S: f64 = 0.04;
/// The shift of a velocity is found by Newton's method in so many steps.
const STEPS: usize = 8;

/// What is late in a recording, a line each.
pub fn remarks(rig: &Rig, recording: &Recording) -> Vec<String> {
    let mut said: Vec<String> = late_velocity(recording).into_iter().collect();
    let signals = ["u", "x", "p_a", "p_b"];
    let is_recorded = |signal: &&str| recording.signal(signal).is_some();
    if rig.valve.is_some() && signals.iter().all(is_recorded) {
        said.extend(late_by_balance(rig, recording));
    }
    said
}

fn late_by_balance(rig: &Rig, recording: &Recording) -> Vec<String> {
    let track = [Track::new(recording)];
    let sides = Side::BOTH.map(|side| {
        let found = lateness(rig, &track, side);
        found.filter(|found| found.misfit < CLOSED)
    });
    let least_s = least_s(recording);
    // The balance gives the time of the position against each gauge.
    let gauges = sides.map(|found| {
        let position = found?.position;
        let late_s = -position.late_s;
        Some(Late { late_s, ..position })
    });
    let gauges = both_told(gauges, least_s);
    let mut said: Vec<String> = late_gauges(gauges).into_iter().collect();
    // No opening comes before its command, whatever spool and tube do.
    let openings = sides.map(|found| found.map(|found| found.opening));
    if let [Some(a), Some(b)] = openings
        && a.late_s.max(b.late_s) < 0.0
        && let Some(early) = told(a, least_s).or(told(b, least_s))
    {
        said.push(format!(
            "u is logged late: the pressures answer {} before it",
            milliseconds(early)
        ));
    }
    said
}

fn least_s(recording: &Recording) -> f64 {
    LEAST_S.max(LEAST_ROWS * median_step_s(&recording.time_s))
}

/// A time that is told from nought and matters, s.
fn told(late: Late, least_s: f64) -> Option<Late> {
    let is_told = late.late_s.abs() > DEVIATIONS * late.deviation_s;
    (is_told && late.late_s.abs() > least_s && late.explains > EXPLAINED).then_some(late)
}

fn milliseconds(late: Late) -> String {
    format!(
        "{:.1} ± {:.1} ms",
        1e3 * late.late_s.abs(),
        1e3 * late.deviation_s.hypot(BALANCE_S)
    )
}

/// The times that are told from nought; beside one of these, the same time of the other gauge counts
/// too, even if the motion shows it less.
fn both_told(gauges: [Option<Late>; 2], least_s: f64) -> [Option<Late>; 2] {
    let alone = gauges.map(|late| told(late?, least_s));
    let beside = |own: usize, other: usize| {
        let (late, told) = (gauges[own]?, alone[other]?);
        ((late.late_s - told.late_s).abs() < LEAST_S).then_some(late)
    };
    [alone[0].or(beside(0, 1)), alone[1].or(beside(1, 0))]
}

/// The times by which the gauges are later than the position, where they are told from nought.
fn late_gauges(told: [Option<Late>; 2]) -> Option<String> {
    if let [Some(a), Some(b)] = told
        && a.late_s < 0.0
        && b.late_s < 0.0
    {
        return Some(format!(
            "x is late against p_a and p_b, by {}: a field bus, a filter, or a logger that reads in turns",
            milliseconds(a)
        ));
    }
    let gauges = ["p_a", "p_b"].into_iter().zip(told);
    let late: Vec<(&str, Late)> = gauges
        .filter_map(|(name, late)| Some((name, late.filter(|one| one.late_s > 0.0)?)))
        .collect();
    let (_, first) = late.first()?;
    let names: Vec<&str> = late.iter().map(|(name, _)| *name).collect();
    let are = if names.len() > 1 { "are" } else { "is" };
    Some(format!(
        "{} {are} late against x, by {}: a slow gauge, a long line to it, or a logger that reads in turns",
        names.join(" and "),
        milliseconds(*first)
    ))
}

/// A velocity that is late against the position.
fn late_velocity(recording: &Recording) -> Option<String> {
    let (position, velocity) = (recording.signal("x")?, recording.signal("v")?);
    let step_s = median_step_s(&recording.time_s);
    let window = ((WINDOW_S / step_s).round() as usize).max(2);
    let margin = (0.05 / step_s).ceil() as usize;
    let centres = (margin..recording.len().checked_sub(margin + window)?).step_by(window);
    let rows: Vec<usize> = centres.collect();
    // Products of what the velocity misses of the way with what a shift of it does; squares of both.
    let sums = |late_s: f64| {
        rows.iter().fold((0.0, 0.0, 0.0), |sums, &row| {
            let at = |row: usize| at_row(velocity, row as f64 + late_s / step_s);
            let way = position[row + window] - position[row];
            let inner: f64 = (row + 1..row + window).map(at).sum();
            let (first, last) = (at(row), at(row + window));
            let missed = way - step_s * (inner + 0.5 * (first + last));
            let slope = last - first;
            (
                sums.0 + slope * missed,
                sums.1 + slope * slope,
                sums.2 + missed * missed,
            )
        })
    };
    let recorded = sums(0.0);
    let (mut late_s, mut shifted) = (0.0, recorded);
    for _ in 0..STEPS {
        if shifted.1 <= 0.0 {
            return None;
        }
        late_s = (late_s + shifted.0 / shifted.1).clamp(-WITHIN_S, WITHIN_S);
        shifted = sums(late_s);
    }
    let late = Late {
        late_s,
        deviation_s: (shifted.2 / rows.len() as f64 / shifted.1).sqrt(),
        explains: 1.0 - shifted.2 / recorded.2.max(f64::MIN_POSITIVE),
    };
    let late = told(late, least_s(recording))?;
    let against = if late.late_s > 0.0 {
        "v is late against x"
    } else {
        "x is late against v"
    };
    Some(format!("{against}, by {}", milliseconds(late)))
}
