//! `pneuma convert`: a recording as a file of another program.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use data_files::Target;

use super::CommandError;
use super::inputs::{bad_input, read_recording, read_rig};
use super::outputs::check_outputs;
use crate::converted;
use crate::text::file_name;

/// Write a recording as CSV, Parquet, MATLAB 7 or MCAP. The columns that the rig names are
/// written under the rig's names and in its units, so that the same rig reads them.
#[derive(Args, Clone, Debug)]
pub struct ConvertArguments {
    /// The rig file that names the columns.
    #[arg(long)]
    pub rig: PathBuf,
    /// The file to write: .csv, .parquet, .mat or .mcap.
    #[arg(long)]
    pub out: PathBuf,
    /// The recording, in any format that is read, or a part of it.
    pub recording: PathBuf,
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &ConvertArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs = [&arguments.rig, &arguments.recording];
    check_outputs(&inputs, &[&arguments.out])?;
    let target = target(&arguments.out)?;
    let rig = read_rig(&arguments.rig)?;
    let recording = read_recording(&arguments.recording, &rig)?;
    let columns = converted::write(&recording, &rig, (&arguments.out, target))
        .map_err(|cause| bad_input(format!("{}: {cause}", shown(&arguments.out))))?;
    for remark in recording.named_remarks() {
        writeln!(out, "note: {remark}")?;
    }
    let rows = recording.len();
    writeln!(
        out,
        "{}: {rows} rows of {columns} columns",
        shown(&arguments.out)
    )?;
    Ok(())
}

fn shown(path: &Path) -> String {
    file_name(&path.display().to_string())
}

/// What the ending of the name asks for; `None` for text.
fn target(path: &Path) -> Result<Option<Target>, CommandError> {
    let ending = path
        .extension()
        .map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("csv") => Ok(None),
        Some(ending) if Target::of_ending(ending).is_some() => Ok(Target::of_ending(ending)),
        _ => Err(bad_input(format!(
            "{}: expected a name that ends in .csv, .parquet, .mat or .mcap",
            shown(path)
        ))),
    }
}
