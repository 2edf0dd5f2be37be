//! `pneuma loop`: a controller and the plant, taking turns.

use super::foreign_plant::ForeignArguments;
use super::inputs::rig_fault;
use super::{CommandError, inputs, outputs, wiring_of};
use crate::charts;
use crate::closed_loop::transcript::{self, Replay};
use crate::closed_loop::{
    Course, Drive, HostController, Judged, RemoteController, Run, judge, recorded,
    run as run_course, wired_task, wrongly_known,
};
use crate::motion::{self, Motion};
use crate::plant::{Event, Plant, PlantSettings};
use crate::recording::MAXIMUM_ROWS;
use crate::report::number;
use crate::rig::Rig;
use crate::text::file_name;
use clap::Args;
use firmware::fault::DESCRIPTIONS;
use firmware::settings::Wiring;
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long a controller may take for its greeting or a command, s.
const PATIENCE: Duration = Duration::from_secs(30);
/// How long the firmware may take to be built and to start, s.
const START_PATIENCE: Duration = Duration::from_secs(600);
/// How often it is asked whether it listens yet.
const ASK_EVERY: Duration = Duration::from_millis(100);

/// Run the controller against the simulated plant: on the host, in QEMU, or at
/// the end of a link.
///
/// The motion is a mixture of moves, sines and holds unless a motion file says
/// otherwise. The recording is read by inspect, compare and diagnose with the
/// same rig.
#[derive(Args, Debug)]
pub struct LoopArguments {
    /// The plant, and what the controller knows of it.
    #[arg(long)]
    pub rig: PathBuf,
    /// What the controller knows of the plant, where that differs.
    #[arg(long)]
    pub controller_rig: Option<PathBuf>,
    /// Let the controller know every uncertain number wrongly, drawn by this seed.
    #[arg(long, conflicts_with_all = ["qemu", "connect", "controller_rig"])]
    pub wrongly_known: Option<u64>,
    /// The motion file; a mixture of moves, sines and holds without one.
    #[arg(long)]
    pub motion: Option<PathBuf>,
    /// Seed of the sensors' noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How long to run: a shorter time cuts the motion off, a longer one repeats it.
    #[arg(long)]
    pub seconds: Option<f64>,
    /// The controller is a board as delivered, whose wiring nobody has checked: it follows no
    /// reference.
    #[arg(long, conflicts_with = "connect")]
    pub unchecked: bool,
    /// Another tool's plant.
    #[command(flatten)]
    pub foreign: ForeignArguments,
    /// Run the firmware in QEMU in the controller's place.
    #[arg(long)]
    pub qemu: bool,
    /// Run a controller in its place that listens here, such as 127.0.0.1:7000.
    #[arg(long, conflicts_with = "qemu")]
    pub connect: Option<String>,
    /// Write the recording here, a CSV file that the rig's signals read.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write what went over the link here: every frame, in order.
    #[arg(long)]
    pub transcript: Option<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Answer the samples of this transcript again and compare every command to
    /// the byte; nothing else is run.
    #[arg(long, conflicts_with_all = ["qemu", "connect", "motion", "seconds", "out", "transcript", "report", "wrongly_known"])]
    pub replay: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// If an input cannot be used, a controller does not answer, a replay differs
/// or an output cannot be written.
pub fn run(arguments: &LoopArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let outputs = [&arguments.out, &arguments.transcript, &arguments.report];
    outputs::check_outputs(
        &input_files(arguments),
        &outputs.into_iter().flatten().collect::<Vec<_>>(),
    )?;
    let known = arguments.controller_rig.as_ref().unwrap_or(&arguments.rig);
    let controller_rig = inputs::read_rig(known)?;
    if let Some(path) = &arguments.replay {
        let wiring = wiring_of(arguments.unchecked);
        return replay(path, (&controller_rig, known), wiring, out);
    }
    let rig = inputs::read_rig(&arguments.rig)?;
    let controller_rig = match arguments.wrongly_known {
        Some(seed) => wrongly_known(&controller_rig, seed),
        None => controller_rig,
    };
    let (motion, events) = motion_of(arguments)?;
    let known = (&rig, &controller_rig);
    let (run, tick_s) = driven(arguments, known, (&motion, events), out)?;
    let judged = judge(&run, &motion);
    write_outputs(arguments, &rig, &run, &judged, tick_s)?;
    summarise((&run, &judged), arguments.foreign.whose_position(), out)?;
    if arguments.unchecked {
        writeln!(
            out,
            "the controller's wiring is unchecked: it follows no reference"
        )?;
    }
    Ok(())
}

fn input_files(arguments: &LoopArguments) -> Vec<&PathBuf> {
    let more = [
        &arguments.controller_rig,
        &arguments.motion,
        &arguments.replay,
        &arguments.foreign.plant,
    ];
    std::iter::once(&arguments.rig)
        .chain(more.into_iter().flatten())
        .collect()
}

fn motion_of(arguments: &LoopArguments) -> Result<(Motion, Vec<Event>), CommandError> {
    let (motion, events) = match &arguments.motion {
        Some(path) => motion::read::read(path).map_err(inputs::bad_input)?,
        None => (Motion::mixed(), Vec::new()),
    };
    if let Some(seconds) = arguments.seconds
        && !(seconds > 0.0 && seconds <= LONGEST_RUN_S)
    {
        return Err(inputs::bad_input(format!(
            "--seconds: is {seconds}, expected a time above 0 s and at most {LONGEST_RUN_S} s"
        )));
    }
    // What happens to the simulated plant does not happen to another one.
    if arguments.foreign.plant.is_some() && !events.is_empty() {
        return Err(inputs::bad_input(
            "--plant: the motion file has events, which change the simulated plant only, expected a motion without",
        ));
    }
    Ok((motion.repeated(arguments.seconds.unwrap_or(0.0)), events))
}

/// Three hours of rows fill some gigabytes.
const LONGEST_RUN_S: f64 = 10_000.0;

/// Runs the motion with the controller that is asked for; also its tick, s.
fn driven(
    arguments: &LoopArguments,
    (rig, controller_rig): (&Rig, &Rig),
    (motion, events): (&Motion, Vec<Event>),
    out: &mut dyn Write,
) -> Result<(Run, f64), CommandError> {
    let task = || {
        let known = arguments.controller_rig.as_ref().unwrap_or(&arguments.rig);
        let wiring = wiring_of(arguments.unchecked);
        wired_task(controller_rig, wiring).map_err(|fault| rig_fault(known, fault))
    };
    let run_with = |drive: &mut dyn Drive, tick_s: f64| {
        check_range(rig, motion)?;
        check_rows(arguments, motion, tick_s)?;
        let course = course(arguments, motion, tick_s);
        if let Some(mut plant) = arguments.foreign.open(rig, tick_s, out)? {
            return run_course(&mut plant, drive, &course).map_err(inputs::bad_input);
        }
        let settings = PlantSettings {
            tick_s,
            events,
            ..PlantSettings::at(motion.start_m(), arguments.seed)
        };
        let plant = Plant::new(rig, settings);
        let mut plant = plant.map_err(|fault| rig_fault(&arguments.rig, fault))?;
        run_course(&mut plant, drive, &course).map_err(inputs::bad_input)
    };
    let address = match &arguments.connect {
        Some(address) => address.clone(),
        None if arguments.qemu => {
            return in_qemu(arguments, run_with);
        }
        None => {
            let mut drive = HostController::new(task()?);
            let tick_s = PlantSettings::TICK_S;
            return Ok((run_with(&mut drive, tick_s)?, tick_s));
        }
    };
    let stream = TcpStream::connect(&address)
        .map_err(|error| inputs::bad_input(format!("{address}: nobody answers: {error}")))?;
    remotely(stream, run_with)
}

/// Runs with the controller at the other end of a stream and ends the run.
fn remotely(
    stream: TcpStream,
    run_with: impl FnOnce(&mut dyn Drive, f64) -> Result<Run, CommandError>,
) -> Result<(Run, f64), CommandError> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let mut drive = RemoteController::greet(stream).map_err(inputs::bad_input)?;
    let tick_s = drive.tick_s();
    let run = run_with(&mut drive, tick_s);
    let mut stream = drive.end().map_err(inputs::bad_input)?;
    // The controller may still have something to say, then hangs up.
    let mut rest = Vec::new();
    let _ = stream.read_to_end(&mut rest);
    Ok((run?, tick_s))
}

