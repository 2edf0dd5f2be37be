//! What host and board say of an experiment.
//!
//! | frame | direction | payload, little-endian |
//! |---|---|---|
//! | `Guard` 0x50 | host to board | u8 kind, f32 x6: lowest and highest position in m, speed in m/s, lowest and highest pressure in Pa, force in N; a new program begins |
//! | `Load` 0x51 | host to board | u8 kind, u8 number of the first step, steps of 17 bytes each |
//! | `Run` 0x52 | host to board | u8 kind, u32 CRC-32 of the envelope and all steps |
//! | `Alive` 0x53 | host to board | u8 kind |
//! | `Halt` 0x54 | host to board | u8 kind |
//! | `Course` 0x55 | board to host | the answer to each: u8 kind, u8 stage, u8 reason, u8 step, u32 tick of the begin or of the end so far, f32 value that left the envelope |

use super::envelope::Envelope;
use super::step::{MOST_STEPS, STEP_BYTES, Step};
use super::{Reason, Stage};
use crate::frame::LONGEST_PAYLOAD;
use crate::link::{Fields, Payload, put};
use crate::settings::record::CRC;

const GUARD: u8 = 0x50;
const LOAD: u8 = 0x51;
const RUN: u8 = 0x52;
const ALIVE: u8 = 0x53;
const HALT: u8 = 0x54;
const COURSE: u8 = 0x55;

/// Steps in one frame at the most.
pub const STEPS_PER_FRAME: usize = (LONGEST_PAYLOAD - 2) / STEP_BYTES;

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<'a> {
    /// A new program begins, with this envelope.
    Guard(Envelope),
    /// Steps of it.
    Load {
        /// Number of the first.
        first: u8,
        /// Their bytes.
        steps: &'a [u8],
    },
    /// It is to run.
    Run {
        /// What the whole program's CRC is.
        crc: u32,
    },
    /// The host is still there.
    Alive,
    /// The run is to end.
    Halt,
}

/// How an experiment stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Where it stands.
    pub stage: Stage,
    /// Why it ended or was refused.
    pub reason: Reason,
    /// The step that runs or ran last; after `Load` how many are there.
    pub place: u8,
    /// The last tick of the run so far.
    pub tick: u32,
    /// What left the envelope, in its unit.
    pub value: f32,
}

/// Reads what a host asks for; none where it is something else.
pub fn read_request(payload: &[u8]) -> Option<Request<'_>> {
    let mut fields = Fields(payload);
    match fields.u8()? {
        GUARD => {
            let mut numbers = [0.0; 6];
            for number in &mut numbers {
                *number = fields.f32()?;
            }
            fields.end(Request::Guard(Envelope::from_array(numbers)))
        }
        LOAD => {
            let first = fields.u8()?;
            let steps = fields.rest();
            Some(Request::Load { first, steps })
        }
        RUN => {
            let crc = fields.u32()?;
            fields.end(Request::Run { crc })
        }
        ALIVE => fields.end(Request::Alive),
        HALT => fields.end(Request::Halt),
        _ => None,
    }
}

/// The envelope's frame, with which a program begins.
pub fn guard(envelope: &Envelope) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[GUARD]);
    for number in envelope.to_array() {
        put(&mut payload, &number.to_le_bytes());
    }
    payload
}

/// A frame of steps; those beyond [`STEPS_PER_FRAME`] and [`MOST_STEPS`] do not fit.
pub fn load(first: usize, steps: &[Step]) -> Option<Payload> {
    let fits = steps.len() <= STEPS_PER_FRAME && first + steps.len() <= MOST_STEPS;
    let first = u8::try_from(first).ok().filter(|_| fits)?;
    let mut payload = Payload::new();
    put(&mut payload, &[LOAD, first]);
    for step in steps {
        put(&mut payload, &step.bytes());
    }
    Some(payload)
}

/// The wish to run the program of this CRC.
pub fn run(crc: u32) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[RUN]);
    put(&mut payload, &crc.to_le_bytes());
    payload
}

/// The sign of life.
pub fn alive() -> Payload {
    bare(ALIVE)
}

/// The wish to end the run.
pub fn halt() -> Payload {
    bare(HALT)
}

fn bare(kind: u8) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[kind]);
    payload
}

/// The CRC of a program: its envelope's numbers and its steps' bytes.
pub fn crc(envelope: &Envelope, steps: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    for number in envelope.to_array() {
        digest.update(&number.to_le_bytes());
    }
    digest.update(steps);
    digest.finalize()
}

impl Stage {
    fn from_code(code: u8) -> Option<Self> {
        let all = [
            Self::Empty,
            Self::Ready,
            Self::Running,
            Self::Done,
            Self::Ended,
        ];
        all.into_iter().find(|one| *one as u8 == code)
    }
}

impl Reason {
    fn from_code(code: u8) -> Option<Self> {
        let all = [
            Self::None,
            Self::Position,
            Self::Speed,
            Self::Pressure,
            Self::Force,
            Self::HostSilent,
            Self::Stopped,
            Self::Fault,
            Self::NotIdle,
            Self::NotAtRest,
            Self::NotThisProgram,
            Self::Impossible,
            Self::Unchecked,
        ];
        all.into_iter().find(|one| *one as u8 == code)
    }
}

impl Report {
    /// Its frame.
    pub fn payload(&self) -> Payload {
        let mut payload = Payload::new();
        put(
            &mut payload,
            &[COURSE, self.stage as u8, self.reason as u8, self.place],
        );
        put(&mut payload, &self.tick.to_le_bytes());
        put(&mut payload, &self.value.to_le_bytes());
        payload
    }

    /// Reads a report; none where it is none.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let mut fields = Fields(payload);
        if fields.u8()? != COURSE {
            return None;
        }
        let report = Self {
            stage: Stage::from_code(fields.u8()?)?,
            reason: Reason::from_code(fields.u8()?)?,
            place: fields.u8()?,
            tick: fields.u32()?,
            value: fields.f32()?,
        };
        fields.end(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_requests_and_reports_come_back() {
        let envelope = Envelope::from_array([-0.1, 0.1, 0.5, 1e5, 7e5, 200.0]);
        assert_eq!(
            read_request(&guard(&envelope)),
            Some(Request::Guard(envelope))
        );
        let steps = [Step::Hold { seconds: 1.0 }; STEPS_PER_FRAME];
        let loaded = load(3, &steps).expect("fits");
        let read = read_request(&loaded);
        assert!(
            matches!(read, Some(Request::Load { first: 3, steps }) if steps.len() == STEPS_PER_FRAME * STEP_BYTES)
        );
        assert_eq!(load(MOST_STEPS, &steps[..1]), None);
        assert_eq!(read_request(&run(7)), Some(Request::Run { crc: 7 }));
        assert_eq!(read_request(&alive()), Some(Request::Alive));
        assert_eq!(read_request(&halt()), Some(Request::Halt));
        let report = Report {
            stage: Stage::Ended,
            reason: Reason::HostSilent,
            place: 3,
            tick: 70_000,
            value: 0.25,
        };
        assert_eq!(Report::read(&report.payload()), Some(report));
        assert_eq!(Report::read(&run(7)), None);
    }
}
