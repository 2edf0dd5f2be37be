//! What a model leaves of rows that its fit did not count.

use super::bench::Bench;
use super::fitted::Fitted;
use super::fold_squares::FoldSquares;
use rayon::prelude::*;

impl Bench<'_> {
    /// Cross-validated squared residuals per output and fold: each fold judged
    /// by a fit that did not count its rows. The initial states have priors, so
    /// a fold at a recording's start is not judged by a wild start.
    pub fn cross_validate(&self, full: &Fitted) -> Vec<FoldSquares> {
        let folds: Vec<usize> = (0..self.folds.count).collect();
        let judge = |&fold: &usize| {
            let values = self.fit_without(full, fold)?;
            let model = Fitted {
                values,
                ..full.clone()
            };
            Some(self.residuals_of(&model))
        };
        let judged: Option<Vec<_>> = folds.par_iter().map(judge).collect();
        let Some(judged) = judged else {
            return vec![FoldSquares::failed(folds.len()); self.noise.len()];
        };
        let scales = self.squares_of_own_noise(full, &self.residuals_of(full));
        self.squares_by_fold(&scales, |fold, output, recording| {
            &judged[fold][output][recording]
        })
    }

    /// Squared residuals of a model per output and fold.
    pub fn by_fold(&self, model: &Fitted) -> Vec<FoldSquares> {
        let residuals = self.residuals_of(model);
        let scales = self.squares_of_own_noise(model, &residuals);
        self.squares_by_fold(&scales, |_, output, recording| {
            &residuals[output][recording]
        })
    }

    /// Of residuals by fold, output and recording, each output over its scale.
    fn squares_by_fold<'r>(
        &self,
        scales: &[f64],
        residuals: impl Fn(usize, usize, usize) -> &'r [f64],
    ) -> Vec<FoldSquares> {
        let (residuals, folds) = (&residuals, &self.folds);
        let of_recording = |output: usize, recording: usize| {
            (0..self.tracks[recording].len()).map(move |row| {
                let fold = folds.fold(recording, row);
                (fold, residuals(fold, output, recording)[row])
            })
        };
        let of_output = |output: usize| {
            let recordings = 0..self.tracks.len();
            let rows = recordings.flat_map(|recording| of_recording(output, recording));
            FoldSquares::of(rows, folds.count)
        };
        let scales = scales.iter().enumerate();
        scales
            .map(|(output, scale)| of_output(output).over(*scale))
            .collect()
    }
}
