//! placeholder until merged
use crate::laws::{Law, Track};
use crate::rig::Rig;
/// Where a misfit sits.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// Place.
    pub place: String,
    /// Signal.
    pub signal: String,
    /// RMS.
    pub rms: f64,
    /// Share.
    pub share: f64,
    /// Intervals.
    pub intervals: Vec<(String, f64, f64)>,
    /// Words.
    pub when: String,
    /// Variables.
    pub variables: Vec<VariableShare>,
}
/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct VariableShare {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// eta squared
    pub eta_squared: f64,
    /// x, mean, sd, count
    pub bins: Vec<(f64, f64, f64, usize)>,
}
/// Locates.
pub fn locate(
    _law: Law,
    _rig: &Rig,
    _tracks: &[Track<'_>],
    _residuals: &[Vec<Vec<f64>>],
) -> Vec<Located> {
    Vec::new()
}
