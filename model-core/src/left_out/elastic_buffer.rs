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
//! Implicit, handed to the friction step as a force and an added mass. Within a buffer
//! the force is that of the middle of the step: spring and mass keep their energy. In the
//! step that enters it is the mean over the part of the step within, and one that leaves
//! does not pull: both take energy, with the square of the step, none gives any, at every
//! stiffness.

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
        let half = R::from_f64(0.5);
        let way_m = dt_s * velocity_m_per_s;
        // The part of the step within the buffer, and the mean depth over it.
        let (share, depth) = if self.depth_m(position_m) == R::ZERO {
            let depth_at_end = self.depth_m(position_m + way_m);
            (depth_at_end / way_m, depth_at_end * half)
        } else {
            (R::ONE, self.depth_m(position_m + way_m * half))
        };
        let force = self.stiffness_n_per_m * depth + self.damping_n_s_per_m * velocity_m_per_s;
        let pushes = force * depth > R::ZERO;
        if !pushes {
            return Reaction::NONE;
        }
        let half_s = dt_s * half;
        let resistance = self.stiffness_n_per_m * half_s + self.damping_n_s_per_m;
        Reaction {
            force_n: share * force,
            added_mass_kg: share * resistance * half_s,
        }
    }

    /// How far a position is within a buffer, with the sign of its side, m; 0 between them.
    #[inline]
    fn depth_m(&self, position_m: R) -> R {
        (position_m - self.high_m).max(R::ZERO) + (position_m - self.low_m).min(R::ZERO)
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
