//! `pneuma fit`: numbers of a rig file fitted to recordings.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::CommandError;
use super::inputs::{
    bad_input, check_apart, laws, names, provenance, read_recordings, read_rig, say_remarks,
    spinner, with_remarks,
};
use super::outputs::{check_outputs, write_json, write_page, write_text};
use crate::laws::Track;
use crate::recording::Recording;
use crate::recording_set;
use crate::rig::Rig;
use diagnosis::identify::{FreeRequest, LawFit, LawTask, fit_law, free_parameters, improved_rig};
use diagnosis::imprecise::with_built_in_priors;

/// Fit numbers of the rig file to recordings, law by law.
#[derive(Args, Clone, Debug)]
pub struct FitArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: PathBuf,
    /// Parameters to fit, `section.key` or `effects.NAME.key`; without any, all
    /// that the rig file lists under `[uncertainty]`, and what no rig file states exactly
    /// (the valve between the points of its table, bristles: `docs/method.md`).
    #[arg(long, value_name = "KEY[=START][,LOWER..UPPER]", num_args = 1..)]
    pub free: Vec<String>,
    /// Recordings to fit; `run.csv@0..50` is the first half of one, `run.csv@2s..5s`
    /// what lies between two times.
    #[arg(long, value_name = "FILE[@FROM..TO]", required = true, num_args = 1..)]
    pub train: Vec<PathBuf>,
    /// Recordings to predict with the fitted numbers.
    #[arg(long, value_name = "FILE[@FROM..TO]", num_args = 1..)]
    pub held_out: Vec<PathBuf>,
    /// Write the outcome as JSON.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write the rig file with the fitted numbers, its comments kept.
    #[arg(long)]
    pub improved_rig: Option<PathBuf>,
    /// Write a page with plots.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the improved rig and exit with 0 even if a fit did not converge or predicts
    /// held-out recordings worse than the rig as given.
    #[arg(long)]
    pub accept: bool,
}

/// The JSON.
#[derive(Serialize)]
struct FitFile<'a> {
    format: &'static str,
    rig: String,
    train: Vec<&'a str>,
    held_out: Vec<&'a str>,
    laws: &'a [LawFit],
    notes: &'a [String],
    remarks: &'a [String],
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &FitArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    check_files(arguments)?;
    let given = read_rig(&arguments.rig)?;
    let requests = requests(arguments)?;
    // Who names what is free is taken at her word.
    let rig = if requests.is_empty() {
        with_built_in_priors(&given)
    } else {
        given.clone()
    };
    let laws = laws(&rig)?;
    let train = recording_set::sorted(read_recordings(&arguments.train, &rig)?);
    let held_out = recording_set::sorted(read_recordings(&arguments.held_out, &rig)?);
    check_apart(&train, &held_out)?;
    let train_tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
    let held_tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
    let free = free_parameters(&rig, &laws, &train_tracks, &requests).map_err(bad_input)?;
    writeln!(out, "{}", headline(&train, &held_out))?;
    let remarks = say_remarks(&given, train.iter().chain(&held_out), out)?;
    let tasks = laws.iter().zip(free).map(|(&law, free)| LawTask {
        law,
        given: &given,
        rig: &rig,
        train: &train_tracks,
        held_out: &held_tracks,
        free,
    });
    let fits = fit_each(tasks, out)?;
    let faults: Vec<String> = fits.iter().flat_map(LawFit::faults).collect();
    let (improved, notes) = improved_rig(&given, &fits);
    say(&fits, (&faults, &notes), out)?;
    let is_accepted = faults.is_empty() || arguments.accept;
    if is_accepted {
        write_improved(arguments, &improved, out)?;
    }
    if let Some(path) = &arguments.json {
        let content = FitFile {
            format: "fit/1",
            rig: arguments.rig.display().to_string(),
            train: names(&train),
            held_out: names(&held_out),
            laws: &fits,
            notes: &notes,
            remarks: &remarks,
        };
        write_json(path, &content)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = crate::charts::fit_page(&rig, &fits, &train_tracks, &held_tracks);
        let recordings = arguments.train.iter().chain(&arguments.held_out);
        let files = std::iter::once(&arguments.rig).chain(recordings);
        page.provenance(with_remarks(provenance(files), &remarks));
        write_page(path, &page)?;
    }
    match faults.first() {
        Some(fault) if !is_accepted => Err(untrusted(arguments, fault)),
        _ => Ok(()),
    }
}

