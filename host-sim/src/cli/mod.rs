//! The commands of the `pneuma` program. Each returns an exit status; a bad
//! input is one line on standard error and status 2.

pub mod board;
pub mod board_port;
pub mod board_run;
pub mod check;
pub mod check_wiring;
pub mod closed_loop;
pub mod commission;
pub mod compare;
pub mod controller;
pub mod convert;
pub mod demo;
pub mod diagnose;
pub mod doctor;
pub mod fit;
pub mod fleet;
pub mod fmu;
pub mod foreign_plant;
pub mod identify;
pub mod init;
mod inputs;
pub mod inspect;
pub mod on_board;
mod outputs;
pub mod paper;
pub mod record;
pub mod response;
pub mod scope;
pub mod settings;
pub mod shell_help;
pub mod simulate;
mod stop;
pub mod trial;

use firmware::settings::Wiring;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// All went well.
pub const SUCCESS: u8 = 0;
/// The work was done, and its result is not to be trusted.
pub const UNTRUSTED: u8 = 1;
/// An input could not be used.
pub const BAD_INPUT: u8 = 2;
/// The program itself failed.
pub const INTERNAL_FAILURE: u8 = 3;

/// Why a command ended early.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// An input that cannot be used; the text is one line.
    #[error("{0}")]
    BadInput(String),
    /// A result that is not to be trusted; the text is one line.
    #[error("{0}")]
    Untrusted(String),
    /// The output could not be written.
    #[error("cannot write: {0}")]
    Output(#[from] io::Error),
}

/// What is known of the wiring, of a board as delivered or not.
fn wiring_of(is_unchecked: bool) -> Wiring {
    if is_unchecked {
        Wiring::Unchecked
    } else {
        Wiring::Checked
    }
}

/// A command's arguments from what a user would type.
fn typed<A: clap::Args>(words: &[&str]) -> Result<A, CommandError> {
    let command = A::augment_args(clap::Command::new("pneuma"));
    let matches = command.try_get_matches_from(words);
    let arguments = matches.and_then(|matches| A::from_arg_matches(&matches));
    arguments.map_err(inputs::bad_input)
}

/// Runs a command and gives its exit status, saying on standard error what went
/// wrong. A reader that closes the pipe (`| head`) has seen enough: that is no
/// error. A panic has told its place already; the status says that it is the
/// program's own failure.
pub fn exit_status(command: impl FnOnce() -> Result<(), CommandError>) -> u8 {
    let Ok(outcome) = catch_unwind(AssertUnwindSafe(command)) else {
        let _ = writeln!(
            io::stderr(),
            "error: an internal failure of pneuma, not of your files; outputs are as before. \
             Please report it with the command and the lines above"
        );
        return INTERNAL_FAILURE;
    };
    match outcome {
        Ok(()) => SUCCESS,
        Err(CommandError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}");
            match error {
                CommandError::Untrusted(_) => UNTRUSTED,
                CommandError::BadInput(_) | CommandError::Output(_) => BAD_INPUT,
            }
        }
    }
}
