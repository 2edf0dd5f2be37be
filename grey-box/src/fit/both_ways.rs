//! A recording predicted with an effect and without it, by a law whose rows do not follow from one
//! another.
//!
//! What is a mean over rows in which the effect comes or goes is of both models, each by its part.
//! Neither run asks when the effect is there: whoever looks for the spans needs both but once.

use model_core::real::Real;
use std::collections::BTreeMap;
use std::ops::Range;

/// Outputs by row of both models; a row that one does not predict is not there.
pub struct BothWays<R> {
    with: BTreeMap<usize, Vec<R>>,
    without: BTreeMap<usize, Vec<R>>,
    /// Of the rows around one, whose mean is predicted there.
    weights: Vec<f64>,
}

impl<R: Real> BothWays<R> {
    /// Of two runs, each of which shows its rows to what it is given.
    pub fn new(
        weights: Vec<f64>,
        with: impl FnOnce(&mut dyn FnMut(usize, &[R])),
        without: impl FnOnce(&mut dyn FnMut(usize, &[R])),
    ) -> Self {
        Self {
            with: by_row(with),
            without: by_row(without),
            weights,
        }
    }

    /// Shows the rows as they are if the effect is there in some stretches.
    pub fn mixed(&self, there: &[Range<usize>], mut show: impl FnMut(usize, &[R])) {
        for (&row, with) in &self.with {
            let part = part_of(&self.weights, row, there);
            let without = self.without.get(&row).into_iter().flatten();
            let mut mixed = with.clone();
            for (here, &other) in mixed.iter_mut().zip(without) {
                *here = mix(*here, other, part);
            }
            show(row, &mixed);
        }
    }
}

/// What a run shows. A row may be shown twice, each time with other outputs: a break-away in the
/// middle of a window.
fn by_row<R: Real>(run: impl FnOnce(&mut dyn FnMut(usize, &[R]))) -> BTreeMap<usize, Vec<R>> {
    let mut by_row = BTreeMap::new();
    run(&mut |row, outputs: &[R]| {
        let known: &mut Vec<R> = by_row.entry(row).or_insert_with(|| outputs.to_vec());
        for (known, &output) in known.iter_mut().zip(outputs) {
            if !output.value().is_nan() {
                *known = output;
            }
        }
    });
    by_row
}

/// The part of a mean around a row that lies in some stretches.
fn part_of(weights: &[f64], row: usize, stretches: &[Range<usize>]) -> f64 {
    let first = row as isize - (weights.len() / 2) as isize;
    let is_in = |place: usize| {
        let row = usize::try_from(first + place as isize);
        row.is_ok_and(|row| stretches.iter().any(|rows| rows.contains(&row)))
    };
    let all = weights.iter().enumerate();
    let inside = all.filter(|(place, _)| is_in(*place));
    // Of all of them it is 1 to the last bit.
    inside.map(|(_, weight)| weight).sum::<f64>() / weights.iter().sum::<f64>()
}

/// So much of one number, and of another what is missing of a whole.
fn mix<R: Real>(one: R, other: R, part: f64) -> R {
    // What is not there may be no number.
    if part <= 0.0 {
        other
    } else if part >= 1.0 {
        one
    } else {
        other + R::from_f64(part) * (one - other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NAN;

    /// Means over three rows; at row 4 a break-away as well.
    fn show_rows(at: f64, show: &mut dyn FnMut(usize, &[f64])) {
        show(4, &[NONE, 10.0 * at]);
        for row in [2, 4, 6] {
            show(row, &[at, NONE]);
        }
    }

    #[test]
    fn prop_a_mean_is_of_both_models_each_by_its_part() {
        let both = BothWays::new(
            vec![0.25, 0.5, 0.25],
            |show| show_rows(1.0, show),
            |show| show_rows(0.0, show),
        );
        let mut means = Vec::new();
        let mut break_aways = Vec::new();
        both.mixed(&[4..6, 8..9], |row, outputs| {
            means.push((row, outputs[0]));
            break_aways.extend((!outputs[1].is_nan()).then_some((row, outputs[1])));
        });
        assert_eq!(means, [(2, 0.0), (4, 0.75), (6, 0.25)]);
        assert_eq!(break_aways, [(4, 7.5)]);
    }
}
