//! `pneuma compare`: where a rig as given and recordings part.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::CommandError;
use super::inputs::{
    bad_input, laws, names, provenance, read_recordings, read_rig, say_remarks, spinner,
    with_remarks,
};
use super::outputs::{check_outputs, write_json, write_page};
use crate::laws::Track;
use diagnosis::compare::{LawComparison, compare_law};

/// Predict recordings with the rig as given and show where they part.
#[derive(Args, Clone, Debug)]
pub struct CompareArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: PathBuf,
    /// Write a page with plots.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the findings as JSON.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// The recordings; `run.csv@0..50` is the first half of one, `run.csv@2s..5s`
    /// what lies between two times.
    #[arg(value_name = "FILE[@FROM..TO]", required = true)]
    pub recordings: Vec<PathBuf>,
}

/// The JSON.
#[derive(Serialize)]
struct CompareFile<'a> {
    format: &'static str,
    rig: String,
    recordings: Vec<&'a str>,
    laws: &'a [LawComparison],
    remarks: &'a [String],
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &CompareArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.recordings)
        .collect();
    let outputs: Vec<&PathBuf> = arguments.json.iter().chain(&arguments.report).collect();
    check_outputs(&inputs, &outputs)?;
    let rig = read_rig(&arguments.rig)?;
    let laws = laws(&rig)?;
    let recordings = read_recordings(&arguments.recordings, &rig)?;
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let remarks = say_remarks(&rig, &recordings, out)?;
    let mut compared: Vec<LawComparison> = Vec::new();
    for law in laws {
        let bar = spinner();
        bar.set_message(format!("{}: predicting", law.title()));
        bar.tick();
        let comparison = compare_law(law, &rig, &tracks).map_err(bad_input)?;
        bar.finish_and_clear();
        let gap = if compared.is_empty() { "" } else { "\n" };
        write!(out, "{gap}{comparison}")?;
        compared.push(comparison);
    }
    writeln!(out, "\n{}", diagnosis::compare::headline(&rig, &compared))?;
    out.flush()?;
    if let Some(path) = &arguments.json {
        let content = CompareFile {
            format: "compare/1",
            rig: arguments.rig.display().to_string(),
            recordings: names(&recordings),
            laws: &compared,
            remarks: &remarks,
        };
        write_json(path, &content)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = crate::charts::compare_page(&rig, &compared, &tracks);
        let files = std::iter::once(&arguments.rig).chain(&arguments.recordings);
        page.provenance(with_remarks(provenance(files), &remarks));
        write_page(path, &page)?;
    }
    Ok(())
}
