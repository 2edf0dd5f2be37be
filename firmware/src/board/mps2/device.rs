//! The machine's interrupts, under the names that the application binds.
//!
//! Lines: Arm, "Application Note AN386", interrupt assignments. The serial line
//! is UART 0; what the STM32F405 has and this machine has not is raised by
//! software, on lines of the second GPIO port, which nothing drives.
#![expect(unsafe_code, reason = "the vector table")]
#![allow(non_camel_case_types, reason = "names of the STM32F405's data sheet")]

/// Bits of an interrupt's priority: AN386's Cortex-M4 has 3. QEMU compares 8,
/// of which the 3 are the upper ones.
pub const NVIC_PRIO_BITS: u8 = 3;

/// Interrupts, with their lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Interrupt {
    /// UART 0 has received a byte.
    USART1 = 0,
    /// A sample is complete.
    DMA2_STREAM0 = 17,
    /// The supervisor is due.
    TIM7 = 18,
    /// There is something to transmit.
    UART5 = 19,
}

pub use Interrupt as interrupt;

// SAFETY: every variant is the number of a line that the machine has.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

unsafe extern "C" {
    fn USART1();
    fn DMA2_STREAM0();
    fn TIM7();
    fn UART5();
    fn DefaultHandler();
}

type Handler = unsafe extern "C" fn();

/// The vector table behind the processor's own exceptions.
// SAFETY: the start-up code's linker script expects handlers in this section,
// under this name.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Handler; 32] = {
    let mut handlers: [Handler; 32] = [DefaultHandler; 32];
    handlers[Interrupt::USART1 as usize] = USART1;
    handlers[Interrupt::DMA2_STREAM0 as usize] = DMA2_STREAM0;
    handlers[Interrupt::TIM7 as usize] = TIM7;
    handlers[Interrupt::UART5 as usize] = UART5;
    handlers
};
