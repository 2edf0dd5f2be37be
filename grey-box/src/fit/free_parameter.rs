//! A number of a rig that a fit moves.

use super::levenberg_marquardt::Parameter;

/// Whether a parameter is one number or one per recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// One for all recordings.
    Shared,
    /// One for each.
    PerRecording,
}

/// A parameter left free in a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeParameter {
    /// `section.key` or `effects.NAME.key`.
    pub key: String,
    /// Shared or per recording.
    pub scope: Scope,
    /// Start, bounds, prior.
    pub parameter: Parameter,
}
