//! One fault at one moment of a motion, and what came of it.

use super::case::{Case, Disturbance};
use crate::closed_loop::{Drive, DriveError, HostController, RemoteController, ScoreError};
use crate::motion::{Limits, Motion, Segment, as_sent};
use crate::plant::{Change, Event, Plant, PlantSettings};
use crate::rig::Rig;
use firmware::codes::DacCode;
use firmware::fault::Fault;
use firmware::link::{CommandRecord, Order};
use firmware::tick::{Sample, State};
use std::io::{Read, Write};

/// For so long a fault may go unseen before it counts as not seen, in ticks.
const PATIENCE: u32 = 4000;
/// For so long the valve is watched after the reaction, in ticks ...
const WATCHED: u32 = 30;
/// ... in the first of which it may take the force from a load that starts the wrong way round.
const BRAKING: u32 = 20;
/// After the acknowledgement the axis tracks within so many ticks: 10 for the
/// observer, and one.
const BACK: u32 = 15;
/// Moments are this many places apart at most, by seed.
const SPREAD: u32 = 20;

/// A controller that can be told what a board sees, and be acknowledged.
pub trait Supervised: Drive {
    /// Gives an order.
    fn order(&mut self, order: Order) -> Result<(), DriveError>;
}

impl Supervised for HostController {
    fn order(&mut self, order: Order) -> Result<(), DriveError> {
        self.task_mut().obey(order);
        Ok(())
    }
}

impl<S: Read + Write> Supervised for RemoteController<S> {
    fn order(&mut self, order: Order) -> Result<(), DriveError> {
        RemoteController::order(self, order)
    }
}

/// When it happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Moment {
    /// Before the first move.
    Rest,
    /// The largest acceleration of a move.
    Accelerating,
    /// The largest speed of a move.
    Cruising,
    /// One move ends and the opposite one begins.
    Reversing,
    /// At rest after moves.
    Hold,
}

impl Moment {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Rest,
        Self::Accelerating,
        Self::Cruising,
        Self::Reversing,
        Self::Hold,
    ];

    fn tick(self, motion: &Motion, seed: u64) -> u32 {
        let parts = motion.parts();
        let within = |part: usize, share: f64| {
            let part = &parts[part];
            part.begin_s + share * (part.end_s - part.begin_s)
        };
        let time_s = match self {
            Self::Rest => within(0, 0.7),
            Self::Accelerating => within(1, 0.2),
            Self::Cruising => within(1, 0.5),
            Self::Reversing => within(2, 0.0),
            Self::Hold => within(3, 0.5),
        };
        (time_s / PlantSettings::TICK_S) as u32 + (seed * 7) as u32 % SPREAD
    }
}

/// What is asked of the load: there, back, a rest, and again.
fn motion() -> Motion {
    let hold = Segment::Hold { seconds: 0.8 };
    let go = |to_m| Segment::Move { to_m };
    let round = [go(0.1), go(-0.1), hold];
    let segments = [&[hold][..], &round, &round, &round].concat();
    Motion::new(0.0, Limits::BRISK, &segments)
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Ticks from the first wrong sample to the reaction; 0 is the same tick.
    /// `None` where there was none.
    pub ticks: Option<u32>,
    /// The fault that was said.
    pub fault: Option<Fault>,
    /// The command of that very tick, and all after it, were the valve's null; of a load that
    /// started the wrong way round, after it was braked.
    pub was_at_null: bool,
    /// Once the cause was gone and acknowledged, the axis tracked again, and
    /// not before; or stayed in fault, or idle until its wiring is checked, where that is right.
    pub came_back: bool,
    /// Largest error of the load against its reference up to the reaction, m.
    pub astray_m: f64,
}

/// The run's changing parts.
struct Bench<'a> {
    plant: Plant,
    drive: &'a mut dyn Supervised,
    motion: Motion,
    tick: u32,
}

impl Bench<'_> {
    fn sample(&mut self) -> Sample {
        let reference = self.motion.at(self.plant.time_s());
        Sample {
            tick: self.tick,
            codes: self.plant.sample(),
            reference: as_sent(&reference),
        }
    }

    fn answer(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let command = self.drive.command(sample)?;
        self.plant.advance(command.valve);
        self.tick += 1;
        Ok(command)
    }

    fn error_m(&self) -> f64 {
        let reference = self.motion.at(self.plant.time_s());
        (self.plant.truth().position_m - reference.position_m).abs()
    }
}

