//! The force that pushes a carriage which stands, had it not moved.

use super::events::{Breakaway, FIRST_WAY_M, PositionReading, around, instant, mean};
use crate::laws::white_noise;
use model_core::real::Real;
use std::ops::Range;

/// How well the force at a slow break-away is known, N: with the true parameters of healthy
/// carriages 0.1 to 0.4 N are left. Faster events are scaled to it.
pub const KNOWN_TO_N: f64 = 0.4;
/// Less than this is not looked into, N: twice what is known. A contact whose form is not quite
/// the model's (elasto-plastic, Maxwell slip) left 1.1 to 2.5 N on four carriages.
pub const BREAKAWAY_NOISE_N: f64 = 0.8;
/// Rows on either side over which the force is averaged, at least and at most: until its noise
/// comes down to what a slow break-away is known to.
const FORCE_REACH: (usize, usize) = (2, 20);
/// By so many deviations of its noise a force has changed surely.
const SURELY: f64 = 4.0;
/// A carriage that the model still holds after the recorded one has left is pushed on by a
/// force that grows at least so fast, N/s.
const LEAST_RATE_N_PER_S: f64 = 50.0;

/// What was recorded of a carriage.
pub struct Recorded<'a, R> {
    time_s: &'a [f64],
    pub(super) position: &'a PositionReading,
    /// Force of the gas alone, N. Which events tell something is read off it: read off what a
    /// model drives the carriage with, a model could make those events silent that it misses.
    gas_n: &'a [f64],
    /// Force of the gas less that of a load behind its spring and all else that is no
    /// friction, N.
    driving_n: &'a [R],
    /// Rows on either side over which a force is averaged.
    reach: usize,
    /// Noise of such an average, N.
    noise_n: f64,
}

impl<'a, R: Real> Recorded<'a, R> {
    /// Of columns of one length.
    pub fn new(
        time_s: &'a [f64],
        position: &'a PositionReading,
        gas_n: &'a [f64],
        driving_n: &'a [R],
    ) -> Self {
        let row_noise_n = white_noise(gas_n);
        let rows = (row_noise_n / KNOWN_TO_N).powi(2);
        let (least, most) = FORCE_REACH;
        let reach = ((rows / 2.0).ceil() as usize).clamp(least, most);
        Self {
            time_s,
            position,
            gas_n,
            driving_n,
            reach,
            noise_n: row_noise_n / ((2 * reach + 1) as f64).sqrt(),
        }
    }

    /// The rows that are averaged around one.
    fn around(&self, row: usize) -> Range<usize> {
        around(row, self.reach, self.time_s.len())
    }
}

/// The force on a carriage had it not moved, in the direction in which it left.
pub(super) struct Push<R> {
    /// Times since the first row, s, and the force there.
    pub time_s: Vec<f64>,
    pub force_n: Vec<R>,
    /// When the recorded carriage left, s since the first row.
    pub left_s: f64,
    /// How fast it grows at the break-away, N/s.
    pub rate_n_per_s: f64,
}

impl<R: Real> Push<R> {
    /// From a while before an event to where the carriage has gone its first way.
    pub fn of(
        event: &Breakaway,
        recorded: &Recorded<'_, R>,
        air_spring_n_per_m: R,
    ) -> Option<Self> {
        let time_s = recorded.time_s;
        let (position_m, standing_m) =
            (&recorded.position.position_m, recorded.position.standing_m);
        let from_s = event.at_s - event.history_s();
        let first = time_s
            .partition_point(|&time| time < from_s)
            .max(recorded.reach);
        let place_m = mean(&position_m[recorded.around(first)]);
        let way = |row: usize| event.direction * (position_m[row] - place_m);
        let last = (event.row..time_s.len()).find(|&row| way(row) > FIRST_WAY_M)?;
        let begun = (event.row..last).find(|&row| way(row) > standing_m)?;
        let left = (&time_s[begun..last], &position_m[begun..last]);
        let left_s = instant(left, place_m, standing_m)?;
        let expanded_m = |rows: Range<usize>| {
            let ways: Vec<f64> = rows.map(|row| way(row).max(0.0)).collect();
            mean(&ways)
        };
        let unmoved = |row: usize| -> R {
            let rows = recorded.around(row);
            let share = R::from_f64(event.direction / rows.len() as f64);
            let mut force = air_spring_n_per_m * R::from_f64(expanded_m(rows.clone()));
            for &driving_n in &recorded.driving_n[rows] {
                force += share * driving_n;
            }
            force
        };
        let force_n: Vec<R> = (first..=last).map(unmoved).collect();
        let gas_n = |row: usize, reach: usize| {
            let rows = around(row, reach, time_s.len());
            let unmoved = air_spring_n_per_m.value() * expanded_m(rows.clone());
            unmoved + event.direction * mean(&recorded.gas_n[rows])
        };
        let level_n = gas_n(event.row, recorded.reach);
        // A force that is taken away again before the first way is done has moved a carriage
        // that crept: one that is held a little more firmly would not have left at all.
        let least_n = BREAKAWAY_NOISE_N.hypot(SURELY * recorded.noise_n);
        let is_taken_away = |row: usize| gas_n(row, recorded.reach) < level_n - least_n;
        if (event.row..=last).any(is_taken_away) {
            return None;
        }
        // Over as few rows whatever the noise: a hard stroke would else seem a slow one.
        let (reach, _) = FORCE_REACH;
        let before = event.row.checked_sub(2 * reach);
        let before = before.filter(|&row| row >= first)?;
        let rise_n = gas_n(event.row, reach) - gas_n(before, reach);
        Some(Self {
            left_s: left_s - time_s[first],
            rate_n_per_s: rise_n / (time_s[event.row] - time_s[before]),
            time_s: time_s[first..=last]
                .iter()
                .map(|time| time - time_s[first])
                .collect(),
            force_n,
        })
    }

    /// The same without derivatives.
    pub fn still(&self) -> Push<f64> {
        Push {
            time_s: self.time_s.clone(),
            force_n: self.force_n.iter().map(|force| force.value()).collect(),
            left_s: self.left_s,
            rate_n_per_s: self.rate_n_per_s,
        }
    }

    /// How fast it grows on after the carriage has left, N/s.
    pub fn growth_n_per_s(&self) -> f64 {
        self.rate_n_per_s.max(LEAST_RATE_N_PER_S)
    }

    /// The force at a time since the first row. Beyond the last it grows on.
    pub fn at(&self, time_s: R) -> R {
        let last = self.time_s.len() - 1;
        let beyond_s = time_s - R::from_f64(self.time_s[last]);
        if beyond_s.value() >= 0.0 {
            return self.force_n[last] + beyond_s * R::from_f64(self.growth_n_per_s());
        }
        let after = self.time_s.partition_point(|&time| time <= time_s.value());
        let before = after.clamp(1, last) - 1;
        let (from_s, to_s) = (self.time_s[before], self.time_s[before + 1]);
        let share = (time_s - R::from_f64(from_s)) / R::from_f64(to_s - from_s);
        self.force_n[before] + (self.force_n[before + 1] - self.force_n[before]) * share
    }
}
