//! What counts as a misfit.

use super::fitted::{Bench, Fitted};
use crate::laws::Law;

/// A misfit whose energy is this much above the noise's is looked into. With
/// 1000 independent rows the energy of noise alone varies by 4 %.
pub(super) const WORTH_A_SEARCH: f64 = 0.10;
/// The same where the noise is a floor that was set and not one that was
/// declared: forces below it are not looked for, and it is no better known than
/// by this (healthy rigs were seen up to 0.6 above it).
const WORTH_A_SEARCH_OF_FORCES: f64 = 1.0;

impl Bench<'_> {
    /// Whether a model misses an output by more than its noise explains.
    pub(super) fn misses_output(&self, model: &Fitted, output: usize) -> bool {
        let noise = self.noise[output].powi(2);
        let least = match self.law {
            Law::Balance => WORTH_A_SEARCH_OF_FORCES,
            _ => WORTH_A_SEARCH,
        };
        model.mean_square[output] / noise - 1.0 > least
    }

    /// Whether a model misses some output.
    pub(super) fn misses_any(&self, model: &Fitted) -> bool {
        (0..self.noise.len()).any(|output| self.misses_output(model, output))
    }

    /// Whether a model misses some output that can be trusted to show it. A break-away
    /// is read off too few rows, and creep too near to sticking, to say by themselves
    /// that something is missing.
    pub(super) fn misses_plainly(&self, model: &Fitted) -> bool {
        let trusted = match self.law {
            Law::Balance => 1,
            _ => self.noise.len(),
        };
        (0..trusted).any(|output| self.misses_output(model, output))
    }
}
