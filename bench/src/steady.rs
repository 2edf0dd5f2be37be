//! Stretches of a recording in which something stays as it is.

use std::ops::Range;

use grey_box::laws::{Track, white_noise};
use grey_box::rig::Rig;

/// The means of a line's tenths may be off it by this part of the way that it covers: the velocity
/// then changes by less than some 10 times as much ...
const OFF_LINE_SHARE: f64 = 0.002;
/// ... and by the noise, so many deviations.
const NOISE_DEVIATIONS: f64 = 4.0;
/// Speeds of both halves of a stretch differ by less than this part ...
const SPEED_CHANGE: f64 = 0.02;
/// ... and are known to this part by the noise, or the stretch is too short.
const SPEED_DEVIATION: f64 = 0.01;
/// The shortest stretch, rows.
const LEAST_ROWS: usize = 20;
/// The shortest way, m: a bristle is bent over some tens of micrometres, and a contact has slid
/// when it went many times that.
const LEAST_WAY_M: f64 = 2e-4;
/// This part of each end is left out: the speed settles, the friction too.
const TRIMMED_SHARE: f64 = 0.1;
/// Batches whose means show the deviation of a stretch's mean, however its noise is correlated.
const BATCHES: usize = 10;

/// A gauge is linear to this part of its reading, one deviation (chosen: of laboratory gauges).
pub const GAUGE_LINEARITY: f64 = 3e-4;
/// So is a force sensor (chosen).
pub const FORCE_LINEARITY: f64 = 1e-3;

/// Stretches in which the carriage moves at one speed.
pub fn at_one_speed(track: &Track<'_>, rig: &Rig) -> Vec<Range<usize>> {
    let time_s = &track.recording.time_s;
    let Some(position_m) = track.recording.signal("x") else {
        return Vec::new();
    };
    let noise_m = signal_noise(rig, "x", position_m);
    let line = Lines {
        time_s,
        position_m,
        noise_m,
    };
    let mut found = Vec::new();
    let mut from = 0;
    while from + LEAST_ROWS < time_s.len() {
        let to = line.reach(from, 1);
        // Begun within an acceleration the line ended too early: it is sought once more from
        // its end.
        let begin = to - line.reach_back(to);
        if line.is_motion(begin..to) && begin <= from {
            found.push(trimmed(from..to));
            from = to;
        } else {
            from += LEAST_ROWS / 2;
        }
    }
    found
}

/// Standard deviation of a signal's noise: what it shows, and at least what its converter makes of it.
pub fn signal_noise(rig: &Rig, signal: &str, values: &[f64]) -> f64 {
    let declared = rig.signals.get(signal);
    let step = declared.and_then(|one| one.resolution).unwrap_or(0.0);
    let shown = white_noise(values);
    shown.max(step / 12_f64.sqrt()).max(f64::MIN_POSITIVE)
}

struct Lines<'a> {
    time_s: &'a [f64],
    position_m: &'a [f64],
    noise_m: f64,
}

impl Lines<'_> {
    /// The end of the longest straight line from a row on.
    fn reach(&self, from: usize, first: usize) -> usize {
        let last = self.time_s.len();
        longest(LEAST_ROWS * first, last - from, |rows| {
            self.is_straight(from..from + rows)
        }) + from
    }

    /// The length of the longest straight line up to a row.
    fn reach_back(&self, to: usize) -> usize {
        longest(LEAST_ROWS.min(to), to, |rows| {
            self.is_straight(to - rows..to)
        })
    }

    fn is_straight(&self, rows: Range<usize>) -> bool {
        let (slope, middle_s, middle_m) = self.line(&rows);
        let way_m = slope.abs() * (self.time_s[rows.end - 1] - self.time_s[rows.start]);
        let size = rows.len().div_ceil(BATCHES);
        let noise_m = self.noise_m / (size as f64).sqrt();
        let allowed_m = NOISE_DEVIATIONS * noise_m + OFF_LINE_SHARE * way_m;
        let (time_s, position_m) = (&self.time_s[rows.clone()], &self.position_m[rows]);
        time_s
            .chunks(size)
            .zip(position_m.chunks(size))
            .all(|(time, position)| {
                let line_m = middle_m + slope * (mean(time) - middle_s);
                (mean(position) - line_m).abs() <= allowed_m
            })
    }

    fn line(&self, rows: &Range<usize>) -> (f64, f64, f64) {
        let (time, position) = (&self.time_s[rows.clone()], &self.position_m[rows.clone()]);
        (slope(time, position), mean(time), mean(position))
    }

    fn is_motion(&self, rows: Range<usize>) -> bool {
        let way_m = (self.position_m[rows.end - 1] - self.position_m[rows.start]).abs();
        if rows.len() < LEAST_ROWS || way_m < LEAST_WAY_M {
            return false;
        }
        let middle = rows.start + rows.len() / 2;
        let [first, second] = [rows.start..middle, middle..rows.end].map(|half| self.line(&half).0);
        let half_s = 0.5 * (self.time_s[rows.end - 1] - self.time_s[rows.start]);
        // Of the slope of evenly sampled white noise.
        let noise = self.noise_m * (12.0 / (0.5 * rows.len() as f64)).sqrt() / half_s;
        let speed = 0.5 * (first + second).abs();
        let allowed = SPEED_CHANGE * speed + NOISE_DEVIATIONS * noise;
        noise < SPEED_DEVIATION * speed && (first - second).abs() < allowed
    }
}