/// Starts the firmware in QEMU beside this program and runs with it.
fn in_qemu(
    arguments: &LoopArguments,
    run_with: impl FnOnce(&mut dyn Drive, f64) -> Result<Run, CommandError>,
) -> Result<(Run, f64), CommandError> {
    let address = free_address()?;
    let known = arguments.controller_rig.as_ref().unwrap_or(&arguments.rig);
    let mut child = Command::new("cargo")
        .args(["xtask", "qemu", "--rig"])
        .arg(known)
        .args(["--serial", &address])
        .args(arguments.unchecked.then_some("--unchecked"))
        .stdout(Stdio::null())
        .spawn()
        .map_err(|error| {
            inputs::bad_input(format!("cargo xtask qemu: cannot be started: {error}"))
        })?;
    let outcome =
        connect_when_ready(&mut child, &address).and_then(|stream| remotely(stream, run_with));
    if outcome.is_err() {
        let _ = child.kill();
    }
    let status = child.wait()?;
    let outcome = outcome?;
    if !status.success() {
        return Err(inputs::bad_input(format!("cargo xtask qemu: {status}")));
    }
    Ok(outcome)
}

/// A port of this machine that nobody listens at.
fn free_address() -> Result<String, CommandError> {
    let listener = std::net::TcpListener::bind("127.0.0.1:0")?;
    Ok(listener.local_addr()?.to_string())
}

