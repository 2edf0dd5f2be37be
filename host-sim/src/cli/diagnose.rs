//! `pneuma diagnose`: recordings in, verdict out.

use super::{CommandError, inputs, outputs};
use crate::charts;
use crate::recording::Recording;
use crate::rehearsal::{Rehearsals, experiment_file};
use crate::report::Page;
use crate::rig::Rig;
use clap::Args;
use diagnosis::diagnose::summary;
use diagnosis::diagnose::{Diagnosis, diagnose};
use diagnosis::search::FIRST_LOOK;
use diagnosis::words;
use indicatif::ProgressBar;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Say what physics a model lacks, how large it is, and prove it on held-out
/// recordings.
#[derive(Args, Debug)]
pub struct DiagnoseArguments {
    /// What is known of the rig.
    #[arg(long)]
    pub rig: PathBuf,
    /// Recordings to learn from; `run.csv@0..50` is the first half of one, `run.csv@2s..5s`
    /// what lies between two times.
    #[arg(long, value_name = "FILE[@FROM..TO]", num_args = 1.., required = true)]
    pub train: Vec<PathBuf>,
    /// Recordings to judge by; no parameter is fitted to them.
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
    /// Write the recording that would tell what is left open here, as an experiment for `pneuma board
    /// run`; nothing is written where none of those that can be simulated is asked for.
    #[arg(long = "next-experiment")]
    pub next_experiment: Option<PathBuf>,
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
    // Read now, as a pipe can be read once; handed over when every parameter is frozen.
    let held_out = inputs::read_recordings(&arguments.held_out, &rig)?;
    inputs::check_apart(&train, &held_out)?;
    if let Some(remark) = words_before_work(&rig) {
        writeln!(out, "note     {remark}")?;
    }
    out.flush()?;
    let progress = inputs::spinner();
    let diagnosis = diagnose(
        &rig,
        train,
        || Ok::<_, CommandError>(held_out),
        &Rehearsals::all(),
        &|stage| tell(&progress, stage),
    )?;
    progress.finish_and_clear();
    if let Some(path) = &arguments.json {
        outputs::write_json(path, &diagnosis.verdict)?;
    }
    if let Some(path) = &arguments.improved_rig {
        let edited = Rig::edited_file(&arguments.rig, &diagnosis.improved_rig);
        let edited = edited.map_err(inputs::bad_input)?;
        let header = improved_rig_header(&diagnosis);
        outputs::write_text(path, &format!("{header}{edited}"))?;
    }
    if let Some(path) = &arguments.report {
        outputs::write_page(path, &page(arguments, &rig, &diagnosis))?;
    }
    show(&diagnosis, out)?;
    if let Some(path) = &arguments.next_experiment {
        write_next_experiment(path, &diagnosis, out)?;
    }
    writeln!(out, "{:.1} s", started.elapsed().as_secs_f64())?;
    Ok(())
}

/// Shows a stage on a terminal; what a first look says stays there.
fn tell(progress: &ProgressBar, stage: &str) {
    if stage.contains(FIRST_LOOK) {
        progress.println(stage);
    }
    progress.set_message(stage.to_owned());
}

/// What a person had better know before minutes of work.
fn words_before_work(rig: &Rig) -> Option<&'static str> {
    rig.uncertainty.is_empty().then_some(
        "the rig file has no [uncertainty]: every number counts as exact, and a wrong nameplate value will look like missing physics; give each uncertain number one standard deviation",
    )
}

fn check(arguments: &DiagnoseArguments) -> Result<(), CommandError> {
    let files: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.train)
        .chain(&arguments.held_out)
        .collect();
    let outputs = [
        &arguments.json,
        &arguments.report,
        &arguments.improved_rig,
        &arguments.next_experiment,
    ];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    outputs::check_outputs(&files, &outputs)
}

fn page(arguments: &DiagnoseArguments, rig: &Rig, diagnosis: &Diagnosis) -> Page {
    let files = std::iter::once(&arguments.rig)
        .chain(&arguments.train)
        .chain(&arguments.held_out);
    let how = inputs::provenance(files).fact("seed", arguments.seed);
    let how = inputs::with_remarks(how, &inputs::remarks_on_rig(rig));
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

fn write_next_experiment(
    path: &Path,
    diagnosis: &Diagnosis,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let mut laws = diagnosis.laws.iter();
    let asked = laws.find_map(|law| law.next_experiment.as_ref());
    let file = asked.and_then(|asked| experiment_file(asked.text, &diagnosis.improved_rig));
    match file {
        Some(text) => outputs::write_text(path, &text),
        None => Ok(writeln!(
            out,
            "note         {}: not written, as no experiment that can be simulated is asked for",
            path.display()
        )?),
    }
}

fn show(diagnosis: &Diagnosis, out: &mut dyn Write) -> Result<(), CommandError> {
    for (label, line) in summary::five_lines(diagnosis) {
        writeln!(out, "{label:12} {line}")?;
    }
    for note in &diagnosis.verdict.notes {
        writeln!(out, "note         {note}")?;
    }
    for assumed in &diagnosis.verdict.assumed {
        writeln!(out, "assumed  {assumed}")?;
    }
    Ok(())
}
