//! `pneuma controller`: the control code of the firmware at the end of a link.

use super::wiring_of;
use super::{CommandError, inputs};
use crate::closed_loop::{serve, wired_task};
use crate::plant::PlantSettings;
use clap::Args;
use std::io::Write;
use std::net::TcpListener;
use std::path::PathBuf;

/// Answer a plant that connects with the host build of the control code.
///
/// Serves one plant until it ends the run.
#[derive(Args, Debug)]
pub struct ControllerArguments {
    /// What the controller knows of the plant.
    #[arg(long)]
    pub rig: PathBuf,
    /// Where to listen, such as 127.0.0.1:7000; port 0 takes a free one.
    #[arg(long)]
    pub listen: String,
    /// Be a board as delivered, whose wiring nobody has checked: it follows no reference.
    #[arg(long)]
    pub unchecked: bool,
}

/// Runs the command. The first line says where it listens.
///
/// # Errors
/// If the rig cannot be used, the address not be listened at, or the plant goes
/// away without ending the run.
pub fn run(arguments: &ControllerArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let rig = inputs::read_rig(&arguments.rig)?;
    let task = wired_task(&rig, wiring_of(arguments.unchecked));
    let mut task = task.map_err(|fault| inputs::rig_fault(&arguments.rig, fault))?;
    let address = &arguments.listen;
    let no_place = |error| {
        inputs::bad_input(format!(
            "{address}: cannot be listened at: {error}, expected a free address such as 127.0.0.1:7000"
        ))
    };
    let listener = TcpListener::bind(address).map_err(no_place)?;
    writeln!(out, "listening at {}", listener.local_addr()?)?;
    out.flush()?;
    let (stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    let tick_period_ns = (1e9 * PlantSettings::TICK_S).round() as u32;
    let served = serve(stream, tick_period_ns, &mut task)
        .map_err(|error| inputs::bad_input(format!("the link broke: {error}")))?;
    writeln!(
        out,
        "{} ticks, {} missed, {} frames dropped",
        served.ticks, served.missed, served.dropped
    )?;
    if !served.ended {
        return Err(inputs::bad_input(format!(
            "the plant went away after {} ticks, expected its End",
            served.ticks
        )));
    }
    Ok(())
}
