//! Independent watchdog, with its own oscillator: once started, only a reset
//! stops it.
//!
//! The oscillator runs at 17 to 47 kHz (to be checked against the data sheet, DS8626), 32 kHz nominal: all
//! times of the watchdog may be 0.68 to 1.9 times the nominal.

use stm32f4xx_hal::pac::IWDG;
use stm32f4xx_hal::pac::iwdg::RegisterBlock;

/// The oscillator divided by 16: 2 kHz nominal.
const PRESCALER: u8 = 2;
/// 100 ms nominal, 68 ms at least: six periods of the supervisor.
const USUAL: u16 = 200;
/// 2 s nominal, 1.36 s at least: erasing a sector of 16 KiB holds the core, which
/// runs from the flash, for 0.5 s, 0.8 s at worst.
const PATIENT: u16 = 4_000;
/// Looks at a flag before it counts as never coming: an update takes five
/// periods, 0.3 ms at worst, which are 50 000 cycles; a look at least 5.
const LOOKS: u32 = 10_000;

/// The running watchdog.
pub struct Watchdog {
    registers: IWDG,
}

impl Watchdog {
    /// Starts it, for good, with the patience that the start of the board needs.
    pub fn start(registers: IWDG) -> Self {
        registers.kr().write(|w| w.key().start());
        set(&registers, PATIENT);
        Self { registers }
    }

    /// The start is over.
    pub fn end_patience(&self) {
        set(&self.registers, USUAL);
    }
}

/// Does what holds the core for longer than the watchdog usually bears.
pub fn patiently<Result>(work: impl FnOnce() -> Result) -> Result {
    // SAFETY: settings arrive as a whole, and only the start of the board and
    // who stores settings make them, one after the other.
    let registers = unsafe { &*IWDG::ptr() };
    set(registers, PATIENT);
    let result = work();
    set(registers, USUAL);
    result
}

/// Periods of 0.5 ms nominal until the reset.
fn set(registers: &RegisterBlock, periods: u16) {
    wait(registers);
    registers.kr().write(|w| w.key().unlock());
    registers.pr().write(|w| w.pr().set(PRESCALER));
    registers.rlr().write(|w| w.rl().set(periods));
    wait(registers);
    registers.kr().write(|w| w.key().feed());
}

/// Until earlier settings have arrived. If they never do, the watchdog keeps
/// what it had and resets the chip: the safe side.
fn wait(registers: &RegisterBlock) {
    let _came = (0..LOOKS).any(|_| registers.sr().read().bits() == 0);
}

impl super::super::Watchdog for Watchdog {
    fn feed(&mut self) {
        self.registers.kr().write(|w| w.key().feed());
    }
}
