//! Does the axis answer the right way round? Wires, tubes and signs, from each start until the
//! axis has answered once.
//!
//! **The valve.** While the spool opens a path plainly and the load hardly moves, the pressure of
//! the chamber that it feeds rises against the other one's. Summed up from the start,
//!
//! ```text
//! s = sum of (pa - pb)' dt  sign of the opening
//! ```
//!
//! grows. Behind a reversed valve, crossed tubes or exchanged gauges it falls, and is known for
//! wrong at a force of a few newtons, before anything moves.
//!
//! **The motion.** From rest a load moves where it is pushed: the work of the gas,
//!
//! ```text
//! W = sum of F dx        F = pa Aa - pb Ab - p0 (Aa - Ab) - FL
//! ```
//!
//! goes into friction and motion, and is never below nothing, told by the position or by the
//! velocity. With either of them reversed it is, as soon as the load has left its place. A shut
//! valve would then let it go on, on the spring of its gas, for millimetres: as the pressures
//! answer rightly, the valve takes the force away first ([`brake_v`]).
//!
//! Limits: of the force only what exceeds a twentieth of the axis' largest counts, as nobody knows
//! every push and every gauge's zero; a weight on an inclined axis that the settings do not know
//! may look like a motion the wrong way. What was right once is not judged again before the next
//! start: signs do not change under way, and a pressure that lags is no wrong sign.

use super::sensors::{PRESSURE_DIFFERENCE_PA, VELOCITY_OFFSET_M_PER_S};
use super::step::Step;
use crate::fault::{Fault, Finding};
use model_core::axis::Axis;
use model_core::controller::Measurements;
use model_core::feedforward::ForceRates;
use model_core::pneumatics::PneumaticState;
use model_core::real::Real;
use model_core::valve::GasState;

/// Details of the fault.
const VALVE: u8 = 0;
const MOTION: u8 = 1;
const VELOCITY: u8 = 2;

/// An opening beyond the overlap by more than the null may be off, V: twice the data sheet's
/// tolerance.
const PLAIN_V: f32 = 0.2;
/// The load hardly moves below this speed, m/s: what the piston does to the pressures then is
/// less than what the plainly open valve does.
const HARDLY_MOVES_M_PER_S: f32 = 0.02;
/// So much the wrong way is no noise: of the sum only its ends count, for each opening.
const WRONG_PA: f32 = 2.0 * PRESSURE_DIFFERENCE_PA;
/// So much the right way is an answer.
const RIGHT_PA: f32 = 4.0 * PRESSURE_DIFFERENCE_PA;
/// A way that the noise of the position does not show, m: ten deviations.
const WAY_M: f32 = 0.1e-3;
/// Share of the axis' largest force that may act unknown.
const SHARE_OF_LARGEST_FORCE: f32 = 0.05;
/// Work is right from so many times what is wrong.
const RIGHT_WORK: f32 = 4.0;
/// The force is taken away within this time, s: twice what a plainly open valve and its spool need.
const BRAKING_S: f32 = 20e-3;
/// As a loop of the force does it, half as fast as the usual one, 1/s: a spool that nobody knows to be slow
/// answers late, and a valve that is torn open until the force is gone then throws the load back. Of 160
/// starts the wrong way round with spools of 15 and 30 Hz the farthest goes 9 mm, with an opening of 2 V 13 mm.
const BRAKING_PER_S: f32 = 100.0;
/// Share of the Coulomb friction that the force may have when the load comes to rest.
const BRAKED: f32 = 0.5;

/// What has been seen since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PolarityState {
    answered_pa: f32,
    has_answered: bool,
    work_j: f32,
    /// The same by the velocity.
    work_by_velocity_j: f32,
    has_worked: bool,
}

impl PolarityState {
    #[inline]
    pub(super) fn check(&mut self, axis: &Axis<f32>, step: &Step<'_>) -> Option<Finding> {
        if !self.has_answered {
            self.judge_valve(axis, step);
            if self.answered_pa < -WRONG_PA {
                return Some(Fault::WrongPolarity.at(VALVE));
            }
        }
        if !self.has_worked {
            let wrong_j = self.judge_motion(axis, step);
            if self.work_j < -wrong_j {
                return Some(Fault::WrongPolarity.at(MOTION));
            }
            if self.work_by_velocity_j < -wrong_j {
                return Some(Fault::WrongPolarity.at(VELOCITY));
            }
        }
        None
    }

