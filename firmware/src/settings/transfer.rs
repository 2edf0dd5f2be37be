//! Settings over the serial wire.
//!
//! The host announces, sends pieces, commits; the board answers each frame. A
//! lost frame or answer is sent again: a piece that is already there and a
//! commit that was already done are acknowledged once more.
//!
//! | frame | direction | payload, little-endian |
//! |---|---|---|
//! | `Begin` 0x20 | host to board | u8 kind, u16 version of the record, u16 length, u32 CRC-32 |
//! | `Chunk` 0x21 | host to board | u8 kind, u16 offset, up to [`LONGEST_CHUNK`] bytes |
//! | `Commit` 0x22 | host to board | u8 kind: used and stored |
//! | `TryOut` 0x24 | host to board | u8 kind: used until the next start, and not stored |
//! | `Answer` 0x23 | board to host | u8 kind, u8 kind of the frame answered, u8 [`Verdict`], u16 bytes received so far, name of the field at fault |
//!
//! What is sent is the content of a [`super::record`]. At the commit the board
//! checks length and CRC, judges every number, builds the controller, swaps it
//! in if the axis is at rest, and only then stores the record: a refusal leaves
//! everything as it was.

use super::field::SettingsFault;
use super::parameters::Connection;
use super::record::{Content, LONGEST_CONTENT, VERSION, content_crc, decode_content};
use super::slots::{SlotStorage, Slots, StoreFault};
use crate::link::{Fields, Payload, put};
use crate::tick::NotAtRest;
use model_core::controller::Controller;

/// The most bytes in a chunk.
pub const LONGEST_CHUNK: usize = 200;
/// The most bytes of a field's name in an answer.
const LONGEST_NAME: usize = 80;

/// First byte of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Announces length and CRC.
    Begin = 0x20,
    /// Some bytes.
    Chunk = 0x21,
    /// All bytes are there: use them.
    Commit = 0x22,
    /// The board's answer.
    Answer = 0x23,
    /// All bytes are there: use them until the next start.
    TryOut = 0x24,
}

/// What the board says to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Verdict {
    /// Taken; to a commit: in use and stored.
    Taken = 0,
    /// The frame has the wrong length.
    Malformed = 1,
    /// Nothing was announced.
    NotBegun = 2,
    /// Settings of another version of the firmware.
    WrongVersion = 3,
    /// Longer than any settings.
    TooLong = 4,
    /// Not the piece that comes next.
    WrongOffset = 5,
    /// Committed before all bytes were there.
    Incomplete = 6,
    /// The CRC does not hold.
    WrongCrc = 7,
    /// The bytes are no settings.
    NotSettings = 8,
    /// A number that no rig has; the answer names it.
    Impossible = 9,
    /// The axis is not at rest.
    NotAtRest = 10,
    /// In use, but not stored: the spare slot was used since the start.
    InUseNotErased = 11,
    /// In use, but not stored: the storage refused.
    InUseNotStored = 12,
}

impl Verdict {
    const ALL: [Self; 13] = [
        Self::Taken,
        Self::Malformed,
        Self::NotBegun,
        Self::WrongVersion,
        Self::TooLong,
        Self::WrongOffset,
        Self::Incomplete,
        Self::WrongCrc,
        Self::NotSettings,
        Self::Impossible,
        Self::NotAtRest,
        Self::InUseNotErased,
        Self::InUseNotStored,
    ];

