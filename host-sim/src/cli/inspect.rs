//! `pneuma inspect`: what recordings are worth before anything is fitted.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::CommandError;
use super::inputs::{provenance, read_recording, read_rig};
use super::outputs::{check_outputs, write_json, write_page};
use crate::recording::Recording;
use diagnosis::inspect::{Inspection, inspect, lateness};

/// Check recordings: timing, noise, quantum, excitation and faults.
#[derive(Args, Clone, Debug)]
pub struct InspectArguments {
    /// The rig file that names the columns.
    #[arg(long)]
    pub rig: PathBuf,
    /// Also write the findings as JSON, a list with one entry per recording.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write a page with plots.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// The recordings.
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &InspectArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.recordings)
        .collect();
    let outputs: Vec<&PathBuf> = arguments.json.iter().chain(&arguments.report).collect();
    check_outputs(&inputs, &outputs)?;
    let rig = read_rig(&arguments.rig)?;
    let mut inspections: Vec<Inspection> = Vec::new();
    // A page needs the samples; without one they are dropped file by file.
    let mut kept: Vec<Recording> = Vec::new();
    for path in &arguments.recordings {
        let recording = read_recording(path, &rig)?;
        let mut inspection = inspect(&rig, &recording);
        inspection.notes.extend(lateness::remarks(&rig, &recording));
        writeln!(out, "{inspection}")?;
        inspections.push(inspection);
        if arguments.report.is_some() {
            kept.push(recording);
        }
    }
    out.flush()?;
    if let Some(path) = &arguments.json {
        write_json(path, &inspections)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = crate::charts::inspection_page(&rig, &kept, &inspections);
        page.provenance(provenance(
            std::iter::once(&arguments.rig).chain(&arguments.recordings),
        ));
        write_page(path, &page)?;
    }
    Ok(())
}
