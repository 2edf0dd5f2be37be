//! What a refit of a model would take up of a change in its predictions.
//!
//! One step of Gauss and Newton with the engineer's uncertainties as priors: what is left is
//! what a diagnosis would see of the change.

use super::fitted::{Bench, Fitted};
use crate::fit::law_problem::{Columns, LawProblem};
use nalgebra::{DMatrix, DVector};

/// The slope by a parameter is taken over this part of its scale.
const STEP: f64 = 0.05;

/// A model, and what its parameters can take up.
pub(super) struct Refit<'a> {
    pub(super) bench: &'a Bench<'a>,
    pub(super) model: &'a Fitted,
    /// Its predictions.
    pub(super) predicted: Vec<Columns>,
    /// By recording and by parameter that acts on it: its place, and the slopes.
    slopes: Vec<Vec<(usize, Columns)>>,
    inverse_curvature: DMatrix<f64>,
    /// The size of a residual, by output.
    sigma: Vec<f64>,
}

impl<'a> Refit<'a> {
    /// A model whose residuals are weighed by this size, by output.
    pub(super) fn new(bench: &'a Bench<'a>, model: &'a Fitted, sigma: Vec<f64>) -> Self {
        let (slopes, predicted, prior) = bench.with_model(model, |problem| {
            let predicted = outputs(problem, &model.values);
            let prior: Vec<f64> = problem
                .parameters()
                .iter()
                .map(|parameter| {
                    parameter
                        .prior
                        .map_or(0.0, |prior| prior.standard_deviation.powi(-2))
                })
                .collect();
            (slopes(problem, &model.values, &predicted), predicted, prior)
        });
        let mut curvature = DMatrix::from_diagonal(&DVector::from_vec(prior));
        for of_recording in &slopes {
            for (row, first) in of_recording {
                for (column, second) in of_recording {
                    curvature[(*row, *column)] += product(first, second, &sigma);
                }
            }
        }
        let inverse_curvature = inverse(curvature);
        Self {
            bench,
            model,
            predicted,
            slopes,
            inverse_curvature,
            sigma,
        }
    }

    /// What two changes have in common, in units of the size of a residual.
    pub(super) fn product(&self, one: &[Columns], other: &[Columns]) -> f64 {
        let recordings = one.iter().zip(other);
        recordings
            .map(|(one, other)| product(one, other, &self.sigma))
            .sum()
    }

    /// By which the product of two residuals of an output counts.
    pub(super) fn weight(&self, output: usize) -> f64 {
        self.sigma[output].powi(-2)
    }

    /// What the parameters cannot take up where the predictions were these.
    pub(super) fn left_of(&self, predicted: &[Columns]) -> Vec<Columns> {
        let pairs = predicted.iter().zip(&self.predicted);
        let mut differences: Vec<Columns> = pairs.map(|(new, old)| difference(new, old)).collect();
        let mut pushes = DVector::zeros(self.model.values.len());
        for (of_recording, difference) in self.slopes.iter().zip(&differences) {
            for (place, slope) in of_recording {
                pushes[*place] += product(slope, difference, &self.sigma);
            }
        }
        let step = &self.inverse_curvature * pushes;
        for (of_recording, left) in self.slopes.iter().zip(&mut differences) {
            for (place, slope) in of_recording {
                take_away(left, slope, step[*place]);
            }
        }
        differences
    }
}

/// Predictions of all recordings.
fn outputs(problem: &LawProblem<'_>, values: &[f64]) -> Vec<Columns> {
    problem
        .predict(values)
        .into_iter()
        .map(|(columns, _)| columns)
        .collect()
}

/// Slopes of the predictions; parameters of different recordings are shifted together.
fn slopes(
    problem: &LawProblem<'_>,
    values: &[f64],
    predicted: &[Columns],
) -> Vec<Vec<(usize, Columns)>> {
    let parameters = problem.parameters();
    let is_free = |&place: &usize| parameters[place].lower < parameters[place].upper;
    let active: Vec<Vec<usize>> = (0..predicted.len())
        .map(|recording| {
            problem
                .active(recording)
                .into_iter()
                .filter(is_free)
                .collect()
        })
        .collect();
    let mut all = vec![Vec::new(); predicted.len()];
    let most = active.iter().map(Vec::len).max().unwrap_or(0);
    for slot in 0..most {
        let mut shifted = values.to_vec();
        for place in active.iter().filter_map(|active| active.get(slot)) {
            shifted[*place] = values[*place] + STEP * parameters[*place].scale;
        }
        for (recording, columns) in outputs(problem, &shifted).iter().enumerate() {
            let Some(&place) = active[recording].get(slot) else {
                continue;
            };
            let mut slope = difference(columns, &predicted[recording]);
            let step = shifted[place] - values[place];
            slope.iter_mut().flatten().for_each(|value| *value /= step);
            all[recording].push((place, slope));
        }
    }
    all
}

/// One less the other; NaN where either is not predicted.
pub(super) fn difference(one: &Columns, other: &Columns) -> Columns {
    let less = |(one, other): (&f64, &f64)| one - other;
    let columns = one.iter().zip(other);
    columns
        .map(|(one, other)| one.iter().zip(other).map(less).collect())
        .collect()
}

/// Sum over all predicted rows in units of the size of a residual.
fn product(one: &Columns, other: &Columns, sigma: &[f64]) -> f64 {
    let outputs = one.iter().zip(other).zip(sigma);
    outputs
        .map(|((one, other), sigma)| {
            let sum: f64 = one
                .iter()
                .zip(other)
                .map(|(one, other)| one * other)
                .filter(|product| !product.is_nan())
                .sum();
            sum / sigma.powi(2)
        })
        .sum()
}

pub(super) fn take_away(left: &mut Columns, slope: &Columns, step: f64) {
    for (left, slope) in left.iter_mut().zip(slope) {
        for (left, slope) in left.iter_mut().zip(slope) {
            *left -= slope * step;
        }
    }
}

/// The pseudo-inverse, with parameters of pascals and of metres in units of their own.
fn inverse(curvature: DMatrix<f64>) -> DMatrix<f64> {
    if curvature.is_empty() {
        return curvature;
    }
    let unit = curvature.diagonal().map(|square| {
        if square > 0.0 {
            square.sqrt().recip()
        } else {
            0.0
        }
    });
    let scale = DMatrix::from_diagonal(&unit);
    let scaled = &scale * curvature * &scale;
    // The deviations of a fit are cut off at the same size of rounding.
    let inverse = scaled
        .pseudo_inverse(1e-12)
        .unwrap_or_else(|_| DMatrix::zeros(unit.len(), unit.len()));
    &scale * inverse * &scale
}
