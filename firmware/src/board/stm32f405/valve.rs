//! The valve's output: the chip's own converter on PA4, or, with the feature
//! `spi-dac`, a DAC8563 on SPI3.
//!
//! Both are followed by an amplifier to 0..10 V, and both leave the valve at the
//! middle of its range while the chip is in reset: the pin of the chip's own
//! converter is then open and two resistors hold it at the middle; the DAC8563's
//! clear input is tied to the chip's reset, which every reset from inside pulls.

use firmware::codes::DacCode;

#[cfg(not(feature = "spi-dac"))]
pub use own::Valve;
#[cfg(feature = "spi-dac")]
pub use spi::Valve;

/// The middle of the valve's range.
const MIDDLE: DacCode = DacCode(0x8000);

/// The chip's own converter, 12 bits.
#[cfg(not(feature = "spi-dac"))]
mod own {
    use super::{DacCode, MIDDLE};
    use stm32f4xx_hal::pac::{DAC, RCC};

    /// The valve behind the chip's own converter.
    pub struct Valve {
        registers: DAC,
    }

    impl Valve {
        /// Switches it on at the valve's middle; its pin already is analogue. Its
        /// buffer stays off: it comes within 0.2 V of either end only.
        pub fn start(rcc: &RCC, registers: DAC) -> Self {
            rcc.apb1enr().modify(|_, w| w.dacen().set_bit());
            let mut valve = Self { registers };
            valve.write(MIDDLE);
            let control = valve.registers.cr();
            control.write(|w| w.boff1().set_bit().en1().set_bit());
            valve
        }

        /// Puts out a code; the low 4 bits are below its steps.
        pub fn write(&mut self, code: DacCode) {
            let data = self.registers.dhr12r1();
            data.write(|w| w.daccdhr().set(code.0 >> 4));
        }

        /// The code that it puts out, from one cycle of APB1 after it was written.
        pub fn read_back(&self) -> DacCode {
            DacCode(self.registers.dor1().read().daccdor().bits() << 4)
        }
    }
}

/// A converter of 16 bits on a bus of its own.
#[cfg(feature = "spi-dac")]
mod spi {
    use super::super::spi::{Bus, CoreDelay, Device};
    use super::{DacCode, MIDDLE};
    use firmware::parts::dac8563::Dac8563;
    use stm32f4xx_hal::gpio::{Output, PA15};
    use stm32f4xx_hal::pac::SPI3;

    /// The valve behind a DAC8563.
    pub struct Valve {
        converter: Dac8563<Device<SPI3, PA15<Output>>>,
        put_out: DacCode,
    }

    impl Valve {
        /// Sets it up at the valve's middle; pins and the bus' clock are ready.
        pub fn start(bus: Bus<SPI3>, select: PA15<Output>, delay: CoreDelay) -> Self {
            let Ok(device) = Device::new(bus, select, delay);
            let mut valve = Self {
                converter: Dac8563::new(device),
                put_out: DacCode(0),
            };
            if valve.converter.configure().is_ok() {
                valve.write(MIDDLE);
            }
            valve
        }

        /// Puts out a code.
        pub fn write(&mut self, code: DacCode) {
            if self.converter.write(code).is_ok() {
                self.put_out = code;
            }
        }

        /// The code that the bus carried last: the converter cannot be read.
        pub fn read_back(&self) -> DacCode {
            self.put_out
        }
    }
}
