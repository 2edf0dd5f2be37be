//! `pneuma diagnose`: recordings in, verdict out.

use super::CommandError;
use super::progress::Progress;
use crate::diagnose::verdict::{FitFigures, Kind, Verdict};
use crate::diagnose::{Diagnosis, diagnose, words};
use crate::recording::Recording;
use crate::report;
use crate::rig::Rig;
use clap::Args;
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
    /// Recordings to learn from.
    #[arg(long, num_args = 1.., required = true)]
    pub train: Vec<PathBuf>,
    /// Recordings to judge by; not read before every parameter is frozen.
    #[arg(long = "held-out", num_args = 1..)]
    pub held_out: Vec<PathBuf>,
    /// Write the verdict here.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the improved rig here.
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
    let rig = Rig::read(&arguments.rig).map_err(bad_input)?;
    let train = read_all(&arguments.train, &rig)?;
    let progress = Progress::new();
    let diagnosis = diagnose(
        &rig,
        train,
        || read_all(&arguments.held_out, &rig),
        &|stage| progress.stage(stage),
    )?;
    progress.done();
    if let Some(path) = &arguments.json {
        let mut text = serde_json::to_string_pretty(&diagnosis.verdict)
            .map_err(|error| CommandError::BadInput(error.to_string()))?;
        text.push('\n');
        write_file(path, &text)?;
    }
    if let Some(path) = &arguments.improved_rig {
        write_file(path, &diagnosis.improved_rig.to_toml())?;
    }
    if let Some(path) = &arguments.report {
        let page = report::diagnosis::page(&rig, &diagnosis, arguments);
        page.write(path).map_err(|error| unwritten(path, &error))?;
    }
    summary(&diagnosis, out)?;
    writeln!(out, "{:.1} s", started.elapsed().as_secs_f64())?;
    Ok(())
}

fn bad_input(error: impl std::fmt::Display) -> CommandError {
    CommandError::BadInput(error.to_string())
}

fn unwritten(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::BadInput(format!("{}: cannot be written: {error}", path.display()))
}

fn read_all(paths: &[PathBuf], rig: &Rig) -> Result<Vec<Recording>, CommandError> {
    paths
        .iter()
        .map(|path| Recording::read(path, &rig.signals).map_err(bad_input))
        .collect()
}

/// Written beside and renamed: an interrupted run leaves the old file or the
/// new one, never half of one.
fn write_file(path: &Path, text: &str) -> Result<(), CommandError> {
    let beside = path.with_extension("partial");
    std::fs::write(&beside, text)
        .and_then(|()| std::fs::rename(&beside, path))
        .map_err(|error| unwritten(path, &error))
}

/// Five lines: what, where, how sure, how much better, what next.
fn summary(diagnosis: &Diagnosis, out: &mut dyn Write) -> Result<(), CommandError> {
    let verdict = &diagnosis.verdict;
    writeln!(out, "what     {}", verdict.sentence)?;
    writeln!(out, "where    {}", places(verdict))?;
    writeln!(out, "how sure {}", certainty(verdict))?;
    writeln!(out, "better   {}", improvement(verdict))?;
    let next = verdict.next_experiment.as_deref();
    writeln!(
        out,
        "next     {}",
        next.unwrap_or(default_next(verdict.verdict))
    )?;
    for note in &verdict.notes {
        writeln!(out, "note     {note}")?;
    }
    Ok(())
}

fn places(verdict: &Verdict) -> String {
    let places: Vec<String> = verdict
        .located
        .iter()
        .map(|located| {
            format!(
                "{} ({:.0} % of the misfit; {})",
                located.place,
                100.0 * located.share,
                located.when
            )
        })
        .collect();
    if places.is_empty() {
        "nowhere".into()
    } else {
        places.join("; ")
    }
}

fn certainty(verdict: &Verdict) -> String {
    let effects: Vec<String> = verdict
        .effects
        .iter()
        .map(|effect| format!("{} {:.2}", effect.effect, effect.probability))
        .collect();
    let word = serde_json::to_value(verdict.verdict).map_or_else(
        |_| String::new(),
        |value| value.as_str().unwrap_or_default().to_owned(),
    );
    if effects.is_empty() {
        word
    } else {
        format!("{word}: {}", effects.join(", "))
    }
}

/// Free-run errors, held out where there are any.
fn improvement(verdict: &Verdict) -> String {
    let fit = &verdict.fit;
    let held = !fit.refitted.free_run_held_out.is_empty();
    let pick = |figures: &FitFigures| {
        if held {
            figures.free_run_held_out.clone()
        } else {
            figures.free_run_train.clone()
        }
    };
    let (given, refitted, improved) = (
        pick(&fit.as_given),
        pick(&fit.refitted),
        pick(&fit.improved),
    );
    let line = |(signal, after): (&String, &f64)| {
        let before = refitted.get(signal).copied().unwrap_or(f64::NAN);
        let first = given.get(signal).copied().unwrap_or(f64::NAN);
        format!(
            "{signal} rms {} as given, {} refitted, {} improved",
            words::digits(first),
            words::digits(before),
            words::digits(*after)
        )
    };
    let lines: Vec<String> = improved.iter().map(line).collect();
    let which = if held {
        "held out"
    } else {
        "training (nothing was held out)"
    };
    format!("{which}, free run, SI: {}", lines.join("; "))
}

fn default_next(kind: Kind) -> &'static str {
    match kind {
        Kind::DataFault => "Mend the recording and run again.",
        Kind::Unknown => {
            "Record the same motion at other speeds and pressures: the shape of the missing term will tell."
        }
        _ => "Nothing more is needed for this verdict.",
    }
}
