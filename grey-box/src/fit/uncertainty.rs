//! What the data say about the parameters of a fit.
//!
//! The covariance is the noise variance times the pseudo-inverse of the curvature
//! of the cost, in the space of the parameters that stand free of their bounds.
//! The curvature is brought to unit diagonal first: pascals beside metres would
//! otherwise pass for rank deficiency. A direction that the data do not determine
//! is reported, and every parameter that takes part in it has no standard deviation.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A parameter takes part in an undetermined direction if its share of the unit
/// vector exceeds this: well above the rounding of an eigenvector (about 1e-13 for
/// well-separated eigenvalues), far below any share that means something.
const PARTICIPATION: f64 = 1.0e-6;

/// The curvature of a cost, taken apart.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    /// Pseudo-inverse of the curvature; zero rows for parameters at their bounds.
    pub inverse_curvature: DMatrix<f64>,
    /// Number of directions that the data determine.
    pub rank: usize,
    /// Ratio of the largest to the smallest eigenvalue of the curvature at unit
    /// diagonal; infinite if the rank is not full.
    pub condition: f64,
    /// Directions in which the cost is flat, scaled to unit length in units of
    /// each parameter's `scale`.
    pub undetermined: Vec<DVector<f64>>,
    /// Whether the data determine this parameter.
    pub determined: Vec<bool>,
}

/// Rounding in a sum of `rows` products grows with the root of their number, that
/// of an eigenvalue with the size of the matrix; both with a margin of several.
fn rank_tolerance(size: usize, rows: usize) -> f64 {
    f64::EPSILON * (32.0 * size as f64 + 4.0 * (rows as f64).sqrt())
}

impl Uncertainty {
    /// Take `curvature` apart on the `free` parameters; `rows` went into it.
    #[must_use]
    pub fn new(curvature: &DMatrix<f64>, free: &[usize], scales: &[f64], rows: usize) -> Self {
        let size = curvature.nrows();
        let mut this = Self {
            inverse_curvature: DMatrix::zeros(size, size),
            rank: 0,
            condition: 1.0,
            undetermined: Vec::new(),
            determined: (0..size).map(|index| free.contains(&index)).collect(),
        };
        let seen = this.set_aside_unseen(curvature, free, scales);
        this.invert(curvature, &seen, scales, rows);
        if !this.undetermined.is_empty() {
            this.condition = f64::INFINITY;
        }
        this
    }

    /// Parameters that no row sees are undetermined by themselves; the others are returned.
    fn set_aside_unseen(
        &mut self,
        curvature: &DMatrix<f64>,
        free: &[usize],
        scales: &[f64],
    ) -> Vec<usize> {
        let (seen, unseen): (Vec<usize>, Vec<usize>) = free
            .iter()
            .partition(|&&index| curvature[(index, index)] > 0.0);
        for index in unseen {
            let mut direction = DVector::zeros(curvature.nrows());
            direction[index] = scales[index];
            self.undetermined.push(direction);
            self.determined[index] = false;
        }
        seen
    }

    fn invert(&mut self, curvature: &DMatrix<f64>, seen: &[usize], scales: &[f64], rows: usize) {
        if seen.is_empty() {
            return;
        }
        let unit: Vec<f64> = seen.iter().map(|&i| curvature[(i, i)].sqrt()).collect();
        let scaled = DMatrix::from_fn(seen.len(), seen.len(), |row, column| {
            curvature[(seen[row], seen[column])] / (unit[row] * unit[column])
        });
        let eigen = SymmetricEigen::new(scaled);
        let largest = eigen.eigenvalues.max();
        self.condition = largest / eigen.eigenvalues.min();
        let threshold = largest * rank_tolerance(seen.len(), rows);
        for (&eigenvalue, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            let mut direction = DVector::zeros(curvature.nrows());
            for (place, &index) in seen.iter().enumerate() {
                direction[index] = vector[place] / unit[place];
            }
            if eigenvalue > threshold {
                self.rank += 1;
                self.inverse_curvature += &direction * direction.transpose() / eigenvalue;
            } else {
                for (place, &index) in seen.iter().enumerate() {
                    self.determined[index] &= vector[place].abs() <= PARTICIPATION;
                }
                self.undetermined.push(in_scales(direction, scales));
            }
        }
    }
}

/// `direction`, of unit length when each parameter is counted in its scale.
fn in_scales(direction: DVector<f64>, scales: &[f64]) -> DVector<f64> {
    let squares = direction.iter().zip(scales).map(|(d, s)| (d / s).powi(2));
    let length = squares.sum::<f64>().sqrt();
    direction / length
}
