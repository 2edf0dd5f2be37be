//! A law whose noise is that of what it is driven by, fitted in units of it.
//!
//! All of a balance of recorded forces is recorded: a model that scales the forces down scales
//! their noise down too, and least squares in newtons prefer it (errors in variables: under ten
//! times the usual noise a friction of 1.3 N per bar was fitted as 7.6 +- 1.3). So each output is
//! divided by the noise that the model itself makes of it, which is what orthogonal regression
//! (Deming; Adcock 1878) minimises where all rows have one noise:
//!
//! ```text
//! cost = 1/2 sum over outputs [ sum r^2 ] / s^2,   s^2 = (other^2 + mean n^2) / noise^2
//! ```
//!
//! with r what the recordings leave of an output in units of its size, n what one more draw of
//! their noise changes of that, `other` all other noise, and `noise` what both come to at the
//! model that the noise was learned of, where s is 1. Forces are linear in nearly every number,
//! so n is taken as linear from where a fit begins: one more draw is run once a fit.

use super::law_problem::{LawProblem, Row};
use super::{LeastSquares, NormalEquations, ResidualSums};
use crate::laws::Track;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// What one more draw of noise changes of an output, squared and in the mean, in units of its
/// noise, as a quadratic of the steps from where it was run.
struct Change {
    square: f64,
    /// Half its gradient.
    slope: DVector<f64>,
    curvature: DMatrix<f64>,
}

/// The noise of a law's outputs by its parameters.
pub struct OwnNoise {
    at: DVector<f64>,
    /// Per output, beside the energy of all other noise; none for what is not scaled.
    outputs: Vec<Option<(f64, Change)>>,
}

/// What is asked for a law's own noise.
pub struct Draw<'a> {
    /// The recordings with one more draw of noise.
    pub shaken: &'a [Track<'a>],
    /// All other noise of each output, SI.
    pub other: Vec<f64>,
    /// Noise of each output, SI.
    pub noise: &'a [f64],
    /// An output of single events, too few to tell the noise of every model by: it is not scaled.
    pub events: usize,
}

/// The noise that a model makes of an output, in units of what it was learned to be.
struct Scale {
    size: f64,
    gradient: DVector<f64>,
}

/// Of the rows of two draws, in ascending order, those that are the same, within a reach: where
/// they stand.
pub fn same_rows(still: &[usize], moved: &[usize], reach: usize) -> Vec<(usize, usize)> {
    let nearest = |(place, &row): (usize, &usize)| {
        let from = moved.partition_point(|&other| other + reach < row);
        let to = moved.partition_point(|&other| other <= row + reach);
        let nearest = (from..to).min_by_key(|&other| moved[other].abs_diff(row))?;
        Some((place, nearest))
    };
    still.iter().enumerate().filter_map(nearest).collect()
}

impl Change {
    /// Of the rows of all recordings as they are and with one more draw, in units of `size`.
    fn of(recordings: &[[Vec<Row>; 2]], parameters: usize, size: f64) -> Self {
        let mut sums = NormalEquations::new(parameters, super::RowWeighting::Squares);
        let mut gradient = vec![0.0; parameters];
        for [still, moved] in recordings {
            let places = |rows: &[Row]| rows.iter().map(|row| row.row).collect::<Vec<_>>();
            for (still_at, moved_at) in same_rows(&places(still), &places(moved), 0) {
                let (still, moved) = (&still[still_at], &moved[moved_at]);
                let slopes = moved.gradient.iter().zip(&still.gradient);
                for (slope, (one, other)) in gradient.iter_mut().zip(slopes) {
                    *slope = one - other;
                }
                sums.add_row(moved.residual - still.residual, &gradient);
            }
        }
        let unit = size * size / sums.sums().rows().max(1) as f64;
        Self {
            square: unit * sums.sums().squares(),
            slope: unit * sums.gradient(),
            curvature: unit * sums.cost_curvature(),
        }
    }
}

