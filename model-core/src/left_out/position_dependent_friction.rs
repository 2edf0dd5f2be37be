//! `position-dependent-friction`: seals, band and guides hold faster in some
//! places of the stroke than in others.
//!
//! ```text
//! share(x) = 1 + c cos(2 pi x / L) + s sin(2 pi x / L) + k1 x + k2 x^2 + z w(x)
//! FC -> FC share(x),   FS -> FS share(x)
//! ```
//!
//! w is 1 within a zone and 0 outside; a seal runs over its border on a tenth of its length to
//! either side of each end, and w rises smoothly there.
//!
//! Source: out-of-straight guides and bands, seals over marks of machining.
//! Amplitudes are shares of the level: 0.05-0.3, at wavelengths of 20-200 mm;
//! under 0.02 of a Coulomb level of 20 N (0.4 N, 0.8 kPa) it does not matter.
//! Confused with a force of the place (cable, slope, misalignment): friction
//! turns with the direction and the force does not, so that strokes both ways
//! at a few constant speeds separate them. A wavelength much over the stroke is
//! `slope_per_m` and `curvature_per_m2`; a place that is dirty, dented or worn is a zone
//! (0.1-1 of the level over 5-100 mm).

use crate::friction::FrictionLevels;
use crate::math::cosine_sine_of_turns;
use crate::real::Real;

/// Friction never falls under this share of its level, whatever the terms add
/// up to: below nought it would drive.
const LEAST_SHARE: f64 = 0.05;
/// Part of a zone's length over which its border is crossed.
const BORDER: f64 = 0.2;
/// A zone shorter than this counts as this, m: the law divides by its length.
const SHORTEST_ZONE_M: f64 = 1e-6;

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
    /// Where along the stroke friction is another one.
    pub zone: FrictionZone<R>,
}

/// A part of the stroke with a friction of its own; a share of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionZone<R> {
    /// z.
    pub share: R,
    /// Its middle, m.
    pub middle_m: R,
    /// Its length, from half a border to half a border, m; over 0.
    pub length_m: R,
}

impl<R: Real> FrictionZone<R> {
    /// No zone; the place is one of a usual length, ready for a fit.
    pub fn neutral() -> Self {
        Self {
            share: R::ZERO,
            middle_m: R::ZERO,
            length_m: R::from_f64(0.05),
        }
    }

    /// What the zone adds to the share at a position.
    fn added(&self, position_m: R) -> R {
        let off_m = (position_m - self.middle_m).abs();
        let length_m = self.length_m.max(R::from_f64(SHORTEST_ZONE_M));
        let inside = R::from_f64(0.5 + 0.5 * BORDER) - off_m / length_m;
        let way = (inside * R::from_f64(1.0 / BORDER)).clamp(R::ZERO, R::ONE);
        self.share * way * way * (R::from_f64(3.0) - way - way)
    }
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
            zone: FrictionZone::neutral(),
        }
    }

    /// Whether friction is the same everywhere.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.has_no_wave()
            && self.slope_per_m == R::ZERO
            && self.curvature_per_m2 == R::ZERO
            && self.zone.share == R::ZERO
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
        let added = wave + trend + self.zone.added(position_m);
        (R::ONE + added).max(R::from_f64(LEAST_SHARE))
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
            ..PositionDependentFriction::neutral()
        };
        for x in [-0.24_f64, -0.01, 0.0, 0.033, 0.2] {
            let angle = TAU * x / 0.07;
            let expected =
                1.0 + 0.2 * libm::cos(angle) - 0.1 * libm::sin(angle) + 0.3 * x + 1.5 * x * x;
            assert!((friction.share(x) - expected).abs() < 1e-12, "at {x}");
        }
    }

    /// Its integral over the stroke is that of a box, and it ends where the borders do.
    #[test]
    fn val_a_zone_is_a_box_with_rounded_borders() {
        let zone = FrictionZone {
            share: 0.4,
            middle_m: 0.05,
            length_m: 0.03,
        };
        let friction = PositionDependentFriction {
            zone,
            ..PositionDependentFriction::neutral()
        };
        let share = |x: f64| friction.share(x);
        for (x, expected) in [
            (0.05, 1.4),
            (0.062, 1.4),
            (0.065, 1.2),
            (0.035, 1.2),
            (0.0681, 1.0),
            (0.0319, 1.0),
        ] {
            assert!((share(x) - expected).abs() < 1e-9, "at {x}: {}", share(x));
        }
        let step_m = 1e-5;
        let sum: f64 = (0..10_000)
            .map(|row| share(f64::from(row) * step_m) - 1.0)
            .sum();
        assert!((sum * step_m - 0.4 * 0.03).abs() < 1e-7);
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
