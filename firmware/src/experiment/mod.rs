//! Experiments: a program of steps that the board runs by itself at every tick, within an envelope
//! that it keeps itself.
//!
//! | file | what it holds |
//! |---|---|
//! | `step` | what a step is, its bytes, its ranges |
//! | `course` | what a step asks for at a tick |
//! | `envelope` | place, speed, pressures and force that a run keeps to |
//! | `frames` | what host and board say of it |
//!
//! A program is sent in pieces and run only if its CRC is the one that the host names. A run ends
//! with its last step, or at once where a measured value leaves the envelope, where the host has been
//! silent for [`SILENCE_S`], at a fault, and at any wish to stop: the same tick commands the
//! valve's null. Shut, the valve does not hold a moving load; the envelope is to leave it room.

mod course;
mod envelope;
pub mod frames;
mod step;

pub use course::Asked;
pub use envelope::Envelope;
pub use step::{Defect, MOST_STEPS, Step};

use crate::settings::Wiring;
use course::Course;
use frames::{Report, Request};
use heapless::Vec;
use model_core::controller::Measurements;
use step::STEP_BYTES;

/// A host that says nothing for so long is gone, s.
pub const SILENCE_S: f32 = 0.5;
/// While the wiring is unchecked, envelopes reach no farther from the load, m: what it may move at
/// the most before it is known to answer the right way round.
pub const CHECKED_WITHIN_M: f32 = 2e-3;

/// Where a program stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Stage {
    /// No whole program.
    #[default]
    Empty = 0,
    /// A program that may be run.
    Ready = 1,
    /// It runs.
    Running = 2,
    /// It ran to its end.
    Done = 3,
    /// It was ended before.
    Ended = 4,
}

/// Why a run ended before its end, or was not begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Reason {
    /// It did not.
    #[default]
    None = 0,
    /// The load left the places of the envelope.
    Position = 1,
    /// It was faster than the envelope allows.
    Speed = 2,
    /// A chamber's pressure left the envelope.
    Pressure = 3,
    /// The gas pushed harder than the envelope allows.
    Force = 4,
    /// The host fell silent.
    HostSilent = 5,
    /// Somebody wished it.
    Stopped = 6,
    /// The board is in fault.
    Fault = 7,
    /// Not begun: the axis is not idle.
    NotIdle = 8,
    /// Not begun: the load moves.
    NotAtRest = 9,
    /// Not begun: the program on the board is another one, or not whole.
    NotThisProgram = 10,
    /// Refused: a step or the envelope is impossible.
    Impossible = 11,
    /// Not begun: the wiring is unchecked, and the envelope is not as narrow as a check's.
    Unchecked = 12,
}

/// A run under way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    course: Course,
    /// Time since the host was heard, s.
    silent_s: f32,
}

/// The program, and how it stands.
#[derive(Clone, Debug, Default)]
pub struct Experiment {
    envelope: Envelope,
    bytes: Vec<u8, { MOST_STEPS * STEP_BYTES }>,
    stage: Stage,
    reason: Reason,
    /// The step that runs, or ran last, or is impossible.
    place: u8,
    /// What left the envelope, in its unit.
    value: f32,
    /// Tick at which it began or ended.
    tick: u32,
    run: Option<Run>,
}

/// What must hold for a run to begin.
#[derive(Clone, Copy, Debug)]
pub struct Readiness {
    /// The axis is idle.
    pub is_idle: bool,
    /// The load stands.
    pub stands: bool,
    /// Where, m.
    pub position_m: f32,
    /// What is known of the wiring.
    pub wiring: Wiring,
}

impl Experiment {
    /// Does what the host asks for; what it is told then.
    pub fn serve(&mut self, request: &Request<'_>, ready: Readiness) -> Report {
        match request {
            Request::Guard(envelope) => self.guard(*envelope),
            Request::Load { first, steps } => self.load(usize::from(*first), steps),
            Request::Run { crc } => self.begin(*crc, ready),
            Request::Alive => {
                if let Some(run) = &mut self.run {
                    run.silent_s = 0.0;
                }
            }
            Request::Halt => self.halt(Reason::Stopped),
        }
        self.report()
    }

