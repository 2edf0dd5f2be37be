//! The sums of a least-squares problem, accumulated row by row.
//!
//! With several 100 000 residuals and tens of parameters a dense Jacobian would
//! be hundreds of megabytes; the sums are a few kilobytes, and two halves of the
//! data can be summed apart and [merged](NormalEquations::merge).
//!
//! A row is a residual `r` with its gradient `g = dr/dx`. Cost of a row, `½ r²`,
//! or for Huber's loss with scale `c` (P. J. Huber, Ann. Math. Stat. 35, 1964):
//! `½ r²` for `|r| <= c`, else `c |r| - ½ c²`.
//!
//! Two curvatures are kept, because an outlier (`|r| > c`) enters them differently:
//! in the curvature of the *cost* it has none (its cost is straight), in the
//! curvature of the *step* it has the weight `c / |r|` of iteratively reweighted
//! least squares, which lies above the cost everywhere and so never steps too far.
//!
//! A row with anything non-finite makes all sums invalid; it is never skipped
//! silently and never a panic.

use nalgebra::{DMatrix, DVector};

/// How residuals become cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowWeighting {
    /// `½ r²`.
    Squares,
    /// Huber's loss: squares up to `scale`, straight beyond.
    Huber {
        /// The residual, in the residual's own unit, from which a row counts as an outlier.
        scale: f64,
    },
}

impl RowWeighting {
    /// Cost of one row.
    #[must_use]
    pub fn cost(self, residual: f64) -> f64 {
        match self {
            Self::Huber { scale } if residual.abs() > scale => {
                scale * (residual.abs() - 0.5 * scale)
            }
            _ => 0.5 * residual * residual,
        }
    }

    /// Derivative of the cost divided by the residual: 1 for rows that are no outliers.
    #[must_use]
    pub fn weight(self, residual: f64) -> f64 {
        match self {
            Self::Huber { scale } if residual.abs() > scale => scale / residual.abs(),
            _ => 1.0,
        }
    }

    fn is_outlier(self, residual: f64) -> bool {
        matches!(self, Self::Huber { scale } if residual.abs() > scale)
    }
}

/// A sum with Neumaier's compensation: the solver compares costs that differ in
/// their last digits, so the order of 100 000 rows must not show.
#[derive(Clone, Copy, Debug, Default)]
struct CompensatedSum {
    sum: f64,
    lost: f64,
}

impl CompensatedSum {
    fn add(&mut self, term: f64) {
        let total = self.sum + term;
        self.lost += if self.sum.abs() >= term.abs() {
            (self.sum - total) + term
        } else {
            (term - total) + self.sum
        };
        self.sum = total;
    }

    fn value(self) -> f64 {
        self.sum + self.lost
    }
}

/// Cost and sum of squares of the rows seen so far.
#[derive(Clone, Debug)]
pub struct ResidualSums {
    weighting: RowWeighting,
    cost: CompensatedSum,
    squares: CompensatedSum,
    rows: usize,
    outliers: usize,
    valid: bool,
}

impl ResidualSums {
    /// No rows yet.
    #[must_use]
    pub fn new(weighting: RowWeighting) -> Self {
        Self {
            weighting,
            cost: CompensatedSum::default(),
            squares: CompensatedSum::default(),
            rows: 0,
            outliers: 0,
            valid: true,
        }
    }

    /// Add one residual.
    pub fn add(&mut self, residual: f64) {
        self.rows += 1;
        self.outliers += usize::from(self.weighting.is_outlier(residual));
        self.valid &= residual.is_finite();
        self.cost.add(self.weighting.cost(residual));
        self.squares.add(residual * residual);
    }

    /// Add the rows of `other`, which must have the same weighting.
    pub fn merge(&mut self, other: &Self) {
        self.rows += other.rows;
        self.outliers += other.outliers;
        self.valid &= other.valid && self.weighting == other.weighting;
        self.cost.add(other.cost.value());
        self.squares.add(other.squares.value());
    }

    /// Say that the model has no answer here: the cost becomes infinite.
    pub fn mark_invalid(&mut self) {
        self.valid = false;
    }

    /// The cost, infinite if any row was not finite.
    #[must_use]
    pub fn cost(&self) -> f64 {
        let cost = self.cost.value();
        if self.valid && cost.is_finite() {
            cost
        } else {
            f64::INFINITY
        }
    }

