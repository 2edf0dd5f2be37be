//! The pressures that act on a carriage, read off their recordings.

use super::{Track, delayed};
use crate::effects::sensing::{position_time_skew, pressure_sensor_lag};
use crate::gauge::Gauge;
use crate::model::{Side, Values};
use crate::rig::Rig;
use model_core::real::Real;

/// Rows on each side for the slope of a pressure, about as long as sensors lag: what reads
/// them averages the rest.
const SLOPE_REACH: usize = 1;

/// Both pressures of a recording, Pa absolute, with what the rig holds of their sensors taken
/// back; none where one was not recorded.
pub fn read_pressures_pa(rig: &Rig, track: &Track<'_>) -> Option<[Vec<f64>; 2]> {
    let values = Values::<f64> {
        rig,
        keys: &[],
        replaced: &[],
    };
    let reading = PressureReading::new(&values, track)?;
    let read_pa = (0..track.len()).map(|row| reading.at(row).into());
    let both: (Vec<f64>, Vec<f64>) = read_pa.unzip();
    Some(both.into())
}

/// How both pressures are read where their sensors lag or are off, or the position was logged
/// at another time.
pub(super) struct PressureReading<'a, R> {
    time_s: &'a [f64],
    recorded_pa: [&'a [f64]; 2],
    gauges: [Gauge<R>; 2],
    lag_s: R,
    skew_s: R,
}

impl<'a, R: Real> PressureReading<'a, R> {
    /// Of a recording; none where a pressure was not recorded.
    pub fn new(values: &Values<'_, R>, track: &'a Track<'_>) -> Option<Self> {
        Some(Self {
            time_s: &track.recording.time_s,
            recorded_pa: [track.signal("p_a")?, track.signal("p_b")?],
            gauges: Side::BOTH.map(|side| Gauge::of(values, side)),
            lag_s: pressure_sensor_lag::time_constant_s(values),
            skew_s: position_time_skew::delay_s(values),
        })
    }

    /// Both pressures when the position of this row was where it was recorded, Pa absolute.
    pub fn at(&self, row: usize) -> [R; 2] {
        [0, 1].map(|side| self.gauges[side].reads_pa(self.shown(self.recorded_pa[side], row)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use std::collections::BTreeMap;
    use truth_plant::{Kind, Request};

    /// A first-order sensor shows a ramp late by its time constant.
    #[test]
    fn val_a_ramp_is_read_back_from_sensors_that_lag_and_are_off() {
        const LAG_S: f64 = 0.005;
        const OFFSET_PA: f64 = 3e3;
        let case = Request::new(1, Kind::Nothing).draw();
        let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("it is a rig");
        let off = [
            ("effects.pressure-sensor-lag.time_constant_s", LAG_S),
            ("effects.pressure-sensor-offset.offset_a_Pa", OFFSET_PA),
        ];
        let rig = rig.with_values(&off.map(|(key, value)| (key.to_owned(), value)).into());
        let time_s: Vec<f64> = (0..50).map(|row| f64::from(row) * 1e-3).collect();
        let ramp_pa = |time_s: &f64| 3e5 + 2e6 * time_s;
        let shown = |offset_pa: f64| -> Vec<f64> {
            let shown = time_s
                .iter()
                .map(|at_s| ramp_pa(&(at_s - LAG_S)) + offset_pa);
            shown.collect()
        };
        let signals = [("p_a", shown(OFFSET_PA)), ("p_b", shown(0.0))];
        let signals: BTreeMap<String, Vec<f64>> = signals
            .into_iter()
            .map(|(name, column)| (name.to_owned(), column))
            .collect();
        let recording = Recording::from_signals("ramp", time_s.clone(), signals);
        let read_pa = read_pressures_pa(&rig, &Track::new(&recording)).expect("both are there");
        for column in read_pa {
            for (read_pa, at_s) in column.iter().zip(&time_s) {
                assert!(
                    (read_pa - ramp_pa(at_s)).abs() < 1e-3,
                    "{read_pa} at {at_s} s"
                );
            }
        }
    }
}
