//! Readings that no sound sensor gives: failed conversions, values out of
//! range, a supply that is lost. One sample is enough.

use super::sensors::{POSITION_SCALE_M, is_pressure_saturated, is_saturated};
use crate::codes::{AdcCodes, FAILED_CONVERSION};
use crate::fault::{Channel, Fault, Finding};
use crate::settings::Wiring;
use model_core::axis::Axis;
use model_core::controller::Measurements;

/// Below this part of the ambient pressure a chamber's or the supply's sensor
/// is broken: a wire that breaks reads 0, while a chamber at ambient pressure
/// whose piston is torn to four times its volume has not got there yet.
const LEAST_SHARE_OF_AMBIENT: f32 = 0.25;
/// A supply of less gauge pressure than this counts as lost, whatever the
/// friction: the errors of a 10 bar sensor alone are a fifth of it, Pa.
const LEAST_GAUGE_PA: f32 = 5e4;
/// A supply of this much gauge pressure is there, whatever the friction: axes of
/// this kind are run from 4 bar gauge on, and a sagging one still has 3, Pa.
const ENOUGH_GAUGE_PA: f32 = 2.5e5;
/// How well the sensor's place against the ends of the stroke is known, m.
const END_MARGIN_M: f32 = 2e-3;

/// Limits of single readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    /// Where the carriage can be, m.
    pub(super) stroke_m: [f32; 2],
    least_pressure_pa: f32,
    least_supply_pa: f32,
}

impl Range {
    /// Of an axis whose wiring is unchecked the supply may be as low as there is any: it is to be
    /// checked with little air.
    pub(super) fn new(axis: &Axis<f32>, wiring: Wiring) -> Self {
        let ambient_pa = axis.carriage.ambient_pressure_pa;
        let area_m2 = axis.carriage.area_a_m2.min(axis.carriage.area_b_m2);
        // A chamber in the middle between supply and exhaust has half of the
        // gauge pressure to work with, and half of that is a reserve.
        let breaking_away_pa = 2.0 * 2.0 * axis.friction.static_n / area_m2;
        let needed_pa = match wiring {
            Wiring::Checked => breaking_away_pa.clamp(LEAST_GAUGE_PA, ENOUGH_GAUGE_PA),
            Wiring::Unchecked => LEAST_GAUGE_PA,
        };
        let ends = [&axis.pneumatics.chamber_a, &axis.pneumatics.chamber_b]
            .map(|chamber| &chamber.geometry)
            .map(|geometry| -geometry.length_at_zero_m * geometry.length_per_position);
        let scale = [POSITION_SCALE_M.lowest, POSITION_SCALE_M.highest];
        let is_cylinder = ends[0] < ends[1];
        Self {
            stroke_m: if is_cylinder { ends } else { scale },
            least_pressure_pa: LEAST_SHARE_OF_AMBIENT * ambient_pa,
            least_supply_pa: ambient_pa + needed_pa,
        }
    }

    /// The first thing that is wrong with this sample alone.
    #[inline]
    pub(super) fn check(&self, codes: &AdcCodes, now: &Measurements<f32>) -> Option<Finding> {
        failed(codes).or_else(|| self.out_of_range(codes, now))
    }

    fn out_of_range(&self, codes: &AdcCodes, now: &Measurements<f32>) -> Option<Finding> {
        let is_pressure_out = |code: u16, pressure_pa: f32| {
            pressure_pa < self.least_pressure_pa || is_pressure_saturated(code)
        };
        let outside = |channel| Some(Fault::OutOfRange.of(channel));
        if is_saturated(codes.position.0)
            || now.position_m < self.stroke_m[0] - END_MARGIN_M
            || now.position_m > self.stroke_m[1] + END_MARGIN_M
        {
            return outside(Channel::Position);
        }
        if is_pressure_out(codes.pressure_a.0, now.pressure_a_pa) {
            return outside(Channel::PressureA);
        }
        if is_pressure_out(codes.pressure_b.0, now.pressure_b_pa) {
            return outside(Channel::PressureB);
        }
        if is_pressure_out(codes.supply_pressure.0, now.supply_pressure_pa) {
            return outside(Channel::SupplyPressure);
        }
        if is_saturated(codes.velocity.0) {
            return outside(Channel::Velocity);
        }
        (now.supply_pressure_pa < self.least_supply_pa)
            .then(|| Fault::SupplyLost.at(tenths_of_a_bar(now.supply_pressure_pa)))
    }
}

fn failed(codes: &AdcCodes) -> Option<Finding> {
    let channel = if codes.position == FAILED_CONVERSION {
        Channel::Position
    } else if codes.pressure_a == FAILED_CONVERSION {
        Channel::PressureA
    } else if codes.pressure_b == FAILED_CONVERSION {
        Channel::PressureB
    } else if codes.supply_pressure == FAILED_CONVERSION {
        Channel::SupplyPressure
    } else if codes.velocity == FAILED_CONVERSION {
        Channel::Velocity
    } else {
        return None;
    };
    Some(Fault::FailedConversion.of(channel))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast from f32 saturates"
)]
fn tenths_of_a_bar(pressure_pa: f32) -> u8 {
    (pressure_pa * 1e-4) as u8
}
