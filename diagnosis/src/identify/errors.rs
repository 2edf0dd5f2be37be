//! What a model leaves unexplained, signal by signal.

use crate::estimate::{Bench, Fitted};
use crate::fit::law_problem::FreeParameter;
use crate::laws::{Law, Track};
use crate::rig::Rig;
use crate::search::baseline;
use serde::Serialize;

/// Residuals (predicted less recorded) by output, recording and row.
pub type Residuals = Vec<Vec<Vec<f64>>>;

/// The residuals of a law with the rig's numbers as they are. Initial states
/// and `own` parameters (those that belong to a recording) are estimated from
/// the recordings; nothing else is. `None` where the law has no finite answer.
pub fn residuals_as_given(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    own: &[FreeParameter],
) -> Option<Residuals> {
    let mut bench = Bench::new(law, rig, tracks);
    bench.ordinary = own.to_vec();
    let fitted: Fitted = baseline(&bench)?;
    let residuals = bench.residuals_of(&fitted);
    is_finite(law, &residuals).then_some(residuals)
}

/// Whether a law predicts every row that it does not leave out on purpose. One that does not
/// has failed, and what is left of its rows says nothing.
pub fn is_finite(law: Law, residuals: &Residuals) -> bool {
    let mut all = residuals.iter().flatten().flatten();
    all.all(|residual| residual.is_finite() || law.leaves_out(*residual))
}

/// RMS over the residuals of one output; rows that a law leaves out on purpose do not count.
pub fn rms(columns: &[Vec<f64>]) -> f64 {
    let (sum, count) = columns
        .iter()
        .flatten()
        .filter(|residual| !residual.is_nan())
        .fold((0.0, 0_usize), |(sum, count), r| (sum + r * r, count + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// A unit as the rig file spells it and its size in SI, the signal's own
/// scaling counted in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OwnUnit {
    /// The spelling.
    pub unit: String,
    /// SI per unit, for differences.
    pub si_per_unit: f64,
}

/// The unit in which a signal stands in its file.
pub fn own_unit(rig: &Rig, signal: &str) -> Option<OwnUnit> {
    let signal = rig.signals.get(signal)?;
    let si_per_unit = signal.unit.factor() * signal.scale.unwrap_or(1.0).abs();
    Some(OwnUnit {
        unit: signal.unit.to_string(),
        si_per_unit,
    })
}

/// RMS errors of one predicted signal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SignalError {
    /// The signal.
    pub signal: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
    /// The unit of the rig file.
    pub own: Option<OwnUnit>,
    /// Noise of the sensor, SI: no model can be better.
    pub noise: f64,
    /// Standard deviation of the recorded signal, SI.
    pub spread: f64,
    /// On the training recordings, SI.
    pub train: BeforeAfter,
    /// On the held-out recordings, SI.
    pub held_out: Option<BeforeAfter>,
}

/// RMS error with the rig as given and with the fitted values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// As given; `None` where the given rig has no finite answer.
    pub before: Option<f64>,
    /// Fitted.
    pub after: Option<f64>,
}

impl BeforeAfter {
    pub(super) fn of(before: Option<&Residuals>, after: Option<&Residuals>, output: usize) -> Self {
        let of = |residuals: Option<&Residuals>| Some(rms(residuals?.get(output)?));
        Self {
            before: of(before),
            after: of(after),
        }
    }
}
