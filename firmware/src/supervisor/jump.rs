//! Readings that change faster than physics.

use super::sensors::{
    MOST_PRESSURE_PA, POSITION_SECOND_DIFFERENCE_M, PRESSURE_DIFFERENCE_PA,
    VELOCITY_DIFFERENCE_M_PER_S,
};
use super::step::Step;
use crate::fault::{Channel, Fault, Finding};
use model_core::axis::Axis;
use model_core::chamber::ChamberGeometry;
use model_core::real::Real;

/// What the bounds are exceeded by where mass, areas and volumes are known
/// wrongly: two deviations of 12 % for a dead volume, of 5 % for an area.
const PARAMETER_MARGIN: f32 = 1.4;

/// Bounds of the change in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    pub(super) most_acceleration_m_per_s2: f32,
    /// Volume flow of the open valve in terms of the pressure before it, m3/s.
    pub(super) most_volume_flow_m3_per_s: f32,
}

/// The position's last change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct JumpState {
    last_change_m: Option<f32>,
}

impl Jump {
    pub(super) fn new(axis: &Axis<f32>) -> Self {
        let carriage = &axis.carriage;
        let area_m2 = carriage.area_a_m2.max(carriage.area_b_m2);
        let force_n = MOST_PRESSURE_PA * area_m2 + axis.friction.static_n;
        let wide_v = f32::MAX;
        let areas = [&axis.valve.supply, &axis.valve.exhaust].map(|table| table.area_m2(wide_v));
        let gas = &axis.pneumatics.gas;
        // m' R T / p of choked flow: A Cd C1 R sqrt(T).
        let per_area = axis.valve.law.most_discharge()
            * gas.flow_coefficient
            * gas.gas_constant_j_per_kg_k
            * Real::sqrt(axis.supply_temperature_k);
        Self {
            most_acceleration_m_per_s2: PARAMETER_MARGIN * force_n / carriage.mass_kg,
            most_volume_flow_m3_per_s: per_area * areas[0].max(areas[1]),
        }
    }

    #[inline]
    pub(super) fn check(
        &self,
        state: &mut JumpState,
        axis: &Axis<f32>,
        step: &Step<'_>,
    ) -> Option<Finding> {
        let jumped = |channel| Some(Fault::JumpingSensor.of(channel));
        if self.position_jumps(state, step) {
            return jumped(Channel::Position);
        }
        let change_m_per_s = (step.now.velocity_m_per_s - step.before.velocity_m_per_s).abs();
        if change_m_per_s
            > self.most_acceleration_m_per_s2 * step.elapsed_s + VELOCITY_DIFFERENCE_M_PER_S
        {
            return jumped(Channel::Velocity);
        }
        let (now, before) = (step.now, step.before);
        let a = (now.pressure_a_pa, before.pressure_a_pa);
        let b = (now.pressure_b_pa, before.pressure_b_pa);
        if self.pressure_jumps(&axis.pneumatics.chamber_a.geometry, axis, step, a) {
            return jumped(Channel::PressureA);
        }
        if self.pressure_jumps(&axis.pneumatics.chamber_b.geometry, axis, step, b) {
            return jumped(Channel::PressureB);
        }
        None
    }

    /// The second difference: what the acceleration and noise make of it. After
    /// a gap there is none, and the check waits for one.
    fn position_jumps(&self, state: &mut JumpState, step: &Step<'_>) -> bool {
        let change_m = step.now.position_m - step.before.position_m;
        let last = state.last_change_m.take();
        if !step.is_next {
            return false;
        }
        state.last_change_m = Some(change_m);
        let limit_m = self.most_acceleration_m_per_s2 * step.elapsed_s * step.elapsed_s
            + POSITION_SECOND_DIFFERENCE_M;
        last.is_some_and(|last_m| (change_m - last_m).abs() > limit_m)
    }

    /// The open valve and the piston: |p'| <= gamma (Q pu + A |v| p) / V, with
    /// pu the higher of supply and chamber.
    fn pressure_jumps(
        &self,
        chamber: &ChamberGeometry<f32>,
        axis: &Axis<f32>,
        step: &Step<'_>,
        (now_pa, before_pa): (f32, f32),
    ) -> bool {
        let (now, before) = (step.now, step.before);
        let supply_pa = Real::max(now.supply_pressure_pa, before.supply_pressure_pa);
        let upstream_pa = Real::max(Real::max(now_pa, before_pa), supply_pa);
        let speed_m_per_s = Real::max(now.velocity_m_per_s.abs(), before.velocity_m_per_s.abs());
        let volume_flow_m3_per_s = self.most_volume_flow_m3_per_s + chamber.area_m2 * speed_m_per_s;
        let work_j = PARAMETER_MARGIN
            * axis.pneumatics.gas.heat_capacity_ratio
            * volume_flow_m3_per_s
            * upstream_pa
            * step.elapsed_s;
        let change_pa = (now_pa - before_pa).abs();
        (change_pa - PRESSURE_DIFFERENCE_PA) * chamber.volume_m3(step.now.position_m) > work_j
    }
}
