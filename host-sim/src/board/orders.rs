//! What a person tells a board: tell your status, leave the fault, go there,
//! let go.
//!
//! A set-point is one frame: the way there, within the limits of speed,
//! acceleration and jerk of its settings, is the board's own, whatever becomes of
//! this program or the wire. What is lost on the wire is sent again.

use std::time::{Duration, Instant};

use firmware::codes::POSITION_M;
use firmware::crash::{self, Crash};
use firmware::link::{self, Order};
use firmware::settings::Wiring;
use firmware::status::Status;
use firmware::telemetry::{Record, Streaming, read_streaming, read_tick, stream};
use firmware::tick::State;
use model_core::reference::Reference;

use super::port::{Port, PortError};
use super::words::fault_line;

const ANSWER_WAIT: Duration = Duration::from_millis(300);
const ATTEMPTS: usize = 5;
/// From one question to the next.
const ASK_EVERY: Duration = Duration::from_millis(20);
/// How long a board that streams may be silent.
const SILENCE: Duration = Duration::from_secs(2);
/// A load within the tolerance for so long has arrived, s.
const ARRIVED_S: f64 = 0.3;
/// Slower than this, a load stands, m/s: what the velocity sensor's noise leaves.
const STANDING_M_PER_S: f64 = 5e-3;
/// Ticks from one observed to the next, at 1 kHz: 50 a second.
const DECIMATION: u16 = 20;

/// Why a board does not do as it is told; one line.
#[derive(Debug, thiserror::Error)]
pub enum OrderError {
    /// The port failed.
    #[error(transparent)]
    Port(#[from] PortError),
    /// Silence.
    #[error(
        "the board does not answer ({ATTEMPTS} attempts): is it powered, is this its port, is its firmware running?"
    )]
    NoAnswer,
    /// It streams, but no ticks come.
    #[error(
        "no tick comes from the board: it has no converters, or its timer stands; a board in QEMU moves with its plant, see `pneuma loop`"
    )]
    NoTicks,
    /// It is in fault.
    #[error("the board is in {0}")]
    Fault(String),
    /// Nobody knows what axis it is at.
    #[error(
        "the board runs on built-in settings of no rig: send this rig's with `pneuma settings`"
    )]
    BuiltInSettings,
    /// Nobody knows which way round it answers.
    #[error(
        "the board's wiring is unchecked, and it follows no set-point until it is: `pneuma board check-wiring`"
    )]
    UncheckedWiring,
    /// A place that the board cannot measure.
    #[error("{0} mm is beyond the position converter, expected {1} to {2} mm")]
    OutOfReach(f64, f64, f64),
    /// The board goes on with what it did.
    #[error("the board does not take the set-point ({ATTEMPTS} attempts): its state is {0:?}")]
    NotTaken(State),
    /// Too slow, or stuck.
    #[error(
        "not there after {seconds} s: {error_mm} mm away and still tracking; `pneuma board stop` lets go"
    )]
    NotThere {
        /// How long it was given, s.
        seconds: f64,
        /// From the set-point to the load, mm.
        error_mm: f64,
    },
    /// The person at the keyboard wanted no more.
    #[error("stopped: the valve is at its null, the load {0} mm from the set-point")]
    Stopped(f64),
}

/// The board's status report.
pub fn status(port: &mut Port) -> Result<Status, OrderError> {
    ask(port, &link::ask_status(), Status::read)
}

/// Where the board's program crashed last since power came; none also of a board whose firmware
/// does not know the question.
pub fn last_crash(port: &mut Port) -> Result<Option<Crash>, OrderError> {
    port.send(&crash::ask())?;
    let until = Instant::now() + ANSWER_WAIT;
    while let Some(payload) = port.receive(until)? {
        if let Some(told) = crash::read(&payload) {
            return Ok(told);
        }
    }
    Ok(None)
}

/// Has the board leave its fault; what it says then.
pub fn acknowledge(port: &mut Port) -> Result<Status, OrderError> {
    let mut now = status(port)?;
    for _ in 0..ATTEMPTS {
        if now.state != State::Fault {
            break;
        }
        port.send(&link::order(Order::Acknowledge))?;
        // A cause that is still there trips again meanwhile; what the board says
        // meanwhile is soon old.
        let until = Instant::now() + ANSWER_WAIT;
        while port.receive(until)?.is_some() {}
        now = status(port)?;
    }
    if now.state == State::Fault {
        return Err(in_fault(&now));
    }
    Ok(now)
}

