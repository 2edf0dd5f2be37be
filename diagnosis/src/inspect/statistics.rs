//! Robust figures of one sampled signal: noise, quantum, runs, quantiles; and position against
//! velocity in windows.

use crate::recording::Recording;

/// The variance of the third difference of white noise is 20 times its own:
/// 1 + 9 + 9 + 1.
const THIRD_DIFFERENCE_GAIN: f64 = 20.0;
/// The variance of the first difference of white noise is twice its own.
const FIRST_DIFFERENCE_GAIN: f64 = 2.0;
/// Share of the smallest third differences that is used; the rest may be motion.
const QUIET_SHARE: f64 = 0.7;
/// Root mean square of the smallest 70 % of a standard normal's magnitudes:
/// `sqrt(1 - 2 c phi(c) / 0.7)` with `c = 1.0364`.
const QUIET_RMS: f64 = 0.5564;
/// A step between rows longer than this many median steps is a gap for the
/// statistics, which then do not look across it.
const UNEVEN_STEP: f64 = 1.5;

/// A stretch of identical values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub start: usize,
    pub length: usize,
}

impl Run {
    pub(super) fn end(self) -> usize {
        self.start + self.length
    }
}

/// All stretches of identical values, in order; they cover the signal.
#[expect(clippy::float_cmp, reason = "a frozen channel repeats its bits")]
pub(super) fn runs(values: &[f64]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (place, value) in values.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if values[run.start] == *value => run.length += 1,
            _ => runs.push(Run {
                start: place,
                length: 1,
            }),
        }
    }
    runs
}

/// The value below which a share of the values lies; 0 for none.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let place = (share * as_float(values.len() - 1)).round();
    let place = (place as usize).min(values.len() - 1);
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Correlation of two series; 0 where one of them stands.
pub(crate) fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let count = x.len().max(1) as f64;
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        xy += (x - mean_x) * (y - mean_y);
        xx += (x - mean_x).powi(2);
        yy += (y - mean_y).powi(2);
    }
    if xx * yy > 0.0 {
        xy / (xx * yy).sqrt()
    } else {
        0.0
    }
}

/// The median step between rows.
pub(super) fn median_step(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    quantile(&mut steps, 0.5)
}

/// The path of a speed, by the trapezoidal rule.
pub(super) fn path(time_s: &[f64], speed: &[f64]) -> f64 {
    let steps = time_s.windows(2).zip(speed.windows(2));
    steps
        .map(|(time, speed)| 0.5 * (speed[0] + speed[1]) * (time[1] - time[0]))
        .sum()
}

/// What position and velocity say of one window of rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved {
    /// First and last row.
    pub rows: (usize, usize),
    /// Its length, s.
    pub seconds: f64,
    /// Change of the position, m.
    pub moved_m: f64,
    /// Integral of the velocity by the trapezoid rule, m.
    pub path_m: f64,
}

/// Adjoining windows of so many rows where x and v were both recorded, without those that hold
/// a gap.
pub(crate) fn moved(recording: &Recording, rows: usize) -> Option<Vec<Moved>> {
    let time_s = &recording.time_s;
    let (position_m, speed) = (recording.signal("x")?, recording.signal("v")?);
    let longest_s = 1.5 * as_float(rows) * median_step(time_s);
    let window = |from: usize| {
        let to = from + rows;
        Moved {
            rows: (from, to),
            seconds: time_s[to] - time_s[from],
            moved_m: position_m[to] - position_m[from],
            path_m: path(&time_s[from..=to], &speed[from..=to]),
        }
    };
    let begins = (0..time_s.len().saturating_sub(rows)).step_by(rows);
    let whole = |moved: &Moved| moved.seconds <= longest_s;
    Some(begins.map(window).filter(whole).collect())
}

/// Which steps between rows are of ordinary length.
pub(super) fn ordinary_steps(time_s: &[f64]) -> Vec<bool> {
    let longest = UNEVEN_STEP * median_step(time_s);
    time_s
        .windows(2)
        .map(|pair| pair[1] - pair[0] <= longest)
        .collect()
}

