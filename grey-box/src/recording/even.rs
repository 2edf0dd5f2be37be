//! Rows that were sampled evenly and stamped late: a PC reads a clock when it gets
//! round to it.
//!
//! Stamps that scatter about an even grid are one of two things: rows that were
//! taken when the stamp says, or evenly sampled rows whose stamps are late. The
//! values tell: a row that moves is predicted from its neighbours by a cubic, once
//! at the stamps and once on the grid; the right times predict better. Where the
//! grid does, or where stamps run backward or repeat and scatter without memory, the
//! rows are placed on it.
//!
//! Not judged: recordings with gaps, stamps that are coarse (a clock that ticks more
//! slowly than the rows come has a memory), rows that do not move.

use crate::text::plain;

/// Fewer rows show no grid.
const LEAST_ROWS: usize = 200;
/// Scatter of stamps that is worth a look, and that may still be lateness, in steps of the grid.
const SCATTER_STEPS: std::ops::Range<f64> = 0.05..20.0;
/// Correlation of neighbouring stamps' scatter from which on it is no accident: lost rows,
/// drift, a coarse clock. Of 200 independent stamps 0.3 is four deviations.
const REMEMBERED: f64 = 0.3;
/// The right times predict moving rows better by this factor at least.
const BETTER: f64 = 1.5;
/// Steps of rounded stamps take this many values and one more at the most ...
const FEW_STEPS: usize = 2;
/// ... each to within this part of the grid's step.
const ALIKE: f64 = 0.03;
/// ... and a rounding is finer than this part of it: a whole step is a lost row.
const COARSEST: f64 = 0.75;
/// Share of the rows that move most.
const MOVING: f64 = 0.2;
/// The least late stamps: they lie on the grid.
const EARLIEST: f64 = 0.05;

/// The even times of the rows, and what is said of it.
pub(super) struct Even {
    pub time_s: Vec<f64>,
    pub remark: String,
}

/// The grid that rows were sampled on, if their stamps are late by chance. `disorder` is the
/// first line whose stamp does not rise.
pub(super) fn grid(stamps_s: &[f64], columns: &[&[f64]], disorder: Option<u32>) -> Option<Even> {
    if stamps_s.len() < LEAST_ROWS {
        return None;
    }
    let line = Line::through(stamps_s);
    let scatter_s: Vec<f64> = stamps_s
        .iter()
        .enumerate()
        .map(|(row, stamp_s)| stamp_s - line.at(row))
        .collect();
    if let Some(rounding_s) = rounding(stamps_s, &scatter_s, line.step_s) {
        return Some(Even {
            time_s: (0..stamps_s.len()).map(|row| line.at(row)).collect(),
            remark: format!(
                "the time stamps are rounded to {} ms while the rows were sampled evenly: \
                 the rows are placed {} ms apart",
                plain(1e3 * rounding_s, 3),
                plain(1e3 * line.step_s, 5)
            ),
        });
    }
    let mut sorted = scatter_s.clone();
    sorted.sort_by(f64::total_cmp);
    let quantile = |share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
    let width_s = quantile(0.99) - quantile(0.01);
    let largest_s = sorted[sorted.len() - 1] - sorted[0];
    let is_scattered = SCATTER_STEPS.contains(&(width_s / line.step_s))
        && largest_s < 2.0 * SCATTER_STEPS.end * line.step_s
        && memory(&scatter_s) < REMEMBERED;
    let is_late = || match disorder {
        Some(_) => true,
        None => is_smoother_on_the_grid(stamps_s, columns),
    };
    (is_scattered && is_late()).then(|| {
        let first_s = line.first_s + quantile(EARLIEST);
        let backward = disorder.map_or(String::new(), |line| {
            format!(" (at line {line} they do not even rise)")
        });
        Even {
            time_s: (0..stamps_s.len())
                .map(|row| first_s + line.step_s * row as f64)
                .collect(),
            remark: format!(
                "the time stamps jitter by up to {} ms{backward} while the rows were sampled evenly: \
                 the rows are placed {} ms apart",
                plain(1e3 * (quantile(0.99) - quantile(EARLIEST)), 3),
                plain(1e3 * line.step_s, 5)
            ),
        }
    })
}

