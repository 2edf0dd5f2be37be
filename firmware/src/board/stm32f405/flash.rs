//! The two slots of settings: sectors 2 and 3 of the flash, 16 KiB each, which
//! `memory.x` keeps free of program.
//!
//! The core runs from the same flash and stands still while it is written: 16 us
//! for a word, half a second for a sector. Sectors are therefore erased at the
//! start only, with a watchdog that knows.

use super::watchdog;
use core::slice;
use firmware::settings::slots::{Slot, SlotStorage, StorageFault};
use stm32f4xx_hal::pac::FLASH;
use stm32f4xx_hal::pac::flash::cr::PSIZE;

const SLOT_BYTES: usize = 16 * 1024;
/// Unlocks the control register: RM0090, embedded flash.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// Looks at a flag before the flash counts as stuck: where the core can go on
/// looking from its cache, this is more than 0.9 s, and a sector takes 0.5 s.
const LOOKS: u32 = 30_000_000;

unsafe extern "C" {
    static _settings_slot_0: [u8; SLOT_BYTES];
    static _settings_slot_1: [u8; SLOT_BYTES];
}

/// Both slots.
pub struct Flash {
    registers: FLASH,
}

impl Flash {
    /// The slots, as they are.
    pub fn new(registers: FLASH) -> Self {
        Self { registers }
    }

    /// Does `work` with the control register unlocked, and locks it whatever comes.
    fn unlocked(
        &self,
        work: impl FnOnce() -> Result<(), StorageFault>,
    ) -> Result<(), StorageFault> {
        // An error of earlier, of whoever it was, is none of this work.
        let _earlier = self.wait();
        for key in KEYS {
            self.registers.keyr().write(|w| w.key().set(key));
        }
        // A key out of turn locks the register until the next reset.
        let is_unlocked = self.registers.cr().read().lock().bit_is_clear();
        let result = if is_unlocked {
            work()
        } else {
            Err(StorageFault)
        };
        self.registers.cr().write(|w| w.lock().set_bit());
        result
    }

    /// Until what was begun has ended; errors are cleared and told.
    fn wait(&self) -> Result<(), StorageFault> {
        let has_ended = (0..LOOKS).any(|_| self.registers.sr().read().bsy().bit_is_clear());
        let flags = self.registers.sr().read();
        self.registers.sr().write(|w| {
            w.pgserr().clear_bit_by_one().pgperr().clear_bit_by_one();
            w.pgaerr().clear_bit_by_one().wrperr().clear_bit_by_one();
            w.eop().clear_bit_by_one()
        });
        let has_failed = flags.pgserr().bit_is_set()
            || flags.pgperr().bit_is_set()
            || flags.pgaerr().bit_is_set()
            || flags.wrperr().bit_is_set();
        if has_ended && !has_failed {
            Ok(())
        } else {
            Err(StorageFault)
        }
    }

    fn erase_sector(&self, sector: u8) -> Result<(), StorageFault> {
        // Chosen first, started then: RM0090, sector erase. A write begins from the value of
        // reset, in which LOCK is set.
        self.registers.cr().write(|w| {
            w.lock().clear_bit();
            w.psize().variant(PSIZE::Psize32).ser().set_bit();
            // SAFETY: the caller's sectors hold settings only.
            unsafe { w.snb().bits(sector) }
        });
        self.registers.cr().modify(|_, w| w.strt().set_bit());
        let result = self.wait();
        self.forget_cached();
        result
    }

    /// The data cache may hold what was there before.
    fn forget_cached(&self) {
        let access = self.registers.acr();
        let is_on = access.read().dcen().bit();
        access.modify(|_, w| w.dcen().clear_bit());
        access.modify(|_, w| w.dcrst().set_bit());
        access.modify(|_, w| w.dcrst().clear_bit());
        access.modify(|_, w| w.dcen().bit(is_on));
    }
}

fn place(slot: Slot) -> *const u8 {
    match slot {
        Slot::First => (&raw const _settings_slot_0).cast(),
        Slot::Second => (&raw const _settings_slot_1).cast(),
    }
}

impl SlotStorage for Flash {
    fn bytes(&self, slot: Slot) -> &[u8] {
        // SAFETY: `memory.x` sets these bytes of flash aside; they change only
        // through `&mut self`, for which this borrow must have ended.
        unsafe { slice::from_raw_parts(place(slot), SLOT_BYTES) }
    }

    fn erase(&mut self, slot: Slot) -> Result<(), StorageFault> {
        let sector = match slot {
            Slot::First => 2,
            Slot::Second => 3,
        };
        watchdog::patiently(|| self.unlocked(|| self.erase_sector(sector)))
    }

    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StorageFault> {
        let fits = offset
            .checked_add(bytes.len())
            .is_some_and(|end| end <= SLOT_BYTES);
        let (words, rest) = bytes.as_chunks::<4>();
        if !fits || !offset.is_multiple_of(4) || !rest.is_empty() {
            return Err(StorageFault);
        }
        let first = place(slot).wrapping_add(offset).cast::<u32>().cast_mut();
        self.unlocked(|| {
            self.registers.cr().write(|w| {
                w.lock().clear_bit();
                w.psize().variant(PSIZE::Psize32).pg().set_bit()
            });
            for (number, word) in words.iter().enumerate() {
                // SAFETY: an aligned word within the slot, see above; the flash
                // takes the write because it is set up to program.
                unsafe { first.add(number).write_volatile(u32::from_le_bytes(*word)) };
                self.wait()?;
            }
            Ok(())
        })?;
        self.forget_cached();
        Ok(())
    }
}
