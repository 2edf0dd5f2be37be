//! An axis that is wired the wrong way round, from its first start on.

use super::run::Supervised;
use crate::closed_loop::ScoreError;
use crate::motion::{Limits, Motion, Segment, as_sent};
use crate::plant::{Plant, PlantSettings};
use crate::rig::Rig;
use firmware::codes::{AdcCode, AdcCodes, DacCode};
use firmware::fault::Fault;
use firmware::tick::{Sample, State};

/// How far the first move goes, m: what somebody tries who does not trust the axis yet.
const FIRST_MOVE_M: f64 = 0.02;
const HOLD_S: f64 = 0.3;
/// The load has come to rest long before, ticks.
const WATCHED: u32 = 2_000;

/// What is the wrong way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// Nothing.
    Right,
    /// The valve's command, or the tubes of its ports.
    ReversedValve,
    /// The tubes or wires of both gauges.
    ExchangedGauges,
    /// The tubes of the ports, gauges and all: what the valve feeds is told rightly, and drives the
    /// load the other way.
    ExchangedPorts,
    /// Position and velocity.
    ReversedMotion,
    /// The position alone.
    ReversedPosition,
    /// The velocity alone.
    ReversedVelocity,
}

impl Wiring {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Right,
        Self::ReversedValve,
        Self::ExchangedGauges,
        Self::ExchangedPorts,
        Self::ReversedMotion,
        Self::ReversedPosition,
        Self::ReversedVelocity,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "nothing",
            Self::ReversedValve => "valve or its tubes reversed",
            Self::ExchangedGauges => "gauges exchanged",
            Self::ExchangedPorts => "tubes reversed, gauges with them",
            Self::ReversedMotion => "position and velocity reversed",
            Self::ReversedPosition => "position reversed",
            Self::ReversedVelocity => "velocity reversed",
        }
    }

    /// What the converters see of these codes.
    pub fn seen(self, codes: AdcCodes) -> AdcCodes {
        let mut seen = codes;
        if matches!(self, Self::ExchangedGauges | Self::ExchangedPorts) {
            std::mem::swap(&mut seen.pressure_a, &mut seen.pressure_b);
        }
        if matches!(self, Self::ReversedMotion | Self::ReversedPosition) {
            seen.position = reversed(seen.position);
        }
        if matches!(self, Self::ReversedMotion | Self::ReversedVelocity) {
            seen.velocity = reversed(seen.velocity);
        }
        seen
    }

    /// What the valve gets of a command.
    pub fn driven(self, command: DacCode, null: DacCode) -> DacCode {
        if matches!(self, Self::ReversedValve | Self::ExchangedPorts) {
            let mirrored = 2 * i32::from(null.0) - i32::from(command.0);
            DacCode(mirrored.clamp(0, i32::from(u16::MAX)) as u16)
        } else {
            command
        }
    }
}

/// Of a scale that is even about its middle; the highest code is no reading.
fn reversed(code: AdcCode) -> AdcCode {
    AdcCode((u16::MAX - code.0).min(u16::MAX - 1))
}

/// What came of the first start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstStart {
    /// The fault that was said, and so many ticks after the move was asked for.
    pub fault: Option<(Fault, u32)>,
    /// How far the load went from where it stood, up to its rest, m.
    pub went_m: f64,
    /// How far it had gone when the fault was said, m.
    pub had_gone_m: f64,
    /// Where the load should be and where it is at the end, apart, m.
    pub apart_m: f64,
}

/// Starts an axis that is wired so, and asks for a first move.
pub fn first_start(
    rig: &Rig,
    drive: &mut dyn Supervised,
    wiring: Wiring,
    seed: u64,
) -> Result<FirstStart, ScoreError> {
    let segments = [
        Segment::Hold { seconds: HOLD_S },
        Segment::Move { to_m: FIRST_MOVE_M },
    ];
    let motion = Motion::new(0.0, Limits::BRISK, &segments);
    let mut plant = Plant::new(rig, PlantSettings::at(motion.start_m(), seed))?;
    let stood_m = plant.truth().position_m;
    let asked_at = (HOLD_S / PlantSettings::TICK_S) as u32;
    let mut outcome = FirstStart {
        fault: None,
        went_m: 0.0,
        had_gone_m: 0.0,
        apart_m: 0.0,
    };
    let mut null = None;
    for tick in 0..asked_at + WATCHED {
        let reference = motion.at(plant.time_s());
        let sample = Sample {
            tick,
            codes: wiring.seen(plant.sample()),
            reference: as_sent(&reference),
        };
        let command = drive.command(&sample)?;
        let null = *null.get_or_insert(command.valve);
        plant.advance(wiring.driven(command.valve, null));
        let position_m = plant.truth().position_m;
        outcome.went_m = outcome.went_m.max((position_m - stood_m).abs());
        outcome.apart_m = (position_m - motion.at(plant.time_s()).position_m).abs();
        if outcome.fault.is_none() && command.state == State::Fault as u8 {
            let fault = Fault::from_code(command.fault);
            outcome.fault = fault.map(|fault| (fault, tick.saturating_sub(asked_at)));
            outcome.had_gone_m = outcome.went_m;
        }
    }
    Ok(outcome)
}