fn connect_when_ready(child: &mut Child, address: &str) -> Result<TcpStream, CommandError> {
    let begin = Instant::now();
    loop {
        if let Ok(stream) = TcpStream::connect(address) {
            return Ok(stream);
        }
        if let Some(status) = child.try_wait()? {
            return Err(inputs::bad_input(format!(
                "cargo xtask qemu: ended before it listened: {status}"
            )));
        }
        if begin.elapsed() > START_PATIENCE {
            return Err(inputs::bad_input(
                "cargo xtask qemu: the firmware did not start in time",
            ));
        }
        std::thread::sleep(ASK_EVERY);
    }
}

fn course(arguments: &LoopArguments, motion: &Motion, tick_s: f64) -> Course {
    let mut course = Course::whole(motion.clone(), tick_s);
    if let Some(seconds) = arguments.seconds {
        course.ticks = (seconds / tick_s).round() as u32;
    }
    course
}

/// A motion beyond the stroke would only show the end stops.
fn check_range(rig: &Rig, motion: &Motion) -> Result<(), CommandError> {
    let Some([low_m, high_m]) = crate::scenario::stroke_range_m(rig) else {
        return Ok(());
    };
    let [least_m, most_m] = motion.range_m();
    if least_m < low_m || most_m > high_m {
        return Err(inputs::bad_input(format!(
            "the motion goes from {least_m} m to {most_m} m, expected it within the stroke, {low_m} m to {high_m} m"
        )));
    }
    Ok(())
}

/// Every tick is a row in memory until the run ends.
fn check_rows(arguments: &LoopArguments, motion: &Motion, tick_s: f64) -> Result<(), CommandError> {
    let ticks = course(arguments, motion, tick_s).ticks as usize;
    if ticks <= MAXIMUM_ROWS {
        return Ok(());
    }
    Err(inputs::bad_input(format!(
        "the run takes {ticks} ticks of {tick_s} s, expected at most {MAXIMUM_ROWS}; shorten it with --seconds"
    )))
}

// what comes out

