//! What the checks assume of the sensors: twice and more the noise and errors of
//! the rig's simulation (`host-sim`), so that a sound sensor never trips. To be
//! checked against the data sheets of the sensors in use.

use crate::codes::{
    END_OF_12_BITS, END_OF_16_BITS, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S,
};

/// Deviations that noise is granted. Once in 1e15 draws is more: the five
/// channels of an axis draw that often in 6000 years.
const DEVIATIONS: f32 = 8.0;
/// Deviation of the difference of two readings, in deviations of one.
const OF_DIFFERENCE: f32 = core::f32::consts::SQRT_2;
/// Deviation of x2 - 2 x1 + x0, in deviations of one: sqrt(1 + 4 + 1).
const OF_SECOND_DIFFERENCE: f32 = 2.449_49;

/// Noise of the position: the sensor's is 4 um, a quantum 7.6 um.
const POSITION_NOISE_M: f32 = 10e-6;
/// Noise of a pressure: the sensor's is 250 Pa, the quantum of 12 bits 244 Pa.
const PRESSURE_NOISE_PA: f32 = 500.0;
/// Noise of the velocity: the sensor's is 1.5 mm/s.
const VELOCITY_NOISE_M_PER_S: f32 = 5e-3;

/// What noise puts into a second difference of the position, m.
pub(super) const POSITION_SECOND_DIFFERENCE_M: f32 =
    DEVIATIONS * OF_SECOND_DIFFERENCE * POSITION_NOISE_M;
/// What noise puts into a difference of pressures, Pa.
pub(super) const PRESSURE_DIFFERENCE_PA: f32 = DEVIATIONS * OF_DIFFERENCE * PRESSURE_NOISE_PA;
/// What noise puts into a difference of velocities, m/s.
pub(super) const VELOCITY_DIFFERENCE_M_PER_S: f32 =
    DEVIATIONS * OF_DIFFERENCE * VELOCITY_NOISE_M_PER_S;

/// Offset of the velocity sensor: half a percent of its span, m/s.
pub(super) const VELOCITY_OFFSET_M_PER_S: f32 =
    0.005 * (VELOCITY_M_PER_S.highest - VELOCITY_M_PER_S.lowest);
/// Error of the velocity sensor's gain, relative.
pub(super) const VELOCITY_GAIN_ERROR: f32 = 0.05;
/// By how much position and velocity may be apart in time: filters and
/// conversions of slow transducers, s.
pub(super) const TIME_SKEW_S: f32 = 5e-3;
/// What position and velocity may part by besides, m: 65 quanta of the
/// position, twice what a skew leaves of a start at 40 m/s2.
pub(super) const PARTING_M: f32 = 0.5e-3;

/// Whether a code of the position or the velocity is at an end of the scale.
pub(super) fn is_saturated(code: u16) -> bool {
    code == 0 || code >= END_OF_16_BITS
}

/// Whether a code of a pressure is at the upper end of the scale.
pub(super) fn is_pressure_saturated(code: u16) -> bool {
    code >= END_OF_12_BITS
}

/// The largest pressure that is measured, Pa.
pub(super) const MOST_PRESSURE_PA: f32 = PRESSURE_PA.highest;
/// The position's scale, m.
pub(super) const POSITION_SCALE_M: Scale = POSITION_M;