    /// The plain sum of squared residuals, whatever the weighting.
    #[must_use]
    pub fn squares(&self) -> f64 {
        self.squares.value()
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of rows beyond the scale of Huber's loss.
    #[must_use]
    pub fn outliers(&self) -> usize {
        self.outliers
    }

    /// How rows are weighted.
    #[must_use]
    pub fn weighting(&self) -> RowWeighting {
        self.weighting
    }

    /// A penalty that is no data: it enters the cost only.
    pub(super) fn add_penalty(&mut self, residual: f64) {
        self.valid &= residual.is_finite();
        self.cost.add(0.5 * residual * residual);
    }
}

/// `JᵀJ`, `Jᵀr` and the cost of the rows seen so far.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    sums: ResidualSums,
    gradient: Vec<f64>,
    /// Row-major, upper triangle: rows that are no outliers.
    curvature: Vec<f64>,
    /// The same for outliers, each with its weight.
    outlier_curvature: Vec<f64>,
}

impl NormalEquations {
    /// No rows yet, for `parameters` unknowns.
    #[must_use]
    pub fn new(parameters: usize, weighting: RowWeighting) -> Self {
        Self {
            sums: ResidualSums::new(weighting),
            gradient: vec![0.0; parameters],
            curvature: vec![0.0; parameters * parameters],
            outlier_curvature: vec![0.0; parameters * parameters],
        }
    }

    /// An empty copy with the same size and weighting, for a second thread.
    #[must_use]
    pub fn empty_copy(&self) -> Self {
        Self::new(self.parameters(), self.sums.weighting)
    }

    /// Add one residual with its derivatives by the parameters. A gradient of the
    /// wrong length makes the sums invalid.
    pub fn add_row(&mut self, residual: f64, gradient: &[f64]) {
        self.sums.add(residual);
        if gradient.len() != self.gradient.len() {
            self.sums.mark_invalid();
            return;
        }
        let weight = self.sums.weighting.weight(residual);
        for (sum, slope) in self.gradient.iter_mut().zip(gradient) {
            *sum += weight * residual * slope;
        }
        if self.sums.weighting.is_outlier(residual) {
            add_outer_product(&mut self.outlier_curvature, weight, gradient);
        } else {
            add_outer_product(&mut self.curvature, 1.0, gradient);
        }
    }

    /// Add the rows of `other`, which must have the same size and weighting.
    pub fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        if other.parameters() != self.parameters() {
            self.sums.mark_invalid();
            return;
        }
        add_all(&mut self.gradient, &other.gradient);
        add_all(&mut self.curvature, &other.curvature);
        add_all(&mut self.outlier_curvature, &other.outlier_curvature);
    }

    /// Say that the model has no answer here: the cost becomes infinite.
    pub fn mark_invalid(&mut self) {
        self.sums.mark_invalid();
    }

    /// Number of unknowns.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.gradient.len()
    }

    /// Cost, sum of squares, number of rows.
    #[must_use]
    pub fn sums(&self) -> &ResidualSums {
        &self.sums
    }

    /// Whether every sum is a number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let parts = [&self.gradient, &self.curvature, &self.outlier_curvature];
        self.sums.cost().is_finite() && parts.iter().all(|part| part.iter().all(|v| v.is_finite()))
    }

    /// Gradient of the cost.
    #[must_use]
    pub fn gradient(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.gradient)
    }

    /// Gauss-Newton curvature of the cost: outliers have none.
    #[must_use]
    pub fn cost_curvature(&self) -> DMatrix<f64> {
        let size = self.parameters();
        DMatrix::from_fn(size, size, |row, column| {
            self.curvature[row.min(column) * size + row.max(column)]
        })
    }

    /// Curvature for steps: outliers count with the weight of their residual.
    #[must_use]
    pub fn step_curvature(&self) -> DMatrix<f64> {
        let size = self.parameters();
        DMatrix::from_fn(size, size, |row, column| {
            let place = row.min(column) * size + row.max(column);
            self.curvature[place] + self.outlier_curvature[place]
        })
    }

    /// A penalty on one parameter that is no data: `½ residual²`, slope `slope`.
    pub(super) fn add_penalty(&mut self, parameter: usize, residual: f64, slope: f64) {
        self.sums.add_penalty(residual);
        self.gradient[parameter] += residual * slope;
        let size = self.parameters();
        self.curvature[parameter * size + parameter] += slope * slope;
    }
}

/// `matrix += weight g gᵀ`, upper triangle; parameters that a row does not see cost nothing.
fn add_outer_product(matrix: &mut [f64], weight: f64, gradient: &[f64]) {
    let size = gradient.len();
    for (row, &slope) in gradient.iter().enumerate() {
        let factor = weight * slope;
        if factor == 0.0 {
            continue;
        }
        let line = &mut matrix[row * size + row..(row + 1) * size];
        for (sum, other) in line.iter_mut().zip(&gradient[row..]) {
            *sum += factor * other;
        }
    }
}

fn add_all(sums: &mut [f64], terms: &[f64]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += term;
    }
}
