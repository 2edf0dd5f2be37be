//! The commands of the `pneuma` program. Each returns an exit status; a bad
//! input is one line on standard error and status 2.

pub mod board;
pub mod check;
pub mod closed_loop;
pub mod compare;
pub mod controller;
pub mod demo;
pub mod diagnose;
pub mod fit;
pub mod init;
mod inputs;
pub mod inspect;
pub mod record;
pub mod settings;
pub mod simulate;
pub mod trial;

use std::io::{self, Write};

/// All went well.
pub const SUCCESS: u8 = 0;
/// An input could not be used.
pub const BAD_INPUT: u8 = 2;

/// Why a command ended early.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// An input that cannot be used; the text is one line.
    #[error("{0}")]
    BadInput(String),
    /// The output could not be written.
    #[error("cannot write: {0}")]
    Output(#[from] io::Error),
}

/// Turns the outcome of a command into an exit status, saying on standard
/// error what went wrong. A reader that closes the pipe (`| head`) has seen
/// enough: that is no error.
pub fn exit_status(outcome: Result<(), CommandError>) -> u8 {
    match outcome {
        Ok(()) => SUCCESS,
        Err(CommandError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}");
            BAD_INPUT
        }
    }
}