    #[inline(never)]
    fn judge_valve(&mut self, axis: &Axis<f32>, step: &Step<'_>) {
        let (now, before) = (step.now, step.before);
        let above_null_v = step.spool_v - axis.valve.null_v;
        let is_open = above_null_v.abs() > axis.valve.supply.edge_v() + PLAIN_V;
        if !is_open || now.velocity_m_per_s.abs() > HARDLY_MOVES_M_PER_S {
            return;
        }
        let difference_pa = |at: &Measurements<f32>| at.pressure_a_pa - at.pressure_b_pa;
        let rise_pa = difference_pa(now) - difference_pa(before);
        let feeds_a = (above_null_v > 0.0) == axis.valve.feeds_a_above_null;
        self.answered_pa += if feeds_a { rise_pa } else { -rise_pa };
        self.has_answered = self.answered_pa > RIGHT_PA;
    }

    /// The work that is wrong, J.
    #[inline(never)]
    fn judge_motion(&mut self, axis: &Axis<f32>, step: &Step<'_>) -> f32 {
        let (now, carriage) = (step.now, &axis.carriage);
        let force_n = force_n(axis, now);
        let gauge_pa = now.supply_pressure_pa - carriage.ambient_pressure_pa;
        let area_m2 = Real::max(carriage.area_a_m2, carriage.area_b_m2);
        let unknown_n = SHARE_OF_LARGEST_FORCE * gauge_pa * area_m2;
        let known_n = force_n - Real::clamp(force_n, -unknown_n, unknown_n);
        self.work_j += known_n * (now.position_m - step.before.position_m);
        let way_m = now.velocity_m_per_s * step.elapsed_s;
        let offset_m = VELOCITY_OFFSET_M_PER_S * step.elapsed_s;
        self.work_by_velocity_j += known_n * (way_m - Real::clamp(way_m, -offset_m, offset_m));
        let wrong_j = WAY_M * Real::max(axis.friction.static_n, unknown_n);
        let least_j = Real::min(self.work_j, self.work_by_velocity_j);
        self.has_worked = least_j > RIGHT_WORK * wrong_j;
        wrong_j
    }
}

/// Force of the gas and of what is known to push, N.
fn force_n(axis: &Axis<f32>, now: &Measurements<f32>) -> f32 {
    let carriage = &axis.carriage;
    carriage.drive_n(now.pressure_a_pa, now.pressure_b_pa)
        - axis.friction_terms.constant_force_n
        - carriage.unknown_force_n(now.position_m, now.velocity_m_per_s)
}

impl PolarityState {
    /// Whether a finding says that a load moves against what its sensors say, and the valve is
    /// known to answer rightly.
    fn can_brake(&self, finding: Finding) -> bool {
        let is_of_motion = match finding.fault {
            Fault::WrongPolarity => finding.detail != VALVE,
            // A velocity of the wrong sign shows either way.
            Fault::VelocityContradictsPosition => !self.has_worked,
            _ => false,
        };
        self.has_answered && is_of_motion
    }
}

/// The command that takes the force from a load that moves against what its sensors say, so long
/// after the fault, V from the null; none where that is done, or the valve itself is in doubt.
#[inline(never)] // Its flow laws' stack is not needed in a tick that follows.
pub(super) fn brake_v(
    axis: &Axis<f32>,
    now: &Measurements<f32>,
    (state, finding): (&PolarityState, Finding),
    since_s: f32,
) -> Option<f32> {
    if since_s > BRAKING_S || !state.can_brake(finding) {
        return None;
    }
    let force_n = force_n(axis, now);
    if force_n.abs() < BRAKED * axis.friction.coulomb_n {
        return None;
    }
    let gas = |pressure_pa| GasState {
        pressure_pa,
        temperature_k: axis.pneumatics.ambient.temperature_k,
    };
    let gas = PneumaticState::at_rest(gas(now.pressure_a_pa), gas(now.pressure_b_pa));
    let rates = ForceRates::at(axis, &gas, now.supply_pressure_pa, now.position_m, 0.0);
    Some(rates.command_v(axis, -BRAKING_PER_S * force_n) - axis.valve.null_v)
}