    /// The verdict of a number on the wire.
    pub fn of(number: u8) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|verdict| *verdict as u8 == number)
    }

    /// What it means to a person, and what to do.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Taken => "taken",
            Self::Malformed => "a frame of the wrong length",
            Self::NotBegun => "the transfer was not announced: send it from the beginning",
            Self::WrongVersion => {
                "the board's firmware has settings of another version: flash the firmware of this program's version"
            }
            Self::TooLong => "longer than any settings",
            Self::WrongOffset => "not the piece that comes next",
            Self::Incomplete => "committed before all bytes were there",
            Self::WrongCrc => "the CRC over the settings does not hold: send them again",
            Self::NotSettings => "the bytes are no settings",
            Self::Impossible => "a number that no rig has",
            Self::NotAtRest => {
                "the axis is not at rest: settings are swapped in only in the states idle and fault, where the valve is at its null"
            }
            Self::InUseNotErased => {
                "in use until the next start, but not stored: the board stores once between two starts; restart it and send them again"
            }
            Self::InUseNotStored => {
                "in use until the next start, but not stored: the board's flash refused"
            }
        }
    }
}

/// The announcement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Announced {
    length: usize,
    crc: u32,
}

/// Where a transfer stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing announced.
    Waiting,
    /// Bytes come in.
    Receiving(Announced),
    /// Committed with this verdict.
    Done(Verdict),
}

/// The board's side.
#[derive(Clone, Debug)]
pub struct Transfer {
    received: Content,
    stage: Stage,
    dt_s: f32,
}

