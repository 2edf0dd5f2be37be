//! What a refit of a model would take up of a change in its predictions.
//!
//! One step of Gauss and Newton with the engineer's uncertainties as priors: what is left is
//! what a diagnosis would see of the change.

use super::bench::Bench;
use super::fitted::Fitted;
use crate::fit::Prior;
use crate::fit::law_problem::{Columns, LawProblem};
use nalgebra::{DMatrix, DVector};

/// The slope by a parameter is taken over this part of its scale.
const STEP: f64 = 0.05;

/// A model, and what its parameters can take up.
pub(crate) struct Refit<'a> {
    pub(crate) bench: &'a Bench<'a>,
    pub(crate) model: &'a Fitted,
    /// Its predictions.
    pub(crate) predicted: Vec<Columns>,
    /// By recording and by parameter that acts on it: its place, and the slopes.
    slopes: Vec<Vec<(usize, Columns)>>,
    inverse_curvature: DMatrix<f64>,
    /// Towards what the engineer stated.
    pull_of_priors: DVector<f64>,
    /// The inverse square of each prior's deviation; 0 where there is none.
    priors: DVector<f64>,
    /// The size of a residual, by output.
    sigma: Vec<f64>,
}

impl<'a> Refit<'a> {
    /// A model whose residuals are weighed by this size, by output.
    pub(crate) fn new(bench: &'a Bench<'a>, model: &'a Fitted, sigma: Vec<f64>) -> Self {
        let (slopes, predicted, priors) = bench.with_model(model, |problem| {
            let predicted = outputs(problem, &model.values);
            let parameters = problem.parameters().into_iter();
            let priors: Vec<Option<Prior>> = parameters.map(|one| one.prior).collect();
            (
                slopes(problem, &model.values, &predicted),
                predicted,
                priors,
            )
        });
        let weight =
            |prior: &Option<Prior>| prior.map_or(0.0, |prior| prior.standard_deviation.powi(-2));
        let pull = |(prior, value): (&Option<Prior>, &f64)| {
            prior.map_or(0.0, |prior| {
                (prior.mean - value) / prior.standard_deviation.powi(2)
            })
        };
        let pull_of_priors = priors.iter().zip(&model.values).map(pull).collect();
        let pull_of_priors = DVector::from_vec(pull_of_priors);
        let priors = DVector::from_vec(priors.iter().map(weight).collect());
        let mut curvature = DMatrix::from_diagonal(&priors);
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
            pull_of_priors,
            priors,
            sigma,
        }
    }

    /// What two changes have in common, in units of the size of a residual.
    pub(crate) fn product(&self, one: &[Columns], other: &[Columns]) -> f64 {
        let recordings = one.iter().zip(other);
        recordings
            .map(|(one, other)| product(one, other, &self.sigma))
            .sum()
    }

    /// By which the product of two residuals of an output counts.
    pub(crate) fn weight(&self, output: usize) -> f64 {
        self.sigma[output].powi(-2)
    }

    /// What the parameters cannot take up of samples, into which `sampled` turns columns in the
    /// size of a residual by recording and output.
    pub(crate) fn beside(&self, sampled: impl Fn(&[Columns]) -> Vec<f64>) -> Beside {
        let nothing: Vec<Columns> = self.predicted.iter().map(nothing_like).collect();
        let of_place = |place: usize| {
            let mut columns = nothing.clone();
            for (recording, of_recording) in self.slopes.iter().enumerate() {
                let own = of_recording.iter().find(|(at, _)| *at == place);
                if let Some((_, slope)) = own {
                    columns[recording].clone_from(slope);
                }
            }
            sampled(&columns)
        };
        Beside {
            slopes: (0..self.model.values.len()).map(of_place).collect(),
            inverse_curvature: self.inverse_curvature.clone(),
            pull_of_priors: self.pull_of_priors.clone(),
            priors: self.priors.clone(),
        }
    }

    /// What the parameters cannot take up where the predictions were these.
    pub(crate) fn left_of(&self, predicted: &[Columns]) -> Vec<Columns> {
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

/// What parameters take up of samples.
pub(crate) struct Beside {
    slopes: Vec<Vec<f64>>,
    inverse_curvature: DMatrix<f64>,
    pull_of_priors: DVector<f64>,
    priors: DVector<f64>,
}

impl Beside {
    /// What they leave of a change.
    pub(crate) fn left_of(&self, samples: &[f64]) -> Vec<f64> {
        self.less(samples, &(&self.inverse_curvature * self.pushes(samples)))
    }

    /// What they leave of what the model misses, where it was fitted in other weights: priors pull.
    /// And what these then cost.
    pub(crate) fn left_of_missed(&self, samples: &[f64]) -> (Vec<f64>, f64) {
        let pushes = self.pushes(samples) + &self.pull_of_priors;
        let step = &self.inverse_curvature * pushes;
        let costs = step.iter().zip(&self.pull_of_priors).zip(&self.priors);
        let cost = |((step, pull), weight): ((&f64, &f64), &f64)| {
            if *weight > 0.0 {
                weight * (step - pull / weight).powi(2)
            } else {
                0.0
            }
        };
        (self.less(samples, &step), costs.map(cost).sum())
    }

    fn pushes(&self, samples: &[f64]) -> DVector<f64> {
        let push = |slope: &Vec<f64>| -> f64 {
            let pairs = slope.iter().zip(samples);
            pairs.map(|(slope, sample)| slope * sample).sum()
        };
        DVector::from_iterator(self.slopes.len(), self.slopes.iter().map(push))
    }

    /// Samples after a step of the parameters.
    fn less(&self, samples: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let mut left = samples.to_vec();
        for (slope, step) in self.slopes.iter().zip(step) {
            for (left, slope) in left.iter_mut().zip(slope) {
                *left -= step * slope;
            }
        }
        left
    }
}

/// Columns of the same rows without anything in them.
fn nothing_like(columns: &Columns) -> Columns {
    let none = |value: &f64| 0.0 * value;
    let column = |column: &Vec<f64>| column.iter().map(none).collect();
    columns.iter().map(column).collect()
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
pub(crate) fn difference(one: &Columns, other: &Columns) -> Columns {
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

pub(crate) fn take_away(left: &mut Columns, slope: &Columns, step: f64) {
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