    /// How it stands.
    pub fn report(&self) -> Report {
        Report {
            stage: self.stage,
            reason: self.reason,
            place: self.place,
            tick: self.tick,
            value: self.value,
        }
    }

    /// Whether a run is under way.
    pub fn is_running(&self) -> bool {
        self.run.is_some()
    }

    /// Ends a run, if there is one.
    pub fn halt(&mut self, reason: Reason) {
        if self.run.take().is_some() {
            self.stage = Stage::Ended;
            self.reason = reason;
        }
    }

    /// A new envelope begins a new program.
    fn guard(&mut self, envelope: Envelope) {
        self.halt(Reason::Stopped);
        self.bytes.clear();
        self.stage = Stage::Empty;
        self.reason = if envelope.is_possible() {
            Reason::None
        } else {
            Reason::Impossible
        };
        self.envelope = envelope;
    }

    /// Takes steps that follow those that are there; the same ones again change nothing.
    fn load(&mut self, first: usize, steps: &[u8]) {
        self.halt(Reason::Stopped);
        self.stage = Stage::Empty;
        let at = first * STEP_BYTES;
        self.place = u8::try_from(first).unwrap_or(u8::MAX);
        self.reason = Reason::Impossible;
        if at > self.bytes.len() || !steps.len().is_multiple_of(STEP_BYTES) {
            return;
        }
        self.bytes.truncate(at);
        for bytes in steps.chunks_exact(STEP_BYTES) {
            let is_sound = Step::read(bytes).is_some_and(|step| step.defect().is_none());
            if !is_sound || self.bytes.extend_from_slice(bytes).is_err() {
                return;
            }
            self.place = self.place.saturating_add(1);
        }
        if self.envelope.is_possible() {
            (self.stage, self.reason) = (Stage::Ready, Reason::None);
        }
    }

    fn begin(&mut self, crc: u32, ready: Readiness) {
        if self.is_running() {
            return;
        }
        let is_this = self.stage != Stage::Empty && frames::crc(&self.envelope, &self.bytes) == crc;
        self.reason = if !is_this {
            Reason::NotThisProgram
        } else if !ready.is_idle {
            Reason::NotIdle
        } else if !ready.stands {
            Reason::NotAtRest
        } else if ready.wiring == Wiring::Unchecked
            && !self.envelope.is_about(ready.position_m, CHECKED_WITHIN_M)
        {
            Reason::Unchecked
        } else {
            Reason::None
        };
        let first = step_at(&self.bytes, 0).filter(|_| self.reason == Reason::None);
        if let Some(first) = first {
            self.run = Some(Run {
                course: Course::new(first),
                silent_s: 0.0,
            });
            self.stage = Stage::Running;
            self.place = 0;
        }
    }

    /// What is asked for at a tick; none where nothing runs. `force_n` is what the gas pushes with.
    #[inline]
    pub fn step(
        &mut self,
        (tick, dt_s): (u32, f32),
        measured: &Measurements<f32>,
        force_n: f32,
    ) -> Option<Asked> {
        let run = self.run.as_mut()?;
        self.tick = tick;
        run.silent_s += dt_s;
        let is_silent = run.silent_s > SILENCE_S;
        let left = self.envelope.left(measured, force_n);
        if let Some((reason, value)) = left.or(is_silent.then_some((Reason::HostSilent, SILENCE_S)))
        {
            self.value = value;
            self.halt(reason);
            return None;
        }
        if run.course.is_over() {
            self.place = self.place.wrapping_add(1);
            let Some(next) = step_at(&self.bytes, self.place) else {
                self.place = self.place.wrapping_sub(1);
                self.run = None;
                self.stage = Stage::Done;
                return None;
            };
            run.course.follow_with(next);
        }
        Some(run.course.step(dt_s, measured.position_m))
    }
}

fn step_at(bytes: &[u8], place: u8) -> Option<Step> {
    let at = usize::from(place) * STEP_BYTES;
    Step::read(bytes.get(at..at + STEP_BYTES)?)
}
