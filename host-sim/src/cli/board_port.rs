//! Where a board is reached, and what it says when it is not.

use super::CommandError;
use super::inputs::bad_input;
use crate::board::orders::OrderError;
use crate::board::port::{BAUD, Port};
use crate::text::file_name;
use clap::Args;
use std::io::Write;

/// Where a board is.
#[derive(Args, Clone, Debug)]
pub struct BoardPort {
    /// The board's serial port, or HOST:PORT.
    #[arg(long)]
    pub serial: String,
    /// Rate of the serial port.
    #[arg(long, default_value_t = BAUD)]
    pub baud: u32,
}

pub(super) fn with_board(
    at: &BoardPort,
    order: impl FnOnce(&mut Port) -> Result<Vec<String>, OrderError>,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let name = file_name(&at.serial);
    let mut port = Port::open(&at.serial, at.baud).map_err(bad_input)?;
    let lines = order(&mut port).map_err(|error| not_done(&at.serial, &error))?;
    for (number, line) in lines.iter().enumerate() {
        let begin = if number == 0 {
            format!("{name}: ")
        } else {
            "  ".into()
        };
        writeln!(out, "{begin}{line}")?;
    }
    Ok(out.flush()?)
}

/// One line that begins with the port's name.
pub(super) fn not_done(serial: &str, error: &OrderError) -> CommandError {
    match error {
        OrderError::Port(error) => bad_input(error),
        error => bad_input(format!("{}: {error}", file_name(serial))),
    }
}
