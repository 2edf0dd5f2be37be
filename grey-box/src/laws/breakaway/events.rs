//! When a recorded carriage leaves its place.

use crate::laws::{median_step_s, white_noise};
use model_core::real::Real;
use std::ops::Range;

/// The carriage stands where it stays within this of its place, m: presliding
/// of metal guides is some 20 to 60 um ...
pub(super) const STANDING_M: f64 = 1e-4;
/// ... or within this many times what its bristle gives way under the declared static friction:
/// from the one side to the other it gives way twice that, and a seal that has aged holds more ...
const STANDING_DEFLECTIONS: f64 = 3.0;
/// ... (that not more than this part of the first way) ...
const STANDING_OF_FIRST_WAY: f64 = 0.3;
/// ... or within this many deviations of the noise with which its position is read ...
const STANDING_DEVIATIONS: f64 = 5.0;
/// ... which is averaged down to this, m: that much of the first way does not shift an instant ...
const POSITION_KNOWN_TO_M: f64 = 1e-5;
/// ... over no more than this on either side, s: at 5 m/s2 it makes an instant 1 ms early ...
const MOST_POSITION_REACH_S: f64 = 8e-3;
/// ... for at least this long, s.
const LEAST_REST_S: f64 = 0.03;
/// The first way after break-away, m: from its parabola over time the instant
/// of the break-away is found.
pub(super) const FIRST_WAY_M: f64 = 1e-3;
/// How long before it leaves the carriage is followed, s: what a bristle creeps before that
/// is less than it gives way in the end.
const HISTORY_S: f64 = 0.2;

/// The instant at which a carriage leaves its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// The row before which it left.
    pub row: usize,
    /// The instant, s.
    pub(super) at_s: f64,
    /// +1 or -1.
    pub direction: f64,
    /// How long it has stood, s.
    pub rest_s: f64,
}

impl Breakaway {
    /// How long before it left the carriage is followed, s: not from the beginning of a short
    /// rest, in which it has only just arrived.
    pub(super) fn history_s(&self) -> f64 {
        (0.5 * self.rest_s).min(HISTORY_S)
    }
}

/// Where a carriage is, as its break-aways are read off it.
pub struct PositionReading {
    /// With the noise averaged down, m.
    pub(super) position_m: Vec<f64>,
    /// Within how much of its place the carriage stands, m.
    pub(super) standing_m: f64,
}

impl PositionReading {
    /// Of a recorded position. A bristle gives way by so much under the static friction.
    pub fn new(time_s: &[f64], position_m: &[f64], deflection_m: f64) -> Self {
        let noise_m = white_noise(position_m);
        let most = MOST_POSITION_REACH_S / median_step_s(time_s);
        let rows = (noise_m / POSITION_KNOWN_TO_M).powi(2);
        let reach = ((rows - 1.0) / 2.0).ceil().clamp(0.0, most.floor()) as usize;
        let averaged = |row: usize| mean(&position_m[around(row, reach, position_m.len())]);
        let noise_m = noise_m / ((2 * reach + 1) as f64).sqrt();
        Self {
            position_m: (0..position_m.len()).map(averaged).collect(),
            standing_m: standing_m(deflection_m).max(STANDING_DEVIATIONS * noise_m),
        }
    }
}

/// Within how much of its place a carriage stands, m, whose bristle gives way by so much under
/// its static friction.
fn standing_m(deflection_m: f64) -> f64 {
    let most_m = STANDING_OF_FIRST_WAY * FIRST_WAY_M;
    STANDING_M.max((STANDING_DEFLECTIONS * deflection_m).min(most_m))
}

/// The rows within reach of one.
pub(super) fn around(row: usize, reach: usize, rows: usize) -> Range<usize> {
    row.saturating_sub(reach)..(row + reach + 1).min(rows)
}

