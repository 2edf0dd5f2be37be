//! The valve's output: the chip's own converter on PA4, or, with the feature
//! `spi-dac`, a DAC8563 on SPI3; behind it a switch and an amplifier to 0..10 V.
//!
//! A command is put out at the beginning of the tick after its own, on the
//! timer's edge: no jitter, and the delay that the observer reckons with. Where
//! nothing drives PB9, as in reset, the switch gives the amplifier the middle of
//! the valve's range instead of the converter: a chip that is held in reset, has
//! lost its supply or restarts centres the valve.

use firmware::codes::{DacCode, ValveConverter};

#[cfg(not(feature = "spi-dac"))]
pub use own::Converter;
#[cfg(feature = "spi-dac")]
pub use spi::Converter;

/// The middle of the valve's range.
pub const MIDDLE: DacCode = DacCode(0x8000);

/// The chip's own converter, 12 bits.
#[cfg(not(feature = "spi-dac"))]
mod own {
    use super::{DacCode, MIDDLE, ValveConverter};
    use stm32f4xx_hal::pac::dac::cr::TSEL1;
    use stm32f4xx_hal::pac::{DAC, RCC};
    use stm32f4xx_hal::rcc::Enable;

    /// The chip's own converter.
    pub struct Converter {
        registers: DAC,
    }

    impl Converter {
        /// Its steps.
        pub const FINENESS: ValveConverter = ValveConverter::TwelveBits;

        /// Puts out the valve's middle at once, and from then on what is written
        /// at the timer's edges. The pin already is analogue. The buffer stays
        /// off: it comes within 0.2 V of either end only.
        pub fn start(rcc: &mut RCC, registers: DAC) -> Self {
            DAC::enable(rcc);
            let mut converter = Self { registers };
            converter.write(MIDDLE);
            let control = converter.registers.cr();
            control.write(|w| w.boff1().set_bit().en1().set_bit());
            // More than the cycle of APB1 that the code takes to the output.
            cortex_m::asm::delay(100);
            control.modify(|_, w| w.tsel1().variant(TSEL1::Tim2trgo).ten1().set_bit());
            converter
        }

        /// What goes out at the next edge; the low 4 bits are below its steps.
        pub fn write(&mut self, code: DacCode) {
            let data = self.registers.dhr12r1();
            data.write(|w| w.daccdhr().set(code.0 >> 4));
        }

        /// An edge of the timer: nothing to do, the converter has seen it.
        pub fn begin_tick(&mut self) {}

        /// What is put out.
        pub fn output(&self) -> DacCode {
            DacCode(self.registers.dor1().read().daccdor().bits() << 4)
        }

        /// The steps that it has, in codes.
        pub fn as_put_out(code: DacCode) -> DacCode {
            DacCode(code.0 & 0xFFF0)
        }
    }
}

/// A converter of 16 bits on a bus of its own.
#[cfg(feature = "spi-dac")]
mod spi {
    use super::super::spi::{Bus, CoreDelay, Device};
    use super::{DacCode, MIDDLE, ValveConverter};
    use firmware::parts::dac8563::Dac8563;
    use stm32f4xx_hal::gpio::{Output, PA15};
    use stm32f4xx_hal::pac::SPI3;

    /// A DAC8563.
    pub struct Converter {
        part: Dac8563<Device<SPI3, PA15<Output>>>,
        next: DacCode,
        output: DacCode,
    }

    impl Converter {
        /// Its steps.
        pub const FINENESS: ValveConverter = ValveConverter::SixteenBits;

        /// Puts out the valve's middle; pins and the bus' clock are ready.
        pub fn start(bus: Bus<SPI3>, select: PA15<Output>, delay: CoreDelay) -> Self {
            let Ok(device) = Device::new(bus, select, delay);
            let mut converter = Self {
                part: Dac8563::new(device),
                next: MIDDLE,
                output: DacCode(0),
            };
            if converter.part.configure().is_ok() {
                converter.begin_tick();
            }
            converter
        }

        /// What goes out at the next tick.
        pub fn write(&mut self, code: DacCode) {
            self.next = code;
        }

        /// Puts it out.
        pub fn begin_tick(&mut self) {
            if self.part.write(self.next).is_ok() {
                self.output = self.next;
            }
        }

        /// What the bus carried last: the part cannot be read.
        pub fn output(&self) -> DacCode {
            self.output
        }

        /// It has all steps of the code.
        pub fn as_put_out(code: DacCode) -> DacCode {
            code
        }
    }
}