/// A verdict, and the name of the field that it is about.
type Judged = (Verdict, &'static str);
const TAKEN: Judged = (Verdict::Taken, "");

impl Transfer {
    /// A transfer that nothing announced, for a controller with ticks of `dt_s`.
    pub const fn new(dt_s: f32) -> Self {
        Self {
            received: Content::new(),
            stage: Stage::Waiting,
            dt_s,
        }
    }

    /// Takes a frame from the host and gives the answer; `None` where it is not
    /// about settings. `install` swaps the controller in, under a short lock.
    pub fn serve<S: SlotStorage>(
        &mut self,
        payload: &[u8],
        slots: &mut Slots<S>,
        install: impl FnOnce(Controller<f32>, &Connection) -> Result<(), NotAtRest>,
    ) -> Option<Payload> {
        let mut fields = Fields(payload);
        let kind = fields.u8()?;
        let judged = match kind {
            kind if kind == Kind::Begin as u8 => self.begin(fields),
            kind if kind == Kind::Chunk as u8 => self.chunk(fields),
            kind if kind == Kind::Commit as u8 => self.commit(fields, Some(slots), install),
            kind if kind == Kind::TryOut as u8 => {
                self.commit(fields, None::<&mut Slots<S>>, install)
            }
            _ => return None,
        };
        Some(self.answer(kind, judged.unwrap_or((Verdict::Malformed, ""))))
    }

    fn begin(&mut self, mut fields: Fields<'_>) -> Option<Judged> {
        let (version, length, crc) = (fields.u16()?, fields.u16()?, fields.u32()?);
        fields.end(())?;
        self.received.clear();
        self.stage = Stage::Waiting;
        let length = usize::from(length);
        if version != VERSION {
            return Some((Verdict::WrongVersion, ""));
        }
        if length > LONGEST_CONTENT {
            return Some((Verdict::TooLong, ""));
        }
        self.stage = Stage::Receiving(Announced { length, crc });
        Some(TAKEN)
    }

    fn chunk(&mut self, mut fields: Fields<'_>) -> Option<Judged> {
        let offset = usize::from(fields.u16()?);
        let bytes = fields.rest();
        let Stage::Receiving(announced) = self.stage else {
            return Some((Verdict::NotBegun, ""));
        };
        let end = offset + bytes.len();
        if self.received.get(offset..end) == Some(bytes) {
            return Some(TAKEN);
        }
        if offset != self.received.len() || end > announced.length {
            return Some((Verdict::WrongOffset, ""));
        }
        match self.received.extend_from_slice(bytes) {
            Ok(()) => Some(TAKEN),
            Err(_) => Some((Verdict::TooLong, "")),
        }
    }

    fn commit<S: SlotStorage>(
        &mut self,
        fields: Fields<'_>,
        slots: Option<&mut Slots<S>>,
        install: impl FnOnce(Controller<f32>, &Connection) -> Result<(), NotAtRest>,
    ) -> Option<Judged> {
        fields.end(())?;
        let announced = match self.stage {
            Stage::Waiting => return Some((Verdict::NotBegun, "")),
            Stage::Done(verdict) => return Some((verdict, "")),
            Stage::Receiving(announced) => announced,
        };
        if self.received.len() != announced.length {
            return Some((Verdict::Incomplete, ""));
        }
        if content_crc(&self.received) != announced.crc {
            return Some((Verdict::WrongCrc, ""));
        }
        if let Err(refusal) = self.put_in_use(install) {
            return Some(refusal);
        }
        let stored = slots.map_or(Ok(()), |slots| slots.store(&self.received));
        let verdict = match stored {
            Ok(()) => Verdict::Taken,
            Err(StoreFault::NotErased) => Verdict::InUseNotErased,
            Err(StoreFault::Storage) => Verdict::InUseNotStored,
        };
        self.stage = Stage::Done(verdict);
        Some((verdict, ""))
    }

    /// A function of its own: what it holds on the stack is gone before the
    /// settings are stored.
    #[inline(never)]
    fn put_in_use(
        &self,
        install: impl FnOnce(Controller<f32>, &Connection) -> Result<(), NotAtRest>,
    ) -> Result<(), Judged> {
        let settings = decode_content(&self.received).ok_or((Verdict::NotSettings, ""))?;
        let controller = settings
            .try_build(self.dt_s)
            .map_err(|fault| (Verdict::Impossible, SettingsFault::field(&fault)))?;
        install(controller, &settings.connection()).map_err(|NotAtRest| (Verdict::NotAtRest, ""))
    }

    fn answer(&self, kind: u8, (verdict, name): Judged) -> Payload {
        let mut payload = Payload::new();
        put(&mut payload, &[Kind::Answer as u8, kind, verdict as u8]);
        let received = u16::try_from(self.received.len()).unwrap_or(u16::MAX);
        put(&mut payload, &received.to_le_bytes());
        let name = name.as_bytes();
        put(&mut payload, name.get(..LONGEST_NAME).unwrap_or(name));
        payload
    }
}

/// The announcement of a content.
pub fn begin(content: &Content) -> Payload {
    let mut payload = Payload::new();
    let length = u16::try_from(content.len()).unwrap_or(u16::MAX);
    put(&mut payload, &[Kind::Begin as u8]);
    put(&mut payload, &VERSION.to_le_bytes());
    put(&mut payload, &length.to_le_bytes());
    put(&mut payload, &content_crc(content).to_le_bytes());
    payload
}

/// The piece of a content that begins at `offset`; `None` behind its end.
pub fn chunk(content: &Content, offset: usize) -> Option<Payload> {
    let end = content.len().min(offset.saturating_add(LONGEST_CHUNK));
    let bytes = content.get(offset..end).filter(|bytes| !bytes.is_empty())?;
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Chunk as u8]);
    put(&mut payload, &u16::try_from(offset).ok()?.to_le_bytes());
    put(&mut payload, bytes);
    Some(payload)
}

/// The wish to use what was sent.
pub fn commit() -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Commit as u8]);
    payload
}

/// The wish to use what was sent until the next start.
pub fn try_out() -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::TryOut as u8]);
    payload
}

/// An answer as the host reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer<'a> {
    /// Kind of the frame that it answers.
    pub kind: u8,
    /// What the board says.
    pub verdict: Verdict,
    /// Bytes that the board has so far.
    pub received: usize,
    /// The field at fault, or nothing.
    pub field: &'a str,
}

/// Reads an answer; `None` where it is none.
pub fn read_answer(payload: &[u8]) -> Option<Answer<'_>> {
    let mut fields = Fields(payload);
    if fields.u8()? != Kind::Answer as u8 {
        return None;
    }
    Some(Answer {
        kind: fields.u8()?,
        verdict: Verdict::of(fields.u8()?)?,
        received: usize::from(fields.u16()?),
        field: core::str::from_utf8(fields.rest()).ok()?,
    })
}
