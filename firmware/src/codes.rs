//! Converter codes to SI units and back.
//!
//! Codes are 16-bit full scale whatever the converter behind. The scales are
//! those of the link between controller and plant, and the board's analogue
//! front ends are dimensioned for them.

use model_core::controller::Measurements;
use model_core::real::Real;
use serde::{Deserialize, Serialize};

/// A converter's code, 0..=65535 over its full scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdcCode(pub u16);

/// The code that a converter gives when its conversion failed.
pub const FAILED_CONVERSION: AdcCode = AdcCode(0xFFFF);

/// Codes from here on are at the upper end of a converter of 12 bits, whose steps are 16 codes.
pub const END_OF_12_BITS: u16 = 0xFFF0;
/// The same of a converter of 16 bits: the code over it is a failed conversion.
pub const END_OF_16_BITS: u16 = 0xFFFE;

/// A code for the valve's converter, 0..=65535 for 0..10 V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DacCode(pub u16);

/// The codes of one tick, in the order of the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdcCodes {
    /// Position.
    pub position: AdcCode,
    /// Pressure of chamber a.
    pub pressure_a: AdcCode,
    /// Pressure of chamber b.
    pub pressure_b: AdcCode,
    /// Supply pressure.
    pub supply_pressure: AdcCode,
    /// Velocity.
    pub velocity: AdcCode,
}

/// A linear scale from code 0 to code 65535.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Value at code 0.
    pub lowest: f32,
    /// Value at code 65535.
    pub highest: f32,
}

/// Position: a stroke of 0.5 m about mid-stroke.
pub const POSITION_M: Scale = Scale::new(-0.25, 0.25);
/// Pressures, absolute.
pub const PRESSURE_PA: Scale = Scale::new(0.0, 1e6);
/// Velocity.
pub const VELOCITY_M_PER_S: Scale = Scale::new(-2.0, 2.0);
/// Volts at a pressure's terminal.
pub const PRESSURE_INPUT_V: Scale = Scale::new(0.0, 10.0);
/// Volts at the terminals of position and velocity.
pub const BIPOLAR_INPUT_V: Scale = Scale::new(-10.0, 10.0);
/// Resistor across a terminal whose sensor puts out a current: 4 to 20 mA are 2 to 10 V.
pub const SHUNT_OHM: f32 = 500.0;
/// The valve's input.
pub const COMMAND_V: Scale = Scale::new(0.0, 10.0);

const FULL_SCALE: f32 = 65_535.0;

/// How fine the valve's converter is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ValveConverter {
    /// 12 bits: it ignores the low 4 of a code.
    #[default]
    TwelveBits,
    /// All bits of a code.
    SixteenBits,
}

impl ValveConverter {
    /// Codes from one of its steps to the next.
    const fn codes_per_step(self) -> u16 {
        match self {
            Self::TwelveBits => 16,
            Self::SixteenBits => 1,
        }
    }
}

impl Scale {
    /// A scale between the values of the lowest and the highest code.
    pub const fn new(lowest: f32, highest: f32) -> Self {
        Self { lowest, highest }
    }

    /// The value of a code.
    #[inline]
    pub fn value(&self, code: u16) -> f32 {
        self.lowest + (self.highest - self.lowest) * (1.0 / FULL_SCALE) * f32::from(code)
    }

    /// The place of a value on the scale, 0..=65535, fractions kept; a value
    /// beyond the scale gives its end, NaN gives NaN.
    #[inline]
    pub fn place(&self, value: f32) -> f32 {
        self.endless_place(value).clamp(0.0, FULL_SCALE)
    }

    /// The same on a scale that goes on beyond its ends.
    #[inline]
    pub fn endless_place(&self, value: f32) -> f32 {
        (value - self.lowest) * (FULL_SCALE / (self.highest - self.lowest))
    }
}

impl AdcCodes {
    /// The five codes in the order of the link.
    pub fn from_array(codes: [u16; 5]) -> Self {
        let [position, pressure_a, pressure_b, supply_pressure, velocity] = codes.map(AdcCode);
        Self {
            position,
            pressure_a,
            pressure_b,
            supply_pressure,
            velocity,
        }
    }

    /// The five codes in the order of the link.
    pub fn to_array(self) -> [u16; 5] {
        [
            self.position.0,
            self.pressure_a.0,
            self.pressure_b.0,
            self.supply_pressure.0,
            self.velocity.0,
        ]
    }