/// What even stamps were rounded to, s: their steps take a few values that are a rounding apart, and
/// none is further from the grid than rounding takes it.
fn rounding(stamps_s: &[f64], scatter_s: &[f64], step_s: f64) -> Option<f64> {
    let alike_s = ALIKE * step_s;
    let mut steps_s: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps_s.sort_by(f64::total_cmp);
    let leaps_s = steps_s.windows(2).map(|pair| pair[1] - pair[0]);
    let apart_s: Vec<f64> = leaps_s.filter(|leap_s| *leap_s > alike_s).collect();
    let rounding_s = apart_s.iter().copied().reduce(f64::max)?;
    let farthest_s = scatter_s
        .iter()
        .fold(0.0_f64, |most, one| most.max(one.abs()));
    let is_rounded = apart_s.len() <= FEW_STEPS
        && rounding_s > SCATTER_STEPS.start * step_s
        && rounding_s < COARSEST * step_s
        && farthest_s < rounding_s;
    is_rounded.then_some(rounding_s)
}

/// The straight line of stamps over rows, by least squares.
struct Line {
    first_s: f64,
    step_s: f64,
}

impl Line {
    fn through(stamps_s: &[f64]) -> Self {
        let rows = stamps_s.len() as f64;
        let middle = 0.5 * (rows - 1.0);
        let mean_s = stamps_s.iter().sum::<f64>() / rows;
        let products = stamps_s.iter().enumerate();
        let slope: f64 = products
            .map(|(row, stamp_s)| (row as f64 - middle) * (stamp_s - mean_s))
            .sum();
        let step_s = slope / (rows * (rows * rows - 1.0) / 12.0);
        Self {
            first_s: mean_s - step_s * middle,
            step_s,
        }
    }

    fn at(&self, row: usize) -> f64 {
        self.first_s + self.step_s * row as f64
    }
}

/// Correlation of each value with the next.
fn memory(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    let products: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
    products / squares.max(f64::MIN_POSITIVE)
}

/// Whether some column is predicted plainly better on an even grid, and none plainly worse.
fn is_smoother_on_the_grid(stamps_s: &[f64], columns: &[&[f64]]) -> bool {
    let ratios: Vec<f64> = columns
        .iter()
        .filter_map(|column| Some(misses(stamps_s, column)?).filter(|ratio| ratio.is_finite()))
        .collect();
    ratios.iter().any(|ratio| *ratio > BETTER) && ratios.iter().all(|ratio| *ratio > 1.0 / BETTER)
}

