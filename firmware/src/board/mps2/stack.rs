//! How much of the stack has been used: the start-up code has painted it.
#![expect(unsafe_code, reason = "reads memory that belongs to nobody")]

use core::ptr::{addr_of, read_volatile};
use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// The most bytes that the stack has held since the start.
pub fn most_used_bytes() -> u32 {
    let (mut word, top) = (addr_of!(_stack_end), addr_of!(_stack_start));
    // SAFETY: between the two lies the stack's memory, all of it, aligned; words
    // below the deepest use still hold the paint.
    while word < top && unsafe { read_volatile(word) } == STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    (top as u32).wrapping_sub(word as u32)
}
