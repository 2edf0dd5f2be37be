//! LuGre friction, (9)-(11), stepped by the closed-form implicit scheme.
//!
//! ```text
//! Ff = sigma0 z + sigma1 z' + sigma2 v                       (9)
//! z' = v - sigma0 |v| / g(v) z
//! g  = FC + (FS - FC) exp(-(v/vs)^2)                         (10)
//! Fss = g(v) sgn(v) + sigma2 v                               (11)
//! ```
//!
//! The equations are stiff: the bristle relaxes at sigma0 |v| / g, 4.5e4 1/s at
//! 1 m/s with the paper's numbers, so that explicit Euler and RK4 give NaN at
//! 1 kHz. With g frozen at the old velocity the implicit step is one quadratic
//! equation in the new speed: stable at every step, first order.
//!
//! Limits, known and kept because they are the published law's: it creeps under
//! a ripple below stiction, and above about 64 mm/s it can give back energy.

use crate::real::Real;

/// The bristle's own parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle<R> {
    /// sigma0 in N/m; over 0.
    pub stiffness_n_per_m: R,
    /// sigma1 in N s/m.
    pub damping_n_s_per_m: R,
    /// v_s in m/s; over 0.
    pub stribeck_velocity_m_per_s: R,
}

/// The force levels, which effects may change from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionLevels<R> {
    /// FC in N.
    pub coulomb_n: R,
    /// FS in N; below FC it is taken as FC.
    pub static_n: R,
    /// sigma2 in N s/m.
    pub viscous_n_s_per_m: R,
}

/// Outcome of one step with the velocity solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionStep<R> {
    /// Velocity at the end of the step, m/s.
    pub velocity_m_per_s: R,
    /// Bristle deflection at the end of the step, m.
    pub deflection_m: R,
    /// Mean friction force over the step, N.
    pub force_n: R,
}

/// A friction level under this counts as this: g must not vanish, since the
/// bristle's rate is divided by it. It stands for "no friction".
const LEAST_LEVEL_N: f64 = 1e-6;

/// In less than this part of its deflection a bristle follows nothing, and the quotient by
/// which it would is 0/0.
const LEAST_TRAVEL: f64 = 1e-3;

impl<R: Real> FrictionLevels<R> {
    /// These levels with one of Coulomb that may be divided by.
    #[inline]
    pub(crate) fn at_least(&self) -> Self {
        Self {
            coulomb_n: self.coulomb_n.max(R::from_f64(LEAST_LEVEL_N)),
            ..*self
        }
    }

    /// g(v), (10), in N.
    #[inline]
    pub fn sliding_n(&self, bristle: &Bristle<R>, velocity_m_per_s: R) -> R {
        let coulomb = self.at_least().coulomb_n;
        let rise = (self.static_n - coulomb).max(R::ZERO);
        let ratio = velocity_m_per_s / bristle.stribeck_velocity_m_per_s;
        coulomb + rise * (-(ratio * ratio)).exp()
    }

    /// Steady-state friction (11) in N.
    pub fn steady_n(&self, bristle: &Bristle<R>, velocity_m_per_s: R) -> R {
        self.sliding_n(bristle, velocity_m_per_s) * velocity_m_per_s.signum()
            + self.viscous_n_s_per_m * velocity_m_per_s
    }
}

impl<R: Real> Bristle<R> {
    /// One step of mass and bristle together: velocity and deflection at the end
    /// of the step are solved for implicitly.
    ///
    /// `drive_n` is the force on the mass without friction. With w = |v+| the
    /// momentum balance and the bristle equation combine to qa w^2 + qb w + qc = 0.
    #[inline]
    pub fn step_with_mass(
        &self,
        levels: &FrictionLevels<R>,
        mass_kg: R,
        velocity_m_per_s: R,
        deflection_m: R,
        drive_n: R,
        dt_s: R,
    ) -> FrictionStep<R> {
        let sliding = levels.sliding_n(self, velocity_m_per_s);
        let rate = dt_s * self.stiffness_n_per_m / sliding;
        let stiffness = self.stiffness_n_per_m + self.damping_n_s_per_m / dt_s;
        let inertia = mass_kg / dt_s + levels.viscous_n_s_per_m;
        let momentum = mass_kg * velocity_m_per_s / dt_s
            + drive_n
            + self.damping_n_s_per_m * deflection_m / dt_s;
        let force_left = momentum - stiffness * deflection_m;
        let direction = if force_left < R::ZERO {
            -R::ONE
        } else {
            R::ONE
        };
        let qa = inertia * rate;
        let qb = inertia + stiffness * dt_s - momentum * rate * direction;
        let speed = positive_root(qa, qb, force_left.abs());
        let velocity = direction * speed;
        let deflection = (deflection_m + dt_s * velocity) / (R::ONE + rate * speed);
        FrictionStep {
            velocity_m_per_s: velocity,
            deflection_m: deflection,
            force_n: self.force_n(levels, deflection_m, deflection, velocity, dt_s),
        }
    }

