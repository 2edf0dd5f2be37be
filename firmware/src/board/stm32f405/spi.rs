//! SPI2 and SPI3 as buses of `embedded-hal`, byte by byte, every wait bounded:
//! the control task goes through here.

use core::ops::Deref;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorKind, ErrorType, SpiBus};
use embedded_hal_bus::spi::ExclusiveDevice;
use stm32f4xx_hal::pac::spi1::RegisterBlock;
use stm32f4xx_hal::pac::spi1::cr1::BR;

/// Looks at a flag before it counts as never coming: a byte takes 128 cycles of
/// the core, a look at least 5.
const LOOKS: u32 = 200;

/// A bus: one of the chip's SPI units.
pub struct Bus<Unit> {
    unit: Unit,
}

/// On which edge of the clock data are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// The first, mode 0.
    First,
    /// The second, mode 1.
    Second,
}

impl<Unit: Deref<Target = RegisterBlock>> Bus<Unit> {
    /// Sets the unit up, its clock and pins already are: master, eight bits, the
    /// most significant first, clock idle low, APB1 / 4 = 10.5 MHz.
    pub fn new(unit: Unit, edge: Edge) -> Self {
        unit.cr1().write(|w| {
            w.mstr().set_bit().ssm().set_bit().ssi().set_bit();
            w.br().variant(BR::Div4);
            w.cpha().bit(edge == Edge::Second);
            w.spe().set_bit()
        });
        Self { unit }
    }

    /// Sends a byte, gives the one that came at the same time.
    fn exchange(&mut self, byte: u8) -> Result<u8, ErrorKind> {
        self.wait(|unit| unit.sr().read().txe().bit_is_set())?;
        self.unit.dr().write(|w| w.dr().set(byte.into()));
        self.wait(|unit| unit.sr().read().rxne().bit_is_set())?;
        let [received, _] = self.unit.dr().read().dr().bits().to_le_bytes();
        Ok(received)
    }

    fn wait(&self, is_ready: impl Fn(&RegisterBlock) -> bool) -> Result<(), ErrorKind> {
        let came = (0..LOOKS).any(|_| is_ready(&self.unit));
        if came { Ok(()) } else { Err(ErrorKind::Other) }
    }
}

impl<Unit> ErrorType for Bus<Unit> {
    type Error = ErrorKind;
}

impl<Unit: Deref<Target = RegisterBlock>> SpiBus for Bus<Unit> {
    fn read(&mut self, words: &mut [u8]) -> Result<(), ErrorKind> {
        words.fill(0);
        self.transfer_in_place(words)
    }

    fn write(&mut self, words: &[u8]) -> Result<(), ErrorKind> {
        for word in words {
            self.exchange(*word)?;
        }
        Ok(())
    }

    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), ErrorKind> {
        let mut outgoing = write.iter();
        let mut incoming = read.iter_mut();
        loop {
            let (to_send, place) = (outgoing.next(), incoming.next());
            if to_send.is_none() && place.is_none() {
                return Ok(());
            }
            let received = self.exchange(to_send.copied().unwrap_or(0))?;
            if let Some(place) = place {
                *place = received;
            }
        }
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), ErrorKind> {
        for word in words {
            *word = self.exchange(*word)?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.wait(|unit| unit.sr().read().bsy().bit_is_clear())
    }
}

/// A converter alone on its bus.
pub type Device<Unit, Select> = ExclusiveDevice<Bus<Unit>, Select, CoreDelay>;

/// Waits by counting the core's cycles.
#[derive(Clone, Copy, Debug)]
pub struct CoreDelay {
    /// Rounded up.
    cycles_per_us: u32,
}

impl CoreDelay {
    /// For a core at this clock.
    pub fn new(core_hz: u32) -> Self {
        Self {
            cycles_per_us: core_hz.div_ceil(1_000_000),
        }
    }
}

impl DelayNs for CoreDelay {
    fn delay_ns(&mut self, nanoseconds: u32) {
        let microseconds = nanoseconds.div_ceil(1_000);
        cortex_m::asm::delay(microseconds.saturating_mul(self.cycles_per_us));
    }
}
