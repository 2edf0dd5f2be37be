//! The cases that a controller is judged by, with their marks.
//!
//! Every case begins with a new plant at rest and a new controller that knows
//! the rig wrongly ([`super::wrongly_known`]); it holds for [`SETTLE_S`] before
//! anything is asked of it. Judged is the true position against the reference
//! that was sent.

use super::drive::{Drive, DriveError};
use super::figure::FigureUnit;
use super::judge::{AFTER_MOVE_S, command_movement_v, overshoot_m, rms_m, worst_m};
use super::run::{Course, Row, Run, run};
use crate::knowledge::wrongly_known;
use crate::model::AxisFault;
use crate::motion::{Limits, Motion, Placed, Segment};
use crate::plant::{Change, Event, Plant, PlantSettings};
use crate::rig::Rig;
use rayon::prelude::*;
use std::fmt;

/// Time to find the null and the forces at rest, s.
pub const SETTLE_S: f64 = 2.0;
/// From the end of a reference to the judgement of how it stays, s.
const BEFORE_HOLD_S: f64 = 1.0;
/// How long it is judged, s.
const HOLD_S: f64 = 30.0;
/// From a disturbance to the judgement of what is left of it, s.
const RECOVERY_S: f64 = 2.0;
/// How near the load must return, m.
const RETURNED_M: f64 = 5e-5;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Case {
    /// Moves of 60 mm.
    Move,
    /// A sine of 60 mm at 0.5 Hz.
    SlowSine,
    /// A sine of 60 mm at 1 Hz.
    FastSine,
    /// 30 s at rest after a move.
    Hold,
    /// Moves of 60 mm with twice the mass.
    Payload,
    /// The supply falls from 7 to 5 bar at rest; then a move.
    Supply,
    /// A push of 10 N that begins at rest and stays; then a move.
    Push,
}

impl Case {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Move,
        Self::SlowSine,
        Self::FastSine,
        Self::Hold,
        Self::Payload,
        Self::Supply,
        Self::Push,
    ];

    /// What is asked of the load.
    pub fn motion(self) -> Motion {
        let hold = |seconds| Segment::Hold { seconds };
        let go = |to_m| Segment::Move { to_m };
        let sine = |frequency_hz| Segment::Sine {
            amplitude_m: 0.06,
            frequency_hz,
            periods: 6,
        };
        let moves = [go(0.06), hold(1.5), go(0.0), hold(1.5)];
        let segments: Vec<Segment> = match self {
            Self::Move | Self::Payload => [moves, moves].concat(),
            Self::SlowSine => vec![sine(0.5)],
            Self::FastSine => vec![sine(1.0)],
            Self::Hold => vec![go(0.06), hold(BEFORE_HOLD_S + HOLD_S)],
            Self::Supply => [vec![hold(1.0 + RECOVERY_S + 1.0)], moves.to_vec()].concat(),
            Self::Push => [vec![hold(1.0 + RECOVERY_S + 1.0)], moves.to_vec()].concat(),
        };
        let start = [hold(SETTLE_S)];
        Motion::new(0.0, Limits::BRISK, &[start.as_slice(), &segments].concat())
    }

    /// What happens meanwhile.
    fn events(self, rig: &Rig) -> Vec<Event> {
        let at = |at_s, change| Event { at_s, change };
        let disturbed_s = SETTLE_S + 1.0;
        match self {
            Self::Payload => {
                let mass_kg = rig.value("carriage.mass_kg").unwrap_or_default();
                vec![at(0.0, Change::Mass(2.0 * mass_kg))]
            }
            Self::Supply => {
                // From 7 to 5 bar, whatever the rig's supply is.
                let supply_pa = rig.value("supply.pressure_Pa").unwrap_or_default();
                vec![at(
                    disturbed_s,
                    Change::SupplyPressure(supply_pa * 5.0 / 7.0),
                )]
            }
            Self::Push => vec![at(disturbed_s, Change::Push(10.0))],
            Self::Move | Self::SlowSine | Self::FastSine | Self::Hold => Vec::new(),
        }
    }
}