/// Has the board ask nothing of the load: the valve goes to its null.
pub fn stop(port: &mut Port) -> Result<Status, OrderError> {
    let nothing = Reference {
        position_m: f32::NAN,
        velocity_m_per_s: f32::NAN,
        acceleration_m_per_s2: f32::NAN,
    };
    let mut now = status(port)?;
    for _ in 0..ATTEMPTS {
        port.send(&link::reference(&nothing))?;
        now = settled_status(port)?;
        if now.state != State::Track {
            return Ok(now);
        }
    }
    Err(OrderError::NotTaken(now.state))
}

/// The status once the board tracks no more, or after a while: it answers before
/// the tick that sees what was sent.
fn settled_status(port: &mut Port) -> Result<Status, OrderError> {
    let until = Instant::now() + ANSWER_WAIT;
    loop {
        let now = status(port)?;
        if now.state != State::Track || Instant::now() >= until {
            return Ok(now);
        }
        std::thread::sleep(ASK_EVERY);
    }
}

/// Whether the board may be asked to move: no fault, and settings of a rig.
pub fn ready(port: &mut Port) -> Result<Status, OrderError> {
    let now = status(port)?;
    if now.state == State::Fault {
        return Err(in_fault(&now));
    }
    if now.has_built_in_settings {
        return Err(OrderError::BuiltInSettings);
    }
    Ok(now)
}

/// Has the board stream every `decimation`-th tick; what it says to that.
pub fn begin_stream(port: &mut Port, decimation: u16) -> Result<Streaming, OrderError> {
    ask(port, &stream(decimation), |payload| {
        read_streaming(payload).filter(|answer| answer.decimation == decimation)
    })
}

/// Sends a question until its answer comes; other frames are passed over.
pub(super) fn ask<Answer>(
    port: &mut Port,
    question: &[u8],
    read: impl Fn(&[u8]) -> Option<Answer>,
) -> Result<Answer, OrderError> {
    for _ in 0..ATTEMPTS {
        port.send(question)?;
        let until = Instant::now() + ANSWER_WAIT;
        while let Some(payload) = port.receive(until)? {
            if let Some(answer) = read(&payload) {
                return Ok(answer);
            }
        }
    }
    Err(OrderError::NoAnswer)
}

fn in_fault(status: &Status) -> OrderError {
    let line = status.finding.map(fault_line);
    OrderError::Fault(line.unwrap_or_else(|| "fault".into()))
}

/// A set-point, and when it counts as reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Where to, m.
    pub to_m: f64,
    /// How near is there, m.
    pub within_m: f64,
    /// How long the board is given, s.
    pub seconds: f64,
}

/// What is to be seen of a move under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Time since the board took the set-point, s.
    pub time_s: f64,
    /// Where the load was before, m.
    pub from_m: f64,
    /// Where it is, as the sensor says, m.
    pub position_m: f64,
}

/// A load that has arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// When it came within the tolerance for good, s after the set-point was taken.
    pub time_s: f64,
    /// Mean of the sensor's positions since then, m.
    pub position_m: f64,
}

/// The ends of the position converter, m.
pub fn reach_m() -> [f64; 2] {
    [POSITION_M.lowest, POSITION_M.highest].map(f64::from)
}

/// Refuses a place that the board cannot measure.
pub fn within_reach(to_m: f64) -> Result<(), OrderError> {
    let [lowest_m, highest_m] = reach_m();
    if (lowest_m..=highest_m).contains(&to_m) {
        return Ok(());
    }
    let [to, lowest, highest] = [to_m, lowest_m, highest_m].map(|place_m| 1e3 * place_m);
    Err(OrderError::OutOfReach(to, lowest, highest))
}

/// Sends the load to a place and watches it. `watch` sees the progress and says
/// whether to go on.
pub fn go(
    port: &mut Port,
    wish: &Move,
    mut watch: impl FnMut(&Progress) -> bool,
) -> Result<Arrival, OrderError> {
    within_reach(wish.to_m)?;
    let status = ready(port)?;
    if status.wiring == Wiring::Unchecked {
        return Err(OrderError::UncheckedWiring);
    }
    let streaming = begin_stream(port, DECIMATION)?;
    let outcome = watched(port, wish, &streaming, &mut watch);
    let ended = match &outcome {
        Err(OrderError::Stopped(_)) => stop(port).map(drop),
        _ => Ok(()),
    };
    port.send(&stream(0))?;
    ended.and(outcome)
}

