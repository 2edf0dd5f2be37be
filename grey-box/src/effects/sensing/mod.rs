//! What gauges and loggers do to the signals.

pub mod gauge_gain;
pub mod position_time_skew;
pub mod pressure_sensor_lag;
pub mod pressure_sensor_offset;
pub mod unknown_reading;

use super::declaration::OffBoard;

/// Why a board gets nothing of a gauge.
pub const WHY_OFF_BOARD: &str = "is the sensor's, and the controller's model has none";

const OF_A_SENSOR: Option<OffBoard> = Some((&[], WHY_OFF_BOARD));
