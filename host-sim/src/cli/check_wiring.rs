//! `pneuma board check-wiring`: which way round valve, tubes, gauges and sensors answer.

use std::io::Write;

use clap::Args;
use firmware::experiment::Reason;
use firmware::settings::Wiring as Known;

use super::CommandError;
use super::inputs::{bad_input, bare_name, read_rig, rig_fault};
use super::on_board::{Ended, LOOK_EVERY, LOOKS_FOR_REST, OnBoard, note};
use crate::board::orders;
use crate::board::send::Kept;
use crate::commission::programs::careful;
use crate::commission::wiring::{
    Answer, DOUBLINGS, Wiring, answer, found, pulses, swing, turned_over,
};
use crate::recording::Recording;
use crate::rig::Rig;

/// A load that has moved less from one look to the next stands, m: six deviations of a usual sensor's noise.
const STANDS_M: f64 = 50e-6;
/// Names of the experiments.
const PULSES: &str = "wiring-pulses";
const SWING: &str = "wiring-swing";

/// Check which way round the axis answers, and have the board know it.
///
/// The board gets the rig's settings as of an unchecked axis: it follows no set-point,
/// and experiments reach no farther than 2 mm from the load. Four pulses of the valve
/// show which chamber rises; then the loop swings the load 1 mm. Reversed valve,
/// exchanged tubes or gauges, a tube that is off, a reversed position or velocity are
/// named. If all is right, the board stores the settings as those of a checked axis.
#[derive(Args, Clone, Debug)]
pub struct CheckWiringArguments {
    /// Board, rig file and folder.
    #[command(flatten)]
    pub board: OnBoard,
}

/// Runs the command.
///
/// # Errors
/// If the board is not ready, or something is the wrong way round.
pub fn run(arguments: &CheckWiringArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let board = &arguments.board;
    let rig = read_rig(&board.rig)?;
    std::fs::create_dir_all(&board.folder)?;
    check(board, &rig, out)?;
    let name = board.rig.display().to_string();
    board.send((&rig, &name), (Known::Checked, Kept::Stored), out)?;
    let name = bare_name(&board.rig);
    writeln!(out, "{name}: wiring checked; the board follows set-points")?;
    Ok(out.flush()?)
}

/// Checks the wiring; an error that names what is the wrong way round, unless nothing is.
pub(super) fn check(board: &OnBoard, rig: &Rig, out: &mut dyn Write) -> Result<(), CommandError> {
    match looked_into(board, rig, out)? {
        Wiring::Right => note(Wiring::Right.text(), out),
        wrong => Err(bad_input(format!("wiring: {}", wrong.text()))),
    }
}

fn looked_into(board: &OnBoard, rig: &Rig, out: &mut dyn Write) -> Result<Wiring, CommandError> {
    let name = board.rig.display().to_string();
    board.send(
        (&careful(rig), &name),
        (Known::Unchecked, Kept::UntilStart),
        out,
    )?;
    let is_turned_over = match pulsed(board, rig, out)? {
        Answer::Right => false,
        Answer::Reversed => true,
        Answer::Faint => return Ok(Wiring::NoAnswer),
        Answer::Ended(wiring) => return Ok(wiring),
    };
    let used = if is_turned_over {
        turned_over(rig)
    } else {
        rig.clone()
    };
    if is_turned_over {
        let settings = (&careful(&used), name.as_str());
        board.send(settings, (Known::Unchecked, Kept::UntilStart), out)?;
    }
    let ended = board.experiment((SWING, &swing(rig, stands_at_m(board)?)), out)?;
    let recording = read(board, SWING, rig)?;
    let was_fault = |ended: &Ended| ended.reason == Reason::Fault;
    let is_fault = ended.as_ref().is_some_and(was_fault);
    let shown = found(&recording, &used, (!is_fault, is_turned_over));
    shown.ok_or_else(|| unclear(ended))
}

/// Pulses that grow until a chamber answers.
fn pulsed(board: &OnBoard, rig: &Rig, out: &mut dyn Write) -> Result<Answer, CommandError> {
    let mut board = board.clone();
    for doublings in 0..=DOUBLINGS {
        let text = pulses(rig, stands_at_m(&board)?, doublings);
        let text = text.map_err(|fault| rig_fault(&board.rig, fault))?;
        let ended = board.experiment((PULSES, &text), out)?;
        match answer(&read(&board, PULSES, rig)?, rig, ended.is_none()) {
            Some(Answer::Faint) if ended.is_none() => {}
            Some(told @ Answer::Ended(_)) => return Ok(told),
            Some(told) if ended.is_none() => return Ok(told),
            _ => return Err(unclear(ended)),
        }
        // It was asked for once.
        board.yes = true;
    }
    Ok(Answer::Faint)
}

fn unclear(ended: Option<Ended>) -> CommandError {
    let why = ended.map_or_else(|| "the load did not move".into(), |ended| ended.why);
    bad_input(format!("wiring: not told: {why}"))
}

/// Where the load is, once it stands.
pub(super) fn stands_at_m(board: &OnBoard) -> Result<f64, CommandError> {
    let mut before_m = board.asked(orders::position_m)?;
    for _ in 0..LOOKS_FOR_REST {
        std::thread::sleep(LOOK_EVERY);
        let now_m = board.asked(orders::position_m)?;
        if (now_m - before_m).abs() < STANDS_M {
            return Ok(now_m);
        }
        before_m = now_m;
    }
    Ok(before_m)
}

fn read(board: &OnBoard, name: &str, rig: &Rig) -> Result<Recording, CommandError> {
    let path = board.path(&format!("{name}.csv"));
    Recording::read(&path, &rig.signals).map_err(bad_input)
}
