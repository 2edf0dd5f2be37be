//! `force-equation`: a force that no effect with a name has, as a short equation that recordings
//! asked for.
//!
//! ```text
//! F(x, v, z) = k (x - x0) + k3 (x - x0)^3  +  d |v| v  +  S sin(2 pi x / L) + C cos(2 pi x / L)  +  T z
//! dz/dx      = (sign(v) - z) / l                              against +x; |z| <= 1
//! ```
//!
//! The terms: a spring and one that stiffens (a hose, a cable chain, a magnet); drag that grows with the
//! square of the speed (fluid, a fan of dust in a guide); a force that repeats along the way (teeth, a
//! screw, a magnetic band); a force that trails behind the motion and is full after some way (Dahl 1968:
//! a dragged cable, a wiper). Each coefficient that is 0 is neutral.
//!
//! Typical: k 0.01-2 N/mm, k3 up to 1e6 N/m3, d 5-100 N s2/m2, S and C 2-20 N at L 5-100 mm,
//! T 2-20 N at l 5-50 mm. What pushes by less than a fiftieth of the Coulomb friction does not matter.
//! Confused with friction over the position (which turns with the direction; a force of the place does
//! not), with viscous friction over a narrow range of speeds, and with presliding.

use crate::math::cosine_sine_of_turns;
use crate::real::Real;

/// Ways are divided by; shorter ones are none.
const SHORTEST_M: f64 = 1e-6;

/// The coefficients of the equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceEquation<R> {
    /// k, N/m.
    pub spring_n_per_m: R,
    /// k3, N/m3.
    pub stiffening_n_per_m3: R,
    /// x0, m.
    pub rest_m: R,
    /// d, N s2/m2; at least 0.
    pub drag_n_s2_per_m2: R,
    /// S, N.
    pub sine_n: R,
    /// C, N.
    pub cosine_n: R,
    /// L, m; over 0.
    pub pitch_m: R,
    /// T, N.
    pub trailing_n: R,
    /// l, m; over 0.
    pub path_m: R,
}

impl<R: Real> ForceEquation<R> {
    /// No force.
    pub fn neutral() -> Self {
        Self {
            spring_n_per_m: R::ZERO,
            stiffening_n_per_m3: R::ZERO,
            rest_m: R::ZERO,
            drag_n_s2_per_m2: R::ZERO,
            sine_n: R::ZERO,
            cosine_n: R::ZERO,
            pitch_m: R::from_f64(0.05),
            trailing_n: R::ZERO,
            path_m: R::from_f64(0.02),
        }
    }

