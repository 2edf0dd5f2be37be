//! USART1 on PA9 and PA10: 921600 bit/s, 8N1.
//!
//! From 84 MHz the rate is 0.2 % too high; from the internal oscillator's 16 MHz
//! it is 2.1 % too high, 1 % more or less: half a bit in ten is what a receiver
//! bears, so that a board without its crystal still tells its fault. What comes in, DMA2 stream 5 puts into a ring:
//! the control task, which may hold the receiving task for longer than a byte
//! takes (11 us), costs none.

use super::super::{SerialIn, SerialOut};
use core::sync::atomic::{AtomicU8, Ordering::Relaxed};
use stm32f4xx_hal::pac::{DMA2, Interrupt, RCC, USART1, dma2, usart1};
use stm32f4xx_hal::rcc::Enable;

/// Bits a second.
pub const BAUD: u32 = 921_600;
/// Bytes that may wait: 2.8 ms of a line that never rests, and a tick looks at
/// least every millisecond.
const RING_BYTES: usize = 256;
/// DMA2's stream and channel of the receiver: RM0090, DMA2 request mapping.
const STREAM: usize = 5;
const CHANNEL: u8 = 4;
/// Looks at a flag before it counts as never coming: a byte takes 1823 cycles of
/// the core, a look at least 5.
const LOOKS: u32 = 2_000;

static RING: [AtomicU8; RING_BYTES] = [const { AtomicU8::new(0) }; RING_BYTES];

/// Sets the line up; `clock_hz` is that of APB2, DMA2 and the pins are ready.
pub fn start(rcc: &mut RCC, usart: USART1, clock_hz: u32) -> (Receiver, Transmitter) {
    USART1::enable(rcc);
    DMA2::enable(rcc);
    let divider = (clock_hz + BAUD / 2) / BAUD;
    usart.brr().write(|w| {
        w.div_mantissa().set((divider >> 4) as u16 & 0x0FFF);
        w.div_fraction().set((divider & 0xF) as u8)
    });
    usart.cr3().write(|w| w.dmar().set_bit());
    fill_ring(stream(), usart.dr().as_ptr() as u32);
    usart.cr1().write(|w| {
        w.te().set_bit().re().set_bit();
        w.idleie().set_bit().ue().set_bit()
    });
    (Receiver { taken: 0 }, Transmitter { usart })
}

fn fill_ring(stream: &dma2::ST, data_register: u32) {
    stream.ndtr().write(|w| w.ndt().set(RING_BYTES as u16));
    // SAFETY: the stream writes `RING_BYTES` bytes from the line's data register
    // into a static of as many atomic bytes.
    unsafe {
        stream.par().write(|w| w.bits(data_register));
        stream.m0ar().write(|w| w.bits(RING.as_ptr() as u32));
    }
    stream.cr().write(|w| {
        w.chsel().set(CHANNEL).minc().set_bit().circ().set_bit();
        w.en().set_bit()
    });
}

fn stream() -> &'static dma2::ST {
    // SAFETY: this stream's registers are this module's alone.
    unsafe { (*DMA2::ptr()).st(STREAM) }
}

fn line() -> &'static usart1::RegisterBlock {
    // SAFETY: the receiver reads the status and data registers only; the
    // transmitter, which owns the unit, does not read what comes in.
    unsafe { &*USART1::ptr() }
}

/// What comes in.
pub struct Receiver {
    /// Place in the ring of the next byte to take.
    taken: usize,
}

impl SerialIn for Receiver {
    fn byte(&mut self) -> Option<u8> {
        if self.arrived() == self.taken {
            acknowledge_pause();
            return None;
        }
        let byte = RING.get(self.taken)?.load(Relaxed);
        self.taken = (self.taken + 1) % RING_BYTES;
        // The next byte is the next interrupt's; one too many finds none.
        rtic::pend(Interrupt::USART1);
        Some(byte)
    }
}

impl Receiver {
    /// Place in the ring that the DMA fills next.
    fn arrived(&self) -> usize {
        let left = usize::from(stream().ndtr().read().ndt().bits());
        RING_BYTES.wrapping_sub(left) % RING_BYTES
    }
}

/// The interrupt of a line that pauses after a frame: reading status, then data
/// clears it, and nothing is lost, since the DMA has taken the data before.
fn acknowledge_pause() {
    if line().sr().read().idle().bit_is_set() {
        let _nothing = line().dr().read();
    }
}

/// What goes out.
pub struct Transmitter {
    usart: USART1,
}

impl SerialOut for Transmitter {
    fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let _came = (0..LOOKS).any(|_| self.usart.sr().read().txe().bit_is_set());
            self.usart.dr().write(|w| w.dr().set(u16::from(*byte)));
        }
    }
}
