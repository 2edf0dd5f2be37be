//! `pneuma board`: what a person tells a board.

use super::board_port::{BoardPort, with_board};
use super::board_run::{self, RunArguments};
use super::check_wiring::{self, CheckWiringArguments};
use super::inputs::{bad_input, read_rig, rig_fault};
use super::stop::stop_wish;
use super::{CommandError, wiring_of};
use crate::board::orders::{self, Move, OrderError, Progress};
use crate::board::port::Port;
use crate::board::twin::Twin;
use crate::board::words;
use crate::plant::PlantSettings;
use crate::report::number;
use clap::{Args, Subcommand};
use firmware::status::Status;
use firmware::tick::State;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Tell a board what to do, or ask how it is.
///
/// A board is at a serial port, or at HOST:PORT.
#[derive(Args, Clone, Debug)]
pub struct BoardArguments {
    /// What to tell it.
    #[command(subcommand)]
    pub order: BoardOrder,
}

/// What a board is told.
#[derive(Clone, Debug, Subcommand)]
pub enum BoardOrder {
    /// Say in words how the board is: its state, the cause of a fault and what to
    /// do, why it started, what it has counted.
    Status(BoardPort),
    /// Leave the fault. Nothing moves until it is asked anew; a cause that is
    /// still there brings the fault back, and the error says so.
    Acknowledge(BoardPort),
    /// Move the load to a place and tell how near it came. The board holds it
    /// there until it is told otherwise; Ctrl-C on the way stops it.
    Move(MoveArguments),
    /// Release the axis: valve to null. Ends an experiment too.
    Stop(BoardPort),
    /// Check which way round valve, tubes, gauges and sensors answer, before anything else moves.
    CheckWiring(CheckWiringArguments),
    /// Have the board run an experiment by itself, and record it.
    Run(RunArguments),
    /// Simulate a board: the firmware's code before a simulated axis, to try out what
    /// one would do to a real one. Serves one host after the other until Ctrl-C.
    Twin(TwinArguments),
}

/// A move.
#[derive(Args, Clone, Debug)]
pub struct MoveArguments {
    /// Where the board is.
    #[command(flatten)]
    pub port: BoardPort,
    /// The place, mm; positive enlarges chamber a. Speed, acceleration and jerk
    /// are those of the settings: `controller.move_...`.
    #[arg(long, allow_negative_numbers = true)]
    pub to_mm: f64,
    /// How near is there, mm.
    #[arg(long, default_value_t = 0.1)]
    pub within_mm: f64,
    /// How long it may take, s.
    #[arg(long, default_value_t = 10.0)]
    pub seconds: f64,
}

/// A board on the host.
#[derive(Args, Clone, Debug)]
pub struct TwinArguments {
    /// The axis.
    #[arg(long)]
    pub rig: PathBuf,
    /// What the board's settings say of it, where that differs.
    #[arg(long)]
    pub controller_rig: Option<PathBuf>,
    /// Where to listen, such as 127.0.0.1:7000; port 0 takes a free one.
    #[arg(long)]
    pub listen: String,
    /// Seed of the sensors' noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// A board as delivered, whose wiring nobody has checked.
    #[arg(long)]
    pub unchecked: bool,
}

/// Runs the command.
///
/// # Errors
/// If the board does not answer, does not do as told or is in fault.
pub fn run(arguments: &BoardArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    match &arguments.order {
        BoardOrder::Status(at) => with_board(
            at,
            |port| {
                let status = orders::status(port)?;
                let mut lines = words::lines(&status);
                lines.extend(orders::last_crash(port)?.as_ref().map(words::crash_line));
                Ok(lines)
            },
            out,
        ),
        BoardOrder::Acknowledge(at) => with_board(at, acknowledge, out),
        BoardOrder::Stop(at) => with_board(
            at,
            |port| {
                let status = orders::stop(port)?;
                Ok(vec![words::state(status.state).to_owned()])
            },
            out,
        ),
        BoardOrder::Move(wish) => go(wish, out),
        BoardOrder::CheckWiring(axis) => check_wiring::run(axis, out),
        BoardOrder::Run(experiment) => board_run::run(experiment, out),
        BoardOrder::Twin(twin) => be_a_board(twin, out),
    }
}

