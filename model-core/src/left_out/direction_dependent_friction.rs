//! `direction-dependent-friction`: lips of seals hold one way faster than the
//! other.
//!
//! ```text
//! FC -> FC (1 + a sgn),   FS -> FS (1 + a sgn),   sigma2 -> sigma2 (1 + av sgn)
//! sgn = tanh(v/vs + 2 sigma0 z / FC)
//! ```
//!
//! A step freezes the levels at its start, so that sgn must not depend on a
//! velocity of nought: where the carriage stands, the bristle says which way it
//! is pushed (sgn is over 0.96 at the Coulomb level), and where it slides the
//! velocity prevails, within a few v_s of a reversal.
//!
//! Source: Zhu and Barth found it necessary; single-lip seals, one per chamber.
//! a is 0.02-0.3 either way; under 0.02 of 20 N (0.4 N) it does not matter.
//! Confused with a constant force, with the offset of a pressure sensor (2 kPa
//! are 1 N) and with unequal areas: these do not grow with the friction level,
//! and a force keeps its sign where this one, being odd and even at once, only
//! shifts the mean. In slow strokes both ways at one pressure it *is* a
//! constant force; stick and slide (FS a against FC a), several speeds
//! (`viscous_asymmetry`) or several pressures separate them.

use crate::friction::{Bristle, FrictionLevels};
use crate::real::Real;

/// The factors keep within 1 -+ this: below nought friction would drive.
const MOST_ASYMMETRY: f64 = 0.95;
/// How fast the bristle turns the sign, per Coulomb level.
const BRISTLE_WEIGHT: f64 = 2.0;
/// Beyond, tanh is 1 to the last bit of an `f64`; its exponential stays finite.
const LARGEST_ARGUMENT: f64 = 20.0;

/// Asymmetries, shares of the level; 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionDependentFriction<R> {
    /// a, of the Coulomb and the static level; over 0 towards +x.
    pub asymmetry: R,
    /// av, of the viscous coefficient.
    pub viscous_asymmetry: R,
}

impl<R: Real> DirectionDependentFriction<R> {
    /// The same friction both ways.
    pub const NEUTRAL: Self = Self {
        asymmetry: R::ZERO,
        viscous_asymmetry: R::ZERO,
    };

    /// Whether friction is the same both ways.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.asymmetry == R::ZERO && self.viscous_asymmetry == R::ZERO
    }

    /// The levels under a motion.
    #[inline]
    pub fn levels(
        &self,
        levels: FrictionLevels<R>,
        bristle: &Bristle<R>,
        velocity_m_per_s: R,
        deflection_m: R,
    ) -> FrictionLevels<R> {
        if self.is_neutral() {
            return levels;
        }
        let speed = velocity_m_per_s / bristle.stribeck_velocity_m_per_s;
        let bent = bristle.stiffness_n_per_m * deflection_m / levels.at_least().coulomb_n;
        let sign = tanh(speed + R::from_f64(BRISTLE_WEIGHT) * bent);
        let most = R::from_f64(MOST_ASYMMETRY);
        let factor = |asymmetry: R| R::ONE + asymmetry.clamp(-most, most) * sign;
        let dry = factor(self.asymmetry);
        FrictionLevels {
            coulomb_n: levels.coulomb_n * dry,
            static_n: levels.static_n * dry,
            viscous_n_s_per_m: levels.viscous_n_s_per_m * factor(self.viscous_asymmetry),
        }
    }
}

fn tanh<R: Real>(argument: R) -> R {
    let most = R::from_f64(LARGEST_ARGUMENT);
    let two = R::from_f64(2.0);
    R::ONE - two / ((two * argument.clamp(-most, most)).exp() + R::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const SEAL: DirectionDependentFriction<f64> = DirectionDependentFriction {
        asymmetry: 0.2,
        viscous_asymmetry: -0.1,
    };

    #[test]
    fn val_levels_while_sliding_either_way() {
        let (bristle, declared) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        for sign in [1.0, -1.0] {
            let bent = sign * declared.coulomb_n / bristle.stiffness_n_per_m;
            let levels = SEAL.levels(declared, &bristle, sign * 0.1, bent);
            let (dry, wet) = (1.0 + 0.2 * sign, 1.0 - 0.1 * sign);
            assert!((levels.coulomb_n - dry * declared.coulomb_n).abs() < 1e-6);
            assert!((levels.static_n - dry * declared.static_n).abs() < 1e-6);
            let viscous = wet * declared.viscous_n_s_per_m;
            assert!((levels.viscous_n_s_per_m - viscous).abs() < 1e-6);
        }
    }

    #[test]
    fn prop_standing_it_is_the_bristle_that_says_the_way() {
        let (bristle, declared) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        let bent = declared.static_n / bristle.stiffness_n_per_m;
        let pushed = SEAL.levels(declared, &bristle, 0.0, bent);
        assert!((pushed.static_n / declared.static_n - 1.2).abs() < 2e-3);
        let relaxed = SEAL.levels(declared, &bristle, 0.0, 0.0);
        assert!((relaxed.static_n - declared.static_n).abs() < 1e-12);
    }
}
