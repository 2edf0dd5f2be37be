//! `pneuma check`: a rig file against its recordings.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::CommandError;
use super::inputs::{bad_input, read_recording};
use super::outputs::{check_outputs, write_json};
use crate::check::{Check, RecordingCheck};
use crate::rig::Rig;

/// Check a rig file against its recordings: all remarks at once.
///
/// Says what is wrong with the rig file, which laws run and which number each of the others
/// lacks, which values are assumed, which numbers are taken as exact, and what the recordings show.
/// Exit status 0 if all of it is usable, 2 if not.
#[derive(Args, Clone, Debug)]
pub struct CheckArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: PathBuf,
    /// Also write the findings as JSON.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// The recordings; `run.csv@0..50` is the first half of one, `run.csv@2s..5s`
    /// what lies between two times.
    #[arg(value_name = "FILE[@FROM..TO]")]
    pub recordings: Vec<PathBuf>,
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If rig or recordings are not usable, or an output cannot be written.
pub fn run(arguments: &CheckArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.recordings)
        .collect();
    let outputs: Vec<&PathBuf> = arguments.json.iter().collect();
    check_outputs(&inputs, &outputs)?;
    let (rig, faults) = Rig::read_faults(&arguments.rig).map_err(bad_input)?;
    let mut check = Check::of_rig(&arguments.rig.display().to_string(), &rig, &faults);
    for path in &arguments.recordings {
        let recording = read_recording(path, &rig).map_err(|error| error.to_string());
        check.add(&rig, &path.display().to_string(), recording);
    }
    write!(out, "{check}")?;
    out.flush()?;
    if let Some(path) = &arguments.json {
        write_json(path, &check)?;
    }
    if check.usable {
        return Ok(());
    }
    let is_rig_sound = check.rig_faults.is_empty();
    let is_wrong = |one: &&RecordingCheck| one.error.is_some() || !one.faults.is_empty();
    let mut wrong = check.recordings.iter().filter(is_wrong);
    let file = match wrong.next() {
        Some(first) if is_rig_sound => first.recording.clone(),
        _ => arguments.rig.display().to_string(),
    };
    Err(bad_input(format!(
        "{file}: not usable as it is, see the lines above"
    )))
}
