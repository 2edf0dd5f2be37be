//! What a model misses of one output, by fold.

/// Squares of an output summed by fold, and the rows that each is of.
#[derive(Clone, Debug)]
pub struct FoldSquares {
    sums: Vec<f64>,
    rows: Vec<usize>,
}

impl FoldSquares {
    /// Of the residuals of every fold; what is no number was not predicted.
    pub fn of(residuals: impl Iterator<Item = (usize, f64)>, folds: usize) -> Self {
        let (mut sums, mut rows) = (vec![0.0; folds], vec![0; folds]);
        for (fold, residual) in residuals.filter(|(_, residual)| residual.is_finite()) {
            sums[fold] += residual * residual;
            rows[fold] += 1;
        }
        Self { sums, rows }
    }

    /// The same in another unit of squares.
    #[must_use]
    pub fn over(mut self, scale: f64) -> Self {
        self.sums.iter_mut().for_each(|sum| *sum /= scale);
        self
    }

    /// Of a model that could not be fitted: as bad as can be.
    pub fn failed(folds: usize) -> Self {
        Self {
            sums: vec![f64::INFINITY; folds],
            rows: vec![1; folds],
        }
    }

    /// Mean square over all rows. A fold counts as often as it has rows: of the break-aways a
    /// recording may hold two where another holds forty.
    pub fn mean(&self) -> f64 {
        let rows: usize = self.rows.iter().sum();
        self.sums.iter().sum::<f64>() / rows.max(1) as f64
    }

    /// Mean squares of the folds with those of another model beside them. A recording without a
    /// break-away says nothing of break-aways.
    pub fn beside<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.means()
            .zip(other.means())
            .filter_map(|(mine, theirs)| mine.zip(theirs))
    }

    /// By fold; none of one without rows.
    fn means(&self) -> impl Iterator<Item = Option<f64>> {
        let folds = self.sums.iter().zip(&self.rows);
        folds.map(|(sum, &rows)| (rows > 0).then(|| sum / rows as f64))
    }
}

/// Squared errors of each row in units of the noise, over all outputs.
pub(crate) fn row_squares(predicted: &[Vec<f64>], recorded: &[&[f64]], sigma: &[f64]) -> Vec<f64> {
    let mut squares = vec![0.0; predicted.first().map_or(0, Vec::len)];
    for ((column, seen), sigma) in predicted.iter().zip(recorded).zip(sigma) {
        for (sum, (p, r)) in squares.iter_mut().zip(column.iter().zip(*seen)) {
            let error = (p - r) / sigma;
            if error.is_finite() {
                *sum += error * error;
            }
        }
    }
    squares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording with two break-aways that were no good outweighed 49 of two others, and a
    /// constant force took the place of a friction that depends on the direction.
    #[test]
    fn regress_few_rows_do_not_outweigh_many() {
        let of = |few: f64, many: f64| {
            let rows = (0..2).map(|_| (0, few)).chain((0..49).map(|_| (1, many)));
            FoldSquares::of(rows, 3)
        };
        let (one, other) = (of(3.0, 0.2), of(1.0, 1.4));
        assert!(one.mean() < other.mean());
        assert!((one.mean() - (2.0 * 9.0 + 49.0 * 0.04) / 51.0).abs() < 1e-12);
        assert_eq!(one.beside(&other).count(), 2, "the third fold is empty");
    }

    #[test]
    fn prop_a_fold_without_rows_and_rows_without_numbers_do_not_count() {
        let squares = FoldSquares::of([(0, 2.0), (1, f64::NAN)].into_iter(), 2);
        assert!((squares.mean() - 4.0).abs() < 1e-12);
        assert!(FoldSquares::failed(2).mean().is_infinite());
        assert!(FoldSquares::of(std::iter::empty(), 2).mean().abs() < 1e-12);
    }
}
