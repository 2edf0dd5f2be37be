//! LuGre friction, (9)-(11), stepped by the closed-form implicit scheme.
//!
//! ```text
//! Ff = sigma0 z + sigma1 z' + sigma2 v                       (9)
//! z' = v - sigma0 |v| / g(v) z
//! g  = FC + (FS - FC) exp(-(v/vs)^2)                         (10)
//! Fss = g(v) sgn(v) + sigma2 v                               (11)
//! ```
//!
//! The equations are stiff: the bristle relaxes at lambda = sigma0 |v| / g, 4.5e4 1/s at
//! 1 m/s with the paper's numbers, so that explicit Euler and RK4 give NaN at
//! 1 kHz. The step solves for the middle of the step, implicitly, mass and bristle
//! together:
//!
//! ```text
//! M (vm - v) / (dt/2) = F - sigma0 zm - sigma1 z' - sigma2 vm
//! z' = (zm - z) / (theta dt) = vm - sigma0 |vm| / g zm
//! v+ = 2 vm - v,   z+ = z + dt z',   x+ = x + dt vm
//! ```
//!
//! With g given that is one quadratic equation in |vm|. It is solved twice: with the
//! forces of the step's start, and with those of the middle that this finds: second
//! order. theta is 1/2 while the step resolves the bristle, and 1 - 1/(lambda dt) beyond,
//! where the middle rule alone would let it ring (its factor tends to -1): a bristle in
//! full slip ends a step at its steady deflection.
//!
//! Energy: with theta = 1/2 the work of the step's forces is exactly the change of kinetic
//! and bristle energy and what the law dissipates at the middle; a larger theta takes
//! (theta - 1/2) sigma0 (z+ - z)^2 more. The step is passive where the law is.
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

/// What acts on the mass at a moment of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acting<R> {
    /// Levels of the friction.
    pub levels: FrictionLevels<R>,
    /// Force without friction, N.
    pub drive_n: R,
}

