//! `pneuma inspect`: what recordings are worth before anything is fitted.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::CommandError;
use crate::inspect::{Inspection, inspect};
use crate::recording::Recording;
use crate::rig::Rig;

/// Check recordings: timing, noise, quantum, excitation and faults.
#[derive(Args, Clone, Debug)]
pub struct InspectArguments {
    /// The rig file that names the columns.
    #[arg(long)]
    pub rig: PathBuf,
    /// Also write the findings as JSON, a list with one entry per recording.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// The recordings.
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &InspectArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let bad_input = |error: &dyn ToString| CommandError::BadInput(error.to_string());
    let rig = Rig::read(&arguments.rig).map_err(|error| bad_input(&error))?;
    let mut inspections: Vec<Inspection> = Vec::new();
    for path in &arguments.recordings {
        let recording = Recording::read(path, &rig.signals).map_err(|error| bad_input(&error))?;
        let inspection = inspect(&rig, &recording);
        writeln!(out, "{inspection}")?;
        inspections.push(inspection);
    }
    out.flush()?;
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&inspections).map_err(|error| bad_input(&error))?;
        fs::write(path, text + "\n").map_err(|error| {
            let path = crate::text::file_name(&path.display().to_string());
            CommandError::BadInput(format!("{path}: cannot be written: {error}"))
        })?;
    }
    Ok(())
}