impl OwnNoise {
    /// As a law makes it around some parameters; none where it has too many of them. Its outputs
    /// should be nought, so that what is left of one is what is predicted.
    pub fn around(values: &[f64], problem: &LawProblem<'_>, draw: &Draw<'_>) -> Option<Self> {
        let shaken = LawProblem {
            tracks: draw.shaken,
            ..*problem
        };
        let recordings = (0..draw.shaken.len()).into_par_iter();
        let both = |recording| {
            Some([
                problem.rows(recording, values)?,
                shaken.rows(recording, values)?,
            ])
        };
        let mut rows: Vec<[Vec<Vec<Row>>; 2]> = recordings.map(both).collect::<Option<_>>()?;
        let mut of_output = |output: usize| {
            let noise = draw.noise[output];
            let is_scaled = output != draw.events;
            is_scaled.then(|| {
                let both = rows.iter_mut();
                let taken = both
                    .map(|both| [0, 1].map(|draw: usize| std::mem::take(&mut both[draw][output])));
                let taken: Vec<[Vec<Row>; 2]> = taken.collect();
                let size = problem.sigma[output] / noise;
                let other = (draw.other[output] / noise).powi(2);
                (other, Change::of(&taken, values.len(), size))
            })
        };
        Some(Self {
            at: DVector::from_column_slice(values),
            outputs: (0..draw.noise.len()).map(&mut of_output).collect(),
        })
    }

    fn scales(&self, values: &[f64]) -> Vec<Scale> {
        let step = DVector::from_column_slice(values) - &self.at;
        let scale = |output: &Option<(f64, Change)>| {
            let Some((other, change)) = output else {
                return Scale {
                    size: 1.0,
                    gradient: DVector::zeros(step.len()),
                };
            };
            let curved = &change.curvature * &step;
            let square = change.square + 2.0 * change.slope.dot(&step) + curved.dot(&step);
            let size = (other + square.max(0.0)).sqrt();
            Scale {
                size,
                gradient: (&change.slope + curved) / size,
            }
        };
        self.outputs.iter().map(scale).collect()
    }
}

/// A law in units of its own noise.
pub struct InOwnNoise<'a> {
    /// The law.
    pub problem: LawProblem<'a>,
    /// Its noise.
    pub noise: OwnNoise,
}

impl LeastSquares for InOwnNoise<'_> {
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations) {
        let scales = self.noise.scales(values);
        let empty = equations.empty_copy();
        let of_one = |recording: usize| {
            let mut sums = empty.clone();
            let mut scaled = vec![0.0; values.len()];
            let mut add = |output: usize, _: usize, residual: f64, gradient: &[f64]| {
                let Scale {
                    size,
                    gradient: of_size,
                } = &scales[output];
                let residual = residual / size;
                let slopes = gradient.iter().zip(of_size.iter());
                for (slope, (of_residual, of_size)) in scaled.iter_mut().zip(slopes) {
                    *slope = (of_residual - residual * of_size) / size;
                }
                sums.add_row(residual, &scaled);
            };
            if self.problem.each(recording, values, &mut add).is_none() {
                sums.mark_invalid();
            }
            sums
        };
        let recordings = (0..self.problem.tracks.len()).into_par_iter();
        for sums in recordings.map(of_one).collect::<Vec<_>>() {
            equations.merge(&sums);
        }
    }

    fn accumulate_cost(&mut self, values: &[f64], sums: &mut ResidualSums) {
        let scales = self.noise.scales(values);
        let empty = ResidualSums::new(sums.weighting());
        let of_one = |recording: usize| {
            let mut sums = empty.clone();
            let mut add = |output: usize, _: usize, residual: f64| {
                sums.add(residual / scales[output].size);
            };
            self.problem.each_plain(recording, values, &mut add);
            sums
        };
        let recordings = (0..self.problem.tracks.len()).into_par_iter();
        for one in recordings.map(of_one).collect::<Vec<_>>() {
            sums.merge(&one);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_an_event_that_noise_shifts_is_the_same_event() {
        assert_eq!(same_rows(&[1, 5], &[2], 0), []);
        assert_eq!(same_rows(&[1, 5], &[5], 0), [(1, 0)]);
        assert_eq!(same_rows(&[10, 100], &[12], 30), [(0, 0)]);
        assert_eq!(same_rows(&[10], &[1, 12, 30], 30), [(0, 1)]);
    }
}
