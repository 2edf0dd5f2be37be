//! ADS8681 (Texas Instruments): 16-bit converter with a programmable input range
//! and its own reference, for the position sensor. ADS8685 and ADS8689 differ in
//! speed only. Commands, registers and flags are to be checked against the data
//! sheet, which was not at hand.
//!
//! A frame is 32 bits, most significant first, SPI mode 0. What the converter
//! receives is a command; what it sends at the same time is the conversion that
//! the end of the frame before (chip select rising) has started. The firmware
//! asks it to send, with each conversion, the flags of its supply and the range
//! in force, so that a frame is
//!
//! | bits | content | expected |
//! |---|---|---|
//! | 31..16 | conversion | |
//! | 15, 14 | supply too low or too high | 0 |
//! | 13..10 | range | as set |
//! | 9..0 | nothing | 0 |
//!
//! A wire that is open or shorted, a converter without supply or one that lost
//! its settings does not send that, and the conversion counts as failed.

use crate::codes::{AdcCode, FAILED_CONVERSION};
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;

/// Write a register's lower half word, the 7-bit command in the upper bits.
const WRITE_HALF_WORD: u8 = 0b1101_0000;
const DATA_OUT_CONTROL: u8 = 0x10;
const RANGE_SELECT: u8 = 0x14;
/// `DATA_OUT_CONTROL`: both supply flags (bits 13, 12) and the range (bit 8) go
/// out with each conversion.
const SEND_SUPPLY_FLAGS_AND_RANGE: u16 = 0x3100;
/// All zero does nothing.
const NO_OPERATION: [u8; 4] = [0; 4];

/// The longest conversion: 665 ns; the rest is margin.
const CONVERSION_NS: u32 = 1_000;

/// What the sensor puts out. The converter's range is 2.4 % wider: a sensor at
/// the end of its range is told from one beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// -10..+10 V over the scale, converter range +-10.24 V.
    PlusMinus10V,
    /// 0..10 V over the scale, converter range 0..10.24 V.
    Zero10V,
}

impl Span {
    const fn range(self) -> u8 {
        match self {
            Self::PlusMinus10V => 0b0001,
            Self::Zero10V => 0b1001,
        }
    }

    /// The raw code that stays where it is when the scale is widened.
    const fn fixed_point(self) -> i32 {
        match self {
            Self::PlusMinus10V => 0x8000,
            Self::Zero10V => 0,
        }
    }

    /// From the converter's 10.24 V to the sensor's 10 V, times 128/125 about
    /// the fixed point. Beyond the sensor's range it gives the last code within;
    /// the highest code of all means a failed conversion.
    fn code(self, raw: u16) -> AdcCode {
        let from_fixed_point = i32::from(raw) - self.fixed_point();
        let widened = (from_fixed_point * 128 + 62).div_euclid(125);
        let code = (self.fixed_point() + widened).clamp(0, i32::from(FAILED_CONVERSION.0) - 1);
        u16::try_from(code).map_or(FAILED_CONVERSION, AdcCode)
    }
}

/// The converter on its bus.
#[derive(Debug)]
pub struct Ads8681<Device, Delay> {
    device: Device,
    delay: Delay,
    span: Span,
}

impl<Device: SpiDevice, Delay: DelayNs> Ads8681<Device, Delay> {
    /// A converter that is not set up yet: its conversions count as failed
    /// until [`configure`](Self::configure) has reached it.
    pub fn new(device: Device, delay: Delay, span: Span) -> Self {
        Self {
            device,
            delay,
            span,
        }
    }

    /// Sets range and frame; to be repeated after the converter lost its supply.
    /// Whether they arrived shows in every frame.
    ///
    /// # Errors
    ///
    /// The bus did not carry it.
    pub fn configure(&mut self) -> Result<(), Device::Error> {
        // The end of whatever frame was the last has begun a conversion.
        self.delay.delay_ns(CONVERSION_NS);
        self.write(RANGE_SELECT, u16::from(self.span.range()))?;
        self.write(DATA_OUT_CONTROL, SEND_SUPPLY_FLAGS_AND_RANGE)
    }

    fn write(&mut self, register: u8, value: u16) -> Result<(), Device::Error> {
        let [high, low] = value.to_be_bytes();
        self.device.write(&[WRITE_HALF_WORD, register, high, low])?;
        self.delay.delay_ns(CONVERSION_NS);
        Ok(())
    }

    /// The position now. The first frame's end starts the conversion, the second
    /// frame brings it; one frame a tick would bring that of the tick before.
    pub fn convert(&mut self) -> AdcCode {
        self.frame_of_new_conversion()
            .ok()
            .and_then(|frame| self.code(frame))
            .unwrap_or(FAILED_CONVERSION)
    }

    fn frame_of_new_conversion(&mut self) -> Result<[u8; 4], Device::Error> {
        self.device.write(&NO_OPERATION)?;
        self.delay.delay_ns(CONVERSION_NS);
        let mut frame = NO_OPERATION;
        self.device.transfer_in_place(&mut frame)?;
        Ok(frame)
    }