    /// Whether there is no force.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.has_no_spring()
            && self.drag_n_s2_per_m2 == R::ZERO
            && self.has_no_wave()
            && self.trailing_n == R::ZERO
    }

    fn has_no_spring(&self) -> bool {
        self.spring_n_per_m == R::ZERO && self.stiffening_n_per_m3 == R::ZERO
    }

    fn has_no_wave(&self) -> bool {
        self.sine_n == R::ZERO && self.cosine_n == R::ZERO
    }

    /// The force of place and velocity, without the one that trails, against +x, N.
    pub fn force_n(&self, position_m: R, velocity_m_per_s: R) -> R {
        self.drag_n_s_per_m(velocity_m_per_s) * velocity_m_per_s + self.of_place_n(position_m)
    }

    /// The drag over the velocity at a velocity, N s/m: what a step counts as viscous friction, as
    /// that stays stable at any speed.
    #[inline]
    pub fn drag_n_s_per_m(&self, velocity_m_per_s: R) -> R {
        self.drag_n_s2_per_m2 * velocity_m_per_s.abs()
    }

    /// The force of the place, against +x, N.
    pub fn of_place_n(&self, position_m: R) -> R {
        let mut force_n = R::ZERO;
        if !self.has_no_spring() {
            let way_m = position_m - self.rest_m;
            force_n += (self.spring_n_per_m + self.stiffening_n_per_m3 * way_m * way_m) * way_m;
        }
        if !self.has_no_wave() {
            let (cosine, sine) =
                cosine_sine_of_turns(position_m / self.pitch_m.max(R::from_f64(SHORTEST_M)));
            force_n += self.cosine_n * cosine + self.sine_n * sine;
        }
        force_n
    }

    /// How far the force that trails has come, -1 to 1, after another way, m.
    #[inline]
    pub fn trail(&self, trail: R, way_m: R) -> R {
        if self.trailing_n == R::ZERO {
            return trail;
        }
        let full = if way_m < R::ZERO { -R::ONE } else { R::ONE };
        let ways = way_m.abs() / self.path_m.max(R::from_f64(SHORTEST_M));
        full + (trail - full) * (-ways).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    fn equation() -> ForceEquation<f64> {
        ForceEquation {
            spring_n_per_m: 30.0,
            stiffening_n_per_m3: 4e3,
            rest_m: 0.02,
            drag_n_s2_per_m2: 40.0,
            sine_n: 3.0,
            cosine_n: -1.0,
            pitch_m: 0.03,
            trailing_n: 7.0,
            path_m: 0.02,
        }
    }

    #[test]
    fn val_the_force_is_the_equation() {
        for (x, v) in [(-0.2_f64, 0.4_f64), (0.02, -0.3), (0.13, 0.0)] {
            let way = x - 0.02;
            let angle = TAU * x / 0.03;
            let expected =
                30.0 * way + 4e3 * way.powi(3) + 40.0 * v * v.abs() + 3.0 * libm::sin(angle)
                    - libm::cos(angle);
            assert!(
                (equation().force_n(x, v) - expected).abs() < 1e-9,
                "at {x}, {v}"
            );
        }
    }

    /// In many steps as in one; full after some ways, and turned over after one and a half of them
    /// (1 - 2 exp(-s) passes nought at ln 2).
    #[test]
    fn val_what_trails_is_dahl_s_solution() {
        let law = equation();
        let in_steps = (0..1000).fold(-1.0, |trail, _| law.trail(trail, 0.02e-3));
        assert!((in_steps - law.trail(-1.0, 0.02)).abs() < 1e-9);
        assert!((in_steps - (1.0 - 2.0 * libm::exp(-1.0))).abs() < 1e-9);
        assert!(law.trail(-1.0, 0.02 * core::f64::consts::LN_2).abs() < 1e-9);
        assert!(law.trail(0.3, 1e3) <= 1.0 && law.trail(0.3, -1e3) >= -1.0);
    }

    /// Over a closed way it takes energy and never gives any.
    #[test]
    fn prop_what_trails_takes_energy_over_every_closed_way() {
        let law = equation();
        for reach_m in [1e-4, 3e-3, 0.02, 0.2] {
            let (mut trail, mut work_j) = (0.0, 0.0);
            let steps = 2000;
            for round in 0..4 {
                if round < 2 {
                    work_j = 0.0;
                }
                for step in 0..steps {
                    let to = step < steps / 2;
                    let way_m = if to { reach_m } else { -reach_m } * 2.0 / f64::from(steps);
                    let before = trail;
                    trail = law.trail(trail, way_m);
                    work_j += 0.5 * (before + trail) * law.trailing_n * way_m;
                }
            }
            assert!(work_j > 0.0, "{work_j} J over {reach_m} m");
        }
    }

    #[test]
    fn prop_neutral_is_no_force_and_no_way_divides_by_nought() {
        let none = ForceEquation::<f32>::neutral();
        assert!(none.is_neutral());
        assert!(none.force_n(0.2, -3.0).abs() < f32::MIN_POSITIVE);
        assert!(none.trail(0.0, 0.1).abs() < f32::MIN_POSITIVE);
        let odd = ForceEquation {
            pitch_m: 0.0,
            path_m: 0.0,
            ..equation()
        };
        assert!(odd.force_n(0.1, 0.2).is_finite() && odd.trail(0.0, 0.0).is_finite());
    }
}