    /// One step under a given (measured) velocity: the bristle relaxes
    /// exponentially to its steady deflection. Returns the new deflection and
    /// the mean force.
    pub fn step_driven(
        &self,
        levels: &FrictionLevels<R>,
        velocity_m_per_s: R,
        deflection_m: R,
        dt_s: R,
    ) -> (R, R) {
        let sliding = levels.sliding_n(self, velocity_m_per_s);
        let steady = sliding / self.stiffness_n_per_m;
        let target = steady * velocity_m_per_s.signum();
        let travelled = velocity_m_per_s.abs() * dt_s / steady;
        let deflection = target + (deflection_m - target) * (-travelled).exp();
        self.bent(levels, deflection, deflection_m, velocity_m_per_s, dt_s)
    }

    /// The same with g rising evenly over the step between the two `sliding_n`, of which the
    /// second is that of the levels at the velocity. Taken as if it had been there from the step's
    /// begin, g of 5 N/bar leads by up to half a row: 0.01 N at 20 bar/s, which a fit mistakes for
    /// other forces.
    pub fn step_driven_between(
        &self,
        sliding_n: [R; 2],
        levels: &FrictionLevels<R>,
        velocity_m_per_s: R,
        deflection_m: R,
        dt_s: R,
    ) -> (R, R) {
        let direction = velocity_m_per_s.signum();
        let steady = sliding_n[1] / self.stiffness_n_per_m;
        let risen = (sliding_n[1] - sliding_n[0]) / self.stiffness_n_per_m;
        let half = R::from_f64(0.5);
        let midway = (steady - risen * half).max(steady * half);
        let travelled = velocity_m_per_s.abs() * dt_s / midway;
        let left = (-travelled).exp();
        // What an even rise leaves, less what a sudden one at the begin does.
        let behind = if travelled > R::from_f64(LEAST_TRAVEL) {
            (R::ONE - left) / travelled - left
        } else {
            R::ZERO
        };
        let target = steady * direction;
        let deflection = target + (deflection_m - target) * left - risen * direction * behind;
        self.bent(levels, deflection, deflection_m, velocity_m_per_s, dt_s)
    }

    /// A deflection within LuGre's bound, and the mean force of the step that led to it.
    fn bent(
        &self,
        levels: &FrictionLevels<R>,
        deflection_m: R,
        before_m: R,
        velocity_m_per_s: R,
        dt_s: R,
    ) -> (R, R) {
        // LuGre's own bound. Not `steady`: a bristle that was bent by stiction
        // relaxes to the sliding level over some way, not at once.
        let most = levels.sliding_n(self, R::ZERO) / self.stiffness_n_per_m;
        let deflection = deflection_m.clamp(-most, most);
        let force = self.force_n(levels, before_m, deflection, velocity_m_per_s, dt_s);
        (deflection, force)
    }

    /// (9) with the mean bristle velocity over the step: the instantaneous one
    /// has a spike of kilonewtons after a reversal whose impulse is only
    /// sigma1 times the change of deflection.
    #[inline]
    fn force_n(
        &self,
        levels: &FrictionLevels<R>,
        deflection_before_m: R,
        deflection_m: R,
        velocity_m_per_s: R,
        dt_s: R,
    ) -> R {
        self.stiffness_n_per_m * deflection_m
            + self.damping_n_s_per_m * (deflection_m - deflection_before_m) / dt_s
            + levels.viscous_n_s_per_m * velocity_m_per_s
    }
}

