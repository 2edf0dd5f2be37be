//! `pneuma demo`: the main job from end to end, on real recordings where they
//! are at hand, else on a simulated gas spring with concealed effects.

use super::diagnose::{self, DiagnoseArguments};
use super::{CommandError, inputs, outputs};
use crate::laws::{Law, Track};
use crate::model::Values;
use crate::random::Noise;
use crate::recording::Recording;
use crate::rig::Rig;
use clap::Args;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The rig of the demonstration: a closed gas spring on a test machine.
const RIG: &str = include_str!("../../rigs/gas-cylinder.toml");
/// Where the real recordings are looked for, and the folder among them.
const RECORDINGS: [&str; 2] = ["../shared/recordings", "real/gas-cylinder"];
/// Length and step of a simulated recording.
const SIMULATED_ROWS: usize = 6000;
const SIMULATED_STEP_S: f64 = 0.05;
/// What the simulated spring has and its rig file does not say.
const CONCEALED: [(&str, f64); 5] = [
    ("effects.gas-temperature-dynamics.memory_a", 1.0),
    ("effects.gas-temperature-dynamics.memory_b", 1.0),
    ("effects.gas-temperature-dynamics.conductance_a_W_K", 35.0),
    ("effects.gas-temperature-dynamics.conductance_b_W_K", 70.0),
    ("effects.dead-volume.volume_b_m3", 0.005),
];

/// Show the main job: recordings in, verdict, report and improved rig out.
#[derive(Args, Debug)]
pub struct DemoArguments {
    /// Folder for everything that is written.
    #[arg(long, default_value = "out/demo")]
    pub out: PathBuf,
}

/// Runs the command; the last line is the path of the report.
///
/// # Errors
/// If something cannot be written.
pub fn run(arguments: &DemoArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    fs::create_dir_all(&arguments.out)?;
    let rig_path = arguments.out.join("gas-cylinder.toml");
    outputs::write_text(&rig_path, RIG)?;
    let (train, held_out) = match real_recordings() {
        Some(pair) => {
            writeln!(
                out,
                "Two recordings of a gas spring on a test machine, measured by others:"
            )?;
            pair
        }
        None => {
            writeln!(
                out,
                "No real recordings here (looked in {}): a simulated gas spring with concealed effects:",
                RECORDINGS[0]
            )?;
            simulated(&arguments.out)?
        }
    };
    writeln!(
        out,
        "  learnt from {}\n  judged by   {}",
        train.display(),
        held_out.display()
    )?;
    let report = arguments.out.join("report.html");
    let request = DiagnoseArguments {
        rig: rig_path,
        train: vec![train],
        held_out: vec![held_out],
        json: Some(arguments.out.join("verdict.json")),
        report: Some(report.clone()),
        improved_rig: Some(arguments.out.join("improved.toml")),
        seed: 1,
    };
    diagnose::run(&request, out)?;
    let whole = fs::canonicalize(&report)?;
    writeln!(out, "{}", whole.display())?;
    Ok(())
}

fn real_recordings() -> Option<(PathBuf, PathBuf)> {
    let root = std::env::var_os("PNEUMA_RECORDINGS")
        .map_or_else(|| PathBuf::from(RECORDINGS[0]), PathBuf::from);
    let folder = root.join(RECORDINGS[1]);
    let train = folder.join("run-2021-07-26.exp");
    let held_out = folder.join("run-2022-01-28.exp");
    (train.is_file() && held_out.is_file()).then_some((train, held_out))
}

fn simulated(folder: &Path) -> Result<(PathBuf, PathBuf), CommandError> {
    let train = folder.join("train.txt");
    let held_out = folder.join("held-out.txt");
    outputs::write_text(&train, &gas_spring(0.11, 1)?)?;
    outputs::write_text(&held_out, &gas_spring(0.17, 2)?)?;
    Ok((train, held_out))
}

/// A recording of the spring with its concealed effects, swung at two
/// frequencies, as text.
fn gas_spring(frequency_hz: f64, seed: u64) -> Result<String, CommandError> {
    let concealed: BTreeMap<String, f64> = CONCEALED
        .iter()
        .map(|&(key, value)| (key.into(), value))
        .collect();
    let rig = Rig::parse(RIG, "gas-cylinder.toml")
        .map_err(inputs::bad_input)?
        .with_values(&concealed);
    let time_s: Vec<f64> = (0..SIMULATED_ROWS)
        .map(|row| row as f64 * SIMULATED_STEP_S)
        .collect();
    let position = |t: f64| {
        let turn = std::f64::consts::TAU * frequency_hz;
        1.0 + 0.5 * (turn * t).sin() + 0.3 * (0.31 * turn * t).sin()
    };
    let x: Vec<f64> = time_s.iter().map(|&t| position(t)).collect();
    let flat = vec![0.0; SIMULATED_ROWS];
    let signals = [
        ("x", x.clone()),
        ("v", flat),
        ("p_a", vec![6e5; SIMULATED_ROWS]),
        ("p_b", vec![9e5; SIMULATED_ROWS]),
    ];
    let signals = signals
        .map(|(name, column)| (name.to_owned(), column))
        .into_iter()
        .collect();
    let recording = Recording::from_signals("demo", time_s, signals);
    let track = Track::new(&recording);
    let values = Values::<f64> {
        rig: &rig,
        keys: &[],
        replaced: &[],
    };
    let mut text = String::from(
        "#time(s) Pos(in) Spd(in/s) UpperSpringPressure(psia) LowerSpringPressure(psia)\n",
    );
    let mut noise = Noise::new(seed, 0);
    let motion = track.motion.as_ref();
    let mut write = |row: usize, outputs: &[f64], _: &[f64]| {
        let speed = motion.map_or(0.0, |motion| motion.velocity_m_per_s[row]);
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "{:.3} {:.3} {:.3} {:.3} {:.3}",
            recording.time_s[row],
            x[row] / 0.0254,
            speed / 0.0254,
            (outputs[0] + 140.0 * noise.normal()) / 6894.757,
            (outputs[1] + 140.0 * noise.normal()) / 6894.757,
        );
    };
    let start = [6e5, 9e5, 293.15, 293.15];
    Law::Chambers.predict(&values, &track, 0..recording.len(), &start, &mut write);
    Ok(text)
}
