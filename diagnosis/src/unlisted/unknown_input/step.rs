//! Steps of the ordinary parameters beside an input.

use super::Explained;
use super::need::{Window, dot};
use crate::fit::Parameter;
use crate::fit::law_problem::FreeParameter;
use nalgebra::{DMatrix, DVector};

/// The slope by an ordinary parameter is taken over this part of its uncertainty.
pub(super) const STEP: f64 = 0.1;

/// The size of a parameter's uncertainty.
pub(super) fn step_size(parameter: &Parameter) -> f64 {
    parameter
        .prior
        .map_or(parameter.scale, |prior| prior.standard_deviation)
}

/// Slopes of every window's errors.
pub(super) fn slopes(base: &[Window], moved: &[Window], size: f64) -> Vec<Vec<f64>> {
    let pairs = base.iter().zip(moved);
    pairs
        .map(|(base, moved)| {
            let errors = base.errors.iter().zip(&moved.errors);
            errors.map(|(base, moved)| (moved - base) / size).collect()
        })
        .collect()
}

/// The step of the ordinary parameters; the input follows in every window.
pub(super) fn step(
    explained: &Explained,
    by_ordinary: &[Vec<Vec<f64>>],
    ordinary: &[FreeParameter],
    values: &[f64],
    penalties: &[f64],
) -> Option<Vec<f64>> {
    let sizes: Vec<f64> = ordinary
        .iter()
        .map(|free| step_size(&free.parameter))
        .collect();
    let (curvature, pull) = beside_input(explained, by_ordinary, ordinary, &sizes, penalties);
    within_bounds(curvature, pull, ordinary, &sizes, values)
}

/// Curvature and pull of the ordinary numbers, each in units of its size, when the parts along the
/// input are taken out.
pub(super) fn beside_input(
    explained: &Explained,
    by_ordinary: &[Vec<Vec<f64>>],
    ordinary: &[FreeParameter],
    sizes: &[f64],
    penalties: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let count = by_ordinary.len();
    let mut curvature = DMatrix::<f64>::zeros(count, count);
    let mut pull = DVector::<f64>::zeros(count);
    for (i, free) in ordinary.iter().enumerate() {
        if free.parameter.prior.is_some() {
            curvature[(i, i)] = 1.0;
            pull[i] = -penalties[i];
        }
    }
    let pairs = explained.windows.iter().zip(&explained.needed);
    for (index, (window, need)) in pairs.enumerate() {
        // An input at the end of its range takes nothing more.
        let direction = need.as_ref().and_then(|need| need.direction.as_deref());
        let free = direction.map(|g| (g, dot(g, g)));
        // Products of what is left when the parts along the input are taken out.
        let product = |a: &[f64], b: &[f64]| match free {
            Some((g, square)) => dot(a, b) - dot(a, g) * dot(b, g) / square,
            None => dot(a, b),
        };
        for i in 0..count {
            let slope = &by_ordinary[i][index];
            pull[i] -= sizes[i] * product(slope, &window.errors);
            for j in 0..=i {
                let value = sizes[i] * sizes[j] * product(slope, &by_ordinary[j][index]);
                curvature[(i, j)] += value;
                if i != j {
                    curvature[(j, i)] += value;
                }
            }
        }
    }
    (curvature, pull)
}

/// The step of the ordinary numbers that stay in their boxes.
pub(super) fn within_bounds(
    mut curvature: DMatrix<f64>,
    mut pull: DVector<f64>,
    ordinary: &[FreeParameter],
    sizes: &[f64],
    values: &[f64],
) -> Option<Vec<f64>> {
    let count = ordinary.len();
    loop {
        let solved = curvature.clone().cholesky()?.solve(&pull);
        let steps: Vec<f64> = solved.iter().zip(sizes).map(|(s, size)| s * size).collect();
        let leaves_box = |i: usize| {
            let Parameter { lower, upper, .. } = ordinary[i].parameter;
            (values[i] <= lower && steps[i] < 0.0) || (values[i] >= upper && steps[i] > 0.0)
        };
        let outwards: Vec<usize> = (0..count).filter(|&i| leaves_box(i)).collect();
        if outwards.is_empty() {
            return Some(steps);
        }
        // What stands on its bound stays there, and the others are solved again.
        for i in outwards {
            curvature.row_mut(i).fill(0.0);
            curvature.column_mut(i).fill(0.0);
            curvature[(i, i)] = 1.0;
            pull[i] = 0.0;
        }
    }
}