/// A figure of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// Largest error from 0.3 s after a reference ends, m.
    EndError,
    /// Furthest beyond the end of a move, m.
    Overshoot,
    /// Largest error of a sine after its first period, in which it swells, and
    /// before its last, in which it fades, m.
    TrackingError,
    /// Root of the mean square of the same, m.
    TrackingRms,
    /// Largest error while at rest, m.
    HoldError,
    /// Half of the positions' range while at rest, m.
    HoldBand,
    /// Movement of the valve's command about its mean while at rest, V rms.
    CommandMovement,
    /// Largest error from 2 s after a disturbance, m.
    DisturbedError,
    /// From a disturbance until the error stays within 0.05 mm, s.
    ReturnTime,
}

impl fmt::Display for Case {
    /// A few words.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Move => "move 60 mm",
            Self::SlowSine => "sine 60 mm, 0.5 Hz",
            Self::FastSine => "sine 60 mm, 1 Hz",
            Self::Hold => "hold 30 s",
            Self::Payload => "payload doubled",
            Self::Supply => "supply 7 to 5 bar",
            Self::Push => "push of 10 N",
        })
    }
}

impl fmt::Display for Measure {
    /// A few words.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::EndError => "error from 0.3 s after moves",
            Self::Overshoot => "overshoot",
            Self::TrackingError => "largest error",
            Self::TrackingRms => "RMS error",
            Self::HoldError => "largest error",
            Self::HoldBand => "half of the positions' range",
            Self::CommandMovement => "command, RMS",
            Self::DisturbedError => "error from 2 s after it",
            Self::ReturnTime => "back within 0.05 mm after",
        })
    }
}

impl Measure {
    /// How it is shown.
    pub fn unit(self) -> FigureUnit {
        match self {
            Self::CommandMovement => FigureUnit::Millivolts,
            Self::ReturnTime => FigureUnit::Seconds,
            _ => FigureUnit::Millimetres,
        }
    }

    /// What it must not exceed, if anything.
    pub fn mark(self, case: Case) -> Option<f64> {
        match (self, case) {
            (Self::EndError, Case::Move) => Some(3e-5),
            (Self::EndError | Self::DisturbedError, _) => Some(RETURNED_M),
            (Self::Overshoot, Case::Move) => Some(2e-4),
            (Self::TrackingError, Case::SlowSine) => Some(3.5e-4),
            (Self::TrackingError, Case::FastSine) => Some(7e-4),
            (Self::HoldError, _) => Some(1.5e-5),
            (Self::CommandMovement, _) => Some(0.020),
            _ => None,
        }
    }
}

/// The figures of one case.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredCase {
    /// Which.
    pub case: Case,
    /// Its figures.
    pub measures: Vec<(Measure, f64)>,
    /// Whether the load ran against an end of its stroke.
    pub hit_end_stop: bool,
    /// Whether the controller saw a fault, where there is none.
    pub saw_fault: bool,
}

/// The figures of one seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The seed of the wrongly known rig and of the noise.
    pub seed: u64,
    /// Every case.
    pub cases: Vec<MeasuredCase>,
}

impl Score {
    /// One figure.
    pub fn get(&self, case: Case, measure: Measure) -> Option<f64> {
        let measured = self.cases.iter().find(|measured| measured.case == case)?;
        let found = measured
            .measures
            .iter()
            .find(|(candidate, _)| *candidate == measure)?;
        Some(found.1)
    }
}

/// Why a score could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// The rig is no whole axis.
    #[error("{}: {}; expected {}", .0.key, .0.problem, .0.expected)]
    Rig(AxisFault),
    /// A controller gave no command.
    #[error(transparent)]
    Drive(#[from] DriveError),
}

impl From<AxisFault> for ScoreError {
    fn from(fault: AxisFault) -> Self {
        Self::Rig(fault)
    }
}

/// A new controller for a rig as it is known.
pub type Factory<'a> = dyn Fn(&Rig) -> Result<Box<dyn Drive>, AxisFault> + Sync + 'a;

/// Runs the cases for every seed, on all processors.
pub fn score(
    rig: &Rig,
    factory: &Factory,
    cases: &[Case],
    seeds: &[u64],
) -> Result<Vec<Score>, ScoreError> {
    let score = |seed: &u64| -> Result<Score, ScoreError> {
        let measured = cases
            .par_iter()
            .map(|case| measure(rig, factory, *case, *seed));
        let cases = measured.collect::<Result<_, _>>()?;
        Ok(Score { seed: *seed, cases })
    };
    seeds.par_iter().map(score).collect()
}

