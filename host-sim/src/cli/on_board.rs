//! What `commission` and `board check-wiring` do at a board: send settings, run an experiment that
//! is written to a file, said and asked for before anything moves.

use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use firmware::experiment::Reason;
use firmware::settings::Wiring;
use firmware::settings::transfer::Verdict;

use super::CommandError;
use super::board_port::{BoardPort, not_done};
use super::board_run::{RunArguments, ending, lines_of, recorded};
use super::inputs::bad_input;
use super::outputs::write_text;
use super::settings::to_board;
use crate::board::orders;
use crate::board::port::Port;
use crate::board::send::{Kept, SendError};
use crate::board::words;
use crate::experiment;
use crate::rig::Rig;
use crate::settings::wired;

/// How often, and how many times, a board is asked again whose load still moves.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(200);
pub(super) const LOOKS_FOR_REST: u32 = 15;

/// A run that ended before its end.
#[derive(Clone, Debug)]
pub(super) struct Ended {
    /// In words, with the fault if there was one.
    pub why: String,
    pub reason: Reason,
}

/// A board, the rig file of its axis, and where files go.
#[derive(Args, Clone, Debug)]
pub struct OnBoard {
    /// Where the board is.
    #[command(flatten)]
    pub port: BoardPort,
    /// The rig file, as `pneuma init` makes it.
    #[arg(long)]
    pub rig: PathBuf,
    /// Where experiments, recordings and what comes of them go.
    #[arg(long)]
    pub folder: PathBuf,
    /// Do not ask before a motion.
    #[arg(long)]
    pub yes: bool,
}

impl OnBoard {
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub(super) fn open(&self) -> Result<Port, CommandError> {
        Port::open(&self.port.serial, self.port.baud).map_err(bad_input)
    }

    /// Asks the board.
    pub(super) fn asked<Answer>(
        &self,
        question: impl FnOnce(&mut Port) -> Result<Answer, orders::OrderError>,
    ) -> Result<Answer, CommandError> {
        let answer = question(&mut self.open()?);
        answer.map_err(|error| not_done(&self.port.serial, &error))
    }

    /// Settings to the board; whether they are kept is said.
    pub(super) fn send(
        &self,
        (rig, rig_name): (&Rig, &str),
        (wiring, kept): (Wiring, Kept),
        out: &mut dyn Write,
    ) -> Result<(), CommandError> {
        let serial = &self.port.serial;
        let settings =
            wired(rig, wiring).map_err(|error| bad_input(format!("{rig_name}: {error}")))?;
        let send = || to_board((serial, self.port.baud), &settings, kept);
        let mut sent = send()?;
        // A load that has just been let go comes to rest.
        for _ in 0..LOOKS_FOR_REST {
            if !is_moving(&sent) {
                break;
            }
            std::thread::sleep(LOOK_EVERY);
            sent = send()?;
        }
        match sent {
            Ok(()) => note(kept.text(), out),
            Err(SendError::NotKept(verdict)) => note(verdict.explanation(), out),
            Err(error) => Err(bad_input(format!("{serial}: {error}"))),
        }
    }

    /// Writes an experiment, says it, asks, and runs it; how it ended early, if it did.
    pub(super) fn experiment(
        &self,
        (name, text): (&str, &str),
        out: &mut dyn Write,
    ) -> Result<Option<Ended>, CommandError> {
        let [file, recording] = ["toml", "csv"].map(|kind| self.path(&format!("{name}.{kind}")));
        let program = experiment::parse(text, &file.display().to_string()).map_err(bad_input)?;
        write_text(&file, text)?;
        for line in lines_of(&program) {
            writeln!(out, "  {line}")?;
        }
        self.ask(out)?;
        let arguments = RunArguments {
            experiment: file,
            port: self.port.clone(),
            rig: self.rig.clone(),
            out: recording,
        };
        announce(
            &[
                "board",
                "run",
                &arguments.experiment.display().to_string(),
                "--serial",
                &arguments.port.serial,
                "--rig",
                &arguments.rig.display().to_string(),
                "--out",
                &arguments.out.display().to_string(),
            ],
            out,
        )?;
        let (program, report) = recorded(&arguments, &mut io::sink())?;
        let Some(why) = ending(&program, &report) else {
            return Ok(None);
        };
        let reason = report.reason;
        let why = match reason {
            Reason::Fault => format!("{why}: {}", self.acknowledged()?),
            _ => why,
        };
        Ok(Some(Ended { why, reason }))
    }

    /// The fault that the board has, which is acknowledged: nothing moves until it is asked anew.
    fn acknowledged(&self) -> Result<String, CommandError> {
        let status = self.asked(|port| {
            let status = orders::status(port)?;
            orders::acknowledge(port)?;
            Ok(status)
        })?;
        let fault = status.finding.map(words::fault_line);
        Ok(fault.unwrap_or_else(|| "the fault is gone".into()))
    }

    fn ask(&self, out: &mut dyn Write) -> Result<(), CommandError> {
        if self.yes {
            return Ok(());
        }
        write!(
            out,
            "  Everybody out of the way? y to go on, anything else to stop: "
        )?;
        out.flush()?;
        let mut answer = String::new();
        io::stdin().lock().read_line(&mut answer)?;
        if answer.trim().eq_ignore_ascii_case("y") {
            return Ok(());
        }
        Err(bad_input(
            "stopped; nothing was moved, and the same command goes on from here",
        ))
    }
}

fn is_moving(sent: &Result<(), SendError>) -> bool {
    let Err(SendError::Refused { verdict, .. }) = sent else {
        return false;
    };
    *verdict == Verdict::NotAtRest
}

/// A line below a step.
pub(super) fn note(what: &str, out: &mut dyn Write) -> Result<(), CommandError> {
    Ok(writeln!(out, "  note: {what}")?)
}

/// The command that does the same.
pub(super) fn announce(words: &[&str], out: &mut dyn Write) -> Result<(), CommandError> {
    writeln!(out, "  pneuma {}", words.join(" "))?;
    Ok(out.flush()?)
}