/// Outcome of one step with the velocity solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionStep<R> {
    /// Velocity in the middle of the step, by which the mass moves, m/s.
    pub middle_velocity_m_per_s: R,
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
    /// One step of mass and bristle together.
    ///
    /// `acting` gives what acts in the middle of the step if mass and bristle are at a
    /// velocity and a deflection then. It is asked twice: at those of the start, and at those
    /// of the middle that follow.
    #[inline]
    pub fn step_with_mass(
        &self,
        acting: impl Fn(R, R) -> Acting<R>,
        mass_kg: R,
        velocity_m_per_s: R,
        deflection_m: R,
        dt_s: R,
    ) -> FrictionStep<R> {
        let start = Start {
            mass_kg,
            velocity_m_per_s,
            deflection_m,
            dt_s,
        };
        let at =
            |velocity, deflection| self.middle(&start, &acting(velocity, deflection), velocity);
        let guess = at(velocity_m_per_s, deflection_m);
        let middle = at(guess.velocity_m_per_s, guess.deflection_m);
        let gained = middle.velocity_m_per_s - velocity_m_per_s;
        FrictionStep {
            middle_velocity_m_per_s: middle.velocity_m_per_s,
            velocity_m_per_s: velocity_m_per_s + gained + gained,
            deflection_m: deflection_m + dt_s * middle.bending_m_per_s,
            force_n: middle.friction_n,
        }
    }

    /// The middle of a step under what acts there, with the level and the weight of the
    /// bristle's equation at a velocity near that of the middle.
    ///
    /// With w = |vm| momentum balance and bristle equation combine to qa w^2 + qb w + qc = 0.
    #[inline]
    fn middle(&self, start: &Start<R>, acting: &Acting<R>, near_m_per_s: R) -> Middle<R> {
        let levels = &acting.levels;
        let slip_per_m = self.stiffness_n_per_m / levels.sliding_n(self, near_m_per_s);
        let bending_s = start.dt_s * bristle_weight(start.dt_s * slip_per_m * near_m_per_s.abs());
        let rate = bending_s * slip_per_m;
        let damping_per_s = self.damping_n_s_per_m / bending_s;
        let stiffness = self.stiffness_n_per_m + damping_per_s;
        let mass_per_s = (start.mass_kg + start.mass_kg) / start.dt_s;
        let inertia = mass_per_s + levels.viscous_n_s_per_m;
        let momentum = mass_per_s * start.velocity_m_per_s
            + acting.drive_n
            + damping_per_s * start.deflection_m;
        let force_left = momentum - stiffness * start.deflection_m;
        let direction = if force_left < R::ZERO {
            -R::ONE
        } else {
            R::ONE
        };
        let qa = inertia * rate;
        let qb = inertia + stiffness * bending_s - momentum * rate * direction;
        let speed = positive_root(qa, qb, force_left.abs());
        let velocity = direction * speed;
        let slip = rate * speed;
        // z' in increments: exactly nought at rest.
        let bending = (velocity - slip_per_m * speed * start.deflection_m) / (R::ONE + slip);
        let deflection = start.deflection_m + bending_s * bending;
        Middle {
            velocity_m_per_s: velocity,
            deflection_m: deflection,
            bending_m_per_s: bending,
            // (9) with the mean bristle velocity over the step: the instantaneous one has a
            // spike of kilonewtons after a reversal whose impulse is only sigma1 times the
            // change of deflection.
            friction_n: self.stiffness_n_per_m * deflection
                + self.damping_n_s_per_m * bending
                + levels.viscous_n_s_per_m * velocity,
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

    /// (9) with the mean bristle velocity over the step, as in [`Self::middle`].
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

/// Mass and bristle at the start of a step.
struct Start<R> {
    mass_kg: R,
    velocity_m_per_s: R,
    deflection_m: R,
    dt_s: R,
}

/// Mass and bristle in the middle of a step.
struct Middle<R> {
    velocity_m_per_s: R,
    deflection_m: R,
    /// z', m/s.
    bending_m_per_s: R,
    /// Mean friction force over the step, N.
    friction_n: R,
}

/// theta: weight of the end of the step in the bristle's equation, for a slip over the
/// step of so many steady deflections.
#[inline]
fn bristle_weight<R: Real>(slip: R) -> R {
    if slip > R::from_f64(2.0) {
        R::ONE - R::ONE / slip
    } else {
        R::from_f64(0.5)
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

    /// A step under one force and the same levels throughout.
    fn step<R: Real>(
        bristle: &Bristle<R>,
        levels: &FrictionLevels<R>,
        (velocity, deflection): (R, R),
        drive_n: R,
        dt_s: R,
    ) -> FrictionStep<R> {
        let acting = |_, _| Acting {
            levels: *levels,
            drive_n,
        };
        bristle.step_with_mass(acting, R::from_f64(MASS_KG), velocity, deflection, dt_s)
    }

    #[test]
    fn prop_implicit_step_solves_both_of_its_equations() {
        let bristle = paper::bristle::<f64>();
        // One level: it does not matter at which velocity it is taken.
        let levels = FrictionLevels {
            static_n: 20.2,
            ..paper::friction_levels::<f64>()
        };
        for (v, z, drive) in [
            (0.0, 0.0, 10.0),
            (1.0, 2e-5, -300.0),
            (-0.003, -1e-5, 40.0),
            (2.5, 2e-5, 0.0),
        ] {
            let dt = 1e-3;
            let out = step(&bristle, &levels, (v, z), drive, dt);
            let middle = out.middle_velocity_m_per_s;
            assert!((0.5 * (v + out.velocity_m_per_s) - middle).abs() < 1e-15);
            let momentum = MASS_KG * (out.velocity_m_per_s - v) / dt - drive + out.force_n;
            assert!(momentum.abs() < 1e-6, "momentum {momentum}");
            let bending = (out.deflection_m - z) / dt;
            let bent = out.force_n
                - bristle.damping_n_s_per_m * bending
                - levels.viscous_n_s_per_m * middle;
            let left = bending - middle + middle.abs() / levels.coulomb_n * bent;
            assert!(left.abs() < 1e-9, "bristle {left}");
        }
    }

    /// What the step's forces do is stored or dissipated: at a constant force, from any state
    /// and with every step, mass and bristle together gain no more than the work done on them
    /// less the law's own dissipation at the middle.
    #[test]
    fn prop_mass_and_bristle_gain_no_more_than_the_work_done() {
        let levels = paper::friction_levels::<f64>();
        for damping in [0.0, 1327.0] {
            let bristle = Bristle {
                damping_n_s_per_m: damping,
                ..paper::bristle::<f64>()
            };
            let energy =
                |v: f64, z: f64| 0.5 * MASS_KG * v * v + 0.5 * bristle.stiffness_n_per_m * z * z;
            for dt in [1e-5, 1.25e-4, 1e-3, 1e-2] {
                for drive in [0.0, 12.0, -25.0, 60.0] {
                    let (mut v, mut z) = (0.4, -3e-5);
                    for _ in 0..2000 {
                        let out = step(&bristle, &levels, (v, z), drive, dt);
                        let middle = out.middle_velocity_m_per_s;
                        let before = energy(v, z);
                        let bending = (out.deflection_m - z) / dt;
                        (v, z) = (out.velocity_m_per_s, out.deflection_m);
                        let bent_n =
                            out.force_n - damping * bending - levels.viscous_n_s_per_m * middle;
                        let stored_w = bent_n * bending;
                        let dissipated_w = middle * out.force_n - stored_w;
                        let left_j = drive * middle * dt - dissipated_w * dt;
                        let gained_j = energy(v, z) - before;
                        assert!(gained_j <= left_j + 1e-12, "{gained_j} J of {left_j} J");
                        if damping <= 0.0 {
                            assert!(dissipated_w >= 0.0, "the bristle gives {dissipated_w} W");
                        }
                    }
                }
            }
        }
    }

    /// A bristle that turns over at 1 m/s, where a step is 45 of its time constants.
    #[test]
    fn prop_a_bristle_in_full_slip_does_not_ring() {
        let (bristle, levels) = (paper::bristle::<f64>(), paper::friction_levels::<f64>());
        let steady = levels.coulomb_n / bristle.stiffness_n_per_m;
        let (mut v, mut z) = (1.0, -steady);
        for row in 0..20 {
            let out = step(&bristle, &levels, (v, z), 84.7, 1e-3);
            (v, z) = (out.velocity_m_per_s, out.deflection_m);
            assert!((z / steady - 1.0).abs() < 1e-3, "row {row}: {z}");
        }
        assert!((v - 1.0).abs() < 0.03, "{v} m/s");
    }

    /// A NaN comes out as NaN, and the limits of the law as numbers.
    #[test]
    fn prop_limit_cases_are_numbers_and_nan_stays_nan() {
        let (bristle, levels) = (paper::bristle::<f32>(), paper::friction_levels::<f32>());
        let still = step(&bristle, &levels, (0.0, 0.0), 0.0, 1e-3);
        assert_eq!(still.velocity_m_per_s.to_bits(), 0.0_f32.to_bits());
        assert_eq!(still.deflection_m.to_bits(), 0.0_f32.to_bits());
        let undamped = Bristle {
            damping_n_s_per_m: 0.0,
            ..bristle
        };
        let inverse = FrictionLevels {
            static_n: 3.0,
            ..levels
        };
        for bristle in [bristle, undamped] {
            for levels in [levels, inverse] {
                for start in [(0.0, 0.0), (1e-30, 0.0), (-3.0, 3e-5), (1e3, 1e-2)] {
                    for drive in [0.0, 1e-20, -28.9, 1e6] {
                        let out = step(&bristle, &levels, start, drive, 1e-3);
                        assert!(out.velocity_m_per_s.is_finite() && out.force_n.is_finite());
                        assert!(out.deflection_m.is_finite());
                    }
                }
            }
        }
        for (start, drive) in [
            ((f32::NAN, 0.0), 0.0),
            ((0.0, f32::NAN), 0.0),
            ((0.0, 0.0), f32::NAN),
        ] {
            let out = step(&bristle, &levels, start, drive, 1e-3);
            assert!(out.velocity_m_per_s.is_nan(), "{start:?} {drive}");
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
            let out = step(&bristle, &levels, (v, z), drive, 1e-3);
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
        let out = step(&bristle, &levels, (0.0, 0.0), 4.0, 1e-3);
        assert!((out.velocity_m_per_s - 2e-3).abs() < 1e-8);
    }
}
