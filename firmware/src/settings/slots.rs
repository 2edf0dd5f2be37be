//! Two places for the settings, one of which is always whole.
//!
//! A new record goes to the slot that does not hold the newest one, its content
//! before its header; it counts once its CRC holds. Whenever the power goes, the
//! slot with the newest sound record has not been touched, or the new one is
//! complete. That slot's turn to be erased comes at the next start, before the
//! control begins: erasing a sector of flash stops the processor for up to half
//! a second (16 KiB; to be checked against the STM32F405's data sheet), no time to take from a control loop
//! with a watchdog. Hence one storing between two starts; programming a word
//! stops the processor for 16 us only.

use super::field::SettingsFault;
use super::parameters::{Settings, Wiring};
use super::record::{
    ERASED, HEADER_BYTES, LONGEST_RECORD, RecordFault, Stored, decode, header, sequence_of,
};
use crate::fault::{Fault, Finding};
use model_core::controller::Controller;

/// Records are programmed in whole pieces of this many bytes, at multiples of
/// it: the widest that flash controllers want.
pub const PROGRAM_UNIT_BYTES: usize = 8;

/// One of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The one that an image is flashed with.
    First,
    /// The other.
    Second,
}

impl Slot {
    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// The storage refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StorageFault;

/// Memory that keeps two slots without power. Implemented by the boards.
pub trait SlotStorage {
    /// The bytes of a slot, at least [`LONGEST_RECORD`] rounded up to
    /// [`PROGRAM_UNIT_BYTES`]; erased ones read 0xFF.
    fn bytes(&self, slot: Slot) -> &[u8];
    /// Erases a slot. It may stop the processor for a second: see the module.
    fn erase(&mut self, slot: Slot) -> Result<(), StorageFault>;
    /// Programs erased bytes; `offset` and length are multiples of
    /// [`PROGRAM_UNIT_BYTES`].
    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StorageFault>;
}

/// Why settings were not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreFault {
    /// The spare slot was used since the start: it is erased at the next one.
    NotErased,
    /// The storage refused, or what was written does not read back.
    Storage,
}

/// Where the settings in use come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// From this slot.
    Slot(Slot),
    /// From this slot, and the other one holds a newer record with this fault: not the settings
    /// that somebody stored last.
    Older(Slot, RecordFault),
    /// Built in: both slots are blank, as on a board fresh from the flasher.
    NeverSet,
    /// Built in: no slot holds a sound record, and this is what is wrong.
    Damaged(RecordFault),
    /// Built in: the newest record is sound but makes no controller.
    Impossible(SettingsFault),
}

impl Origin {
    /// The fault at the start: none on a board that was never set, whose status
    /// tells of its built-in settings.
    pub fn finding(&self) -> Option<Finding> {
        match self {
            Self::Slot(_) | Self::NeverSet => None,
            Self::Damaged(_) => Some(Fault::SettingsDamaged.at(0)),
            Self::Older(..) => Some(Fault::SettingsDamaged.at(1)),
            Self::Impossible(_) => Some(Fault::SettingsImpossible.at(0)),
        }
    }

    /// Whether the settings are those of this rig.
    pub fn is_of_this_rig(&self) -> bool {
        matches!(self, Self::Slot(_) | Self::Older(..))
    }
}

/// What a board starts with.
#[derive(Clone, Debug)]
pub struct Start {
    /// The controller.
    pub controller: Controller<f32>,
    /// Where its settings come from.
    pub origin: Origin,
    /// What they say of the wiring: unchecked unless they are the ones stored last.
    pub wiring: Wiring,
}

/// The two slots.
#[derive(Debug)]
pub struct Slots<S> {
    storage: S,
    /// Holds the newest sound record.
    newest: Option<(Slot, u32)>,
}

