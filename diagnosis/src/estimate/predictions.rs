//! What a model predicts, and what it leaves.

use super::bench::Bench;
use super::fitted::Fitted;
use super::fold_squares::row_squares;
use crate::fit::law_problem::{Columns, LawProblem};
use crate::laws::Track;

impl Bench<'_> {
    /// Mean squares of what a model leaves, in the bench's noise.
    pub(super) fn mean_squares(&self, model: &Fitted, residuals: &[Vec<Vec<f64>>]) -> Vec<f64> {
        let scales = self.squares_of_own_noise(model, residuals);
        let squares = mean_squares(residuals).into_iter().zip(scales);
        squares.map(|(square, scale)| square / scale).collect()
    }

    /// Residuals (predicted less recorded) by output, then by recording.
    pub fn residuals(&self, problem: &LawProblem<'_>, values: &[f64]) -> Vec<Vec<Vec<f64>>> {
        let outputs = self.law.outputs(self.rig).len();
        let mut all = vec![Vec::with_capacity(self.tracks.len()); outputs];
        for (recording, (predicted, _)) in problem.predict(values).into_iter().enumerate() {
            let recorded = problem.recorded(recording);
            for (output, (column, seen)) in predicted.iter().zip(recorded).enumerate() {
                all[output].push(column.iter().zip(seen).map(|(p, r)| p - r).collect());
            }
        }
        all
    }

    /// What was recorded, by recording and output.
    pub(crate) fn recorded(&self) -> Vec<Columns> {
        let outputs = self.law.outputs(self.rig);
        let of_track = |track: &Track<'_>| {
            let columns = outputs.iter().map(|output| track.recorded(output).to_vec());
            columns.collect()
        };
        self.tracks.iter().map(of_track).collect()
    }

    /// Predictions of a fitted model for other tracks of the same recordings.
    pub fn predicted_on(&self, fitted: &Fitted, tracks: &[Track<'_>]) -> Vec<Columns> {
        let presence = fitted.presence.as_ref();
        self.with_problem(&fitted.set, tracks, presence, |problem| {
            let predicted = problem.predict(&fitted.values).into_iter();
            predicted.map(|(columns, _)| columns).collect()
        })
    }

    /// The same by output, then by recording.
    pub(crate) fn predicted_by_output(
        &self,
        fitted: &Fitted,
        tracks: &[Track<'_>],
    ) -> Vec<Vec<Vec<f64>>> {
        let mut all = vec![Vec::with_capacity(tracks.len()); self.noise.len()];
        for columns in self.predicted_on(fitted, tracks) {
            for (output, column) in all.iter_mut().zip(columns) {
                output.push(column);
            }
        }
        all
    }

    /// Residuals of a fitted model.
    pub fn residuals_of(&self, fitted: &Fitted) -> Vec<Vec<Vec<f64>>> {
        let presence = fitted.presence.as_ref();
        self.with_problem(&fitted.set, self.tracks, presence, |problem| {
            self.residuals(problem, &fitted.values)
        })
    }

    /// What a fitted model misses of one recording if its effect were there in some spans: squares
    /// in units of the noise, summed.
    pub fn cost_of_spans<'b>(
        &'b self,
        fitted: &'b Fitted,
        recording: usize,
    ) -> impl Fn(&[(f64, f64)]) -> f64 + 'b {
        let presence = fitted.presence.as_ref();
        let both_ways = self.with_problem(&fitted.set, self.tracks, presence, |problem| {
            problem.both_ways(recording, &fitted.values)
        });
        move |spans_s| {
            let mut presence = presence.cloned();
            if let Some(presence) = &mut presence {
                presence.spans_s[recording] = spans_s.to_vec();
            }
            self.with_problem(&fitted.set, self.tracks, presence.as_ref(), |problem| {
                let predicted = match &both_ways {
                    Some(both_ways) => problem.predict_mixed(recording, both_ways),
                    None => problem.predict_recording(recording, &fitted.values),
                };
                let recorded = problem.recorded(recording);
                let squares = row_squares(&predicted, &recorded, &self.noise);
                squares.iter().sum()
            })
        }
    }

    /// Squared residuals of a fitted model by recording and row, in units of the
    /// noise and summed over the outputs, in windows that each begin from what was
    /// measured.
    pub fn squares_in_windows(&self, fitted: &Fitted) -> Vec<Vec<f64>> {
        let presence = fitted.presence.as_ref();
        let window_s = self.rig.horizon_s();
        self.with_problem(&fitted.set, self.tracks, presence, |problem| {
            let predicted = problem.predict_in_windows(&fitted.values, window_s);
            let squares = |(recording, columns): (usize, &Columns)| {
                row_squares(columns, &problem.recorded(recording), &self.noise)
            };
            predicted.iter().enumerate().map(squares).collect()
        })
    }
}

/// Of residuals by output and recording, the mean square of each output, SI squared.
pub(crate) fn mean_squares(residuals: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let of_output = |columns: &Vec<Vec<f64>>| {
        let rows = columns.iter().flatten();
        let finite = rows.filter(|residual| residual.is_finite());
        let (sum, count) = finite.fold((0.0, 0_usize), |(sum, count), r| (sum + r * r, count + 1));
        sum / count.max(1) as f64
    };
    residuals.iter().map(of_output).collect()
}
