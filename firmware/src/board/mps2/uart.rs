//! UART 0: Arm, "Cortex-M System Design Kit", APB UART.
#![expect(unsafe_code, reason = "registers")]

use crate::board::{SerialIn, SerialOut};
use core::ptr::{read_volatile, write_volatile};

const BASE: usize = 0x4000_4000;
const DATA: *mut u32 = BASE as *mut u32;
const STATE: *const u32 = (BASE + 0x4) as *const u32;
const CONTROL: *mut u32 = (BASE + 0x8) as *mut u32;
const INTERRUPT_CLEAR: *mut u32 = (BASE + 0xC) as *mut u32;
const BAUD_DIVIDER: *mut u32 = (BASE + 0x10) as *mut u32;

const STATE_TRANSMIT_FULL: u32 = 1 << 0;
const CONTROL_TRANSMIT: u32 = 1 << 0;
const CONTROL_RECEIVE: u32 = 1 << 1;
const CONTROL_RECEIVE_INTERRUPT: u32 = 1 << 3;
const INTERRUPT_RECEIVE: u32 = 1 << 1;
/// The smallest that the data sheet allows; QEMU transmits at once.
const SMALLEST_DIVIDER: u32 = 16;

/// Switches the line on.
pub fn start() -> (Receiver, Transmitter) {
    // SAFETY: called once, before interrupts; these are UART 0's registers.
    unsafe {
        write_volatile(BAUD_DIVIDER, SMALLEST_DIVIDER);
        let control = CONTROL_TRANSMIT | CONTROL_RECEIVE | CONTROL_RECEIVE_INTERRUPT;
        write_volatile(CONTROL, control);
    }
    (Receiver(()), Transmitter(()))
}

/// Inwards.
pub struct Receiver(());

impl SerialIn for Receiver {
    fn byte(&mut self) -> Option<u8> {
        // SAFETY: UART 0's registers; reading data and clearing the receive
        // interrupt is this type's alone. Cleared first: a byte that comes after
        // the reading raises it anew.
        unsafe {
            write_volatile(INTERRUPT_CLEAR, INTERRUPT_RECEIVE);
            let [byte, ..] = read_volatile(DATA).to_le_bytes();
            Some(byte)
        }
    }
}

/// Outwards.
pub struct Transmitter(());

impl SerialOut for Transmitter {
    fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            // SAFETY: UART 0's registers; writing data is this type's alone.
            unsafe {
                while read_volatile(STATE) & STATE_TRANSMIT_FULL != 0 {}
                write_volatile(DATA, u32::from(*byte));
            }
        }
    }
}