impl<S: SlotStorage> Slots<S> {
    /// Reads both slots and builds the controller for ticks of `dt_s` from the
    /// newest sound record, or else from the built-in settings. An error only
    /// if `dt_s` is no period of a tick.
    pub fn start(storage: S, dt_s: f32) -> Result<(Self, Start), SettingsFault> {
        let mut slots = Self {
            storage,
            newest: None,
        };
        let mut wiring = Wiring::Unchecked;
        let (built, origin) = match slots.find_newest() {
            Ok((slot, stored)) => {
                slots.newest = Some((slot, stored.sequence));
                wiring = stored.settings.wiring;
                match stored.settings.try_build(dt_s) {
                    Err(fault) => (built_in(dt_s), Origin::Impossible(fault)),
                    built => (built, slots.origin(slot, stored.sequence)),
                }
            }
            Err(RecordFault::Blank) => (built_in(dt_s), Origin::NeverSet),
            Err(fault) => (built_in(dt_s), Origin::Damaged(fault)),
        };
        let start = Start {
            controller: built?,
            origin,
            wiring: match origin {
                Origin::Slot(_) => wiring,
                _ => Wiring::Unchecked,
            },
        };
        Ok((slots, start))
    }

    /// Erases the spare slot unless it is blank. For the start, before the
    /// control begins: see the module.
    pub fn prepare(&mut self) -> Result<(), StorageFault> {
        let spare = self.spare();
        if is_blank(self.storage.bytes(spare)) {
            return Ok(());
        }
        self.storage.erase(spare)
    }

    /// Stores the content of a record in the spare slot, from where the next
    /// start takes it.
    pub fn store(&mut self, content: &[u8]) -> Result<(), StoreFault> {
        let spare = self.spare();
        let sequence = self.newest.map_or(1, |(_, newest)| newest.wrapping_add(1));
        let header = header(sequence, content).ok_or(StoreFault::Storage)?;
        if !is_blank(self.storage.bytes(spare)) {
            return Err(StoreFault::NotErased);
        }
        self.program(spare, HEADER_BYTES, content)?;
        self.program(spare, 0, &header)?;
        let written = self.storage.bytes(spare).split_first_chunk();
        if !written.is_some_and(|(first, rest)| *first == header && rest.starts_with(content)) {
            return Err(StoreFault::Storage);
        }
        self.newest = Some((spare, sequence));
        Ok(())
    }

    /// The storage, given back.
    pub fn into_storage(self) -> S {
        self.storage
    }

    /// Programs whole units; the last is filled up with the erased value.
    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StoreFault> {
        let mut place = offset;
        for piece in bytes.chunks(PROGRAM_UNIT_BYTES) {
            let mut unit = [ERASED; PROGRAM_UNIT_BYTES];
            unit.iter_mut()
                .zip(piece)
                .for_each(|(byte, wanted)| *byte = *wanted);
            self.storage
                .program(slot, place, &unit)
                .map_err(|StorageFault| StoreFault::Storage)?;
            place += PROGRAM_UNIT_BYTES;
        }
        Ok(())
    }

    /// Where the next record goes.
    fn spare(&self) -> Slot {
        self.newest.map_or(Slot::First, |(slot, _)| slot.other())
    }

    /// Where sound settings come from: whether the other slot holds a newer record that is not.
    fn origin(&self, slot: Slot, sequence: u32) -> Origin {
        let other = self.storage.bytes(slot.other());
        let is_overtaken = sequence_of(other).is_some_and(|newer| is_newer(newer, sequence));
        match decode(other) {
            Err(fault) if is_overtaken => Origin::Older(slot, fault),
            _ => Origin::Slot(slot),
        }
    }

    /// The newest sound record; where there is none, what is wrong with the
    /// slot that is not blank.
    fn find_newest(&self) -> Result<(Slot, Stored), RecordFault> {
        let read = |slot| decode(self.storage.bytes(slot)).map(|stored| (slot, stored));
        match (read(Slot::First), read(Slot::Second)) {
            (Ok(first), Ok(second)) if is_newer(second.1.sequence, first.1.sequence) => Ok(second),
            (Ok(first), _) => Ok(first),
            (Err(_), Ok(second)) => Ok(second),
            (Err(RecordFault::Blank), Err(fault)) | (Err(fault), Err(_)) => Err(fault),
        }
    }
}

/// Sequence numbers go round: the newer one is less than half a turn ahead.
fn is_newer(one: u32, other: u32) -> bool {
    let ahead = one.wrapping_sub(other);
    ahead != 0 && ahead < u32::MAX / 2
}

fn is_blank(bytes: &[u8]) -> bool {
    bytes
        .iter()
        .take(LONGEST_RECORD)
        .all(|byte| *byte == ERASED)
}

fn built_in(dt_s: f32) -> Result<Controller<f32>, SettingsFault> {
    Settings::built_in().try_build(dt_s)
}
