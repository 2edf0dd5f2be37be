//! The link over a byte stream: a socket, a serial line, a file.
//!
//! [`RemoteController`] is the plant's side, [`serve`] the controller's. Both
//! skip payloads that are not the link's (a board also sends status and
//! telemetry); damaged frames are dropped and counted.

use super::drive::{Drive, DriveError};
use crate::wire::Wire;
use firmware::control_task::ControlTask;
use firmware::experiment::frames as experiment;
use firmware::link::{self, CommandRecord, FromPlant, Order, Payload};
use firmware::start::ResetCause;
use firmware::tick::Sample;
use std::io::{self, Read, Write};
use std::ops::RangeInclusive;

/// Ticks that a plant can be stepped with: faster than the valve by far at one
/// end, slower than the axis at the other.
const TICK_PERIODS_NS: RangeInclusive<u32> = 20_000..=100_000_000;

/// A controller at the other end of a stream.
pub struct RemoteController<S> {
    wire: Wire<S>,
    tick_s: f64,
}

impl<S: Read + Write> RemoteController<S> {
    /// Waits for the controller's greeting.
    pub fn greet(stream: S) -> Result<Self, DriveError> {
        let mut wire = Wire::new(stream);
        loop {
            let payload = received(&mut wire, "its greeting")?;
            if let Some(tick_period_ns) = link::hello_tick_period_ns(&payload) {
                if !TICK_PERIODS_NS.contains(&tick_period_ns) {
                    return Err(DriveError::Link(format!(
                        "the controller greets with a tick of {tick_period_ns} ns, expected {} to {} ns",
                        TICK_PERIODS_NS.start(),
                        TICK_PERIODS_NS.end()
                    )));
                }
                let tick_s = 1e-9 * f64::from(tick_period_ns);
                return Ok(Self { wire, tick_s });
            }
            if payload.first() == Some(&(link::Kind::Hello as u8)) {
                return Err(DriveError::Link(format!(
                    "the controller greets with {:02x?}: expected protocol {} and five channels",
                    &payload[..],
                    link::PROTOCOL
                )));
            }
        }
    }

    /// The tick that the controller has greeted with, s.
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// Gives the controller an order, to be obeyed before the next sample.
    pub fn order(&mut self, order: Order) -> Result<(), DriveError> {
        self.wire
            .send(&link::order(order))
            .map_err(|error| broken(&error, "an order"))
    }

    /// Ends the run and gives the stream back.
    pub fn end(mut self) -> Result<S, DriveError> {
        self.wire
            .send(&link::end())
            .map_err(|error| broken(&error, "the end of the run"))?;
        Ok(self.wire.into_stream())
    }
}

impl<S: Read + Write> Drive for RemoteController<S> {
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let tick = sample.tick;
        self.wire
            .send(&link::sample(sample))
            .map_err(|error| broken(&error, &format!("the sample of tick {tick}")))?;
        loop {
            let payload = received(&mut self.wire, &format!("the command of tick {tick}"))?;
            match link::read_command(&payload) {
                Some(command) if command.tick == tick => return Ok(command),
                Some(command) => {
                    return Err(DriveError::Link(format!(
                        "the controller answers tick {tick} with a command of tick {}",
                        command.tick
                    )));
                }
                None => {}
            }
        }
    }
}

fn received<S: Read>(wire: &mut Wire<S>, what: &str) -> Result<Payload, DriveError> {
    let payload = wire.receive().map_err(|error| broken(&error, what))?;
    payload.ok_or_else(|| DriveError::Link(format!("the controller went away before {what}")))
}

fn broken(error: &io::Error, what: &str) -> DriveError {
    let problem = match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "nothing came in time".to_owned(),
        _ => error.to_string(),
    };
    DriveError::Link(format!("the link broke at {what}: {problem}"))
}

/// What a controller saw of a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Samples answered.
    pub ticks: u64,
    /// Frames dropped for their CRC, and payloads that are not the link's.
    pub dropped: u64,
    /// Samples that the plant's numbers say were missed.
    pub missed: u64,
    /// Whether the plant ended the run, rather than went away.
    pub ended: bool,
}

/// Answers one plant until it ends the run or goes away.
pub fn serve<S: Read + Write>(
    stream: S,
    tick_period_ns: u32,
    task: &mut ControlTask,
) -> io::Result<Served> {
    let mut wire = Wire::new(stream);
    let mut served = Served::default();
    let mut unread = 0;
    let mut expected = None;
    wire.send(&link::hello(tick_period_ns))?;
    while let Some(payload) = wire.receive()? {
        match link::from_plant(&payload) {
            Some(FromPlant::Sample(sample)) => {
                let skipped = sample.tick.wrapping_sub(expected.unwrap_or(sample.tick));
                served.missed += u64::from(skipped);
                served.ticks += 1;
                expected = Some(sample.tick.wrapping_add(1));
                wire.send(&link::command(&task.tick(&sample)))?;
            }
            Some(FromPlant::Order(order)) => {
                task.obey(order);
            }
            Some(FromPlant::End) => {
                served.ended = true;
                break;
            }
            Some(FromPlant::AskStatus) => {
                wire.send(&task.status(ResetCause::Unknown, false).payload())?;
            }
            // A reference without a sample is for a board with sensors of its own.
            Some(FromPlant::Reference(_)) => unread += 1,
            None => match experiment::read_request(&payload) {
                Some(wish) => wire.send(&task.serve_experiment(&wish).payload())?,
                None => unread += 1,
            },
        }
    }
    served.dropped = u64::from(wire.dropped()) + unread;
    Ok(served)
}
