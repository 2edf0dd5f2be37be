//! `pneuma identify`: one part of an axis measured in recordings, with deviations.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::CommandError;
use super::inputs::{
    bad_input, names, provenance, read_recordings, read_rig, say_remarks, with_remarks,
};
use super::outputs::{check_outputs, write_json, write_page, write_text};
use crate::charts;
use crate::laws::Track;
use crate::recording_set;
use crate::rig::Rig;
use diagnosis::valve_flow::{self, ValveFlow};

/// Measure one part of the axis in recordings, as numbers of a rig file.
#[derive(Args, Clone, Debug)]
pub struct IdentifyArguments {
    #[command(subcommand)]
    part: Part,
}

#[derive(Clone, Debug, Subcommand)]
enum Part {
    ValveFlow(ValveFlowArguments),
}

/// Areas of the valve over its opening, null, critical pressure ratio and dead volumes.
///
/// The chambers are the flow meter: recordings of the command, both pressures and the position
/// in motion are enough.
#[derive(Args, Clone, Debug)]
pub struct ValveFlowArguments {
    /// The rig file; of its valve a nominal flow is enough.
    #[arg(long)]
    rig: PathBuf,
    /// Write the rig file with what was measured, its comments kept.
    #[arg(long)]
    improved_rig: Option<PathBuf>,
    /// Write the outcome as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write a page with plots.
    #[arg(long)]
    report: Option<PathBuf>,
    /// The recordings; `run.csv@0..50` is the first half of one.
    #[arg(value_name = "FILE[@FROM..TO]", required = true)]
    recordings: Vec<PathBuf>,
}

/// The JSON.
#[derive(Serialize)]
struct ValveFlowFile<'a> {
    format: &'static str,
    rig: String,
    recordings: Vec<&'a str>,
    #[serde(flatten)]
    valve: &'a ValveFlow,
    remarks: &'a [String],
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If the rig or a recording cannot be used, or an output not written.
pub fn run(arguments: &IdentifyArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    match &arguments.part {
        Part::ValveFlow(arguments) => valve_flow(arguments, out),
    }
}

fn valve_flow(arguments: &ValveFlowArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.recordings)
        .collect();
    let outputs = [&arguments.improved_rig, &arguments.json, &arguments.report];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    check_outputs(&inputs, &outputs)?;
    let rig = read_rig(&arguments.rig)?;
    let recordings = recording_set::sorted(read_recordings(&arguments.recordings, &rig)?);
    let remarks = say_remarks(&rig, &recordings, out)?;
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let valve = valve_flow::measure(&rig, &tracks).map_err(bad_input)?;
    write!(out, "{valve}")?;
    out.flush()?;
    if let Some(path) = &arguments.improved_rig {
        let edited = Rig::edited_file(&arguments.rig, &valve.applied(&rig)).map_err(bad_input)?;
        let source = format!(
            "# [valve] and the dead volumes were measured by `pneuma identify valve-flow` in {}.\n",
            names(&recordings).join(", ")
        );
        write_text(path, &(source + &edited))?;
    }
    if let Some(path) = &arguments.json {
        let content = ValveFlowFile {
            format: "valve-flow/1",
            rig: arguments.rig.display().to_string(),
            recordings: names(&recordings),
            valve: &valve,
            remarks: &remarks,
        };
        write_json(path, &content)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = charts::valve_flow_page(&rig, &valve);
        let files = std::iter::once(&arguments.rig).chain(&arguments.recordings);
        page.provenance(with_remarks(provenance(files), &remarks));
        write_page(path, &page)?;
    }
    Ok(())
}
