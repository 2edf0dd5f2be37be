//! Figure 14: the axis' answer to a step of the command.

use bench::{Kind, Picture};

use super::Figure;
use crate::rig::{ChamberModel, Rig};
use crate::scenario::{Command, Initial, Scenario, Segment, Shape};
use crate::simulate::{Simulation, simulate};

/// Integration steps in a row of 1 ms.
const STEPS_PER_ROW: u32 = 10;
/// Commands of the steps, V; the paper's is the first.
const COMMANDS_V: [f64; 4] = [4.0, 3.0, 2.0, 1.0];
/// When the command steps, s, and how long a step is followed.
const STEP_AT_S: f64 = 0.1;
const FOLLOWED_S: f64 = 0.4;

pub(super) fn figure(rig: &Rig) -> Result<Figure, String> {
    let mut reduced = rig.clone();
    if let Some(chambers) = reduced.chambers.as_mut() {
        chambers.model = ChamberModel::Polytropic;
    }
    let full = step(rig, COMMANDS_V[0])?;
    let other = step(&reduced, COMMANDS_V[0])?;
    let mut pictures = vec![
        pressures(&full, &other),
        picture("Position", ("position", "mm"), &full, &other, |one| {
            1e3 * one.position_m
        }),
        picture("Velocity", ("velocity", "m/s"), &full, &other, |one| {
            one.velocity_m_s
        }),
    ];
    let mut steps = Picture::new("Further steps", ("time", "s"), ("position", "mm"));
    for command_v in COMMANDS_V {
        let run = step(rig, command_v)?;
        let course = run
            .samples
            .iter()
            .map(|one| (one.time_s, 1e3 * one.position_m));
        steps = steps.with(format!("{command_v} V"), Kind::Law, course.collect());
    }
    pictures.push(steps);
    Ok(Figure {
        number: "14",
        title: "Open-loop step of the command",
        says: "A step to 4 V from the middle of the stroke: pressures, position and velocity.",
        assumed: "Moving mass 2 kg, dead volumes 25 cm³, the valve's areas (figure 6), when the step happens. No point of the figure is in the text, so that none stands here.",
        pictures,
    })
}

/// A step from the null, until the carriage leaves its stroke.
fn step(rig: &Rig, to_v: f64) -> Result<Simulation, String> {
    let null_v = rig.value("valve.null_V").unwrap_or(5.0);
    let shape = Shape::Step {
        at_s: STEP_AT_S,
        from_v: null_v,
        to_v,
    };
    let scenario = open_loop(rig, shape, STEP_AT_S + FOLLOWED_S, Initial::default());
    simulate(&scenario).map_err(|fault| fault.to_string())
}

/// An open-loop run of a rig.
pub(super) fn open_loop(rig: &Rig, shape: Shape, duration_s: f64, initial: Initial) -> Scenario {
    Scenario {
        name: "step".into(),
        rig_name: "paper.toml".into(),
        files: Vec::new(),
        rig: rig.clone(),
        duration_s,
        sample_s: 1e-3,
        steps_per_sample: STEPS_PER_ROW,
        initial,
        command: Command {
            segments: vec![Segment {
                start_s: 0.0,
                shape,
            }],
        },
        noise_seed: None,
        records_states: false,
    }
}

fn pressures(full: &Simulation, reduced: &Simulation) -> Picture {
    let mut picture = Picture::new(
        "Chamber pressures",
        ("time", "s"),
        ("pressure, absolute", "bar"),
    );
    for (name, run, kind) in [
        ("full balance (3)", full, Kind::Law),
        ("reduced model (6)", reduced, Kind::Given),
    ] {
        let a = run
            .samples
            .iter()
            .map(|one| (one.time_s, 1e-5 * one.pressure_a_pa));
        let b = run
            .samples
            .iter()
            .map(|one| (one.time_s, 1e-5 * one.pressure_b_pa));
        picture = picture.with(format!("A, {name}"), kind, a.collect()).with(
            format!("B, {name}"),
            kind,
            b.collect(),
        );
    }
    picture
}

fn picture(
    title: &str,
    scale: (&str, &str),
    full: &Simulation,
    reduced: &Simulation,
    of: fn(&crate::simulate::Sample) -> f64,
) -> Picture {
    let course = |run: &Simulation| {
        run.samples
            .iter()
            .map(|one| (one.time_s, of(one)))
            .collect()
    };
    Picture::new(title, ("time", "s"), scale)
        .with("full balance (3)", Kind::Law, course(full))
        .with("reduced model (6)", Kind::Given, course(reduced))
}
