//! Why the chip started.

use firmware::start::ResetCause;
use stm32f4xx_hal::pac::RCC;

/// Reads the cause and clears it for the next time.
///
/// Every cause inside the chip also pulls the reset pin, so that the pin counts
/// only where nothing else does; power-up raises the brown-out flag as well.
pub fn take(rcc: &RCC) -> ResetCause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    if flags.porrstf().bit_is_set() {
        ResetCause::PowerOn
    } else if flags.borrstf().bit_is_set() {
        ResetCause::BrownOut
    } else if flags.wdgrstf().bit_is_set() {
        ResetCause::Watchdog
    } else if flags.sftrstf().bit_is_set() {
        ResetCause::Software
    } else if flags.padrstf().bit_is_set() {
        ResetCause::Pin
    } else {
        ResetCause::Unknown
    }
}