/// The largest number for which something holds, sought by doubling and halving from `first` on.
fn longest(first: usize, most: usize, holds: impl Fn(usize) -> bool) -> usize {
    let mut good = first.min(most);
    let mut step = good.max(1);
    while good < most && holds((good + step).min(most)) {
        good = (good + step).min(most);
        step *= 2;
    }
    while step > 1 {
        step = step.div_ceil(2);
        if good + step <= most && holds(good + step) {
            good += step;
        }
    }
    good
}

fn trimmed(rows: Range<usize>) -> Range<usize> {
    let edge = (TRIMMED_SHARE * rows.len() as f64) as usize;
    rows.start + edge..rows.end - edge
}

/// Mean of values; 0 of none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Slope of the least-squares line.
pub fn slope(time_s: &[f64], values: &[f64]) -> f64 {
    let middle_s = mean(time_s);
    let pairs = time_s.iter().zip(values);
    let (mut product, mut square) = (0.0, 0.0);
    for (at_s, value) in pairs {
        product += (at_s - middle_s) * value;
        square += (at_s - middle_s).powi(2);
    }
    product / square.max(f64::MIN_POSITIVE)
}

/// Mean and its standard deviation, from the means of batches: right for correlated noise too.
pub fn mean_of_batches(values: &[f64]) -> (f64, f64) {
    let size = values.len().div_ceil(BATCHES).max(1);
    let means: Vec<f64> = values.chunks(size).map(mean).collect();
    let middle = mean(values);
    let count = means.len() as f64;
    let squares: f64 = means.iter().map(|one| (one - middle).powi(2)).sum();
    let variance = squares / (count - 1.0).max(1.0);
    (middle, (variance / count).sqrt())
}

/// Runs of rows in which a signal keeps its value within a tolerance.
pub fn held(values: &[f64], tolerance: f64) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut from = 0;
    for row in 1..=values.len() {
        if row == values.len() || (values[row] - values[from]).abs() > tolerance {
            runs.push(from..row);
            from = row;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_longest_is_found() {
        for limit in [20, 21, 37, 64, 99, 100] {
            assert_eq!(longest(20, 100, |rows| rows <= limit), limit);
        }
    }

    #[test]
    fn val_batches_show_the_deviation_of_a_mean_of_correlated_noise() {
        let mut noise = grey_box::random::Noise::new(1, 0);
        let mut of_batches = 0.0;
        let mut true_squares = 0.0;
        for _ in 0..200 {
            let mut values = Vec::new();
            for _ in 0..100 {
                values.extend([noise.normal(); 10]);
            }
            let (middle, deviation) = mean_of_batches(&values);
            of_batches += deviation * deviation / 200.0;
            true_squares += middle * middle / 200.0;
        }
        assert!(
            (of_batches / true_squares - 1.0_f64).abs() < 0.3,
            "{of_batches} {true_squares}"
        );
    }

    #[test]
    fn prop_runs_of_a_held_signal_cover_it() {
        assert_eq!(
            held(&[1.0, 1.0, 2.0, 2.0, 2.0, 1.0], 0.1),
            [0..2, 2..5, 5..6]
        );
    }
}
