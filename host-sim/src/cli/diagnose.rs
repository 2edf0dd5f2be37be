//! `pneuma diagnose`: recordings in, verdict out.

use super::{CommandError, inputs};
use crate::charts;
use crate::diagnose::verdict::{FitFigures, Kind, Verdict};
use crate::diagnose::{Diagnosis, diagnose, words};
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
        inputs::write_text(path, &diagnosis.improved_rig.to_toml())?;
    }
    if let Some(path) = &arguments.report {
        inputs::write_page(path, &page(arguments, &rig, &diagnosis))?;
    }
    summary(&diagnosis, out)?;
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
    if improved.is_empty() {
        return "nothing was fitted".into();
    }
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
        _ => {
            "Nothing is needed for this verdict; a recording at other speeds and pressures would test it further."
        }
    }
}
