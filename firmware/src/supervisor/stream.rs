//! Does time go on, and does the reference? Missed samples and stale references.

use super::jump::Jump;
use crate::codes::VELOCITY_M_PER_S;
use crate::fault::{Fault, Finding};
use crate::status::Counters;
use model_core::axis::Axis;
use model_core::real::Real;
use model_core::reference::Reference;

/// How far the load may go astray while the valve holds its last command, m.
const ASTRAY_M: f32 = 1e-3;
/// No tick is so fast that more samples than this may be missed.
const MOST_MISSED: u16 = 100;
/// A reference that stands so long does not come from a stream of 50 Hz or
/// more, s.
const STALE_S: f32 = 20e-3;

/// Limits of the stream of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stream {
    /// Samples that may be missing in a row.
    pub(super) most_missed: u16,
    stroke_m: [f32; 2],
    /// Nothing faster can be measured, and no larger acceleration be had.
    most_m_per_s: f32,
    most_m_per_s2: f32,
}

/// The stream so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StreamState {
    last_tick: Option<u32>,
    standing: u16,
    reference: ReferenceState,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ReferenceState {
    position_bits: u32,
    standing_s: f32,
    way_m: f32,
}

impl Stream {
    /// The valve is wide open and its command holds: both pressures run apart at
    /// gamma Q p / V and the load with a jerk of 2 A p' / M. It is astray by
    /// jerk t3 / 6, which bounds t and with it the samples that may be missed.
    pub(super) fn new(axis: &Axis<f32>, stroke_m: [f32; 2], jump: &Jump) -> Self {
        let area_m2 = axis.carriage.area_a_m2.max(axis.carriage.area_b_m2);
        let middle_m = 0.5 * (stroke_m[0] + stroke_m[1]);
        let volume_m3 = axis.pneumatics.chamber_a.geometry.volume_m3(middle_m);
        let rate_pa_per_s = axis.pneumatics.gas.heat_capacity_ratio
            * jump.most_volume_flow_m3_per_s
            * super::sensors::MOST_PRESSURE_PA
            / volume_m3;
        let jerk_m_per_s3 = 2.0 * area_m2 * rate_pa_per_s / axis.carriage.mass_kg;
        let time_s = Real::powf(6.0 * ASTRAY_M / jerk_m_per_s3, 1.0 / 3.0);
        let ticks = (time_s / axis.dt_s).max(0.0).min(f32::from(MOST_MISSED));
        Self {
            most_missed: whole(ticks),
            stroke_m,
            most_m_per_s: VELOCITY_M_PER_S.highest,
            most_m_per_s2: jump.most_acceleration_m_per_s2,
        }
    }

    /// The ticks since the last sample, or why they are too many or none.
    #[inline]
    pub(super) fn elapsed(
        &self,
        state: &mut StreamState,
        tick: u32,
        counters: &mut Counters,
    ) -> Result<u32, Finding> {
        let Some(last) = state.last_tick.replace(tick) else {
            return Ok(1);
        };
        let elapsed = tick.wrapping_sub(last);
        if elapsed == 0 || elapsed > u32::MAX / 2 {
            state.standing = state.standing.saturating_add(1);
            counters.repeated_ticks = counters.repeated_ticks.saturating_add(1);
            let is_too_long = state.standing > self.most_missed;
            let finding = Fault::TickStandsStill.at(at_most_255(u32::from(state.standing)));
            return if is_too_long { Err(finding) } else { Ok(0) };
        }
        state.standing = 0;
        let missed = elapsed - 1;
        counters.missed_ticks = counters.missed_ticks.saturating_add(missed);
        if missed > u32::from(self.most_missed) {
            return Err(Fault::MissedTicks.at(at_most_255(missed)));
        }
        Ok(elapsed)
    }

    /// A reference that is no number asks for nothing.
    #[inline]
    pub(super) fn check_reference(
        &self,
        state: &mut StreamState,
        reference: &Reference<f32>,
        elapsed_s: f32,
    ) -> Option<Finding> {
        if is_nothing(reference) {
            state.reference = ReferenceState::default();
            return None;
        }
        let [low_m, high_m] = self.stroke_m;
        if reference.position_m < low_m || reference.position_m > high_m {
            return Some(Fault::ReferenceOutOfStroke.at(0));
        }
        if reference.velocity_m_per_s.abs() > self.most_m_per_s {
            return Some(Fault::ReferenceOutOfStroke.at(1));
        }
        if reference.acceleration_m_per_s2.abs() > self.most_m_per_s2 {
            return Some(Fault::ReferenceOutOfStroke.at(2));
        }
        state.reference.check(reference, elapsed_s)
    }
}

impl ReferenceState {
    fn check(&mut self, reference: &Reference<f32>, elapsed_s: f32) -> Option<Finding> {
        let position_bits = reference.position_m.to_bits();
        if position_bits == self.position_bits {
            // The way that it says by its velocity, and by what that becomes.
            let [speed, change] = [
                reference.velocity_m_per_s,
                reference.acceleration_m_per_s2 * (self.standing_s + 0.5 * elapsed_s),
            ];
            self.standing_s += elapsed_s;
            self.way_m += elapsed_s * (speed.abs() + change.abs());
        } else {
            *self = Self {
                position_bits,
                ..Self::default()
            };
        }
        (self.standing_s > STALE_S && self.way_m > ASTRAY_M).then(|| Fault::StaleReference.at(0))
    }
}

/// Whether a reference asks for nothing.
pub(super) fn is_nothing(reference: &Reference<f32>) -> bool {
    reference.position_m.is_nan()
        || reference.velocity_m_per_s.is_nan()
        || reference.acceleration_m_per_s2.is_nan()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast from f32 saturates"
)]
fn whole(value: f32) -> u16 {
    value as u16
}

fn at_most_255(count: u32) -> u8 {
    u8::try_from(count).unwrap_or(u8::MAX)
}
