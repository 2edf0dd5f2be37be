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
//!
//! Behind the record a slot has room for a mark: what the record knows of the wiring
//! is void. It is programmed when a fault of the wiring showed, and stays until new
//! settings are stored.

use super::field::SettingsFault;
use super::parameters::{Connection, Settings, Wiring};
use super::record::{
    ERASED, HEADER_BYTES, LONGEST_RECORD, RecordFault, decode, header, sequence_of,
};
use crate::fault::{Fault, Finding};
use model_core::controller::Controller;

/// Records are programmed in whole pieces of this many bytes, at multiples of
/// it: the widest that flash controllers want.
pub const PROGRAM_UNIT_BYTES: usize = 8;
/// Where the mark stands that the wiring is unchecked again.
const VOID_AT: usize = LONGEST_RECORD.next_multiple_of(PROGRAM_UNIT_BYTES);
/// Neither erased nor nought. Power that goes while it is programmed leaves some of it: anything
/// that is not erased counts.
const VOID: [u8; PROGRAM_UNIT_BYTES] = [0x5A; PROGRAM_UNIT_BYTES];
/// What a slot needs.
pub const LEAST_SLOT_BYTES: usize = VOID_AT + PROGRAM_UNIT_BYTES;

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
    /// The bytes of a slot, at least [`LEAST_SLOT_BYTES`]; erased ones read 0xFF.
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
    /// The settings; those built in where there are none of this rig.
    pub settings: Settings,
    /// Where they come from.
    pub origin: Origin,
    /// A fault of the wiring showed since they were stored.
    pub is_wiring_void: bool,
}

impl Start {
    /// The controller for ticks of `dt_s`: of settings that make none the built-in ones take the
    /// place. An error only if `dt_s` is no period of a tick.
    pub fn build(&mut self, dt_s: f32) -> Result<Controller<f32>, SettingsFault> {
        if let Err(fault) = self.settings.check(dt_s) {
            self.settings = Settings::built_in();
            self.origin = Origin::Impossible(fault);
        }
        self.settings.try_build(dt_s)
    }

    /// How the axis is connected: unchecked unless these are the settings stored last, and no
    /// fault of the wiring showed since.
    pub fn connection(&self) -> Connection {
        let mut connection = self.settings.connection();
        if self.is_wiring_void || !matches!(self.origin, Origin::Slot(_)) {
            connection.wiring = Wiring::Unchecked;
        }
        connection
    }
}

/// The two slots.
#[derive(Debug)]
pub struct Slots<S> {
    storage: S,
    /// Holds the newest sound record.
    newest: Option<(Slot, u32)>,
}

impl<S: SlotStorage> Slots<S> {
    /// Reads both slots: the newest sound record, or else the built-in settings.
    pub fn start(storage: S) -> (Self, Start) {
        let mut slots = Self {
            storage,
            newest: None,
        };
        let origin = match slots.find_newest() {
            Ok((slot, sequence)) => {
                slots.newest = Some((slot, sequence));
                slots.origin(slot, sequence)
            }
            Err(RecordFault::Blank) => Origin::NeverSet,
            Err(fault) => Origin::Damaged(fault),
        };
        let read = |(slot, _)| decode(slots.storage.bytes(slot)).ok();
        let settings = match slots.newest.and_then(read) {
            Some(stored) => stored.settings,
            None => Settings::built_in(),
        };
        let start = Start {
            settings,
            origin,
            is_wiring_void: slots.is_wiring_void(),
        };
        (slots, start)
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

    /// A fault of the wiring showed: the next start takes it for unchecked, until new settings are
    /// stored.
    pub fn void_wiring(&mut self) -> Result<(), StoreFault> {
        let Some((slot, _)) = self.newest else {
            return Ok(());
        };
        if self.is_wiring_void() {
            return Ok(());
        }
        self.program(slot, VOID_AT, &VOID)
    }

    fn is_wiring_void(&self) -> bool {
        let mark = |(slot, _)| self.storage.bytes(slot).get(VOID_AT..LEAST_SLOT_BYTES);
        let mark = self.newest.and_then(mark).unwrap_or_default();
        mark.iter().any(|byte| *byte != ERASED)
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
        match self.sequence(slot.other()) {
            Err(fault) if is_overtaken => Origin::Older(slot, fault),
            _ => Origin::Slot(slot),
        }
    }

    /// The newest sound record; where there is none, what is wrong with the
    /// slot that is not blank.
    fn find_newest(&self) -> Result<(Slot, u32), RecordFault> {
        let read = |slot| self.sequence(slot).map(|sequence| (slot, sequence));
        match (read(Slot::First), read(Slot::Second)) {
            (Ok(first), Ok(second)) if is_newer(second.1, first.1) => Ok(second),
            (Ok(first), _) => Ok(first),
            (Err(_), Ok(second)) => Ok(second),
            (Err(RecordFault::Blank), Err(fault)) | (Err(fault), Err(_)) => Err(fault),
        }
    }

    /// The number of a record that is sound throughout. A function of its own: no two settings lie
    /// on the stack at once.
    #[inline(never)]
    fn sequence(&self, slot: Slot) -> Result<u32, RecordFault> {
        decode(self.storage.bytes(slot)).map(|stored| stored.sequence)
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
        .take(LEAST_SLOT_BYTES)
        .all(|byte| *byte == ERASED)
}