fn write_outputs(
    arguments: &LoopArguments,
    rig: &Rig,
    run: &Run,
    judged: &[Judged],
    tick_s: f64,
) -> Result<(), CommandError> {
    if let Some(path) = &arguments.out {
        let name = arguments.rig.display().to_string();
        let table = recorded(run, rig, &name).map_err(inputs::bad_input)?;
        outputs::write_with(path, |out| table.write(out))?;
    }
    if let Some(path) = &arguments.transcript {
        let tick_period_ns = (1e9 * tick_s).round() as u32;
        outputs::write_with(path, |out| transcript::write(run, tick_period_ns, out))?;
    }
    if let Some(path) = &arguments.report {
        let how = inputs::provenance(input_files(arguments)).fact("seed", arguments.seed);
        let name = arguments.rig.file_stem().unwrap_or_default();
        let title = format!("Closed loop: {}", name.to_string_lossy());
        outputs::write_page(path, &charts::closed_loop_page(&title, run, judged, how))?;
    }
    Ok(())
}

fn summarise(
    (run, judged): (&Run, &[Judged]),
    whose_position: &str,
    out: &mut dyn Write,
) -> std::io::Result<()> {
    writeln!(
        out,
        "{:<32} {:>8} {:>9} {:>9} {:>10} {:>9} {:>10}",
        "part", "from s", "worst mm", "rms mm", "beyond mm", "rest mm", "command mV"
    )?;
    for judged in judged {
        let optional = |value: Option<f64>, decimals| {
            value.map_or("-".into(), |value| number::fixed(1e3 * value, decimals))
        };
        writeln!(
            out,
            "{:<32} {:>8} {:>9} {:>9} {:>10} {:>9} {:>10}",
            judged.part.segment.to_string(),
            number::fixed(judged.part.begin_s, 2),
            number::fixed(1e3 * judged.worst_m, 3),
            number::fixed(1e3 * judged.rms_m, 3),
            optional(judged.overshoot_m, 3),
            optional(judged.at_rest_m, 3),
            optional(judged.command_movement_v, 1),
        )?;
    }
    if let Some(stop) = &run.end_stop {
        writeln!(
            out,
            "note: at {} s the carriage ran against the end of its stroke at {} mm",
            number::fixed(stop.time_s, 3),
            number::fixed(1e3 * stop.position_m, 1)
        )?;
    }
    if let Some(row) = run.first_fault() {
        writeln!(
            out,
            "note: at {} s the controller went into fault {}: {}",
            number::fixed(row.truth.time_s, 3),
            row.command.fault,
            fault_name(row.command.fault)
        )?;
    }
    writeln!(
        out,
        "{whose_position} against the reference; beyond: past the end of the move before; \
         rest: from 0.3 s on; command: rms about its mean"
    )?;
    out.flush()
}

/// The name of a fault's code.
fn fault_name(code: u8) -> &'static str {
    let described = DESCRIPTIONS
        .iter()
        .find(|description| description.fault.code() == code);
    described.map_or("unknown", |description| description.name)
}

// replay

fn replay(
    path: &Path,
    (rig, rig_path): (&Rig, &Path),
    wiring: Wiring,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let name = file_name(&path.display().to_string());
    let file = File::open(path)
        .map_err(|error| inputs::bad_input(format!("{name}: cannot be read: {error}")))?;
    let task = wired_task(rig, wiring).map_err(|fault| rig_fault(rig_path, fault))?;
    let replay = transcript::replay(BufReader::new(file), task)
        .map_err(|error| inputs::bad_input(format!("{name}: {error}")))?;
    let Replay {
        ticks,
        first_difference,
        differences,
    } = replay;
    match first_difference {
        None => writeln!(out, "{name}: {ticks} commands, all the same to the byte")?,
        Some((recorded, recomputed)) => {
            return Err(inputs::bad_input(format!(
                "{name}: {differences} of {ticks} commands differ, the first at tick {}: \
                 recorded {recorded:?}, recomputed {recomputed:?}",
                recorded.tick
            )));
        }
    }
    Ok(())
}