fn acknowledge(port: &mut Port) -> Result<Vec<String>, OrderError> {
    let before: Status = orders::status(port)?;
    if before.state != State::Fault {
        let state = words::state(before.state);
        return Ok(vec![format!("no fault to acknowledge; {state}")]);
    }
    let was = before.finding.map(words::fault_line).unwrap_or_default();
    let after = orders::acknowledge(port)?;
    let state = words::state(after.state);
    Ok(vec![
        format!("acknowledged; {state}"),
        format!("it was {was}"),
    ])
}

fn go(arguments: &MoveArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let positive = |name: &str, value: f64| {
        if value.is_finite() && value > 0.0 {
            return Ok(value);
        }
        Err(bad_input(format!(
            "--{name}: is {value}, expected a number above 0"
        )))
    };
    if !arguments.to_mm.is_finite() {
        return Err(bad_input("--to-mm: expected a number"));
    }
    let wish = Move {
        to_m: 1e-3 * arguments.to_mm,
        within_m: 1e-3 * positive("within-mm", arguments.within_mm)?,
        seconds: positive("seconds", arguments.seconds)?,
    };
    let stopped = stop_wish()?;
    let bar = bar();
    let went = |port: &mut Port| {
        let arrival = orders::go(port, &wish, |progress| {
            show(&bar, progress, &wish);
            !stopped.load(Ordering::Relaxed)
        });
        bar.finish_and_clear();
        let arrival = arrival?;
        let mm = |length_m: f64| number::fixed(1e3 * length_m, 3);
        Ok(vec![
            format!(
                "at {} mm, {} mm from the set-point, within {} mm after {} s",
                mm(arrival.position_m),
                mm(arrival.position_m - wish.to_m),
                arguments.within_mm,
                number::fixed(arrival.time_s, 2)
            ),
            "the board holds it there; `pneuma board stop` lets go".into(),
        ])
    };
    with_board(&arguments.port, went, out)
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(100);
    if let Ok(style) = ProgressStyle::with_template("move {bar:30} {msg}") {
        bar.set_style(style);
    }
    bar
}

fn show(bar: &ProgressBar, progress: &Progress, wish: &Move) {
    let way_m = wish.to_m - progress.from_m;
    let share = if way_m.abs() > 0.0 {
        (progress.position_m - progress.from_m) / way_m
    } else {
        1.0
    };
    bar.set_position((100.0 * share.clamp(0.0, 1.0)) as u64);
    bar.set_message(format!(
        "{} mm of {} mm, {} s",
        number::fixed(1e3 * progress.position_m, 2),
        number::fixed(1e3 * wish.to_m, 2),
        number::fixed(progress.time_s, 1)
    ));
}

fn be_a_board(arguments: &TwinArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let known_path = arguments.controller_rig.as_ref().unwrap_or(&arguments.rig);
    let (rig, known) = (read_rig(&arguments.rig)?, read_rig(known_path)?);
    let plant = PlantSettings::at(0.0, arguments.seed);
    let twin = Twin::new(&rig, (&known, wiring_of(arguments.unchecked)), plant);
    let mut twin = twin.map_err(|fault| rig_fault(known_path, fault))?;
    let address = &arguments.listen;
    let listener = TcpListener::bind(address).map_err(|error| {
        bad_input(format!(
            "{address}: cannot be listened at: {error}, expected a free address such as 127.0.0.1:7000"
        ))
    })?;
    writeln!(out, "listening at {}", listener.local_addr()?)?;
    out.flush()?;
    loop {
        twin.serve_next(&listener, 1.0)?;
    }
}
