//! Friction and load terms that add to the levels of the LuGre law:
//! `coulomb-friction`, `viscous-friction`, `stribeck-friction`,
//! `pressure-dependent-friction`, `constant-force`.
//!
//! ```text
//! FC    = FC0 + dFC + a (pa + pb - 2 p0)/2 + d |pa - pb|
//! FS    = FS0 + dFC + dFS + a (...) + d |...| + b (pa + pb - 2 p0)/2
//! sigma2 = sigma2_0 + dsigma2
//! FL    = FL0 + dFL
//! ```
//!
//! Source: the paper's figures 12 and 13 show FC, FS and sigma2 growing about
//! linearly with pressure and pressure difference while its (9)-(11) hold them
//! constant. Typical a: 2-6 N/bar, d: 0.5-3 N/bar; a seal that is pressed harder holds
//! harder too, so that with FS/FC kept b is a (FS0 - FC0)/FC0. While the carriage slides d
//! cannot be told from a scale of FC, sigma2 and mass together, but for braking against
//! driving. Confused with a scale of the
//! piston area (friction that follows the pressure difference looks like lost
//! area) and with FC fitted at the working pressure; strokes at several supply
//! pressures separate them. A constant force is confused with the offset of a
//! pressure sensor: 2 kPa are 1 N on this piston.

use crate::friction::FrictionLevels;
use crate::real::Real;

/// The additions; all 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionTerms<R> {
    /// `coulomb-friction`: dFC, N.
    pub coulomb_n: R,
    /// `stribeck-friction`: dFS above the Coulomb level, N.
    pub stribeck_n: R,
    /// `viscous-friction`: dsigma2, N s/m.
    pub viscous_n_s_per_m: R,
    /// `pressure-dependent-friction`: a, N per Pa of mean gauge pressure.
    pub per_mean_pressure_n_per_pa: R,
    /// `pressure-dependent-friction`: d, N per Pa of pressure difference.
    pub per_pressure_difference_n_per_pa: R,
    /// `pressure-dependent-friction`: b, N per Pa of mean gauge pressure by which FS grows
    /// more than FC.
    pub static_rise_per_mean_pressure_n_per_pa: R,
    /// `constant-force`: dFL against +x, N.
    pub constant_force_n: R,
}

impl<R: Real> FrictionTerms<R> {
    /// No addition.
    pub const NEUTRAL: Self = Self {
        coulomb_n: R::ZERO,
        stribeck_n: R::ZERO,
        viscous_n_s_per_m: R::ZERO,
        per_mean_pressure_n_per_pa: R::ZERO,
        per_pressure_difference_n_per_pa: R::ZERO,
        static_rise_per_mean_pressure_n_per_pa: R::ZERO,
        constant_force_n: R::ZERO,
    };

    /// The levels at the present gauge pressures of the chambers.
    #[inline]
    pub fn levels(
        &self,
        declared: &FrictionLevels<R>,
        gauge_a_pa: R,
        gauge_b_pa: R,
    ) -> FrictionLevels<R> {
        let mean = (gauge_a_pa + gauge_b_pa) * R::from_f64(0.5);
        let added = self.coulomb_n
            + self.per_mean_pressure_n_per_pa * mean
            + self.per_pressure_difference_n_per_pa * (gauge_a_pa - gauge_b_pa).abs();
        FrictionLevels {
            coulomb_n: declared.coulomb_n + added,
            static_n: declared.static_n
                + added
                + self.stribeck_n
                + self.static_rise_per_mean_pressure_n_per_pa * mean,
            viscous_n_s_per_m: declared.viscous_n_s_per_m + self.viscous_n_s_per_m,
        }
    }
}
