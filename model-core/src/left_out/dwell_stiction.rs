//! `dwell-stiction`: the longer the seal stands, the faster it holds.
//!
//! ```text
//! FS_eff = FS + dF s
//! s' = (1 - s) / tau  -  |v| / l  s
//! ```
//!
//! s grows from 0 towards 1 while the seal stands and is forgotten over the way
//! l once it moves: the state of rate-and-state friction. A bristle under a
//! rising load creeps, and part of the age is lost on the way to break-away:
//! the force that is read there lies below FS + dF s, the more so the shorter l.
//! Few recordings tell dF and l apart. The update is the exact solution for a velocity held over the step:
//! stable at every step.
//!
//! Source: growth of stiction with time of stationary contact (adhesion and
//! squeezed-out lubricant); the form with one time constant and forgetting over
//! a length is that of rate-and-state friction (Dieterich). Typical dF is
//! 0.3-1.5 FS with tau 0.5-100 s and l some widths of a contact, 0.05-0.5 mm; under 2 N (4 kPa) it does not matter.
//! Confused with a static level fitted at one dwell, with valve hysteresis and
//! with thermal drift of the pressures while waiting; stops of several lengths
//! (0.1 s to 300 s) before one and the same slow ramp separate them.

use crate::friction::FrictionLevels;
use crate::real::Real;

/// l where nothing is known of it, m: ten deflections of the bristle at the Coulomb
/// level (22 um).
pub const FORGETTING_WAY_M: f64 = 0.2e-3;

/// Parameters; a rise of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DwellStiction<R> {
    /// dF in N.
    pub rise_n: R,
    /// tau in s; over 0.
    pub time_constant_s: R,
    /// l in m; over 0.
    pub forgetting_way_m: R,
}

impl<R: Real> DwellStiction<R> {
    /// A static level that does not age.
    pub fn neutral() -> Self {
        Self {
            rise_n: R::ZERO,
            time_constant_s: R::ONE,
            forgetting_way_m: R::from_f64(FORGETTING_WAY_M),
        }
    }

    /// Whether the static level does not age.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.rise_n == R::ZERO
    }

    /// The levels of a contact of this age.
    #[inline]
    pub fn levels(&self, levels: FrictionLevels<R>, age: R) -> FrictionLevels<R> {
        if self.is_neutral() {
            return levels;
        }
        FrictionLevels {
            static_n: levels.static_n + self.rise_n * age,
            ..levels
        }
    }

    /// The age s after a step at a velocity.
    #[inline]
    pub fn step(&self, age: R, velocity_m_per_s: R, dt_s: R) -> R {
        if self.is_neutral() {
            return age;
        }
        let growing = dt_s / self.time_constant_s;
        let slid = dt_s * velocity_m_per_s.abs() / self.forgetting_way_m;
        let rate = growing + slid;
        let target = growing / rate;
        age + (target - age) * (R::ONE - (-rate).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STICTION: DwellStiction<f64> = DwellStiction {
        rise_n: 30.0,
        time_constant_s: 0.8,
        forgetting_way_m: 50e-6,
    };

    #[test]
    fn val_age_is_exponential_at_rest_at_every_step() {
        for steps in [1_u32, 7, 1000] {
            let mut age = 0.0;
            for _ in 0..steps {
                age = STICTION.step(age, 0.0, 2.0 / f64::from(steps));
            }
            assert!((age - (1.0 - libm::exp(-2.0 / 0.8))).abs() < 1e-12);
        }
    }

    #[test]
    fn prop_sliding_forgets_within_a_fraction_of_a_millimetre() {
        let mut age = 1.0;
        for _ in 0..20 {
            age = STICTION.step(age, 0.02, 0.5e-3);
        }
        assert!(age < 0.03, "{age} after 0.2 mm");
    }
}
