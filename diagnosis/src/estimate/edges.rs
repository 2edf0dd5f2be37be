//! Numbers at which residuals jump: walked by values where derivatives end.

use super::bench::Bench;
use super::candidates::Edge;
use super::correlation::correlation_length;
use super::fitted::Fitted;
use crate::fit::compass::{self, Varied};
use crate::fit::law_problem::FreeParameter;
use rayon::prelude::*;

/// So many steps either way an edge is tried.
const EDGE_STEPS: i32 = 15;

/// Values with other numbers at some places.
fn replaced(values: &[f64], places: &[usize], numbers: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    for (&place, &number) in places.iter().zip(numbers) {
        values[place] = number;
    }
    values
}

impl Bench<'_> {
    /// A finished fit with an effect in which the residuals jump, walked down by
    /// values where derivatives ended, and fitted from there again. The deviations of
    /// its sizes come from values too: derivatives through a row of blows are those
    /// of one course of them.
    pub fn walked(&self, fitted: Fitted) -> Fitted {
        let fitted = self.shifted_at_edges(fitted);
        let rough = |index: &&usize| self.candidates[**index].is_rough;
        let Some(&candidate) = fitted.set.iter().find(rough) else {
            return fitted;
        };
        let free = &self.candidates[candidate].free;
        let place = |free: &FreeParameter| fitted.place(&free.key);
        let places: Vec<usize> = free.iter().filter_map(place).collect();
        let numbers = |model: &Fitted| -> Vec<f64> {
            places.iter().map(|&place| model.values[place]).collect()
        };
        let varied = |(free, start): (&FreeParameter, f64)| {
            Varied::of(free.parameter, start, compass::WIDE_STEP)
        };
        let begun: Vec<Varied> = free.iter().zip(numbers(&fitted)).map(varied).collect();
        let end = compass::descend(&begun, |sizes| self.half_squares(&fitted, &places, sizes));
        let near = Fitted {
            values: replaced(&fitted.values, &places, &end),
            ..fitted.clone()
        };
        let Some(mut walked) = self.finished(&near) else {
            return fitted;
        };
        let length = correlation_length(&self.residuals_of(&walked));
        let deviations = compass::deviations(&numbers(&walked), |sizes| {
            self.half_squares(&walked, &places, sizes) / length
        });
        for (row, &place) in places.iter().enumerate() {
            let known = deviations.as_ref().map(|deviations| deviations[row]);
            walked.standard_deviations[place] = known;
        }
        walked
    }

    /// A finished fit with its edges shifted to where it leaves least, by values, and fitted from
    /// there again; in the end each is put amid the values that leave about as little.
    fn shifted_at_edges(&self, fitted: Fitted) -> Fitted {
        let shifted = |fitted: Fitted, edge: &Edge| {
            let from_best = self.finished(&self.shifted(&fitted, edge));
            let energy = |model: &Fitted| model.energy_above(&self.noise);
            let is_lower = |one: &Fitted| energy(one) < energy(&fitted);
            from_best.filter(is_lower).unwrap_or(fitted)
        };
        let edges = self.edges(&fitted.set);
        let lowest = edges.iter().copied().fold(fitted, shifted);
        self.centred_at_edges(lowest)
    }

    fn edges(&self, set: &[usize]) -> Vec<&Edge> {
        let candidates = set.iter().map(|&index| &self.candidates[index]);
        candidates.filter_map(|one| one.edge.as_ref()).collect()
    }

    /// A model with an edge where it leaves least, nothing else refitted.
    fn shifted(&self, model: &Fitted, edge: &Edge) -> Fitted {
        let costs = self.costs_about(model, edge);
        let least = costs
            .into_iter()
            .min_by(|one, other| one.1.total_cmp(&other.1));
        match (model.place(&edge.key), least) {
            (Some(place), Some((value, _))) => Fitted {
                values: replaced(&model.values, &[place], &[value]),
                ..model.clone()
            },
            _ => model.clone(),
        }
    }

    /// A model with every edge at the mean of its values, each weighed by how likely what it
    /// leaves is: where no row was near it, all of them are, and where a fit ends is chance.
    pub(crate) fn centred_at_edges(&self, model: Fitted) -> Fitted {
        let centred = |model: Fitted, edge: &Edge| {
            let costs = self.costs_about(&model, edge);
            let least = costs.iter().map(|one| one.1).fold(f64::INFINITY, f64::min);
            let length = correlation_length(&self.residuals_of(&model));
            let weight = |cost: f64| (-(cost - least) / length).exp();
            let mean = |of: &dyn Fn(f64) -> f64| {
                let weighed = costs.iter().map(|one| of(one.0) * weight(one.1));
                weighed.sum::<f64>() / costs.iter().map(|one| weight(one.1)).sum::<f64>()
            };
            let Some(place) = model.place(&edge.key).filter(|_| !costs.is_empty()) else {
                return model;
            };
            let centre = mean(&|value| value);
            let spread = mean(&|value| (value - centre).powi(2)).sqrt();
            let values = replaced(&model.values, &[place], &[centre]);
            let mut centred = self.with_values(&model, values);
            centred.standard_deviations[place] = Some(spread.max(edge.step));
            centred
        };
        self.edges(&model.set).into_iter().fold(model, centred)
    }

    /// Values about an edge, and half the squares that the model leaves with each, in units of
    /// what it leaves.
    fn costs_about(&self, model: &Fitted, edge: &Edge) -> Vec<(f64, f64)> {
        let Some(place) = model.place(&edge.key) else {
            return Vec::new();
        };
        let at = |steps: i32| {
            let value = model.values[place] + f64::from(steps) * edge.step;
            (value, self.half_squares(model, &[place], &[value]))
        };
        let about = (-EDGE_STEPS..=EDGE_STEPS).into_par_iter();
        about.map(at).collect()
    }

    /// Half the sum of a model's squared residuals with other numbers at some places,
    /// in units of what it leaves.
    fn half_squares(&self, model: &Fitted, places: &[usize], numbers: &[f64]) -> f64 {
        let sigma = self.sigma(Some(model));
        let values = replaced(&model.values, places, numbers);
        let presence = model.presence.as_ref();
        let residuals = self.with_problem(&model.set, self.tracks, presence, |problem| {
            self.residuals(problem, &values)
        });
        let outputs = residuals.iter().zip(&sigma);
        let squares = outputs.flat_map(|(columns, sigma)| {
            let finite = columns
                .iter()
                .flatten()
                .filter(|residual| !residual.is_nan());
            finite.map(move |residual| (residual / sigma).powi(2))
        });
        0.5 * squares.sum::<f64>()
    }
}