    /// What the codes mean.
    #[inline]
    pub fn measurements(&self) -> Measurements<f32> {
        Measurements {
            position_m: POSITION_M.value(self.position.0),
            velocity_m_per_s: VELOCITY_M_PER_S.value(self.velocity.0),
            pressure_a_pa: PRESSURE_PA.value(self.pressure_a.0),
            pressure_b_pa: PRESSURE_PA.value(self.pressure_b.0),
            supply_pressure_pa: PRESSURE_PA.value(self.supply_pressure.0),
        }
    }
}

/// Commands to the steps of the valve's converter. What a step leaves over is
/// added to the next command (first-order noise shaping): the mean over some
/// ticks, which is all that the spool and the chambers see, is finer than the
/// steps. Those of 12 bits are 2.4 mV, each of which would be some kilopascal;
/// those of 16 bits are 0.15 mV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandShaper {
    codes_per_step: u16,
    left_over_codes: f32,
}

impl CommandShaper {
    /// A shaper that has left nothing over.
    pub fn new(converter: ValveConverter) -> Self {
        Self {
            codes_per_step: converter.codes_per_step(),
            left_over_codes: 0.0,
        }
    }

    /// Begins anew.
    #[inline]
    pub fn forget(&mut self) {
        self.left_over_codes = 0.0;
    }

    /// The code to write for a command in V; a command that is no number asks
    /// for `safe_v` instead.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the place is within 0..=65535"
    )]
    pub fn code(&mut self, command_v: f32, safe_v: f32) -> DacCode {
        let command_v = if command_v.is_finite() {
            command_v
        } else {
            safe_v
        };
        let step = f32::from(self.codes_per_step);
        let last = FULL_SCALE - (step - 1.0);
        let wanted = COMMAND_V.place(command_v) + self.left_over_codes;
        // The low bits, which a coarser converter ignores, are cleared; a step is
        // a power of two.
        let nearest = Real::clamp(wanted + 0.5 * step, 0.0, last) as u16;
        let code = nearest & !(self.codes_per_step - 1);
        self.left_over_codes = Real::clamp(wanted - f32::from(code), -step, step);
        DacCode(code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [ValveConverter; 2] = [ValveConverter::TwelveBits, ValveConverter::SixteenBits];

    #[test]
    fn prop_shaped_codes_mean_the_command() {
        for (converter, step) in BOTH.into_iter().zip([16, 1]) {
            let mut shaper = CommandShaper::new(converter);
            let command_v = 5.001_3;
            let codes = [(); 1000].map(|()| shaper.code(command_v, 5.0).0);
            assert!(codes.iter().all(|code| code % step == 0));
            let sum: f64 = codes.iter().copied().map(f64::from).sum();
            let mean_v = sum / 1000.0 * 10.0 / 65_535.0;
            assert!((mean_v - f64::from(command_v)).abs() < 1e-5, "{mean_v}");
            // And each is one of the two steps about it.
            let place = COMMAND_V.place(command_v);
            let furthest = codes.iter().map(|code| (f32::from(*code) - place).abs());
            assert!(furthest.fold(0.0, f32::max) < f32::from(step));
        }
    }

    #[test]
    fn prop_a_command_beyond_the_scale_or_without_a_value_is_safe() {
        for (converter, ends) in BOTH
            .into_iter()
            .zip([(4095 * 16, 2048 * 16), (65_535, 32_768)])
        {
            let code = |command_v: f32| CommandShaper::new(converter).code(command_v, 5.0).0;
            assert_eq!((code(12.0), code(f32::NAN)), ends);
            assert_eq!(code(-3.0), 0);
        }
    }

    #[test]
    fn val_12_bit_codes_are_the_nearest_steps() {
        // All steps and the places between them, against whole numbers.
        for code in 0..=u16::MAX {
            let command_v = COMMAND_V.value(code);
            let shaped = CommandShaper::new(ValveConverter::TwelveBits).code(command_v, 5.0);
            let place = COMMAND_V.place(command_v);
            let nearest = ((place / 16.0 + 0.5) as u16).min(4095) * 16;
            assert_eq!(shaped.0, nearest, "{code}");
        }
    }

    #[test]
    fn prop_the_ends_of_a_scale_are_its_codes() {
        assert!((POSITION_M.value(0) + 0.25).abs() < 1e-7);
        assert!((POSITION_M.value(65_535) - 0.25).abs() < 1e-7);
        assert!((PRESSURE_PA.place(1e6) - FULL_SCALE).abs() < 0.1);
    }
}
