//! From the codes of an axis' own sensors to codes on the scales of the link.
//!
//! Whatever looks at a code knows one scale ([`crate::codes`]): controller, supervision,
//! telemetry, host. A sensor of another range, kind or sign ([`Sensors`]) is brought to it
//! here, once, before anything else looks. A code that says that a conversion failed stays
//! one, and a code at the end of its converter goes to the end of the scale: what was found
//! at standard sensors is found at all.
//!
//! Without a velocity sensor the velocity is the position's difference quotient, low-passed.

use crate::codes::{
    AdcCode, AdcCodes, END_OF_12_BITS, END_OF_16_BITS, FAILED_CONVERSION, POSITION_M, PRESSURE_PA,
    Scale, VELOCITY_M_PER_S,
};
use crate::settings::Sensors;

/// Time constant of the low-pass of a velocity that is worked out, s: a position with noise
/// of 4 um and steps of 7.6 um gives 2 mm/s rms at every rate of ticks, about what a sensor has.
const VELOCITY_TIME_CONSTANT_S: f32 = 2e-3;

/// The way from the codes of these sensors to those of the link.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensing {
    is_standard: bool,
    position: Line,
    pressure_a: Line,
    pressure_b: Line,
    supply_pressure: Line,
    velocity: Velocity,
}

/// A straight line from code to code.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    gain: f32,
    /// Half a code more: what follows is cut off.
    offset: f32,
    /// Codes from this one on are at the end of the converter.
    last: u16,
}

/// Where the velocity comes from.
#[derive(Clone, Debug, PartialEq)]
enum Velocity {
    Measured(Line),
    OfPosition(Quotient),
}

/// A low-passed difference quotient.
#[derive(Clone, Debug, PartialEq)]
struct Quotient {
    /// Codes of the velocity for a code of the position from tick to tick.
    per_difference: f32,
    /// Share of the way to a new value in a tick.
    share: f32,
    before: Option<u16>,
    codes: f32,
}

impl Sensing {
    /// Of these sensors, for ticks of `dt_s`.
    pub fn new(sensors: &Sensors, dt_s: f32) -> Self {
        let pressure = |shown: &Scale| Line::new(shown, &PRESSURE_PA, END_OF_12_BITS);
        Self {
            is_standard: *sensors == Sensors::STANDARD,
            position: Line::new(&sensors.position_m, &POSITION_M, END_OF_16_BITS),
            pressure_a: pressure(&sensors.pressure_a_pa),
            pressure_b: pressure(&sensors.pressure_b_pa),
            supply_pressure: pressure(&sensors.supply_pressure_pa),
            velocity: match &sensors.velocity_m_per_s {
                Some(shown) => {
                    Velocity::Measured(Line::new(shown, &VELOCITY_M_PER_S, END_OF_12_BITS))
                }
                None => Velocity::OfPosition(Quotient::new(dt_s)),
            },
        }
    }

    /// The codes on the scales of the link.
    #[inline]
    pub fn shown(&mut self, codes: &AdcCodes) -> AdcCodes {
        if self.is_standard {
            *codes
        } else {
            self.rescaled(codes)
        }
    }

    #[inline(never)]
    fn rescaled(&mut self, codes: &AdcCodes) -> AdcCodes {
        let position = self.position.shown(codes.position);
        AdcCodes {
            position,
            pressure_a: self.pressure_a.shown(codes.pressure_a),
            pressure_b: self.pressure_b.shown(codes.pressure_b),
            supply_pressure: self.supply_pressure.shown(codes.supply_pressure),
            velocity: match &mut self.velocity {
                Velocity::Measured(line) => line.shown(codes.velocity),
                Velocity::OfPosition(quotient) => quotient.step(position),
            },
        }
    }
}

impl Line {
    /// Apart, as [`Self::shown`] is: inlined five times they take a kilobyte of code more.
    #[inline(never)]
    fn new(shown: &Scale, link: &Scale, last: u16) -> Self {
        let gain = (shown.highest - shown.lowest) / (link.highest - link.lowest);
        // A sensor that is not there reads the same whatever its input does.
        let last = if gain == 0.0 {
            FAILED_CONVERSION.0
        } else {
            last
        };
        Self {
            gain,
            offset: link.endless_place(shown.lowest) + 0.5,
            last,
        }
    }

    #[inline(never)]
    fn shown(self, code: AdcCode) -> AdcCode {
        if code == FAILED_CONVERSION {
            return code;
        }
        if code.0 >= self.last {
            return AdcCode(END_OF_16_BITS);
        }
        code_of(f32::from(code.0) * self.gain + self.offset)
    }
}

impl Quotient {
    fn new(dt_s: f32) -> Self {
        let position_m = POSITION_M.highest - POSITION_M.lowest;
        let velocity_m_per_s = VELOCITY_M_PER_S.highest - VELOCITY_M_PER_S.lowest;
        Self {
            per_difference: position_m / (velocity_m_per_s * dt_s),
            share: dt_s / (VELOCITY_TIME_CONSTANT_S + dt_s),
            before: None,
            codes: VELOCITY_M_PER_S.place(0.0),
        }
    }

