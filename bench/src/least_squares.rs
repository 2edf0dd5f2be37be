//! Small least-squares problems: a curve of a few numbers through points.
//!
//! Derivatives are central differences; the solver is that of [`grey_box::fit`]. Deviations are
//! scaled by what the points leave per degree of freedom where this is more than their own
//! deviations say (Birge's ratio), and by the wider tails of Student's law where points are few.

use grey_box::fit::{
    LeastSquares, NoiseVariance, NormalEquations, Options, Parameter, ResidualSums, RowWeighting,
    solve,
};
use nalgebra::{DMatrix, DVector};

/// Step of a difference, as a part of the parameter's scale: the cube root of the rounding, as a
/// central difference wants it.
const STEP: f64 = 6e-6;

/// A solved problem.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The parameters.
    pub values: Vec<f64>,
    /// One standard deviation of each; infinite where the points do not determine it.
    pub deviations: Vec<f64>,
    /// Sum of the squared residuals, in units of their deviations.
    pub squares: f64,
    /// Number of residuals.
    pub rows: usize,
    /// Number of parameters that were not held.
    pub free: usize,
    covariance: DMatrix<f64>,
}

impl Solved {
    /// Schwarz's criterion of a model whose residuals' scale is unknown: smaller is better.
    pub fn bic(&self) -> f64 {
        let rows = self.rows as f64;
        let mean = (self.squares / rows).max(f64::MIN_POSITIVE);
        rows * mean.ln() + self.free as f64 * rows.ln()
    }

    /// The deviation of the sum of two parameters.
    pub fn deviation_of_sum(&self, one: usize, other: usize) -> f64 {
        self.deviation_together(one, other, 1.0)
    }

    /// The deviation of the difference of two parameters.
    pub fn deviation_of_difference(&self, one: usize, other: usize) -> f64 {
        self.deviation_together(one, other, -1.0)
    }

    fn deviation_together(&self, one: usize, other: usize, sign: f64) -> f64 {
        let covariance = &self.covariance;
        let own = covariance[(one, one)] + covariance[(other, other)];
        let variance = own + 2.0 * sign * covariance[(one, other)];
        variance.max(0.0).sqrt()
    }

    /// A parameter and its deviation.
    pub fn at(&self, place: usize) -> (f64, f64) {
        (self.values[place], self.deviations[place])
    }
}

struct Problem<'a> {
    residuals: &'a dyn Fn(&[f64]) -> Vec<f64>,
    scales: Vec<f64>,
}

impl LeastSquares for Problem<'_> {
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations) {
        let here = (self.residuals)(values);
        let columns: Vec<Vec<f64>> = (0..values.len())
            .map(|place| self.column(values, place))
            .collect();
        let mut gradient = vec![0.0; values.len()];
        for (row, residual) in here.iter().enumerate() {
            for (slot, column) in gradient.iter_mut().zip(&columns) {
                *slot = column[row];
            }
            equations.add_row(*residual, &gradient);
        }
    }

    fn accumulate_cost(&mut self, values: &[f64], sums: &mut ResidualSums) {
        for residual in (self.residuals)(values) {
            sums.add(residual);
        }
    }
}

impl Problem<'_> {
    fn column(&self, values: &[f64], place: usize) -> Vec<f64> {
        let step = STEP * self.scales[place].max(values[place].abs());
        let moved = |by: f64| {
            let mut values = values.to_vec();
            values[place] += by;
            (self.residuals)(&values)
        };
        let (below, above) = (moved(-step), moved(step));
        let pairs = above.iter().zip(&below);
        pairs
            .map(|(above, below)| (above - below) / (2.0 * step))
            .collect()
    }
}

