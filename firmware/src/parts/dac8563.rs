//! DAC8563 (Texas Instruments): 16-bit converter for the valve, in place of the
//! chip's own of 12 bits. Commands and behaviour at reset are to be checked
//! against the data sheet, which was not at hand.
//!
//! Chosen because it begins at mid-scale, the middle of the valve, and goes back
//! there when its clear input falls, which the board ties to the chip's reset.
//! Its reference stays the external one of 2.5 V: the internal one would be off
//! until the firmware has asked for it, and mid-scale of nothing is the valve's
//! end. A frame is 24 bits, most significant first, SPI mode 1: two bits of no
//! meaning, three of command, three of address, sixteen of data. It cannot be
//! read; what it puts out is measured behind the amplifier.

use crate::codes::DacCode;
use embedded_hal::spi::SpiDevice;

/// Write converter A and let it out at once.
const WRITE_AND_UPDATE_A: u8 = 0b00_011_000;
/// How both converters treat the load input.
const LOAD_INPUT: u8 = 0b00_110_000;
/// Neither waits for it.
const LOAD_INPUT_OFF: u8 = 0b11;

/// The converter on its bus.
#[derive(Debug)]
pub struct Dac8563<Device> {
    device: Device,
}

impl<Device: SpiDevice> Dac8563<Device> {
    /// The converter behind `device`.
    pub fn new(device: Device) -> Self {
        Self { device }
    }

    /// Makes the output follow each write, whatever level the load input has.
    ///
    /// # Errors
    ///
    /// The bus did not carry it.
    pub fn configure(&mut self) -> Result<(), Device::Error> {
        self.device.write(&[LOAD_INPUT, 0, LOAD_INPUT_OFF])
    }

    /// Puts out a code.
    ///
    /// # Errors
    ///
    /// The bus did not carry it.
    pub fn write(&mut self, code: DacCode) -> Result<(), Device::Error> {
        let [high, low] = code.0.to_be_bytes();
        self.device.write(&[WRITE_AND_UPDATE_A, high, low])
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use embedded_hal_mock::eh1::spi::{Mock, Transaction};
    use std::vec::Vec;

    #[test]
    fn prop_frames_are_these_words() {
        let expected: Vec<Transaction<u8>> = [[0x30, 0x00, 0x03], [0x18, 0x80, 0x01]]
            .into_iter()
            .flat_map(|bytes| {
                [
                    Transaction::transaction_start(),
                    Transaction::write_vec(bytes.to_vec()),
                    Transaction::transaction_end(),
                ]
            })
            .collect();
        let mut bus = Mock::new(&expected);
        let mut converter = Dac8563::new(bus.clone());
        converter.configure().expect("the mock carries it");
        converter
            .write(DacCode(0x8001))
            .expect("the mock carries it");
        bus.done();
    }
}
