//! Position against velocity: how far the load went by either.
//!
//! The difference of both ways, less what the velocity sensor's offset and gain
//! explain, is summed up three times: since the position's code last changed
//! (a frozen position), since the velocity's did (a frozen velocity), and with
//! a memory of 50 ms (a contradiction). A sensor that stands still because the
//! load does gives no difference and never trips.

use super::sensors::{PARTING_M, TIME_SKEW_S, VELOCITY_GAIN_ERROR, VELOCITY_OFFSET_M_PER_S};
use super::step::Step;
use crate::fault::{Channel, Fault, Finding};
use model_core::real::Real;

/// Memory of the contradiction: ten times the skew that is granted, s.
const MEMORY_S: f32 = 10.0 * TIME_SKEW_S;

/// Sums of the difference of both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TravelState {
    since_position_changed_m: f32,
    since_velocity_changed_m: f32,
    remembered_m: f32,
    /// The velocity's changes with the same memory, m/s: sensors that are apart
    /// in time part by the skew times this.
    recent_change_m_per_s: f32,
}

impl TravelState {
    #[inline]
    pub(super) fn check(&mut self, step: &Step<'_>) -> Option<Finding> {
        let parting_m = parting_m(step);
        let share = Real::min(step.elapsed_s * (1.0 / MEMORY_S), 1.0);
        let change_m_per_s = step.now.velocity_m_per_s - step.before.velocity_m_per_s;
        self.remembered_m += parting_m - share * self.remembered_m;
        self.recent_change_m_per_s += change_m_per_s - share * self.recent_change_m_per_s;
        let position_stands = step.codes_now.position == step.codes_before.position;
        let velocity_stands = step.codes_now.velocity == step.codes_before.velocity;
        self.since_position_changed_m =
            sum_while(position_stands, self.since_position_changed_m, parting_m);
        self.since_velocity_changed_m =
            sum_while(velocity_stands, self.since_velocity_changed_m, parting_m);
        self.verdict()
    }

    fn verdict(&self) -> Option<Finding> {
        if self.since_position_changed_m.abs() > PARTING_M {
            return Some(Fault::FrozenSensor.of(Channel::Position));
        }
        if self.since_velocity_changed_m.abs() > PARTING_M {
            return Some(Fault::FrozenSensor.of(Channel::Velocity));
        }
        let skew_m = TIME_SKEW_S * self.recent_change_m_per_s.abs();
        (self.remembered_m.abs() > PARTING_M + skew_m)
            .then(|| Fault::VelocityContradictsPosition.at(0))
    }
}

/// The way by position less the way by velocity, beyond the velocity's error.
fn parting_m(step: &Step<'_>) -> f32 {
    let mean_m_per_s = 0.5 * (step.now.velocity_m_per_s + step.before.velocity_m_per_s);
    let way_m = step.now.position_m - step.before.position_m;
    let difference_m = way_m - mean_m_per_s * step.elapsed_s;
    let error_m_per_s = VELOCITY_OFFSET_M_PER_S + VELOCITY_GAIN_ERROR * mean_m_per_s.abs();
    let explained_m = error_m_per_s * step.elapsed_s;
    difference_m - Real::clamp(difference_m, -explained_m, explained_m)
}

fn sum_while(stands: bool, sum: f32, addend: f32) -> f32 {
    if stands { sum + addend } else { 0.0 }
}