/// Runs one case. `rig` is the plant's; the drive may know it wrongly.
pub fn run_case(
    rig: &Rig,
    drive: &mut dyn Supervised,
    case: &Case,
    moment: Moment,
    seed: u64,
) -> Result<Outcome, ScoreError> {
    let motion = motion();
    let begin = moment.tick(&motion, seed);
    let mut settings = PlantSettings::at(motion.start_m(), seed);
    if let Disturbance::Supply(pressure_pa) = case.disturbance {
        settings.events.push(Event {
            // One tick before it can be sampled.
            at_s: (f64::from(begin) - 0.5) * PlantSettings::TICK_S,
            change: Change::SupplyPressure(pressure_pa),
        });
    }
    let mut bench = Bench {
        plant: Plant::new(rig, settings)?,
        drive,
        motion,
        tick: 0,
    };
    let (first, null) = run_until(&mut bench, begin)?;
    if let Disturbance::Board(fault) = case.disturbance {
        bench.drive.order(Order::Inject(fault.at(0)))?;
    }
    let mut outcome = Outcome {
        ticks: None,
        fault: None,
        was_at_null: true,
        came_back: true,
        astray_m: 0.0,
    };
    for ticks in 0..PATIENCE {
        let sample = bench.sample();
        outcome.astray_m = outcome.astray_m.max(bench.error_m());
        let command = bench.answer(&case.disturbance.applied(sample, &first, ticks))?;
        if command.state == State::Fault as u8 {
            outcome.ticks = Some(ticks);
            outcome.fault = Fault::from_code(command.fault);
            outcome.was_at_null = command.valve == null || may_brake(command.fault, 0);
            break;
        }
    }
    if let Some(fault) = outcome.fault {
        let stays = fault.is_standing() || case.disturbance.lasts();
        watch(&mut bench, &mut outcome, null, stays)?;
        outcome.came_back |= case.disturbance.upsets_the_axis();
    }
    Ok(outcome)
}

/// Runs a sound axis up to a tick. Returns the last sample, and the valve's command at null.
fn run_until(bench: &mut Bench<'_>, end: u32) -> Result<(Sample, DacCode), ScoreError> {
    let mut last = bench.sample();
    let null = bench.answer(&last)?.valve;
    while bench.tick < end {
        last = bench.sample();
        let command = bench.answer(&last)?;
        if command.fault != 0 {
            let fault = Fault::from_code(command.fault);
            return Err(DriveError::Link(format!(
                "{fault:?} at tick {} before anything was wrong: a false trip",
                last.tick
            ))
            .into());
        }
    }
    Ok((last, null))
}

/// Whether so many ticks after a fault the valve may take the force from the load.
fn may_brake(code: u8, ticks: u32) -> bool {
    Fault::from_code(code) == Some(Fault::WrongPolarity) && ticks <= BRAKING
}

/// After the reaction: the valve stays at its null although the samples are
/// sound again, until somebody acknowledges; and afterwards where the cause stays.
fn watch(
    bench: &mut Bench<'_>,
    outcome: &mut Outcome,
    null: DacCode,
    stays: bool,
) -> Result<(), ScoreError> {
    for ticks in 1..=WATCHED {
        let sample = bench.sample();
        let command = bench.answer(&sample)?;
        let is_at_null = command.valve == null || may_brake(command.fault, ticks);
        outcome.was_at_null &= is_at_null && command.state == State::Fault as u8;
    }
    bench.drive.order(Order::Acknowledge)?;
    let mut last = State::Fault as u8;
    for ticks in 0..BACK {
        let sample = bench.sample();
        let command = bench.answer(&sample)?;
        last = command.state;
        if ticks == 0 {
            let expected = if stays { State::Fault } else { State::Idle };
            outcome.came_back &= last == expected as u8;
        }
    }
    let expected = match outcome.fault {
        _ if stays => State::Fault,
        // Its wiring is to be checked anew before it follows a reference.
        Some(Fault::WrongPolarity) => State::Idle,
        _ => State::Track,
    };
    outcome.came_back &= last == expected as u8;
    Ok(())
}