fn watched(
    port: &mut Port,
    wish: &Move,
    streaming: &Streaming,
    watch: &mut impl FnMut(&Progress) -> bool,
) -> Result<Arrival, OrderError> {
    let first = next_tick(port)?;
    let from_m = measured_m(&first);
    let taken = have_taken(port, wish)?;
    let mut arrival = Nearness::default();
    let tick_s = streaming.tick_s();
    loop {
        let record = next_tick(port)?;
        if record.state == State::Fault as u8 {
            return Err(in_fault(&status(port)?));
        }
        let time_s = tick_s * f64::from(record.tick.wrapping_sub(taken.tick));
        let position_m = measured_m(&record);
        let progress = Progress {
            time_s,
            from_m,
            position_m,
        };
        let error_m = position_m - wish.to_m;
        if !watch(&progress) {
            return Err(OrderError::Stopped(rounded_mm(error_m)));
        }
        let velocity_m_per_s = f64::from(record.estimate[1]);
        let is_near = error_m.abs() <= wish.within_m && velocity_m_per_s.abs() <= STANDING_M_PER_S;
        if let Some(arrived) = arrival.add(is_near, time_s, position_m) {
            return Ok(arrived);
        }
        if time_s > wish.seconds {
            return Err(OrderError::NotThere {
                seconds: wish.seconds,
                error_mm: rounded_mm(error_m),
            });
        }
    }
}

/// Micrometres are enough for a person.
fn rounded_mm(length_m: f64) -> f64 {
    (1e6 * length_m).round() * 1e-3
}

/// Where the load is, as the sensor says, m.
pub fn position_m(port: &mut Port) -> Result<f64, OrderError> {
    begin_stream(port, DECIMATION)?;
    let first = next_tick(port);
    port.send(&stream(0))?;
    Ok(measured_m(&first?))
}

fn measured_m(record: &Record) -> f64 {
    f64::from(POSITION_M.value(record.codes.position.0))
}

/// The next tick that is streamed.
fn next_tick(port: &mut Port) -> Result<Record, OrderError> {
    let until = Instant::now() + SILENCE;
    while let Some(payload) = port.receive(until)? {
        if let Some(record) = read_tick(&payload) {
            return Ok(record);
        }
    }
    Err(OrderError::NoTicks)
}

/// Sends the set-point until the ticks show it; the first that does.
fn have_taken(port: &mut Port, wish: &Move) -> Result<Record, OrderError> {
    let set_point = Reference::at(wish.to_m as f32);
    let mut last_state = State::Init;
    for _ in 0..ATTEMPTS {
        port.send(&link::reference(&set_point))?;
        let until = Instant::now() + ANSWER_WAIT;
        while let Some(payload) = port.receive(until)? {
            let Some(record) = read_tick(&payload) else {
                continue;
            };
            if record.state == State::Fault as u8 {
                return Err(in_fault(&status(port)?));
            }
            let shown = record.reference_position_m.to_bits();
            if shown == set_point.position_m.to_bits() && record.state == State::Track as u8 {
                return Ok(record);
            }
            last_state = State::from_code(record.state).unwrap_or(last_state);
        }
    }
    Err(OrderError::NotTaken(last_state))
}

/// Whether a load has come near for good.
#[derive(Debug, Default)]
struct Nearness {
    since_s: Option<f64>,
    sum_m: f64,
    count: u32,
}

impl Nearness {
    fn add(&mut self, is_near: bool, time_s: f64, position_m: f64) -> Option<Arrival> {
        if !is_near {
            *self = Self::default();
            return None;
        }
        let since_s = *self.since_s.get_or_insert(time_s);
        self.sum_m += position_m;
        self.count += 1;
        (time_s - since_s >= ARRIVED_S).then(|| Arrival {
            time_s: since_s,
            position_m: self.sum_m / f64::from(self.count),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_load_that_leaves_again_has_not_arrived() {
        let mut nearness = Nearness::default();
        let mut at = |is_near, time_s| nearness.add(is_near, time_s, 0.06);
        assert_eq!(at(true, 1.0), None);
        assert_eq!(at(true, 1.2), None);
        assert_eq!(at(false, 1.25), None);
        assert_eq!(at(true, 1.4), None);
        let arrived = at(true, 1.75).expect("0.35 s near");
        assert!((arrived.time_s - 1.4).abs() < 1e-12);
        assert!((arrived.position_m - 0.06).abs() < 1e-12);
    }
}
