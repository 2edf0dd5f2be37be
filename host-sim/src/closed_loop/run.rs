//! A motion run through, row by row.

use super::drive::{Drive, DriveError};
use crate::motion::{Motion, as_sent};
use crate::plant::{self, EndStop, Plant};
use firmware::codes::{AdcCodes, DacCode};
use firmware::link::CommandRecord;
use firmware::tick::{Sample, State};
use model_core::reference::Reference;

/// What happened at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// What the controller was told.
    pub sample: Sample,
    /// What it answered.
    pub command: CommandRecord,
    /// What was true, with the valve's voltage from this tick to the next.
    pub truth: plant::Sample,
}

impl Row {
    /// How far the load is from where it should be, m.
    pub fn error_m(&self) -> f64 {
        self.truth.position_m - f64::from(self.sample.reference.position_m)
    }

    /// How far the observer's position is from the true one, m.
    pub fn error_of_belief_m(&self) -> f64 {
        f64::from(self.command.estimate[0]) - self.truth.position_m
    }

    /// The voltage that answers this row's sample.
    pub fn commanded_v(&self) -> f64 {
        plant::valve_v(self.command.valve)
    }
}

/// A closed-loop run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// A row per tick.
    pub rows: Vec<Row>,
    /// The first hit of an end stop, if there was one.
    pub end_stop: Option<EndStop>,
}

impl Run {
    /// The first tick at which the controller was in fault, if there was one.
    pub fn first_fault(&self) -> Option<&Row> {
        let in_fault = State::Fault as u8;
        self.rows.iter().find(|row| row.command.state == in_fault)
    }
}

/// What is asked of the load: the motion, and for how long.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// The reference.
    pub motion: Motion,
    /// Ticks to run.
    pub ticks: u32,
}

impl Course {
    /// The whole of a motion.
    pub fn whole(motion: Motion, tick_s: f64) -> Self {
        let ticks = (motion.duration_s() / tick_s).ceil() as u32;
        Self { motion, ticks }
    }
}

/// What a controller drives, tick by tick.
pub trait Driven {
    /// Time of the present tick, s.
    fn time_s(&self) -> f64;
    /// What is true now, as far as it is known.
    fn truth(&self) -> plant::Sample;
    /// What the sensors show now, on the scales of the link.
    fn sample(&mut self) -> AdcCodes;
    /// One tick's time under the present command; then this one takes over.
    fn advance(&mut self, command: DacCode) -> Result<(), DriveError>;
    /// The first hit of an end stop, if there was one.
    fn end_stop(&self) -> Option<EndStop>;
}

impl Driven for Plant {
    fn time_s(&self) -> f64 {
        Self::time_s(self)
    }

    fn truth(&self) -> plant::Sample {
        Self::truth(self)
    }

    fn sample(&mut self) -> AdcCodes {
        Self::sample(self)
    }

    fn advance(&mut self, command: DacCode) -> Result<(), DriveError> {
        Self::advance(self, command);
        Ok(())
    }

    fn end_stop(&self) -> Option<EndStop> {
        Self::end_stop(self)
    }
}

/// Runs a course.
pub fn run(
    plant: &mut dyn Driven,
    drive: &mut dyn Drive,
    course: &Course,
) -> Result<Run, DriveError> {
    let mut rows = Vec::with_capacity(course.ticks as usize);
    for tick in 0..course.ticks {
        let reference: Reference<f64> = course.motion.at(plant.time_s());
        let truth = plant.truth();
        let sample = Sample {
            tick,
            codes: plant.sample(),
            reference: as_sent(&reference),
        };
        let command = drive.command(&sample)?;
        plant.advance(command.valve)?;
        rows.push(Row {
            sample,
            command,
            truth,
        });
    }
    Ok(Run {
        rows,
        end_stop: plant.end_stop(),
    })
}