/// One case with one seed.
pub fn run_case(rig: &Rig, factory: &Factory, case: Case, seed: u64) -> Result<Run, ScoreError> {
    let mut drive = factory(&wrongly_known(rig, seed))?;
    let motion = case.motion();
    let settings = PlantSettings {
        events: case.events(rig),
        ..PlantSettings::at(motion.start_m(), seed)
    };
    let mut plant = Plant::new(rig, settings)?;
    let course = Course::whole(motion, PlantSettings::TICK_S);
    Ok(run(&mut plant, drive.as_mut(), &course)?)
}

fn measure(
    rig: &Rig,
    factory: &Factory,
    case: Case,
    seed: u64,
) -> Result<MeasuredCase, ScoreError> {
    let run = run_case(rig, factory, case, seed)?;
    let motion = case.motion();
    let measures = match case {
        Case::Move | Case::Payload => vec![
            (Measure::EndError, end_error_m(&run, &motion)),
            (Measure::Overshoot, largest_overshoot_m(&run, &motion)),
        ],
        Case::SlowSine | Case::FastSine => tracking(&run, &motion),
        Case::Hold => holding(&run, &motion),
        Case::Supply | Case::Push => {
            let mut measures = returning(&run, &case.events(rig));
            measures.push((Measure::EndError, end_error_m(&run, &motion)));
            measures
        }
    };
    Ok(MeasuredCase {
        case,
        measures,
        hit_end_stop: run.end_stop.is_some(),
        saw_fault: run.first_fault().is_some(),
    })
}

/// Moves, each with the time at which the rest after it ends, s.
fn moves_with_rests(motion: &Motion) -> impl Iterator<Item = (&Placed, f64)> {
    let parts = motion.parts();
    let pairs = parts.iter().zip(parts.iter().skip(1));
    pairs
        .filter(|(moving, _)| matches!(moving.segment, Segment::Move { .. }))
        .map(|(moving, resting)| (moving, resting.end_s))
}

fn end_error_m(run: &Run, motion: &Motion) -> f64 {
    moves_with_rests(motion)
        .map(|(moving, end_s)| worst_m(run.between(moving.end_s + AFTER_MOVE_S, end_s)))
        .fold(0.0, f64::max)
}

fn largest_overshoot_m(run: &Run, motion: &Motion) -> f64 {
    moves_with_rests(motion)
        .map(|(moving, end_s)| overshoot_m(run, moving, end_s))
        .fold(0.0, f64::max)
}

fn tracking(run: &Run, motion: &Motion) -> Vec<(Measure, f64)> {
    let sines = motion.parts().iter().filter_map(|part| match part.segment {
        Segment::Sine { frequency_hz, .. } => {
            let period_s = 1.0 / frequency_hz;
            Some(run.between(part.begin_s + period_s, part.end_s - period_s))
        }
        Segment::Hold { .. } | Segment::Move { .. } => None,
    });
    sines
        .flat_map(|rows| {
            [
                (Measure::TrackingError, worst_m(rows)),
                (Measure::TrackingRms, rms_m(rows)),
            ]
        })
        .collect()
}

fn holding(run: &Run, motion: &Motion) -> Vec<(Measure, f64)> {
    let end_s = motion.duration_s();
    let rows = run.between(end_s - HOLD_S, end_s);
    let positions_m = || rows.iter().map(|row| row.truth.position_m);
    let highest_m = positions_m().fold(f64::NEG_INFINITY, f64::max);
    let lowest_m = positions_m().fold(f64::INFINITY, f64::min);
    vec![
        (Measure::HoldError, worst_m(rows)),
        (Measure::HoldBand, 0.5 * (highest_m - lowest_m)),
        (Measure::CommandMovement, command_movement_v(rows)),
    ]
}

fn returning(run: &Run, events: &[Event]) -> Vec<(Measure, f64)> {
    let (mut error_m, mut time_s) = (0.0_f64, 0.0_f64);
    for event in events {
        let end_s = event.at_s + RECOVERY_S + 1.0;
        let outside = |row: &&Row| row.error_m().abs() > RETURNED_M;
        let rows = run.between(event.at_s, end_s);
        let last_outside = rows.iter().rev().find(outside);
        time_s = time_s.max(last_outside.map_or(0.0, |row| row.truth.time_s - event.at_s));
        error_m = error_m.max(worst_m(run.between(event.at_s + RECOVERY_S, end_s)));
    }
    vec![
        (Measure::DisturbedError, error_m),
        (Measure::ReturnTime, time_s),
    ]
}
