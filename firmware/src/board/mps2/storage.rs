//! The two slots of settings: ordinary memory here, filled by QEMU before the
//! start where a rig was named.
#![expect(unsafe_code, reason = "memory that the linker script sets aside")]

use core::ptr::{addr_of, addr_of_mut};
use core::slice;
use firmware::settings::record::{ERASED, LONGEST_RECORD};
use firmware::settings::slots::{Slot, SlotStorage, StorageFault};

/// As large as the STM32F405's sectors; link.x says the same.
const SLOT_BYTES: usize = 16 * 1024;

unsafe extern "C" {
    static mut _settings_slot_0: [u8; SLOT_BYTES];
    static mut _settings_slot_1: [u8; SLOT_BYTES];
}

/// Both slots; there is one value of it.
pub struct Memory(());

impl Memory {
    /// The slots; what QEMU has not filled of one is erased. Called once.
    pub fn start() -> Self {
        let mut memory = Self(());
        for slot in [Slot::First, Slot::Second] {
            // Memory begins as noughts, which flash does not.
            let (record, behind) = memory.bytes_mut(slot).split_at_mut(LONGEST_RECORD);
            for part in [record, behind] {
                if part.iter().all(|byte| *byte == 0) {
                    part.fill(ERASED);
                }
            }
        }
        memory
    }

    fn bytes_mut(&mut self, slot: Slot) -> &mut [u8] {
        let first = match slot {
            Slot::First => addr_of_mut!(_settings_slot_0),
            Slot::Second => addr_of_mut!(_settings_slot_1),
        };
        // SAFETY: the linker script sets these bytes aside, nothing else uses
        // them, and the only value of this type is borrowed for as long.
        unsafe { slice::from_raw_parts_mut(first.cast(), SLOT_BYTES) }
    }
}

impl SlotStorage for Memory {
    fn bytes(&self, slot: Slot) -> &[u8] {
        let first = match slot {
            Slot::First => addr_of!(_settings_slot_0),
            Slot::Second => addr_of!(_settings_slot_1),
        };
        // SAFETY: as above.
        unsafe { slice::from_raw_parts(first.cast(), SLOT_BYTES) }
    }

    fn erase(&mut self, slot: Slot) -> Result<(), StorageFault> {
        self.bytes_mut(slot).fill(ERASED);
        Ok(())
    }

    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StorageFault> {
        let place = self.bytes_mut(slot).get_mut(offset..);
        let place = place.and_then(|place| place.get_mut(..bytes.len()));
        place.ok_or(StorageFault)?.copy_from_slice(bytes);
        Ok(())
    }
}
