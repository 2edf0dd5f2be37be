//! `pneuma trial`: the diagnosis judged on concealed data.

use super::{CommandError, inputs, outputs};
use crate::side_by_side::{side_by_side, usual};
use crate::text::file_name;
use crate::trial::others::other;
use crate::trial::plan::Planned;
use crate::trial::{
    CaseResult, Scorecard, Setting, TrialError, markdown, page, plan, run as run_case, seal,
};
use clap::Args;
use std::fs;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use truth_plant::{Kind, Nature};

/// Judge the diagnosis on rigs whose truth is sealed before it runs.
///
/// Cases run side by side and the scorecard is written after each, in the order
/// of the plan. A scorecard that is there already is gone on with.
#[derive(Args, Debug)]
pub struct TrialArguments {
    /// How many cases the scorecard shall hold.
    #[arg(long)]
    pub cases: NonZeroUsize,
    /// The seed that all cases follow from.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Cases of this kind only: single, pair, onset, nothing, parameters, dirty,
    /// other-form, off-list or unobservable.
    #[arg(long)]
    pub kind: Option<Kind>,
    /// Where the rigs stand: laboratory, where the rig files' laws hold exactly, or shop-floor, where
    /// they hold nearly.
    #[arg(long, default_value_t = Nature::Laboratory)]
    pub nature: Nature,
    /// How many cases run at once, sharing the cores; one for each core unless
    /// told. The times in the scorecard are those of cases that ran so.
    #[arg(long, default_value_t = usual())]
    pub at_once: NonZeroUsize,
    /// The scorecard.
    #[arg(long)]
    pub json: PathBuf,
    /// Write the report here.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the main tables here, as Markdown.
    #[arg(long)]
    pub markdown: Option<PathBuf>,
    /// Keep the cases' files in this folder; each holds its truth once it is open.
    #[arg(long)]
    pub keep: Option<PathBuf>,
    /// Judge other tools too, by the verdicts NAME.json that they have written
    /// into the kept folders.
    #[arg(long, value_name = "NAME", num_args = 1.., requires = "keep")]
    pub others: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// If a file cannot be written, or the scorecard is of another trial.
pub fn run(arguments: &TrialArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let setting = Setting {
        seed: arguments.seed,
        kind: arguments.kind,
        nature: arguments.nature,
    };
    let outputs = [
        Some(&arguments.json),
        arguments.report.as_ref(),
        arguments.markdown.as_ref(),
    ];
    outputs::check_outputs(&[], &outputs.into_iter().flatten().collect::<Vec<_>>())?;
    let planned = plan(setting, arguments.cases.get());
    let mut card = opened_or_new(arguments, setting)?;
    seal_cases(&mut card, &planned, arguments, out)?;
    let work = Work::new(arguments)?;
    run_cases(&mut card, &planned, arguments, &work, out)?;
    for name in &arguments.others {
        let score = other(&card.cases, &work.root, name).map_err(inputs::bad_input)?;
        card.others.insert(name.clone(), score);
    }
    card.write(&arguments.json).map_err(inputs::bad_input)?;
    write_reports(arguments, &card)?;
    summary(&card, out)
}

/// Runs the cases that the scorecard does not hold yet.
fn run_cases(
    card: &mut Scorecard,
    planned: &[Planned],
    arguments: &TrialArguments,
    work: &Work,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let (setting, seals) = (card.setting, card.seals.clone());
    let progress = inputs::spinner();
    let run_one = |planned: &Planned| {
        let folder = work.root.join(planned.folder());
        let tell = |stage: &str| progress.set_message(format!("{}: {stage}", planned.folder()));
        run_case(setting, planned, &seals[planned.number], &folder, &tell)
    };
    let left = planned.get(card.cases.len()..).unwrap_or_default();
    let taken = side_by_side(
        left,
        arguments.at_once,
        run_one,
        |case: Result<CaseResult, TrialError>| {
            let case = case.map_err(inputs::bad_input)?;
            let folder = case.planned.folder();
            let verdict = if case.judgement.right {
                "right"
            } else {
                "WRONG"
            };
            card.add(case);
            card.write(&arguments.json).map_err(inputs::bad_input)?;
            work.after(&work.root.join(&folder))?;
            progress.suspend(|| writeln!(out, "{folder}: {verdict}"))?;
            Ok(out.flush()?)
        },
    );
    progress.finish_and_clear();
    taken
}

fn opened_or_new(arguments: &TrialArguments, setting: Setting) -> Result<Scorecard, CommandError> {
    if arguments.json.exists() {
        return Scorecard::read(&arguments.json, setting).map_err(inputs::bad_input);
    }
    Ok(Scorecard::new(setting, Vec::new()))
}

/// Seals every case that is not sealed yet and publishes the seals, before any
/// of them is run.
fn seal_cases(
    card: &mut Scorecard,
    planned: &[Planned],
    arguments: &TrialArguments,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let progress = inputs::spinner();
    for planned in planned.iter().skip(card.seals.len()) {
        progress.set_message(format!("sealing {}", planned.folder()));
        card.seals
            .push(seal(card.setting, planned).map_err(inputs::bad_input)?);
    }
    progress.finish_and_clear();
    let path = arguments.json.with_extension("sealed.txt");
    let lines: Vec<String> = card
        .seals
        .iter()
        .enumerate()
        .map(|(number, seal)| format!("case-{number:04} {}\n", seal.sha256))
        .collect();
    outputs::write_text(&path, &lines.concat())?;
    card.write(&arguments.json).map_err(inputs::bad_input)?;
    let name = file_name(&path.display().to_string());
    writeln!(out, "{} truths sealed in {name}", card.seals.len())?;
    Ok(())
}

/// The folder that the cases are written to.
struct Work {
    root: PathBuf,
    is_kept: bool,
}

impl Work {
    fn new(arguments: &TrialArguments) -> Result<Self, CommandError> {
        let is_kept = arguments.keep.is_some();
        let root = arguments
            .keep
            .clone()
            .unwrap_or_else(|| arguments.json.with_extension("cases"));
        fs::create_dir_all(&root)?;
        Ok(Self { root, is_kept })
    }

    fn after(&self, folder: &Path) -> Result<(), CommandError> {
        if !self.is_kept {
            fs::remove_dir_all(folder)?;
        }
        Ok(())
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        if !self.is_kept {
            // A folder that still holds something stays.
            let _ = fs::remove_dir(&self.root);
        }
    }
}

fn write_reports(arguments: &TrialArguments, card: &Scorecard) -> Result<(), CommandError> {
    if let Some(path) = &arguments.report {
        let how = inputs::provenance([]).fact("seed", arguments.seed);
        outputs::write_page(path, &page::page(card, how))?;
    }
    if let Some(path) = &arguments.markdown {
        outputs::write_text(path, &markdown::tables(card))?;
    }
    Ok(())
}

fn summary(card: &Scorecard, out: &mut dyn Write) -> Result<(), CommandError> {
    for mark in &card.score.marks {
        let kept = mark
            .kept
            .map_or("no case", |kept| if kept { "kept" } else { "MISSED" });
        writeln!(
            out,
            "{:<52} {:>16}  {:>12}  {kept}",
            mark.title,
            mark.reached.to_string(),
            mark.reached.interval_in_words()
        )?;
    }
    Ok(())
}