    fn step(&mut self, position: AdcCode) -> AdcCode {
        let before = self.before.replace(position.0).unwrap_or(position.0);
        let difference = f32::from(position.0) - f32::from(before);
        let new = VELOCITY_M_PER_S.place(0.0) + self.per_difference * difference;
        self.codes += self.share * (new - self.codes);
        code_of(self.codes + 0.5)
    }
}

/// The code that a place is cut off to, on the scale.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast from f32 saturates"
)]
fn code_of(place: f32) -> AdcCode {
    AdcCode(place.min(f32::from(END_OF_16_BITS)) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::iter::repeat_n;

    const DT_S: f32 = 1e-3;

    fn codes(pressure: u16) -> AdcCodes {
        AdcCodes::from_array([32_768, pressure, pressure, pressure, 32_768])
    }

    /// A gauge of 0 to 10 bar gauge, 4 to 20 mA across 500 Ohm before an input of 0 to 10 V.
    const LIVE_ZERO: Scale = Scale::new(101_325.0 - 2.5e5, 101_325.0 + 1e6);

    fn with_pressures(shown: Scale) -> Sensors {
        Sensors {
            pressure_a_pa: shown,
            pressure_b_pa: shown,
            supply_pressure_pa: shown,
            ..Sensors::STANDARD
        }
    }

    #[test]
    fn prop_standard_sensors_keep_their_codes() {
        let mut sensing = Sensing::new(&Sensors::STANDARD, DT_S);
        for code in 0..=u16::MAX {
            let codes = AdcCodes::from_array([code; 5]);
            assert_eq!(sensing.shown(&codes), codes);
        }
    }

    #[test]
    fn val_a_gauge_with_a_live_zero_shows_absolute_pressure() {
        let mut sensing = Sensing::new(&with_pressures(LIVE_ZERO), DT_S);
        // 12 mA are 6 V: half of 10 bar, gauge.
        let half = (0.6 * 65_535.0) as u16;
        let shown = sensing.shown(&codes(half)).measurements();
        assert!((shown.pressure_a_pa - 601_325.0).abs() < 30.0, "{shown:?}");
        // A wire that breaks gives no current, and that is no pressure.
        assert_eq!(sensing.shown(&codes(0)).pressure_b.0, 0);
        // 20 mA, the end of the converter, the end of the scale.
        assert_eq!(sensing.shown(&codes(0xFFF0)).pressure_b.0, 0xFFFE);
        // And what failed has failed.
        let failed = sensing.shown(&codes(FAILED_CONVERSION.0));
        assert_eq!(failed.supply_pressure, FAILED_CONVERSION);
    }

    #[test]
    fn prop_a_position_sensor_the_other_way_round_is_turned() {
        let sensors = Sensors {
            position_m: Scale::new(0.25, -0.25),
            ..Sensors::STANDARD
        };
        let mut sensing = Sensing::new(&sensors, DT_S);
        for code in [1, 1000, 32_768, 60_000, 0xFFFD] {
            let shown = sensing.shown(&AdcCodes::from_array([code, 9, 9, 9, 9]));
            assert_eq!(shown.position.0, u16::MAX - code);
        }
    }

    #[test]
    fn prop_a_supply_that_is_taken_for_granted_reads_it_whatever_comes_in() {
        let sensors = Sensors {
            supply_pressure_pa: Scale::new(7e5, 7e5),
            ..Sensors::STANDARD
        };
        let mut sensing = Sensing::new(&sensors, DT_S);
        for code in [0, 30_000, 0xFFF0, 0xFFFE] {
            let codes = AdcCodes::from_array([9, 9, 9, code, 9]);
            let shown = sensing.shown(&codes).measurements();
            assert!((shown.supply_pressure_pa - 7e5).abs() < 10.0, "{shown:?}");
        }
    }

    #[test]
    fn val_a_velocity_is_worked_out_from_the_position() {
        let sensors = Sensors {
            velocity_m_per_s: None,
            ..Sensors::STANDARD
        };
        for (dt_s, ticks) in [(1e-3, 40), (1.25e-4, 320)] {
            let mut sensing = Sensing::new(&sensors, dt_s);
            // Half a metre a second, after 40 ms: twenty time constants.
            let mut last = 0.0;
            for tick in 0..ticks {
                let place = POSITION_M.place(-0.1 + 0.5 * dt_s * tick as f32) as u16;
                let codes = AdcCodes::from_array([place, 9, 9, 9, 0]);
                last = sensing.shown(&codes).measurements().velocity_m_per_s;
            }
            // Steps of the code are 7.6 um: a share of a step a tick, low-passed.
            assert!((last - 0.5).abs() < 0.01, "{last} at {dt_s}");
            // At rest it is nought, from the first tick on.
            let mut sensing = Sensing::new(&sensors, dt_s);
            for place in repeat_n(20_000, 5) {
                let codes = AdcCodes::from_array([place, 9, 9, 9, 0]);
                let shown = sensing.shown(&codes).measurements();
                assert!(shown.velocity_m_per_s.abs() < 1e-4, "{shown:?}");
            }
        }
    }
}
