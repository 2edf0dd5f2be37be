//! What a model misses of one output, by fold.

/// Mean squares of an output by fold, and the rows that each is of.
#[derive(Clone, Debug)]
pub struct FoldSquares {
    mean_squares: Vec<f64>,
    rows: Vec<usize>,
}

impl FoldSquares {
    /// Of the residuals of every fold; what is no number was not predicted.
    pub fn of(residuals: impl Iterator<Item = (usize, f64)>, folds: usize) -> Self {
        let (mut sums, mut rows) = (vec![0.0; folds], vec![0_usize; folds]);
        for (fold, residual) in residuals.filter(|(_, residual)| residual.is_finite()) {
            sums[fold] += residual * residual;
            rows[fold] += 1;
        }
        let means = sums.iter().zip(&rows);
        Self {
            mean_squares: means.map(|(sum, &n)| sum / n.max(1) as f64).collect(),
            rows,
        }
    }

    /// Of a model that could not be fitted: as bad as can be.
    pub fn failed(folds: usize) -> Self {
        Self {
            mean_squares: vec![f64::INFINITY; folds],
            rows: vec![1; folds],
        }
    }

    /// Mean square over all rows. A fold counts as often as it has rows: of the break-aways a
    /// recording may hold two where another holds forty.
    pub fn mean(&self) -> f64 {
        let held = self.mean_squares.iter().zip(&self.rows);
        let held = held.filter(|(_, rows)| **rows > 0);
        let (sum, rows) = held.fold((0.0, 0), |(sum, all), (square, &rows)| {
            (sum + square * rows as f64, all + rows)
        });
        sum / rows.max(1) as f64
    }

    /// Mean squares of the folds with those of another model beside them. A recording without a
    /// break-away says nothing of break-aways.
    pub fn beside<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (f64, f64)> + 'a {
        let mine = self.mean_squares.iter().copied();
        let pairs = mine.zip(other.mean_squares.iter().copied());
        let held = pairs.zip(&self.rows).filter(|(_, rows)| **rows > 0);
        held.map(|(pair, _)| pair)
    }
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
