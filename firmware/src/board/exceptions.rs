//! Exceptions of the processor: the cause is kept, and the board gives up.
#![expect(unsafe_code, reason = "the processor enters here")]

use super::{Board, Chosen, keep};
use cortex_m_rt::{ExceptionFrame, exception};
use firmware::start::EXCEPTION;

// SAFETY: entered by the processor alone; nothing of the program goes on after it.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    keep(EXCEPTION);
    Chosen::give_up()
}

// SAFETY: as above; no interrupt that has no task is ever enabled.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    keep(EXCEPTION);
    Chosen::give_up()
}