/// The root w >= 0 of qa w^2 + qb w - c = 0 for qa > 0, c >= 0, without cancellation.
#[inline]
fn positive_root<R: Real>(qa: R, qb: R, c: R) -> R {
    let two = R::from_f64(2.0);
    let root = (qb * qb + R::from_f64(4.0) * qa * c).sqrt();
    if qb >= R::ZERO {
        two * c / (qb + root)
    } else {
        (root - qb) / (two * qa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const MASS_KG: f64 = 2.0;

    #[test]
    fn val_steady_sliding_matches_equation_11() {
        let (bristle, levels) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        for velocity in [-0.5, -0.01, 0.002, 0.05, 2.0] {
            let mut z = 0.0;
            let mut force = 0.0;
            for _ in 0..20_000 {
                (z, force) = bristle.step_driven(&levels, velocity, z, 1e-4);
            }
            let expected = levels.steady_n(&bristle, velocity);
            assert!(
                (force - expected).abs() < 1e-6 * expected.abs(),
                "at {velocity}"
            );
        }
    }

    /// A level that rises by 100 N in 50 ms, under rows of 1 ms against steps of 1 us.
    #[test]
    fn prop_rows_under_a_rising_level_give_what_fine_steps_give() {
        let bristle = paper::bristle::<f64>();
        let level = |time_s: f64| FrictionLevels {
            coulomb_n: 20.0 + 2e3 * time_s,
            static_n: 20.0 + 2e3 * time_s,
            viscous_n_s_per_m: 0.0,
        };
        for velocity in [0.02, 0.1, -0.4] {
            let start = level(0.0).coulomb_n / bristle.stiffness_n_per_m * f64::signum(velocity);
            let (mut rows, mut sudden, mut fine) = (start, start, start);
            for row in 1..=50 {
                let end_s = f64::from(row) * 1e-3;
                for step in 1..=1000 {
                    let levels = level(end_s - 1e-3 + f64::from(step) * 1e-6);
                    (fine, _) = bristle.step_driven(&levels, velocity, fine, 1e-6);
                }
                let levels = level(end_s);
                let sliding = [end_s - 1e-3, end_s].map(|time_s| level(time_s).coulomb_n);
                (rows, _) = bristle.step_driven_between(sliding, &levels, velocity, rows, 1e-3);
                (sudden, _) = bristle.step_driven(&levels, velocity, sudden, 1e-3);
            }
            let error_n = |z: f64| ((z - fine) * bristle.stiffness_n_per_m).abs();
            assert!(error_n(rows) < 0.05, "{velocity}: {} N", error_n(rows));
            assert!(error_n(sudden) > 4.0 * error_n(rows), "{velocity}");
        }
    }

    #[test]
    fn prop_implicit_step_solves_both_of_its_equations() {
        let (bristle, levels) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        for (v, z, drive) in [
            (0.0, 0.0, 10.0),
            (1.0, 2e-5, -300.0),
            (-0.003, -1e-5, 40.0),
            (2.5, 2e-5, 0.0),
        ] {
            let dt = 1e-3;
            let out = bristle.step_with_mass(&levels, MASS_KG, v, z, drive, dt);
            let momentum = MASS_KG * (out.velocity_m_per_s - v) / dt - drive + out.force_n;
            let g = levels.sliding_n(&bristle, v);
            let bristle_left = (out.deflection_m - z) / dt - out.velocity_m_per_s
                + bristle.stiffness_n_per_m * out.velocity_m_per_s.abs() / g * out.deflection_m;
            assert!(momentum.abs() < 1e-6, "momentum {momentum}");
            assert!(bristle_left.abs() < 1e-9, "bristle {bristle_left}");
        }
    }

    #[test]
    fn regress_a_bristle_bent_by_stiction_relaxes_over_its_way() {
        let (bristle, levels) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        let bent = levels.static_n / bristle.stiffness_n_per_m;
        let velocity = 0.01;
        let (after, _) = bristle.step_driven(&levels, velocity, bent, 1e-3);
        // The bristle equation at constant velocity, in steps of 10 ns.
        let g = levels.sliding_n(&bristle, velocity);
        let mut fine = bent;
        for _ in 0..100_000 {
            fine += 1e-8 * (velocity - bristle.stiffness_n_per_m * velocity / g * fine);
        }
        assert!((after - fine).abs() < 1e-9, "{after} against {fine}");
    }

    #[test]
    fn prop_stable_at_1_khz_in_f32_up_to_2_5_m_per_s() {
        let (bristle, levels) = (paper::bristle::<f32>(), paper::friction_levels::<f32>());
        let (mut v, mut z, mut time) = (0.0_f32, 0.0_f32, 0.0_f64);
        let mut fastest = 0.0_f32;
        for _ in 0..20_000 {
            time += 1e-3;
            // 1 Hz force that swings the mass to 2.5 m/s and back.
            let drive = 235.0 * libm::sin(core::f64::consts::TAU * time) as f32;
            let out = bristle.step_with_mass(&levels, 2.0, v, z, drive, 1e-3);
            (v, z) = (out.velocity_m_per_s, out.deflection_m);
            fastest = fastest.max(v.abs());
            assert!(v.is_finite() && z.abs() <= 32.0e-6);
        }
        assert!((2.3..8.0).contains(&fastest), "fastest {fastest}");
    }

    #[test]
    fn prop_without_friction_the_mass_moves_freely() {
        let levels = FrictionLevels {
            coulomb_n: 0.0,
            static_n: 0.0,
            viscous_n_s_per_m: 0.0,
        };
        let bristle = Bristle {
            damping_n_s_per_m: 0.0,
            ..paper::bristle::<f64>()
        };
        let out = bristle.step_with_mass(&levels, MASS_KG, 0.0, 0.0, 4.0, 1e-3);
        assert!((out.velocity_m_per_s - 2e-3).abs() < 1e-8);
    }
}
