//! Clocks: 168 MHz from the 8 MHz crystal; if crystal or PLL do not come within a
//! bounded time, the internal 16 MHz oscillator, and a fault to report.
//!
//! | clock | from the crystal | without it |
//! |---|---:|---:|
//! | core, AHB | 168 MHz | 16 MHz |
//! | APB1: SPI2, SPI3, DAC (timers twice that) | 42 MHz | 8 MHz |
//! | APB2: USART1, ADC (ADC a quarter of that) | 84 MHz | 16 MHz |
//!
//! Figures, to be checked against the sheets, which were not at hand: the chip's
//! reference manual RM0090 on wait states, voltage scale and clocks; its data
//! sheet DS8626 on start-up times.
//!
//! A unit's clock is switched on by the HAL's `Enable` everywhere on this board: it ends with a
//! barrier, without which the first writes to the unit may be lost (errata ES0182, "Delay after
//! an RCC peripheral clock enabling").

use stm32f4xx_hal::pac::rcc::cfgr::{PPRE1, SW};
use stm32f4xx_hal::pac::rcc::pllcfgr::{PLLP, PLLSRC};
use stm32f4xx_hal::pac::{FLASH, PWR, RCC};
use stm32f4xx_hal::rcc::Enable;

/// The internal oscillator, on which the chip leaves reset.
const INTERNAL_HZ: u32 = 16_000_000;
/// The PLL: 8 MHz / 8 * 336 = 336 MHz, / 2 = 168 MHz; / 7 = 48 MHz is unused.
const PLL_DIVIDER: u8 = 8;
const PLL_FACTOR: u16 = 336;
const PLL_48_MHZ_DIVIDER: u8 = 7;
const CORE_HZ: u32 = 168_000_000;

/// Looks at a flag before it counts as never coming. At 16 MHz a look takes at
/// least 5 cycles, so this is more than 30 ms; a crystal takes 2 ms, the PLL
/// 0.3 ms.
const LOOKS: u32 = 100_000;

/// Why the chip runs on its internal oscillator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClockFault {
    /// The crystal does not swing.
    Crystal = 1,
    /// The PLL does not lock, or the core does not change over to it.
    Pll = 2,
}

/// The clocks that really run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Core, Hz.
    pub core_hz: u32,
    /// APB2, of USART1, Hz.
    pub apb2_hz: u32,
    /// Timers of APB1, of TIM2, Hz.
    pub apb1_timers_hz: u32,
    /// What kept the chip from its 168 MHz.
    pub fault: Option<ClockFault>,
}

/// Starts the clocks; in any case returns within half a second, a time for which
/// the watchdog must be told to wait.
pub fn start(rcc: &mut RCC, flash: &FLASH, power: &PWR) -> Clocks {
    let fault = start_crystal(rcc)
        .and_then(|()| start_pll(rcc, power))
        .and_then(|()| change_over(rcc, flash))
        .err();
    match fault {
        None => Clocks {
            core_hz: CORE_HZ,
            apb2_hz: CORE_HZ / 2,
            apb1_timers_hz: CORE_HZ / 2,
            fault,
        },
        Some(_) => {
            stay_internal(rcc);
            Clocks {
                core_hz: INTERNAL_HZ,
                apb2_hz: INTERNAL_HZ,
                apb1_timers_hz: INTERNAL_HZ,
                fault,
            }
        }
    }
}

/// The crystal, watched from then on: if it stops, the chip changes to the
/// internal oscillator and raises the non-maskable interrupt.
fn start_crystal(rcc: &RCC) -> Result<(), ClockFault> {
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    wait(
        || rcc.cr().read().hserdy().bit_is_set(),
        ClockFault::Crystal,
    )?;
    rcc.cr().modify(|_, w| w.csson().set_bit());
    Ok(())
}

fn start_pll(rcc: &mut RCC, power: &PWR) -> Result<(), ClockFault> {
    PWR::enable(rcc);
    // Scale 1, the only one for more than 144 MHz.
    power.cr().modify(|_, w| w.vos().set_bit());
    rcc.pllcfgr().write(|w| {
        w.pllsrc().variant(PLLSRC::Hse).pllp().variant(PLLP::Div2);
        // SAFETY: the factors are within the fields and the PLL's limits: 1 MHz
        // in (1..2), 336 MHz inside (100..432), 168 MHz out.
        unsafe {
            w.pllm().bits(PLL_DIVIDER);
            w.plln().bits(PLL_FACTOR);
            w.pllq().bits(PLL_48_MHZ_DIVIDER)
        }
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    wait(|| rcc.cr().read().pllrdy().bit_is_set(), ClockFault::Pll)
}

/// Flash and buses are slowed down before the core becomes fast.
fn change_over(rcc: &RCC, flash: &FLASH) -> Result<(), ClockFault> {
    // Five wait states: 168 MHz at 2.7 to 3.6 V. Caches and prefetch hide them.
    flash.acr().modify(|_, w| {
        w.latency().ws5();
        w.prften().set_bit().icen().set_bit().dcen().set_bit()
    });
    wait(|| flash.acr().read().latency().is_ws5(), ClockFault::Pll)?;
    rcc.cfgr().modify(|_, w| {
        w.ppre1().variant(PPRE1::Div4);
        w.ppre2().variant(PPRE1::Div2)
    });
    rcc.cfgr().modify(|_, w| w.sw().variant(SW::Pll));
    wait(|| rcc.cfgr().read().sws().is_pll(), ClockFault::Pll)
}

/// Back to the internal oscillator, on which the chip may still be.
fn stay_internal(rcc: &RCC) {
    rcc.cfgr().modify(|_, w| w.sw().variant(SW::Hsi));
    rcc.cfgr().modify(|_, w| {
        // APB1 at half: SPI and DAC then keep within the limits of 168 MHz.
        w.ppre1().variant(PPRE1::Div2);
        w.ppre2().variant(PPRE1::Div1)
    });
    rcc.cr().modify(|_, w| {
        w.pllon().clear_bit();
        w.csson().clear_bit().hseon().clear_bit()
    });
}

fn wait(is_ready: impl Fn() -> bool, fault: ClockFault) -> Result<(), ClockFault> {
    let came = (0..LOOKS).any(|_| is_ready());
    if came { Ok(()) } else { Err(fault) }
}
