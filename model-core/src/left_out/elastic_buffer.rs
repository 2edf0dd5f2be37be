//! `end-cushion`, elastic form: buffers at the ends of the stroke.
//!
//! ```text
//! F = k d + c v   along the way out of the buffer, never a pull,
//! d = way into the buffer, which begins its length before the stroke's end
//! ```
//!
//! Source: rubber buffers of the end caps, 1e4-1e6 N/m over the last 2-15 mm,
//! c such that half of the speed is lost. It matters where recordings reach the
//! ends: 1 mm into 1e5 N/m are 100 N. Confused with friction that rises towards
//! the ends (which turns with the direction) and with dead volume (whose
//! pressure shows it); strokes to the end at two speeds separate them.
//!
//! Implicit: the force is that of the end of the step, handed to the friction
//! step as a force and an added mass. The scheme takes energy (a damping ratio
//! of w dt / 2) and gives none, at every stiffness.

use super::load_coupling::Reaction;
use crate::real::Real;

/// Parameters; a stiffness and a damping of 0 are neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticBuffer<R> {
    /// Position at which the lower buffer begins, m.
    pub low_m: R,
    /// Position at which the upper buffer begins, m.
    pub high_m: R,
    /// k in N/m.
    pub stiffness_n_per_m: R,
    /// c in N s/m.
    pub damping_n_s_per_m: R,
}

impl<R: Real> ElasticBuffer<R> {
    /// No buffers.
    pub const NEUTRAL: Self = Self {
        low_m: R::ZERO,
        high_m: R::ZERO,
        stiffness_n_per_m: R::ZERO,
        damping_n_s_per_m: R::ZERO,
    };

    /// Whether there are no buffers.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.stiffness_n_per_m == R::ZERO && self.damping_n_s_per_m == R::ZERO
    }

    /// What the buffers do to the carriage over a step from a position.
    #[inline]
    pub fn reaction(&self, position_m: R, velocity_m_per_s: R, dt_s: R) -> Reaction<R> {
        if self.is_neutral() {
            return Reaction::NONE;
        }
        let ahead = position_m + dt_s * velocity_m_per_s;
        let depth = if ahead > self.high_m {
            ahead - self.high_m
        } else if ahead < self.low_m {
            ahead - self.low_m
        } else {
            return Reaction::NONE;
        };
        let force = self.stiffness_n_per_m * depth + self.damping_n_s_per_m * velocity_m_per_s;
        let pulls = (force < R::ZERO) == (depth > R::ZERO);
        if pulls {
            return Reaction::NONE;
        }
        Reaction {
            force_n: force,
            added_mass_kg: (self.stiffness_n_per_m * dt_s + self.damping_n_s_per_m) * dt_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUFFERS: ElasticBuffer<f64> = ElasticBuffer {
        low_m: -0.2,
        high_m: 0.24,
        stiffness_n_per_m: 1e5,
        damping_n_s_per_m: 100.0,
    };

    #[test]
    fn prop_buffers_push_inwards_and_never_pull() {
        let force = |x, v| BUFFERS.reaction(x, v, 1e-4).force_n;
        assert!(force(0.2399, 0.0).abs() < 1e-12 && force(-0.1999, 0.0).abs() < 1e-12);
        assert!((force(0.241, 0.0) - 100.0).abs() < 1e-9);
        assert!((force(-0.201, 0.0) + 100.0).abs() < 1e-9);
        assert!(force(0.2401, -1.0).abs() < 1e-12, "pulls on the way out");
    }
}