/// Standard deviation of what is left of the signal's quickest content, by
/// third differences. Motion does not count as long as most of the recording
/// is smooth over four rows. Quantisation counts as noise; a signal that rests
/// on one quantum shows none.
pub(super) fn noise(values: &[f64], ordinary: &[bool]) -> f64 {
    let squares: Vec<f64> = values
        .windows(4)
        .zip(ordinary.windows(3))
        .filter(|(_, steps)| steps.iter().all(|step| *step))
        .map(|(row, _)| (row[3] - 3.0 * row[2] + 3.0 * row[1] - row[0]).powi(2))
        .collect();
    quiet_rms(squares) / THIRD_DIFFERENCE_GAIN.sqrt()
}

/// The same by first differences: more than [`noise`] where the signal moves
/// from row to row.
pub(super) fn roughness(values: &[f64], ordinary: &[bool]) -> f64 {
    let squares: Vec<f64> = values
        .windows(2)
        .zip(ordinary)
        .filter(|(_, ordinary)| **ordinary)
        .map(|(pair, _)| (pair[1] - pair[0]).powi(2))
        .collect();
    quiet_rms(squares) / FIRST_DIFFERENCE_GAIN.sqrt()
}

/// Standard deviation of normal numbers from the smallest of their squares.
fn quiet_rms(mut squares: Vec<f64>) -> f64 {
    if squares.is_empty() {
        return 0.0;
    }
    let kept = ((QUIET_SHARE * as_float(squares.len())).ceil() as usize).clamp(1, squares.len());
    squares.select_nth_unstable_by(kept - 1, f64::total_cmp);
    let mean = squares[..kept].iter().sum::<f64>() / as_float(kept);
    mean.sqrt() / QUIET_RMS
}

/// The smallest common step of the values: their differences are whole
/// multiples of it. `None` for a signal that is constant or has no such step.
pub(super) fn quantum(values: &[f64]) -> Option<f64> {
    /// Differences over this many steps gather the rounding of the text.
    const FARTHEST_STEPS: f64 = 200.0;
    /// Deviation from a whole multiple, as a share of the step.
    const OFF_GRID: f64 = 0.1;
    /// Share of the differences that must lie on the grid.
    const ON_GRID_SHARE: f64 = 0.99;
    /// Rounding of the numbers themselves, relative to the largest.
    const ROUNDING: f64 = 1e-12;
    let largest = values.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
    let mut steps: Vec<f64> = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > ROUNDING * largest)
        .collect();
    if steps.len() < 2 {
        return None;
    }
    let smallest = quantile(&mut steps, 0.001);
    let on_grid = |step: f64| {
        let near: Vec<f64> = steps
            .iter()
            .map(|one| one / step)
            .filter(|one| *one < FARTHEST_STEPS)
            .collect();
        let hits = near
            .iter()
            .filter(|one| (*one - one.round()).abs() < OFF_GRID)
            .count();
        as_float(hits) >= ON_GRID_SHARE * as_float(near.len())
    };
    [1.0, 2.0, 3.0, 4.0, 5.0]
        .map(|divisor| smallest / divisor)
        .into_iter()
        .find(|step| on_grid(*step))
}

/// Counts as a float; recordings are far shorter than 2^53 rows.
pub(super) fn as_float(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence of standard normals: sums of twelve uniforms.
    fn normals(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            as_float((state >> 11) as usize) / as_float(1 << 53)
        };
        (0..count)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect()
    }

    #[test]
    fn val_noise_of_known_deviation_on_a_moving_signal() {
        let values: Vec<f64> = normals(10_000)
            .iter()
            .enumerate()
            .map(|(place, normal)| 1e5 * (as_float(place) * 1e-3).sin() + 250.0 * normal)
            .collect();
        let found = noise(&values, &vec![true; values.len() - 1]);
        assert!((found - 250.0).abs() < 12.5, "{found} is not 250");
    }

    #[test]
    fn val_quantum_is_found_under_noise_and_absent_without_grid() {
        let smooth: Vec<f64> = normals(5_000).iter().map(|normal| 300.0 * normal).collect();
        let stepped: Vec<f64> = smooth
            .iter()
            .map(|one| (one / 244.0).round() * 244.0)
            .collect();
        let found = quantum(&stepped).expect("a quantum");
        assert!((found - 244.0).abs() < 1e-6, "{found}");
        assert_eq!(quantum(&smooth), None);
    }

    #[test]
    fn val_runs_cover_the_signal() {
        let found = runs(&[1.0, 1.0, 2.0, 3.0, 3.0, 3.0]);
        let lengths: Vec<usize> = found.iter().map(|run| run.length).collect();
        assert_eq!(lengths, [2, 1, 3]);
    }
}
