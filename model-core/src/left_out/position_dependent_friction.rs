//! `position-dependent-friction`: seals, band and guides hold faster in some
//! places of the stroke than in others.
//!
//! ```text
//! share(x) = 1 + c cos(2 pi x / L) + s sin(2 pi x / L) + k1 x + k2 x^2
//! FC -> FC share(x),   FS -> FS share(x)
//! ```
//!
//! Source: out-of-straight guides and bands, seals over marks of machining.
//! Amplitudes are shares of the level: 0.05-0.3, at wavelengths of 20-200 mm;
//! under 0.02 of a Coulomb level of 20 N (0.4 N, 0.8 kPa) it does not matter.
//! Confused with a force of the place (cable, slope, misalignment): friction
//! turns with the direction and the force does not, so that strokes both ways
//! at a few constant speeds separate them. A wavelength much over the stroke is
//! `slope_per_m` and `curvature_per_m2`.

use crate::friction::FrictionLevels;
use crate::math::cosine_sine_of_turns;
use crate::real::Real;

/// Friction never falls under this share of its level, whatever the terms add
/// up to: below nought it would drive.
const LEAST_SHARE: f64 = 0.05;

/// Amplitudes, shares of the level; all 0 is neutral at every wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionDependentFriction<R> {
    /// c.
    pub cosine: R,
    /// s.
    pub sine: R,
    /// L in m; over 0.
    pub wavelength_m: R,
    /// k1 in 1/m.
    pub slope_per_m: R,
    /// k2 in 1/m2.
    pub curvature_per_m2: R,
}

impl<R: Real> PositionDependentFriction<R> {
    /// The same friction everywhere.
    pub fn neutral() -> Self {
        Self {
            cosine: R::ZERO,
            sine: R::ZERO,
            wavelength_m: R::from_f64(0.1),
            slope_per_m: R::ZERO,
            curvature_per_m2: R::ZERO,
        }
    }

    /// Whether friction is the same everywhere.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.has_no_wave() && self.slope_per_m == R::ZERO && self.curvature_per_m2 == R::ZERO
    }

    fn has_no_wave(&self) -> bool {
        self.cosine == R::ZERO && self.sine == R::ZERO
    }

    /// What share of the level holds at a position.
    pub fn share(&self, position_m: R) -> R {
        let trend = (self.slope_per_m + self.curvature_per_m2 * position_m) * position_m;
        let wave = if self.has_no_wave() {
            R::ZERO
        } else {
            let (cosine, sine) = cosine_sine_of_turns(position_m / self.wavelength_m);
            self.cosine * cosine + self.sine * sine
        };
        (R::ONE + wave + trend).max(R::from_f64(LEAST_SHARE))
    }

    /// The levels at a position.
    #[inline]
    pub fn levels(&self, levels: FrictionLevels<R>, position_m: R) -> FrictionLevels<R> {
        if self.is_neutral() {
            return levels;
        }
        let share = self.share(position_m);
        FrictionLevels {
            coulomb_n: levels.coulomb_n * share,
            static_n: levels.static_n * share,
            ..levels
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;
    use core::f64::consts::TAU;

    #[test]
    fn val_share_is_the_series() {
        let friction = PositionDependentFriction {
            cosine: 0.2,
            sine: -0.1,
            wavelength_m: 0.07,
            slope_per_m: 0.3,
            curvature_per_m2: 1.5,
        };
        for x in [-0.24_f64, -0.01, 0.0, 0.033, 0.2] {
            let angle = TAU * x / 0.07;
            let expected =
                1.0 + 0.2 * libm::cos(angle) - 0.1 * libm::sin(angle) + 0.3 * x + 1.5 * x * x;
            assert!((friction.share(x) - expected).abs() < 1e-12, "at {x}");
        }
    }

    #[test]
    fn prop_friction_never_drives() {
        let friction = PositionDependentFriction {
            slope_per_m: 10.0,
            ..PositionDependentFriction::neutral()
        };
        let levels = friction.levels(paper::friction_levels::<f64>(), -0.25);
        assert!(levels.coulomb_n > 0.0 && levels.static_n > levels.coulomb_n);
    }
}
