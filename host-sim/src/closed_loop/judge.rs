//! A run judged, part by part of its motion.

use super::run::{Row, Run};
use crate::motion::{Motion, Placed, Segment};

/// From the end of a reference to the judgement of where the load stands, s.
pub const AFTER_MOVE_S: f64 = 0.3;

/// What a part of a motion came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The part.
    pub part: Placed,
    /// Largest error, m.
    pub worst_m: f64,
    /// Root of the mean square of the errors, m.
    pub rms_m: f64,
    /// At rest after a move: furthest beyond its end, m.
    pub overshoot_m: Option<f64>,
    /// At rest: largest error from [`AFTER_MOVE_S`] on, m.
    pub at_rest_m: Option<f64>,
    /// At rest: movement of the command about its mean from [`AFTER_MOVE_S`]
    /// on, V rms.
    pub command_movement_v: Option<f64>,
}

impl Run {
    /// The rows from one time to just before another, s.
    pub fn between(&self, from_s: f64, to_s: f64) -> &[Row] {
        let place = |time_s: f64| {
            self.rows
                .partition_point(|row| row.truth.time_s < time_s - HALF_A_NANOSECOND_S)
        };
        let (from, to) = (place(from_s), place(to_s));
        &self.rows[from..to.max(from)]
    }
}

/// Times of rows are sums of ticks: what rounding adds is less than this.
const HALF_A_NANOSECOND_S: f64 = 5e-10;

/// Largest error, m.
pub fn worst_m(rows: &[Row]) -> f64 {
    rows.iter()
        .map(|row| row.error_m().abs())
        .fold(0.0, f64::max)
}

/// Root of the mean square of the errors, m.
pub fn rms_m(rows: &[Row]) -> f64 {
    root_mean_square(rows.iter().map(Row::error_m))
}

/// Movement of the command about its mean, V rms.
pub fn command_movement_v(rows: &[Row]) -> f64 {
    let mean_v = rows.iter().map(Row::commanded_v).sum::<f64>() / rows.len().max(1) as f64;
    root_mean_square(rows.iter().map(|row| row.commanded_v() - mean_v))
}

/// Furthest beyond the end of a move, m. A load that leads its reference is
/// beyond the end early: that counts too.
pub fn overshoot_m(run: &Run, moving: &Placed, rest_end_s: f64) -> f64 {
    let Segment::Move { to_m } = moving.segment else {
        return 0.0;
    };
    let direction = (to_m - moving.from_m).signum();
    run.between(moving.begin_s, rest_end_s)
        .iter()
        .map(|row| (row.truth.position_m - to_m) * direction)
        .fold(0.0, f64::max)
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    libm::sqrt(values.map(|value| value * value).sum::<f64>() / count)
}

/// Every part of the motion that the run has reached.
pub fn judge(run: &Run, motion: &Motion) -> Vec<Judged> {
    let parts = motion.parts();
    let reached = |part: &Placed| !run.between(part.begin_s, part.end_s).is_empty();
    parts
        .iter()
        .enumerate()
        .filter(|(_, part)| reached(part))
        .map(|(place, part)| {
            let before = place.checked_sub(1).and_then(|before| parts.get(before));
            judge_part(run, *part, before)
        })
        .collect()
}

fn judge_part(run: &Run, part: Placed, before: Option<&Placed>) -> Judged {
    let rows = run.between(part.begin_s, part.end_s);
    let settled = run.between(part.begin_s + AFTER_MOVE_S, part.end_s);
    let rests = matches!(part.segment, Segment::Hold { .. }) && !settled.is_empty();
    let moved = before.filter(|before| matches!(before.segment, Segment::Move { .. }));
    Judged {
        part,
        worst_m: worst_m(rows),
        rms_m: rms_m(rows),
        overshoot_m: moved
            .filter(|_| rests)
            .map(|moving| overshoot_m(run, moving, part.end_s)),
        at_rest_m: rests.then(|| worst_m(settled)),
        command_movement_v: rests.then(|| command_movement_v(settled)),
    }
}