/// What a cubic through the neighbours misses of the rows that move most at their stamps,
/// over what it misses on an even grid: medians.
fn misses(stamps_s: &[f64], column: &[f64]) -> Option<f64> {
    let middles = 2..column.len() - 2;
    let moved = |row: usize| (column[row + 1] - column[row - 1]).abs();
    let mut moves: Vec<f64> = middles.clone().map(moved).collect();
    let place = ((1.0 - MOVING) * moves.len() as f64) as usize;
    let least = *moves.select_nth_unstable_by(place, f64::total_cmp).1;
    let moving: Vec<usize> = middles.filter(|&row| moved(row) > least).collect();
    if moving.len() < LEAST_ROWS / 10 {
        return None;
    }
    let median = |times: &dyn Fn(usize) -> [f64; 5]| {
        let missed = |&row: &usize| {
            let around = [-2_isize, -1, 1, 2].map(|step| column[row.wrapping_add_signed(step)]);
            (column[row] - cubic(times(row), around)).abs()
        };
        let mut missed: Vec<f64> = moving.iter().map(missed).collect();
        let middle = missed.len() / 2;
        *missed.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let stamped = median(&|row| std::array::from_fn(|step| stamps_s[row + step - 2]));
    let even = median(&|_| [-2.0, -1.0, 0.0, 1.0, 2.0]);
    (even > 0.0).then(|| stamped / even)
}

/// The cubic through four values at the first two and the last two times, at the middle one
/// (Lagrange).
fn cubic(times: [f64; 5], values: [f64; 4]) -> f64 {
    let outer = [times[0], times[1], times[3], times[4]];
    let weight = |place: usize| -> f64 {
        let others = (0..4).filter(|other| *other != place);
        others
            .map(|other| (times[2] - outer[other]) / (outer[place] - outer[other]))
            .product()
    };
    (0..4).map(|place| weight(place) * values[place]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;

    const STEP_S: f64 = 1e-3;

    /// A swing with noise at evenly spaced instants, or where the stamps say.
    fn recording(is_even: bool) -> (Vec<f64>, Vec<f64>) {
        let mut noise = Noise::new(3, 0);
        let rows = 0..3000;
        let stamps_s: Vec<f64> = rows
            .map(|row| STEP_S * (f64::from(row) + 0.4 * noise.normal().abs()))
            .collect();
        let value = |(row, stamp_s): (usize, &f64)| {
            let time_s = if is_even {
                STEP_S * row as f64
            } else {
                *stamp_s
            };
            (6.0 * time_s).sin() + 1e-4 * noise.normal()
        };
        let values = stamps_s.iter().enumerate().map(value).collect();
        (stamps_s, values)
    }

    #[test]
    fn val_late_stamps_of_even_rows_are_put_right() {
        let (stamps_s, values) = recording(true);
        let even = grid(&stamps_s, &[&values], None).expect("late");
        for (row, time_s) in even.time_s.iter().enumerate() {
            assert!(
                (time_s - STEP_S * row as f64).abs() < 0.1 * STEP_S,
                "{row}: {time_s}"
            );
        }
        assert!(
            even.remark.contains("placed 1.0000 ms apart"),
            "{}",
            even.remark
        );
    }

    /// Seconds since some day, as 32-bit numbers: 0.49 ms apart.
    #[test]
    fn val_rounded_stamps_of_even_rows_are_put_right() {
        let (_, values) = recording(true);
        for begin_s in [5000.0, 5000.0003] {
            let stamps_s: Vec<f64> = (0..3000)
                .map(|row| f64::from((begin_s + STEP_S * f64::from(row)) as f32))
                .collect();
            let even = grid(&stamps_s, &[&values], None).expect("rounded");
            let steps_s = even.time_s.windows(2).map(|pair| pair[1] - pair[0]);
            assert!(
                steps_s
                    .into_iter()
                    .all(|step_s| (step_s - STEP_S).abs() < 1e-6)
            );
            assert!(
                even.remark.contains("rounded to 0.488 ms"),
                "{}",
                even.remark
            );
        }
    }

    #[test]
    fn prop_true_stamps_of_uneven_rows_stay() {
        let (stamps_s, values) = recording(false);
        assert!(grid(&stamps_s, &[&values], None).is_none());
    }

    #[test]
    fn prop_a_coarse_clock_and_lost_rows_are_no_jitter() {
        let values: Vec<f64> = (0..3000)
            .map(|row| (0.006 * f64::from(row)).sin())
            .collect();
        let coarse: Vec<f64> = (0..3000)
            .map(|row| (f64::from(row) * STEP_S / 0.0156).floor() * 0.0156)
            .collect();
        assert!(grid(&coarse, &[&values], Some(3)).is_none());
        let lost: Vec<f64> = (0..3000)
            .map(|row| STEP_S * f64::from(if row < 1500 { row } else { row + 150 }))
            .collect();
        assert!(grid(&lost, &[&values], None).is_none());
        let one_lost: Vec<f64> = (0..3000)
            .map(|row| STEP_S * f64::from(if row < 1500 { row } else { row + 1 }))
            .collect();
        assert!(grid(&one_lost, &[&values], None).is_none());
    }
}
