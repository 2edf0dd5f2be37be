//! Exceptions of the processor: the cause is kept, and the board gives up.
#![expect(unsafe_code, reason = "the processor enters here")]

use super::{Board, Chosen, keep, keep_crash};
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use firmware::crash::Crash;
use firmware::start::EXCEPTION;

// SAFETY: entered by the processor alone; nothing of the program goes on after it.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    Chosen::isolate_valve();
    keep_crash(Crash {
        pc: frame.pc(),
        lr: frame.lr(),
        // SAFETY: a register of the processor, read only.
        cfsr: unsafe { (*SCB::PTR).cfsr.read() },
        ..Crash::default()
    });
    keep(EXCEPTION);
    Chosen::give_up()
}

// SAFETY: as above; no interrupt that has no task is ever enabled.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    keep(EXCEPTION);
    Chosen::give_up()
}