/// What is to be free, as typed.
fn requests(arguments: &FitArguments) -> Result<Vec<FreeRequest>, CommandError> {
    let parsed = arguments.free.iter().map(|text| FreeRequest::parse(text));
    parsed.collect::<Result<_, String>>().map_err(bad_input)
}

/// Fits every law of which a number is free.
fn fit_each<'t>(
    tasks: impl Iterator<Item = LawTask<'t>>,
    out: &mut dyn Write,
) -> Result<Vec<LawFit>, CommandError> {
    let mut fits = Vec::new();
    for task in tasks {
        if task.free.is_empty() {
            let law = task.law.title();
            writeln!(out, "\n{law}: none of its numbers is free")?;
        } else {
            fits.push(fit_with_progress(&task)?);
        }
    }
    Ok(fits)
}

/// Prints the fits. What speaks against the whole outcome comes first.
fn say(
    fits: &[LawFit],
    (faults, notes): (&[String], &[String]),
    out: &mut dyn Write,
) -> io::Result<()> {
    for fault in faults {
        writeln!(out, "NOT TO BE TRUSTED: {fault}")?;
    }
    for fit in fits {
        write!(out, "\n{fit}")?;
    }
    for note in notes {
        writeln!(out, "note: {note}")?;
    }
    out.flush()
}

/// The rig file with what was fitted.
fn write_improved(
    arguments: &FitArguments,
    improved: &Rig,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let Some(path) = &arguments.improved_rig else {
        return Ok(());
    };
    let edited = Rig::edited_file(&arguments.rig, improved).map_err(bad_input)?;
    let (text, complaint) = improved_text(&edited);
    write_text(path, &text)?;
    if let Some(complaint) = complaint {
        writeln!(out, "note: {complaint}")?;
    }
    Ok(())
}

fn untrusted(arguments: &FitArguments, fault: &str) -> CommandError {
    let unwritten = match &arguments.improved_rig {
        Some(_) => "; no improved rig is written (--accept takes the fit as it is)",
        None => "",
    };
    CommandError::Untrusted(format!(
        "{fault}{unwritten}; physics that the rig leaves out does this: pneuma diagnose looks for it"
    ))
}

fn check_files(arguments: &FitArguments) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.train)
        .chain(&arguments.held_out)
        .collect();
    let outputs = [&arguments.json, &arguments.improved_rig, &arguments.report];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    check_outputs(&inputs, &outputs)
}

fn fit_with_progress(task: &LawTask<'_>) -> Result<LawFit, CommandError> {
    let bar = spinner();
    let title = task.law.title();
    let progress = |runs: usize| {
        bar.set_message(format!("{title}: run {runs} through the recordings"));
        bar.tick();
    };
    let fit = fit_law(task, &progress).map_err(bad_input);
    bar.finish_and_clear();
    fit
}

fn headline(train: &[Recording], held_out: &[Recording]) -> String {
    let mut line = format!("fitted to {}", names(train).join(", "));
    if !held_out.is_empty() {
        line.push_str(&format!("; held out: {}", names(held_out).join(", ")));
    }
    line
}

/// The improved rig file, and what is wrong with it should it not read back.
fn improved_text(edited: &str) -> (String, Option<String>) {
    let text = format!("# Numbers fitted by `pneuma fit`.\n{edited}");
    let complaint = Rig::parse(&text, "the improved rig")
        .err()
        .map(|error| format!("{error}; bound the parameters with --free KEY,LOWER..UPPER"));
    (text, complaint)
}