/// The parameters of least squares; residuals are in units of their deviations.
///
/// # Errors
/// If the model has no finite answer at the start.
pub fn fitted(
    parameters: &[Parameter],
    residuals: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Result<Solved, String> {
    let scales = parameters.iter().map(|one| one.scale).collect();
    let mut problem = Problem { residuals, scales };
    let options = Options {
        weighting: RowWeighting::Squares,
        noise: NoiseVariance::Given(1.0),
        cost_tolerance: 1e-9,
        step_tolerance: 1e-7,
        ..Options::default()
    };
    let fit = solve(&mut problem, parameters, &options)
        .map_err(|fault| format!("the fit could not start: {fault}"))?;
    let free = parameters
        .iter()
        .filter(|one| one.lower < one.upper)
        .count();
    let widened = widening(fit.residual_sum_of_squares, fit.rows, free);
    let deviations = fit.standard_deviations.iter();
    let size = parameters.len();
    let covariance = fit.covariance.unwrap_or_else(|| DMatrix::zeros(size, size));
    Ok(Solved {
        free,
        covariance: covariance * widened.powi(2),
        deviations: deviations
            .map(|one| one.map_or(f64::INFINITY, |deviation| deviation * widened))
            .collect(),
        values: fit.values,
        squares: fit.residual_sum_of_squares,
        rows: fit.rows,
    })
}

/// A linear problem: `design` times the unknowns is `wanted`, rows in units of their deviations.
///
/// # Errors
/// If the rows do not determine the unknowns.
pub fn linear(design: &DMatrix<f64>, wanted: &DVector<f64>) -> Result<Solved, String> {
    let (rows, unknowns) = design.shape();
    if rows < unknowns {
        return Err(format!("{rows} points do not determine {unknowns} numbers"));
    }
    // Columns of one length: pascals stand beside cubic metres.
    let lengths: Vec<f64> = design
        .column_iter()
        .map(|column| column.norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(rows, unknowns, |row, place| {
        design[(row, place)] / lengths[place]
    });
    let curvature = scaled.transpose() * &scaled;
    let inverse = curvature
        .cholesky()
        .ok_or("the points do not determine the numbers: they are too much alike")?
        .inverse();
    let solution = &inverse * (scaled.transpose() * wanted);
    let left = wanted - &scaled * &solution;
    let squares = left.norm_squared();
    let widened = widening(squares, rows, unknowns);
    let deviation =
        |place: usize| inverse[(place, place)].max(0.0).sqrt() * widened / lengths[place];
    let covariance = DMatrix::from_fn(unknowns, unknowns, |row, place| {
        inverse[(row, place)] * widened.powi(2) / (lengths[row] * lengths[place])
    });
    Ok(Solved {
        free: unknowns,
        covariance,
        values: (0..unknowns)
            .map(|place| solution[place] / lengths[place])
            .collect(),
        deviations: (0..unknowns).map(deviation).collect(),
        squares,
        rows,
    })
}

/// By how much deviations are widened: Birge's ratio where it is above one, and the deviation of
/// Student's law, `sqrt(f/(f-2))`, where few points show that ratio.
fn widening(squares: f64, rows: usize, parameters: usize) -> f64 {
    let freedom = rows.saturating_sub(parameters) as f64;
    if freedom < 1.0 {
        return f64::INFINITY;
    }
    let tails = if freedom > 2.0 {
        freedom / (freedom - 2.0)
    } else {
        9.0
    };
    (squares / freedom).max(1.0).sqrt() * tails.sqrt()
}

/// Factor by which the variance of a mean of correlated residuals exceeds that of independent
/// ones: `1 + 2 sum rho_k` up to the first lag that is not positive (Geyer 1992).
pub fn correlation_length(residuals: &[f64]) -> f64 {
    let variance: f64 = residuals.iter().map(|one| one * one).sum();
    if variance <= 0.0 {
        return 1.0;
    }
    let mut length = 1.0;
    for lag in 1..residuals.len() / 4 {
        let product: f64 = residuals
            .iter()
            .zip(&residuals[lag..])
            .map(|(a, b)| a * b)
            .sum();
        if product <= 0.0 {
            break;
        }
        length += 2.0 * product / variance;
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_line_through_points_has_the_deviations_of_the_textbook() {
        // y = 1 + 2 x with residuals +-1 on four points: slope variance s2 / Sxx.
        let (x, y) = ([0.0, 1.0, 2.0, 3.0], [2.0, 2.0, 4.0, 8.0]);
        let design = DMatrix::from_fn(4, 2, |row, place| if place == 0 { 1.0 } else { x[row] });
        let wanted = DVector::from_row_slice(&y);
        let direct = linear(&design, &wanted).expect("determined");
        let residuals = |b: &[f64]| x.iter().zip(y).map(|(x, y)| b[0] + b[1] * x - y).collect();
        let searched =
            fitted(&[Parameter::new(0.0), Parameter::new(0.0)], &residuals).expect("a fit");
        for place in 0..2 {
            assert!((direct.values[place] - searched.values[place]).abs() < 1e-6);
            assert!((direct.deviations[place] / searched.deviations[place] - 1.0).abs() < 1e-6);
        }
        assert!((direct.values[1] - 2.0).abs() < 1e-12);
        // Squares 4 over 2 degrees of freedom, Sxx 5, and the tails of two degrees.
        assert!((direct.deviations[1] - (2.0_f64 / 5.0).sqrt() * 3.0).abs() < 1e-9);
    }

    #[test]
    fn val_independent_residuals_have_a_length_of_about_one() {
        let mut random = grey_box::random::Noise::new(3, 0);
        let white: Vec<f64> = (0..4000).map(|_| random.normal()).collect();
        assert!(correlation_length(&white) < 1.3);
        let mut held = Vec::new();
        for one in white.iter().take(1000) {
            held.extend([*one; 4]);
        }
        let length = correlation_length(&held);
        assert!((3.0..6.0).contains(&length), "{length}");
    }
}
