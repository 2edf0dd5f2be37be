//! `pneuma diagnose`: recordings in, verdict out.

use super::{CommandError, inputs};
use crate::charts;
use crate::diagnose::{Diagnosis, diagnose, summary, words};
use crate::recording::Recording;
use crate::report::Page;
use crate::rig::Rig;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Say what physics a model lacks, how large it is, and prove it on held-out
/// recordings.
#[derive(Args, Debug)]
pub struct DiagnoseArguments {
    /// What is known of the rig.
    #[arg(long)]
    pub rig: PathBuf,
    /// Recordings to learn from; `run.csv@0..50` is the first half of one.
    #[arg(long, value_name = "FILE[@FROM..TO]", num_args = 1.., required = true)]
    pub train: Vec<PathBuf>,
    /// Recordings to judge by; not read before every parameter is frozen.
    #[arg(long = "held-out", value_name = "FILE[@FROM..TO]", num_args = 1..)]
    pub held_out: Vec<PathBuf>,
    /// Write the verdict here.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the improved rig here: the rig file with changed numbers and added effects, its
    /// comments kept.
    #[arg(long = "improved-rig")]
    pub improved_rig: Option<PathBuf>,
    /// Seed of whatever is drawn at random (nothing is, at present).
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Runs the command.
///
/// # Errors
/// If the rig or a recording cannot be used, or an output not written.
pub fn run(arguments: &DiagnoseArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let started = Instant::now();
    check(arguments)?;
    let rig = inputs::read_rig(&arguments.rig)?;
    let train = inputs::read_recordings(&arguments.train, &rig)?;
    let progress = inputs::spinner();
    let diagnosis = diagnose(
        &rig,
        train,
        || inputs::read_recordings(&arguments.held_out, &rig),
        &|stage| progress.set_message(stage.to_owned()),
    )?;
    progress.finish_and_clear();
    if let Some(path) = &arguments.json {
        inputs::write_json(path, &diagnosis.verdict)?;
    }
    if let Some(path) = &arguments.improved_rig {
        let edited = Rig::edited_file(&arguments.rig, &diagnosis.improved_rig);
        let edited = edited.map_err(inputs::bad_input)?;
        let header = improved_rig_header(&diagnosis);
        inputs::write_text(path, &format!("{header}{edited}"))?;
    }
    if let Some(path) = &arguments.report {
        inputs::write_page(path, &page(arguments, &rig, &diagnosis))?;
    }
    show(&diagnosis, out)?;
    writeln!(out, "{:.1} s", started.elapsed().as_secs_f64())?;
    Ok(())
}

fn check(arguments: &DiagnoseArguments) -> Result<(), CommandError> {
    let files: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.train)
        .chain(&arguments.held_out)
        .collect();
    let outputs: Vec<&PathBuf> = [&arguments.json, &arguments.report, &arguments.improved_rig]
        .into_iter()
        .flatten()
        .collect();
    inputs::check_outputs(&files, &outputs)?;
    inputs::check_apart(&arguments.train, &arguments.held_out)
}

fn page(arguments: &DiagnoseArguments, rig: &Rig, diagnosis: &Diagnosis) -> Page {
    let files = std::iter::once(&arguments.rig)
        .chain(&arguments.train)
        .chain(&arguments.held_out);
    let how = inputs::provenance(files).fact("seed", arguments.seed);
    let name = arguments.rig.file_stem().unwrap_or_default();
    let title = format!("Diagnosis: {}", name.to_string_lossy());
    charts::diagnosis_page(&title, rig, diagnosis, how)
}

/// Where the numbers of an improved rig come from, as comments.
fn improved_rig_header(diagnosis: &Diagnosis) -> String {
    let names = |recordings: &[Recording]| -> String {
        let names: Vec<String> = recordings.iter().map(|one| one.name.clone()).collect();
        words::list(&names)
    };
    let held_out = if diagnosis.held_out.is_empty() {
        "not proved on other recordings".to_owned()
    } else {
        format!("judged by {}", names(&diagnosis.held_out))
    };
    format!(
        "# Improved by `pneuma diagnose`: fitted to {}, {held_out}.\n# {}\n# [uncertainty] is as it was given: how well the numbers are known now is in the verdict.\n",
        names(&diagnosis.train),
        diagnosis.verdict.sentence
    )
}

fn show(diagnosis: &Diagnosis, out: &mut dyn Write) -> Result<(), CommandError> {
    for (label, line) in summary::five_lines(diagnosis) {
        writeln!(out, "{label:8} {line}")?;
    }
    for note in &diagnosis.verdict.notes {
        writeln!(out, "note     {note}")?;
    }
    Ok(())
}
