//! What the pressure gauge of a chamber shows.

use crate::effects::sensing::{gauge_gain, pressure_sensor_offset, unknown_reading};
use crate::model::{Side, Values};
use model_core::left_out::{KNOTS, over_knots};
use model_core::real::Real;

/// Steps from what is shown back to the pressure: an error that changes by a tenth of the
/// pressure is left to one part in ten thousand of itself, one by a thirtieth to a millionth.
const STEPS_BACK: usize = 4;

/// The gauge of one chamber: off by so much, `p_shown = p (1 + gain error) + offset + error(p)`.
#[derive(Clone, Copy, Debug)]
pub struct Gauge<R> {
    /// `chambers.gauge_gain_a`, times `effects.gauge-gain` and one.
    gain: R,
    /// `effects.pressure-sensor-offset`, Pa.
    offset_pa: R,
    /// `effects.unknown-reading`: first and last knot, and the error at each, Pa.
    error_pa: Option<(R, R, [R; KNOTS])>,
}

/// Keys of the gains of both gauges.
pub const GAIN_KEYS: [&str; 2] = [Side::A.gauge_gain_key(), Side::B.gauge_gain_key()];

impl<R: Real> Gauge<R> {
    /// Of a rig.
    pub fn of(values: &Values<'_, R>, side: Side) -> Self {
        Self {
            gain: values.get_or(side.gauge_gain_key(), 1.0)
                * (gauge_gain::gain_error(values, side) + R::ONE),
            offset_pa: pressure_sensor_offset::offset_pa(values, side),
            error_pa: unknown_reading::law(values, side),
        }
    }

    /// What it shows of a pressure, Pa.
    pub fn shows_pa(&self, pressure_pa: R) -> R {
        pressure_pa * self.gain + self.offset_pa + self.error_pa(pressure_pa)
    }

    /// The pressure of which it shows this, Pa.
    pub fn reads_pa(&self, shown_pa: R) -> R {
        let shown_pa = shown_pa - self.offset_pa;
        if self.error_pa.is_none() {
            return shown_pa / self.gain;
        }
        let closer = |pressure_pa, _| (shown_pa - self.error_pa(pressure_pa)) / self.gain;
        (0..STEPS_BACK).fold(shown_pa / self.gain, closer)
    }

    fn error_pa(&self, pressure_pa: R) -> R {
        self.error_pa.map_or(R::ZERO, |(from, to, errors_pa)| {
            over_knots(from, to, &errors_pa, pressure_pa)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::sensing::unknown_reading::error_key;
    use crate::rig::Rig;

    /// Three hundredths too much, and bowed.
    #[test]
    fn val_what_it_shows_is_read_back() {
        let error_pa = |knot: usize| 30.0 * knot as f64 * (130.0 - 7.0 * knot as f64);
        let mut text = "format = \"rig/1\"\n[effects.pressure-sensor-offset]\noffset_a_Pa = 2e3\n\
                        [effects.unknown-reading]\nfrom = 1e5\nto = 9e5\n"
            .to_owned();
        for knot in 0..KNOTS {
            text += &format!("{} = {}\n", error_key(Side::A, knot), error_pa(knot));
        }
        let rig = Rig::parse(&text, "rig.toml").unwrap();
        let values = Values::<f64> {
            rig: &rig,
            keys: &[],
            replaced: &[],
        };
        let gauge = Gauge::of(&values, Side::A);
        for knot in 0..KNOTS {
            let pressure_pa = 1e5 * (knot as f64 + 1.0);
            let shown_pa = gauge.shows_pa(pressure_pa);
            assert!((shown_pa - pressure_pa - 2e3 - error_pa(knot)).abs() < 1e-6);
        }
        for pressure_pa in [1.3e5, 4.44e5, 8.9e5, 1.1e6] {
            let read_pa = gauge.reads_pa(gauge.shows_pa(pressure_pa));
            assert!((read_pa - pressure_pa).abs() < 1.0, "{read_pa}");
        }
        let other = Gauge::of(&values, Side::B);
        assert!((other.reads_pa(5e5) - 5e5).abs() < 1e-9);
    }

    #[test]
    fn val_a_gain_acts_on_the_pressure_and_not_on_the_offset() {
        let text = "format = \"rig/1\"\n[effects.pressure-sensor-offset]\noffset_b_Pa = 2e3\n\
                    [effects.gauge-gain]\ngain_error_b = 0.01\n";
        let rig = Rig::parse(text, "rig.toml").unwrap();
        let values = Values::<f64> {
            rig: &rig,
            keys: &[],
            replaced: &[],
        };
        let gauge = Gauge::of(&values, Side::B);
        assert!((gauge.shows_pa(5e5) - 5.07e5).abs() < 1e-9);
        assert!((gauge.reads_pa(5.07e5) - 5e5).abs() < 1e-9);
    }
}
