//! The pressures that act on a carriage, read off their recordings.

use super::{Track, delayed};
use crate::model::{Side, Values};
use model_core::real::Real;

/// Rows on each side for the slope of a pressure, about as long as sensors lag: what reads
/// them averages the rest.
const SLOPE_REACH: usize = 1;

/// How both pressures are read where their sensors lag or are off, or the position was logged
/// at another time.
pub(super) struct PressureReading<'a, R> {
    time_s: &'a [f64],
    recorded_pa: [&'a [f64]; 2],
    offsets_pa: [R; 2],
    lag_s: R,
    skew_s: R,
}

impl<'a, R: Real> PressureReading<'a, R> {
    /// Of a recording; none where a pressure was not recorded.
    pub fn new(values: &Values<'_, R>, track: &'a Track<'_>) -> Option<Self> {
        Some(Self {
            time_s: &track.recording.time_s,
            recorded_pa: [track.signal("p_a")?, track.signal("p_b")?],
            offsets_pa: Side::BOTH.map(|side| values.pressure_offset_pa(side)),
            lag_s: values.effect("pressure-sensor-lag", "time_constant_s", 0.0),
            skew_s: values.effect("position-time-skew", "delay_s", 0.0),
        })
    }

    /// Both pressures when the position of this row was where it was recorded, Pa absolute.
    pub fn at(&self, row: usize) -> [R; 2] {
        [0, 1].map(|side| self.shown(self.recorded_pa[side], row) - self.offsets_pa[side])
    }

    fn shown(&self, recorded_pa: &[f64], row: usize) -> R {
        let shown = if self.skew_s.value().abs() > 0.0 {
            delayed(self.time_s, recorded_pa, row, -self.skew_s)
        } else {
            R::from_f64(recorded_pa[row])
        };
        if self.lag_s.value() <= 0.0 {
            return shown;
        }
        let (from, to) = (
            row.saturating_sub(SLOPE_REACH),
            (row + SLOPE_REACH).min(recorded_pa.len() - 1),
        );
        let slope = (recorded_pa[to] - recorded_pa[from]) / (self.time_s[to] - self.time_s[from]);
        shown + self.lag_s * R::from_f64(slope)
    }
}
