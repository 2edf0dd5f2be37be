//! A board runs an experiment, and the host records it.
//!
//! The host sends envelope and steps, has the board run the program of this CRC, and says twenty times a
//! second that it is still there. What the board streams goes to a recorder from
//! before the begin until after the end.

use std::io::Write;
use std::time::{Duration, Instant};

use firmware::experiment::frames::{self, Report, STEPS_PER_FRAME};
use firmware::experiment::{Reason, Stage};
use firmware::telemetry::{read_tick, stream};

use super::orders::{OrderError, ask};
use super::port::Port;
use super::recorder::{Recorder, RecorderError};
use crate::experiment::Program;

/// The host says so often that it is there: ten times before a board takes it for gone.
const ALIVE_EVERY: Duration = Duration::from_millis(50);
/// Recorded before the begin and after the end.
const REST: Duration = Duration::from_millis(300);
/// An answer takes no longer, or the question is sent again.
const ANSWER_WAIT: Duration = Duration::from_millis(200);
/// One look at the port.
const GLANCE: Duration = Duration::from_millis(20);
/// A board that says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(2);

/// Why a run did not come to its end, or was not recorded.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The board does not answer, or is not ready.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// The recording cannot be written.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
    /// The board does not begin.
    #[error("the board does not begin: {0}")]
    Refused(&'static str),
    /// It fell silent.
    #[error("the board fell silent; it ends the experiment by itself")]
    Silent,
}

/// What is to be seen of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The board's step.
    pub place: usize,
    /// Time since the begin, s.
    pub time_s: f64,
}

/// Sends a program; the board has it whole then.
///
/// # Errors
/// If the board does not answer or refuses it.
pub fn send(port: &mut Port, program: &Program) -> Result<(), RunError> {
    let begun = ask(port, &frames::guard(&program.envelope), Report::read)?;
    refused(&begun)?;
    for (number, steps) in program.steps.chunks(STEPS_PER_FRAME).enumerate() {
        let first = number * STEPS_PER_FRAME;
        let Some(frame) = frames::load(first, steps) else {
            return Err(RunError::Refused("the program is too long"));
        };
        let until = first + steps.len();
        let is_there =
            |report: &Report| report.reason != Reason::None || usize::from(report.place) == until;
        let report = ask(port, &frame, |payload| {
            Report::read(payload).filter(is_there)
        })?;
        refused(&report)?;
    }
    Ok(())
}

fn refused(report: &Report) -> Result<(), RunError> {
    match report.reason {
        Reason::None => Ok(()),
        reason => Err(RunError::Refused(why(reason))),
    }
}

/// Runs the program that the board has, recorded; how it stands in the end. `watch` sees the
/// progress and says whether to go on.
///
/// # Errors
/// If the board is not ready, falls silent, or the recording cannot be written.
pub fn run<W: Write>(
    port: &mut Port,
    program: &Program,
    recorder: &mut Recorder<W>,
    mut watch: impl FnMut(&Progress) -> bool,
) -> Result<Report, RunError> {
    let mut listener = Listener::new(port, recorder);
    listener.listen_for(REST)?;
    let mut report = listener.ask(&frames::run(program.crc()))?;
    if report.stage != Stage::Running {
        refused(&report)?;
        return Err(RunError::Refused("it does not say why"));
    }
    let begun = Instant::now();
    while report.stage == Stage::Running {
        listener.listen_for(ALIVE_EVERY)?;
        let progress = Progress {
            place: usize::from(report.place),
            time_s: begun.elapsed().as_secs_f64(),
        };
        let wish = if watch(&progress) {
            frames::alive()
        } else {
            frames::halt()
        };
        report = listener.ask(&wish)?;
    }
    listener.listen_for(REST)?;
    let _ = listener.port.send(&stream(0));
    Ok(report)
}

/// Takes what the board streams while it is asked.
struct Listener<'a, W> {
    port: &'a mut Port,
    recorder: &'a mut Recorder<W>,
    last_heard: Instant,
}

impl<'a, W: Write> Listener<'a, W> {
    fn new(port: &'a mut Port, recorder: &'a mut Recorder<W>) -> Self {
        Self {
            port,
            recorder,
            last_heard: Instant::now(),
        }
    }

    /// Records for a while.
    fn listen_for(&mut self, time: Duration) -> Result<(), RunError> {
        let until = Instant::now() + time;
        while Instant::now() < until {
            self.look(until.min(Instant::now() + GLANCE))?;
        }
        Ok(())
    }

    fn look(&mut self, until: Instant) -> Result<Option<Report>, RunError> {
        if self.last_heard.elapsed() > SILENCE {
            return Err(RunError::Silent);
        }
        let Some(payload) = self.port.receive(until).map_err(OrderError::from)? else {
            return Ok(None);
        };
        self.last_heard = Instant::now();
        if let Some(tick) = read_tick(&payload) {
            self.recorder.take(&tick)?;
        }
        Ok(Report::read(&payload))
    }

    /// Asks until a report comes; ticks that come meanwhile are recorded.
    fn ask(&mut self, question: &[u8]) -> Result<Report, RunError> {
        let begun = Instant::now();
        while begun.elapsed() < SILENCE {
            self.port.send(question).map_err(OrderError::from)?;
            if let Some(report) = self.listen_for_report()? {
                return Ok(report);
            }
        }
        Err(RunError::Silent)
    }

    fn listen_for_report(&mut self) -> Result<Option<Report>, RunError> {
        let until = Instant::now() + ANSWER_WAIT;
        while Instant::now() < until {
            if let Some(report) = self.look(until)? {
                return Ok(Some(report));
            }
        }
        Ok(None)
    }
}

/// Why a run was not begun or ended early, in words.
pub fn why(reason: Reason) -> &'static str {
    match reason {
        Reason::None => "it ran to its end",
        Reason::Position => "the load left the envelope's places",
        Reason::Speed => "the load was faster than the envelope allows",
        Reason::Pressure => "a chamber's pressure left the envelope",
        Reason::Force => "the gas pushed harder than the envelope allows",
        Reason::HostSilent => "the board heard nothing of the host for half a second",
        Reason::Stopped => "it was stopped",
        Reason::Fault => "the board is in fault (`pneuma board status` says why)",
        Reason::NotIdle => "the axis is not idle (`pneuma board stop` releases it)",
        Reason::NotAtRest => "the load moves",
        Reason::NotThisProgram => "another program is on the board, or not all of this one",
        Reason::Impossible => "a step or the envelope is impossible",
        Reason::Unchecked => {
            "the wiring is unchecked: `pneuma board check-wiring` first, or places within 2 mm of the load"
        }
    }
}

/// What left the envelope, with its unit; none for other reasons.
pub fn value_in_words(report: &Report) -> Option<String> {
    let value = f64::from(report.value);
    match report.reason {
        Reason::Position => Some(format!("{:.1} mm", 1e3 * value)),
        Reason::Speed => Some(format!("{value:.3} m/s")),
        Reason::Pressure => Some(format!("{:.3} bar absolute", 1e-5 * value)),
        Reason::Force => Some(format!("{value:.0} N")),
        _ => None,
    }
}
