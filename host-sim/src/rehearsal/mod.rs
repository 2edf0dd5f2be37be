//! What to record next, as the simulated axis would record it: the bank of experiments that the
//! diagnosis asks ([`Bank`]).

mod bank;
mod program;

use crate::closed_loop::{Course, HostController, control_task, run};
use crate::laws::Law;
use crate::motion::Motion;
use crate::plant::{Plant, PlantSettings, Seen, seen};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::scenario::stroke_range_m;
use bank::{Excitation, Place, Procedure, SetUp};
use diagnosis::search::next_experiment::{Bank, Experiment, Recorded};

/// The experiments of whole axes.
pub struct Rehearsals {
    of_chambers: Vec<Box<dyn Experiment>>,
    of_carriage: Vec<Box<dyn Experiment>>,
}

impl Rehearsals {
    /// All of them.
    pub fn all() -> Self {
        let boxed = |all: &'static [Procedure]| -> Vec<Box<dyn Experiment>> {
            all.iter().map(|one| Box::new(one) as _).collect()
        };
        Self {
            of_chambers: boxed(bank::OF_CHAMBERS),
            of_carriage: boxed(bank::OF_CARRIAGE),
        }
    }
}

/// The experiment file of a recording that was asked for in these words; none where the rig does not
/// say enough of the axis.
pub fn experiment_file(text: &str, rig: &Rig) -> Option<String> {
    let mut all = bank::OF_CHAMBERS.iter().chain(bank::OF_CARRIAGE);
    program::of(all.find(|one| one.text == text)?, rig)
}

impl Bank for Rehearsals {
    fn of(&self, law: Law) -> &[Box<dyn Experiment>] {
        match law {
            Law::Chambers => &self.of_chambers,
            Law::Balance => &self.of_carriage,
            _ => &[],
        }
    }
}

impl Experiment for &'static Procedure {
    fn text(&self) -> &'static str {
        self.text
    }

    fn set_up(&self, rig: &Rig) -> Rig {
        match &self.excitation {
            Excitation::Tracked { set_up, .. } => set_up.applied(rig),
            Excitation::Clamped { .. } | Excitation::ByHand { .. } => rig.clone(),
        }
    }

    fn recorded(&self, rig: &Rig, step_s: f64, seed: u64) -> Option<Vec<Recorded>> {
        let stroke_m = stroke_range_m(rig)?;
        let place = Place::within(stroke_m);
        match &self.excitation {
            Excitation::Clamped {
                places,
                seconds,
                command,
            } => {
                let command = command(rig.value("valve.null_V")?);
                let time_s = times(*seconds, step_s);
                let driven = |share: &f64| Recorded::Driven {
                    position_m: vec![
                        stroke_m[0] + share * (stroke_m[1] - stroke_m[0]);
                        time_s.len()
                    ],
                    command_v: time_s.iter().map(|&time| command.at(time)).collect(),
                    time_s: time_s.clone(),
                };
                Some(places.iter().map(driven).collect())
            }
            Excitation::ByHand {
                seconds,
                frequencies_hz,
            } => {
                let time_s = times(*seconds, step_s);
                let at = |&time: &f64| by_hand(time, *seconds, frequencies_hz, place);
                Some(vec![Recorded::Driven {
                    position_m: time_s.iter().map(at).collect(),
                    command_v: vec![rig.value("valve.null_V")?; time_s.len()],
                    time_s,
                }])
            }
            Excitation::Tracked { motion, .. } => {
                Some(vec![Recorded::Whole(tracked(rig, &motion(place), seed)?)])
            }
        }
    }
}

impl SetUp {
    /// The rig with the change, as far as it has the numbers.
    fn applied(self, rig: &Rig) -> Rig {
        let ambient_pa = rig.ambient_pressure_pa();
        let sign = if self.is_turned { -1.0 } else { 1.0 };
        let changed = |key: &str, change: &dyn Fn(f64) -> f64| {
            rig.value(key).map(|value| (key.to_owned(), change(value)))
        };
        let values = [
            changed("carriage.mass_kg", &|mass_kg| mass_kg + self.payload_kg),
            changed("carriage.external_force_N", &|force_n| sign * force_n),
            changed("effects.constant-force.force_N", &|force_n| sign * force_n),
            changed("supply.pressure_Pa", &|pressure_pa| {
                ambient_pa + self.supply * (pressure_pa - ambient_pa)
            }),
        ];
        rig.with_values(&values.into_iter().flatten().collect())
    }
}

/// The controller, which knows the rig, moving its load; none where it trips or runs into an
/// end: an experiment that nobody would get to record.
fn tracked(rig: &Rig, motion: &Motion, seed: u64) -> Option<Recording> {
    let mut plant = Plant::new(rig, PlantSettings::at(motion.start_m(), seed)).ok()?;
    let mut drive = HostController::new(control_task(rig).ok()?);
    let course = Course::whole(motion.clone(), PlantSettings::TICK_S);
    let run = run(&mut plant, &mut drive, &course).ok()?;
    if run.first_fault().is_some() || run.end_stop.is_some() {
        return None;
    }
    let column = |value: fn(&Seen) -> f64| -> Vec<f64> {
        run.rows
            .iter()
            .map(|row| value(&seen(&row.sample.codes)))
            .collect()
    };
    let signals = [
        ("x", column(|seen| seen.position_m)),
        ("v", column(|seen| seen.velocity_m_s)),
        ("p_a", column(|seen| seen.pressure_a_pa)),
        ("p_b", column(|seen| seen.pressure_b_pa)),
        (
            "u",
            run.rows.iter().map(|row| row.truth.command_v).collect(),
        ),
    ];
    let signals = signals.map(|(name, column)| (name.to_owned(), column));
    let time_s = run.rows.iter().map(|row| row.truth.time_s).collect();
    Some(Recording::from_signals("simulated", time_s, signals.into()))
}

fn times(seconds: f64, step_s: f64) -> Vec<f64> {
    let rows = (seconds / step_s).round() as usize;
    (0..=rows).map(|row| row as f64 * step_s).collect()
}

/// Equal times at each frequency, whole periods or not: a hand does not begin anew.
fn by_hand(time_s: f64, seconds: f64, frequencies_hz: &[f64], place: Place) -> f64 {
    let each_s = seconds / frequencies_hz.len() as f64;
    let turns: f64 = frequencies_hz
        .iter()
        .enumerate()
        .map(|(number, frequency_hz)| {
            frequency_hz * (time_s - number as f64 * each_s).clamp(0.0, each_s)
        })
        .sum();
    place.middle_m + place.half_stroke_m * libm::sin(std::f64::consts::TAU * turns)
}
