//! Converters on a serial bus, one file per part, over `embedded-hal`'s
//! `SpiDevice`: the same code on the chip and, against a mock, on the host.

pub mod ads8681;
pub mod dac8563;