/// The break-aways of a recorded position.
pub fn breakaways(time_s: &[f64], reading: &PositionReading) -> Vec<Breakaway> {
    let (position_m, standing_m) = (&reading.position_m, reading.standing_m);
    let mut events = Vec::new();
    let Some(&first) = position_m.first() else {
        return events;
    };
    // The place is the mean of where it has stood so far.
    let (mut place, mut since, mut rows) = (first, 0_usize, 1.0);
    // The place before, and whether an event told of it.
    let (mut place_before, mut was_told) = (f64::INFINITY, false);
    for (row, &position) in position_m.iter().enumerate() {
        let away = position - place;
        if away.abs() <= standing_m {
            rows += 1.0;
            place += away / rows;
            continue;
        }
        let rest_s = time_s[row] - time_s[since];
        if rest_s < LEAST_REST_S {
            (place, since, rows) = (position, row, 1.0);
            continue;
        }
        // Within the first way from the place before it creeps: neither was a rest.
        let creeps = (place - place_before).abs() < FIRST_WAY_M;
        if creeps && was_told {
            events.pop();
        }
        place_before = place;
        let left = (&time_s[row..], &position_m[row..]);
        // What has left as soon as it came has not stood: it went on, slowly.
        let stood = |at_s: &f64| *at_s - time_s[since] >= LEAST_REST_S && *at_s <= time_s[row];
        let instant = instant(left, place, standing_m).filter(|at_s| !creeps && stood(at_s));
        was_told = instant.is_some();
        if let Some(at_s) = instant {
            events.push(Breakaway {
                row: time_s.partition_point(|&time| time < at_s),
                at_s,
                direction: away.signum(),
                rest_s: at_s - time_s[since],
            });
        }
        (place, since, rows) = (position, row, 1.0);
    }
    events
}

/// The instant at which a way that grows with the square of time began: the
/// root of the way is a straight line of time. `None` where the carriage does
/// not get through the first millimetre, or turns back.
pub(super) fn instant<R: Real>(
    (time_s, position_m): (&[R], &[R]),
    place_m: R,
    standing_m: f64,
) -> Option<R> {
    let is_first = |way: f64| way <= FIRST_WAY_M && way > 0.5 * standing_m;
    let roots: Vec<(R, R)> = time_s
        .iter()
        .zip(position_m)
        .map(|(&time, &position)| (time, (position - place_m).abs()))
        .take_while(|(_, way)| is_first(way.value()))
        .map(|(time, way)| (time, way.sqrt()))
        .collect();
    if roots.len() < 3 {
        return None;
    }
    let share = R::ONE / R::from_f64(roots.len() as f64);
    let (mut time, mut root) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        time += at * share;
        root += value * share;
    }
    let (mut covariance, mut variance) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        covariance += (at - time) * (value - root);
        variance += (at - time) * (at - time);
    }
    let slope = covariance / variance;
    (slope.value() > 0.0).then(|| time - root / slope)
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS_PER_S: f64 = 1000.0;

    /// A carriage that gives way by so much over a second and a half, then leaves at 10 m/s2.
    fn leaves(gives_way_m: f64) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..1700).map(|row| f64::from(row) / ROWS_PER_S).collect();
        let place = |&time: &f64| {
            let gone_s = (time - 1.5).max(0.0);
            gives_way_m * (time / 1.5).min(1.0).powi(3) + 5.0 * gone_s * gone_s
        };
        let positions = times.iter().map(place).collect();
        (times, positions)
    }

    #[test]
    fn regress_a_bristle_that_gives_way_far_leaves_all_the_same() {
        // 50 N at 1 N/um.
        for gives_way_m in [0.0, 5e-5, 1.5e-4] {
            let (times, positions) = leaves(gives_way_m);
            let reading = PositionReading::new(&times, &positions, 5e-5);
            let events = breakaways(&times, &reading);
            assert_eq!(events.len(), 1, "{gives_way_m}: {events:?}");
            assert!((events[0].rest_s - 1.5).abs() < 0.02, "{events:?}");
        }
    }

    /// It slows down, nearly stops and goes on: nothing has broken away.
    #[test]
    fn regress_a_carriage_that_creeps_on_has_not_left() {
        let times: Vec<f64> = (0..400).map(|row| f64::from(row) / ROWS_PER_S).collect();
        let place = |&time: &f64| 20.0 * (time - 0.2).powi(3) + 2e-3 * (time - 0.2);
        let positions: Vec<f64> = times.iter().map(place).collect();
        let reading = PositionReading::new(&times, &positions, 0.0);
        assert_eq!(breakaways(&times, &reading), []);
    }
}
