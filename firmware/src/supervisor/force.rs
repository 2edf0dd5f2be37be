//! Pressures against motion: the force balance of the carriage.
//!
//! ```text
//! r = pa Aa - pb Ab - p0 (Aa - Ab) - FL - M v'
//! ```
//!
//! is friction and whatever pushes at the load. In the mean over 50 ms it is at
//! most what is granted: half as much friction again as is known, as much
//! payload again as there is mass, and 15 % of the axis' largest force for
//! pushes, cables and the sensors' offsets. Judged while the axis tracks only:
//! else anybody may push it by hand.

use super::step::Step;
use crate::fault::{Fault, Finding};
use model_core::axis::Axis;
use model_core::real::Real;

/// Memory, s: some periods of the axis' air spring (about 10 Hz to 20 Hz) would
/// be slower, one period of the loops' own frequencies is within it.
const MEMORY_S: f32 = 50e-3;
/// Friction granted, in terms of the known one: seals that are dry or new.
const FRICTION_MARGIN: f32 = 1.5;
/// What else may act, in terms of the largest force: 44 N of 294 N.
const SHARE_OF_LARGEST_FORCE: f32 = 0.15;

/// Means over the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ForceState {
    unexplained_n: f32,
    inertia_n: f32,
}

impl ForceState {
    #[inline]
    pub(super) fn check(&mut self, axis: &Axis<f32>, step: &Step<'_>) -> Option<Finding> {
        let (now, carriage) = (step.now, &axis.carriage);
        let share = Real::min(step.elapsed_s * (1.0 / MEMORY_S), 1.0);
        // M v' dt / T: the velocities' difference, so that noise cancels.
        let change_m_per_s = now.velocity_m_per_s - step.before.velocity_m_per_s;
        let inertia_n = carriage.mass_kg * change_m_per_s * (1.0 / MEMORY_S);
        let drive_n = carriage.drive_n(now.pressure_a_pa, now.pressure_b_pa);
        self.inertia_n += inertia_n - share * self.inertia_n;
        self.unexplained_n += share * (drive_n - self.unexplained_n) - inertia_n;
        let granted_n = self.granted_n(axis, step);
        (self.unexplained_n.abs() > granted_n).then(|| Fault::PressureContradictsPosition.at(0))
    }

    fn granted_n(&self, axis: &Axis<f32>, step: &Step<'_>) -> f32 {
        let carriage = &axis.carriage;
        let ambient_pa = carriage.ambient_pressure_pa;
        let speed_m_per_s = step.now.velocity_m_per_s.abs();
        let levels = axis.friction_terms.levels(
            &axis.friction,
            step.now.pressure_a_pa - ambient_pa,
            step.now.pressure_b_pa - ambient_pa,
        );
        let friction_n = levels.static_n + levels.viscous_n_s_per_m * speed_m_per_s;
        let equation = carriage.effects.map(|effects| effects.force_equation);
        let trailing_n = equation.map_or(0.0, |equation| equation.trailing_n);
        let gauge_pa = step.now.supply_pressure_pa - ambient_pa;
        let largest_n = gauge_pa * Real::max(carriage.area_a_m2, carriage.area_b_m2);
        FRICTION_MARGIN * friction_n
            + axis.friction_terms.constant_force_n.abs()
            + carriage
                .unknown_force_n(step.now.position_m, step.now.velocity_m_per_s)
                .abs()
            + trailing_n.abs()
            + self.inertia_n.abs()
            + SHARE_OF_LARGEST_FORCE * largest_n
    }
}
