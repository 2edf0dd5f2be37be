//! What counts as a misfit: above the noise, and large enough to matter.

use super::fitted::{Bench, Fitted};
use crate::laws::Law;

/// A misfit whose energy is this much above the noise's is looked into. With
/// 1000 independent rows the energy of noise alone varies by 4 %.
pub(super) const WORTH_A_SEARCH: f64 = 0.10;
/// The same where the noise is a floor that was set and not one that was
/// declared: forces below it are not looked for, and it is no better known than
/// by this (healthy rigs were seen up to 0.6 above it).
const WORTH_A_SEARCH_OF_FORCES: f64 = 1.0;
/// A force of less than this part of the declared Coulomb level is not material, however
/// plain: 0.4 N of 20 N, 0.8 kPa on the piston, which an integrator holds.
pub(super) const LEAST_FORCE: f64 = 0.02;

impl Bench<'_> {
    /// What an effect must account for to matter: a force, of the balance of forces.
    pub(super) fn least_amplitude(&self) -> f64 {
        let coulomb_n = self.rig.value("friction.coulomb_N").unwrap_or(0.0);
        match self.law {
            Law::Balance => LEAST_FORCE * coulomb_n,
            _ => 0.0,
        }
    }

    /// Whether a model misses an output by more than its noise explains.
    pub(super) fn misses_output(&self, model: &Fitted, output: usize) -> bool {
        let noise = self.noise[output].powi(2);
        let least = match self.law {
            Law::Balance => WORTH_A_SEARCH_OF_FORCES,
            _ => WORTH_A_SEARCH,
        };
        let above = model.mean_square[output] - noise;
        above > least * noise && above >= self.least_amplitude().powi(2)
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
