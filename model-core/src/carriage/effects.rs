//! The effects that live in the carriage's own step, together.

use super::CarriageState;
use crate::friction::{Bristle, FrictionLevels};
use crate::left_out::{
    DirectionDependentFriction, DwellStiction, ElasticBuffer, ForceEquation, LoadCoupling,
    PositionDependentFriction, UnknownForce,
};
use crate::real::Real;

/// Friction of place, direction and age, a load behind a spring, buffers, a force
/// without a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriageEffects<R> {
    /// `position-dependent-friction`.
    pub position_friction: PositionDependentFriction<R>,
    /// `direction-dependent-friction`.
    pub direction_friction: DirectionDependentFriction<R>,
    /// `dwell-stiction`.
    pub dwell_stiction: DwellStiction<R>,
    /// `load-compliance`, `load-backlash`.
    pub load: LoadCoupling<R>,
    /// `end-cushion`, its elastic form.
    pub elastic_buffer: ElasticBuffer<R>,
    /// `unknown-force`.
    pub unknown_force: UnknownForce<R>,
    /// `force-equation`.
    pub force_equation: ForceEquation<R>,
}

impl<R: Real> CarriageEffects<R> {
    /// None of them.
    pub fn neutral() -> Self {
        Self {
            position_friction: PositionDependentFriction::neutral(),
            direction_friction: DirectionDependentFriction::NEUTRAL,
            dwell_stiction: DwellStiction::neutral(),
            load: LoadCoupling::NEUTRAL,
            elastic_buffer: ElasticBuffer::NEUTRAL,
            unknown_force: UnknownForce::neutral(),
            force_equation: ForceEquation::neutral(),
        }
    }

    /// These effects, unless all are neutral: what a carriage holds. A dual
    /// number that is 0 but has a derivative is not neutral.
    pub fn if_any(self) -> Option<Self> {
        let neutral = self.position_friction.is_neutral()
            && self.direction_friction.is_neutral()
            && self.dwell_stiction.is_neutral()
            && self.load.is_neutral()
            && self.elastic_buffer.is_neutral()
            && self.unknown_force.is_neutral()
            && self.force_equation.is_neutral();
        (!neutral).then_some(self)
    }

    /// The friction levels where the carriage is, as it moves, after its dwell.
    #[inline]
    pub fn levels(
        &self,
        levels: FrictionLevels<R>,
        bristle: &Bristle<R>,
        state: &CarriageState<R>,
    ) -> FrictionLevels<R> {
        let levels = self
            .position_friction
            .levels(levels, state.position_m.value);
        let (velocity, deflection) = (state.velocity_m_per_s, state.deflection_m);
        let levels = self
            .direction_friction
            .levels(levels, bristle, velocity, deflection);
        self.dwell_stiction.levels(levels, state.contact_age)
    }

    /// The force that no law with a name has, of place and velocity, against +x, N.
    #[inline]
    pub fn unnamed_force_n(&self, position_m: R, velocity_m_per_s: R) -> R {
        let tabled_n = self.unknown_force.force_n(position_m, velocity_m_per_s);
        if self.force_equation.is_neutral() {
            return tabled_n;
        }
        tabled_n + self.force_equation.force_n(position_m, velocity_m_per_s)
    }

    /// The age of the seal's contact after a step that ends at a velocity.
    #[inline]
    pub fn contact_age(&self, age: R, velocity_m_per_s: R, dt_s: R) -> R {
        self.dwell_stiction.step(age, velocity_m_per_s, dt_s)
    }
}