    fn code(&self, [high, low, flags, rest]: [u8; 4]) -> Option<AdcCode> {
        let is_sound = flags == self.span.range() << 2 && rest == 0;
        is_sound.then(|| self.span.code(u16::from_be_bytes([high, low])))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use embedded_hal::spi::ErrorKind;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::spi::{Mock, Transaction};
    use std::vec;
    use std::vec::Vec;

    fn frame(sent: Vec<u8>, received: Vec<u8>) -> [Transaction<u8>; 3] {
        [
            Transaction::transaction_start(),
            Transaction::transfer_in_place(sent, received),
            Transaction::transaction_end(),
        ]
    }

    fn written(bytes: Vec<u8>) -> [Transaction<u8>; 3] {
        [
            Transaction::transaction_start(),
            Transaction::write_vec(bytes),
            Transaction::transaction_end(),
        ]
    }

    /// What one conversion gives when the second frame is `received`.
    fn converted(span: Span, received: [u8; 4]) -> AdcCode {
        let expected = [written(vec![0; 4]), frame(vec![0; 4], received.to_vec())].concat();
        let mut bus = Mock::new(&expected);
        let code = Ads8681::new(bus.clone(), NoopDelay::new(), span).convert();
        bus.done();
        code
    }

    #[test]
    fn prop_settings_are_these_words() {
        // Write half word 0x14 = 1 (+-2.5 x 4.096 V), then 0x10 = 0x3100.
        let expected = [
            written(vec![0xD0, 0x14, 0x00, 0x01]),
            written(vec![0xD0, 0x10, 0x31, 0x00]),
        ];
        let mut bus = Mock::new(&expected.concat());
        let mut converter = Ads8681::new(bus.clone(), NoopDelay::new(), Span::PlusMinus10V);
        converter.configure().expect("the mock carries it");
        bus.done();
    }

    #[test]
    fn val_ten_volts_are_the_ends_of_the_scale() {
        let raw = |volts: f64, span: Span| match span {
            Span::PlusMinus10V => ((volts + 10.24) / 20.48 * 65_536.0).round() as u16,
            Span::Zero10V => (volts / 10.24 * 65_536.0).round() as u16,
        };
        for (span, lowest_v) in [(Span::PlusMinus10V, -10.0), (Span::Zero10V, 0.0)] {
            for step in 0..=1000 {
                let part = f64::from(step) / 1000.0;
                let volts = lowest_v + part * (10.0 - lowest_v);
                let code = f64::from(span.code(raw(volts, span)).0);
                // Two roundings, and 65536 steps against 65535.
                let expected = part * 65_535.0;
                assert!((code - expected).abs() <= 1.7, "{span:?} {volts}: {code}");
            }
            assert_eq!(span.code(0xFFFF).0, 0xFFFE, "beyond is not failed");
        }
        assert_eq!(Span::PlusMinus10V.code(0).0, 0);
    }

    #[test]
    fn prop_a_frame_with_its_range_is_a_conversion() {
        let code = converted(Span::PlusMinus10V, [0x80, 0x00, 0b0000_0100, 0]);
        assert_eq!(code, AdcCode(0x8000));
        let code = converted(Span::Zero10V, [0x00, 0x7D, 0b0010_0100, 0]);
        assert_eq!(code, AdcCode(0x80));
    }

    #[test]
    fn prop_dead_wires_lost_settings_and_bad_supply_are_failed_conversions() {
        for received in [
            [0x00; 4],
            [0xFF; 4],
            // Settings lost: conversion alone, +-12.288 V.
            [0x80, 0x00, 0x00, 0x00],
            // Supply flags.
            [0x80, 0x00, 0b0100_0100, 0x00],
            [0x80, 0x00, 0b1000_0100, 0x00],
            // Another range.
            [0x80, 0x00, 0b0010_0100, 0x00],
            // A bit too many or too few.
            [0x80, 0x00, 0b0000_1000, 0x00],
            [0x80, 0x00, 0b0000_0100, 0x01],
        ] {
            let code = converted(Span::PlusMinus10V, received);
            assert_eq!(code, FAILED_CONVERSION, "{received:02x?}");
        }
    }

    /// A bus whose transfers time out.
    struct DeadBus;

    impl embedded_hal::spi::ErrorType for DeadBus {
        type Error = ErrorKind;
    }

    impl SpiDevice for DeadBus {
        fn transaction(
            &mut self,
            _: &mut [embedded_hal::spi::Operation<'_, u8>],
        ) -> Result<(), ErrorKind> {
            Err(ErrorKind::Other)
        }
    }

    #[test]
    fn prop_a_bus_error_is_a_failed_conversion() {
        let mut converter = Ads8681::new(DeadBus, NoopDelay::new(), Span::Zero10V);
        assert_eq!(converter.convert(), FAILED_CONVERSION);
        assert!(converter.configure().is_err());
    }
}
