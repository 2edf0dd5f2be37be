//! A search by values alone, for parameters in which the residuals are not smooth.
//!
//! Behind a play the instant of every blow jumps with the parameters: derivatives
//! are those of one course of blows, and lead into the hollow of it. So the
//! parameters are varied by factors, one after the other, and the step of a whole
//! round is repeated while it helps (Hooke and Jeeves 1961).

use super::Parameter;
use nalgebra::DMatrix;

/// A first factor, as a logarithm, for a number of which little is known: most starts are
/// within it of the end.
pub const WIDE_STEP: f64 = 0.4;
/// The last step over the first one: two per cent for a wide one.
const LAST_STEP: f64 = 0.05;
/// So many costs are asked for at the most.
const MOST_COSTS: usize = 400;

/// A number that is varied by factors: its sign stays, and nought stays nought.
#[derive(Clone, Copy, Debug)]
pub struct Varied {
    /// Where it begins.
    pub start: f64,
    /// Its least and its largest value.
    pub bounds: (f64, f64),
    /// The first factor, as a logarithm.
    pub first_step: f64,
}

impl Varied {
    /// A parameter from another start.
    pub fn of(parameter: Parameter, start: f64, first_step: f64) -> Self {
        Self {
            start,
            bounds: (parameter.lower, parameter.upper),
            first_step,
        }
    }
}

/// The numbers near their starts, within their bounds, at which `cost` is least.
pub fn descend(numbers: &[Varied], mut cost: impl FnMut(&[f64]) -> f64) -> Vec<f64> {
    let mut asked = 0;
    let mut ask = |values: &[f64]| {
        asked += 1;
        (cost(values), asked >= MOST_COSTS)
    };
    let mut best: Vec<f64> = numbers.iter().map(|number| number.start).collect();
    let mut step = 1.0;
    let (mut least, mut ended) = ask(&best);
    while step > LAST_STEP && !ended {
        let before = best.clone();
        for index in 0..best.len() {
            let by = step * numbers[index].first_step;
            for factor in [by.exp(), (-by).exp()] {
                let mut trial = best.clone();
                trial[index] = within(trial[index] * factor, numbers[index].bounds);
                let (value, last) = ask(&trial);
                ended |= last;
                if value < least {
                    (best, least) = (trial, value);
                    break;
                }
            }
        }
        if best == before {
            step *= 0.5;
            continue;
        }
        let trial: Vec<f64> = (0..best.len())
            .map(|index| again(best[index], before[index], numbers[index].bounds))
            .collect();
        let (value, last) = ask(&trial);
        ended |= last;
        if value < least {
            (best, least) = (trial, value);
        }
    }
    best
}

/// Standard deviations of positive numbers, from how `cost` (half the sum of
/// squares, in units of its noise) rises around them when they are varied by a tenth:
/// wide against the ripples, narrow against the hollow. `None` where it does not rise.
pub fn deviations(at: &[f64], mut cost: impl FnMut(&[f64]) -> f64) -> Option<Vec<f64>> {
    const STEP: f64 = 0.1;
    let count = at.len();
    let mut moved = |moves: &[(usize, f64)]| {
        let mut values = at.to_vec();
        for &(index, sign) in moves {
            values[index] *= (sign * STEP).exp();
        }
        cost(&values)
    };
    let here = moved(&[]);
    let mut curvature = DMatrix::zeros(count, count);
    for i in 0..count {
        let sides = moved(&[(i, 1.0)]) + moved(&[(i, -1.0)]);
        curvature[(i, i)] = (sides - 2.0 * here) / (STEP * STEP);
        for j in 0..i {
            let mut both = |a, b| moved(&[(i, a), (j, b)]);
            let alike = both(1.0, 1.0) + both(-1.0, -1.0);
            let apart = both(1.0, -1.0) + both(-1.0, 1.0);
            let mixed = (alike - apart) / (4.0 * STEP * STEP);
            (curvature[(i, j)], curvature[(j, i)]) = (mixed, mixed);
        }
    }
    let covariance = curvature.cholesky()?.inverse();
    let deviation = |index: usize| at[index] * covariance[(index, index)].sqrt();
    Some((0..count).map(deviation).collect())
}

/// A number moved once more by the factor that it has moved by; nought has none.
fn again(now: f64, before: f64, bounds: (f64, f64)) -> f64 {
    let moved = now * (now / before);
    if moved.is_nan() {
        now
    } else {
        within(moved, bounds)
    }
}

fn within(value: f64, (lower, upper): (f64, f64)) -> f64 {
    if value.is_nan() {
        lower
    } else {
        value.clamp(lower, upper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(start: f64, bounds: (f64, f64)) -> Varied {
        Varied {
            start,
            bounds,
            first_step: WIDE_STEP,
        }
    }

    #[test]
    fn val_a_valley_with_steps_is_walked_down_to_its_end() {
        // Least at (3, 0.02), along a ridge, with ripples that turn every gradient.
        let cost = |at: &[f64]| {
            let (a, b) = ((at[0] / 3.0).ln(), (at[1] / 0.02).ln());
            (a + b).powi(2) * 10.0 + (a - b).powi(2) + 0.01 * ((a * 40.0).sin().abs())
        };
        let numbers = [number(1.0, (0.1, 10.0)), number(0.1, (1e-3, 1.0))];
        let end = descend(&numbers, cost);
        assert!((end[0] / 3.0).ln().abs() < 0.1, "{end:?}");
        assert!((end[1] / 0.02).ln().abs() < 0.1, "{end:?}");
    }

    #[test]
    fn val_deviations_are_those_of_a_known_covariance() {
        // Logarithms with deviations 0.02 and 0.05 and a correlation of 0.6.
        let (sa, sb, r) = (0.02, 0.05, 0.6);
        let cost = |at: &[f64]| {
            let (a, b) = ((at[0] / 3.0).ln() / sa, (at[1] / 0.02).ln() / sb);
            0.5 * (a * a - 2.0 * r * a * b + b * b) / (1.0 - r * r)
        };
        let found = deviations(&[3.0, 0.02], cost).unwrap();
        assert!((found[0] / (3.0 * sa) - 1.0).abs() < 1e-6, "{found:?}");
        assert!((found[1] / (0.02 * sb) - 1.0).abs() < 1e-6, "{found:?}");
        assert!(deviations(&[1.0, 1.0], |_| 1.0).is_none());
    }

    #[test]
    fn prop_bounds_are_kept_and_nothing_gets_worse() {
        let cost = |at: &[f64]| (at[0] - 5.0).powi(2) + (at[1] - 1.0).powi(2);
        let end = descend(&[number(1.0, (0.5, 2.0)), number(1.0, (0.0, 2.0))], cost);
        assert!(end[0] <= 2.0 && cost(&end) <= cost(&[1.0, 1.0]), "{end:?}");
        assert!((end[0] - 2.0).abs() < 1e-9, "{end:?}");
    }
}
