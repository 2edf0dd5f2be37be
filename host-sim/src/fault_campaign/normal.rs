//! Hard motion with everything that is no fault: nothing may trip.

use super::run::Supervised;
use crate::closed_loop::ScoreError;
use crate::motion::{Limits, Motion, Segment, as_sent};
use crate::plant::{Change, Event, Plant, PlantSettings};
use crate::rig::Rig;
use firmware::fault::Fault;
use firmware::tick::Sample;

/// Length of one run, s.
pub const NORMAL_RUN_S: f64 = 30.0;

/// One run without a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalRun {
    /// Time that was run, s.
    pub time_s: f64,
    /// The false trip, with its time, if there was one.
    pub trip: Option<(Fault, f64)>,
    /// Largest speed of the load, m/s.
    pub fastest_m_per_s: f64,
}

/// Moves over most of the stroke, sines, rests; seeds differ in what comes when.
fn motion(seed: u64) -> Motion {
    let go = |to_m| Segment::Move { to_m };
    let sine = |frequency_hz, amplitude_m| Segment::Sine {
        amplitude_m,
        frequency_hz,
        periods: 4,
    };
    let hold = Segment::Hold { seconds: 0.7 };
    let blocks: [&[Segment]; 4] = [
        &[go(0.2), go(-0.2), hold, go(0.0)],
        &[sine(1.0, 0.06), sine(0.5, 0.06)],
        &[go(0.06), hold, go(0.0), hold, go(-0.01), go(0.0)],
        &[sine(2.0, 0.03), hold],
    ];
    let mut segments = vec![Segment::Hold { seconds: 0.3 }];
    let mut place = seed as usize;
    while Motion::new(0.0, Limits::BRISK, &segments).duration_s() < NORMAL_RUN_S {
        segments.extend_from_slice(blocks[place % blocks.len()]);
        place += 1;
    }
    Motion::new(0.0, Limits::BRISK, &segments)
}

/// Nothing, twice the mass, 5 bar instead of 7, pushes of 10 N; by seed.
fn events(rig: &Rig, seed: u64) -> Vec<Event> {
    let at = |at_s, change| Event { at_s, change };
    let mass_kg = rig.value("carriage.mass_kg").unwrap_or_default();
    let supply_pa = rig.value("supply.pressure_Pa").unwrap_or_default();
    match seed % 4 {
        0 => Vec::new(),
        1 => vec![at(0.0, Change::Mass(2.0 * mass_kg))],
        2 => vec![
            at(5.03, Change::SupplyPressure(supply_pa * 5.0 / 7.0)),
            at(20.0, Change::SupplyPressure(supply_pa)),
        ],
        _ => vec![
            at(3.01, Change::Push(10.0)),
            at(12.0, Change::Push(-20.0)),
            at(21.0, Change::Push(10.0)),
        ],
    }
}

/// Runs hard motion; ends at the first trip.
pub fn normal_run(
    rig: &Rig,
    drive: &mut dyn Supervised,
    seed: u64,
) -> Result<NormalRun, ScoreError> {
    let motion = motion(seed);
    let settings = PlantSettings {
        events: events(rig, seed),
        ..PlantSettings::at(motion.start_m(), seed)
    };
    let mut plant = Plant::new(rig, settings)?;
    let mut result = NormalRun {
        time_s: 0.0,
        trip: None,
        fastest_m_per_s: 0.0,
    };
    for tick in 0..(NORMAL_RUN_S / PlantSettings::TICK_S) as u32 {
        let sample = Sample {
            tick,
            codes: plant.sample(),
            reference: as_sent(&motion.at(plant.time_s())),
        };
        result.fastest_m_per_s = result.fastest_m_per_s.max(plant.truth().velocity_m_s.abs());
        result.time_s = plant.time_s();
        let command = drive.command(&sample)?;
        if let Some(fault) = Fault::from_code(command.fault) {
            result.trip = Some((fault, result.time_s));
            break;
        }
        plant.advance(command.valve);
    }
    Ok(result)
}
