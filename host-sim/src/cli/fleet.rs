//! `pneuma fleet`: thousands of recordings of many axes.

use super::CommandError;
use super::inputs::{bad_input, spinner};
use super::outputs::{write_json, write_page, write_text};
use crate::fleet::manifest::Manifest;
use crate::fleet::page::{page, sentence};
use crate::fleet::plan::{AxisPlan, Night, Plan};
use crate::fleet::scheduler;
use crate::fleet::store::{Kind, Outcome, Store};
use crate::fleet::summary::{night_for_verdict, summary};
use crate::fleet::work::{self, Reference};
use crate::fleet::{table, watched};
use crate::output::write_whole;
use crate::side_by_side::{side_by_side, usual};
use crate::text::one_line;
use clap::{Args, Subcommand};
use serde::Serialize;
use std::fs;
use std::io::Write;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Follow many axes over many nights: what changes in which, since when.
#[derive(Args, Debug)]
pub struct FleetArguments {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Write the list of all work: each job is named by the files that it works on.
    Plan(PlanArguments),
    /// Do what is not done yet, on this machine or as a part of it.
    Run(RunArguments),
    /// Write what changed: a page, and a table of all estimates.
    Report(ReportArguments),
    /// Write the same work for a scheduler.
    Submit(SubmitArguments),
}

#[derive(Args, Debug)]
struct PlanArguments {
    /// The axes of the fleet (docs/fleet.md).
    manifest: PathBuf,
    /// Write the plan here; `plan.json` among the results unless told.
    #[arg(long)]
    plan: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct RunArguments {
    /// The plan.
    #[arg(long)]
    plan: PathBuf,
    /// This stage only, of reference, night and verdict.
    #[arg(long)]
    stage: Option<Kind>,
    /// Every so many-th job only, `2/8` for the second of eight parts.
    #[arg(long, value_name = "N/OF", default_value = "1/1", value_parser = part)]
    part: (usize, usize),
    /// Jobs at once, each on one core.
    #[arg(long, default_value_t = usual())]
    at_once: NonZeroUsize,
}

#[derive(Args, Debug)]
struct ReportArguments {
    /// The plan.
    #[arg(long)]
    plan: PathBuf,
    /// Write the page here.
    #[arg(long)]
    report: Option<PathBuf>,
    /// Write every change here.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write all estimates here, a Parquet table.
    #[arg(long)]
    table: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct SubmitArguments {
    /// The plan.
    #[arg(long)]
    plan: PathBuf,
    /// For which scheduler.
    #[arg(long)]
    to: Scheduler,
    /// In how many parts.
    #[arg(long, default_value_t = NonZeroUsize::new(4).unwrap_or(NonZeroUsize::MIN))]
    parts: NonZeroUsize,
    /// The image that holds the program, for Kubernetes.
    #[arg(long, default_value = "pneuma:latest")]
    image: String,
    /// Write a script, or the manifests, here; standard output unless told.
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Scheduler {
    /// A script that submits three arrays, each after the other.
    Slurm,
    /// Three Jobs, one to apply after the other.
    Kubernetes,
    /// Three lines for GNU parallel.
    Parallel,
}

/// `2/8`.
fn part(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/');
    let parsed = parts.and_then(|(one, of)| Some((one.parse().ok()?, of.parse().ok()?)));
    let sound = parsed.filter(|&(one, of): &(usize, usize)| 1 <= one && one <= of);
    sound.ok_or_else(|| format!("\"{}\": expected N/OF, as 2/8", one_line(text)))
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If a file cannot be read or written.
pub fn run(arguments: &FleetArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    match &arguments.command {
        FleetCommand::Plan(arguments) => plan(arguments, out),
        FleetCommand::Run(arguments) => work_on(arguments, out),
        FleetCommand::Report(arguments) => report(arguments, out),
        FleetCommand::Submit(arguments) => submit(arguments, out),
    }
}

fn plan(arguments: &PlanArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let manifest = Manifest::read(&arguments.manifest).map_err(bad_input)?;
    let plan = Plan::of(&manifest).map_err(bad_input)?;
    let store = Store::of(&plan).map_err(bad_input)?;
    let usual = plan.results.join("plan.json");
    let path = arguments.plan.as_ref().unwrap_or(&usual);
    write_json(path, &plan)?;
    let nights = plan.axes.iter().flat_map(|axis| &axis.nights);
    let done = nights
        .filter(|night| store.is_done(&night.job, Kind::Night))
        .count();
    writeln!(
        out,
        "{}: {} axes, {} jobs, {done} nights done",
        path.display(),
        plan.axes.len(),
        scheduler::jobs(&plan)
    )?;
    Ok(())
}

fn read_plan(path: &Path) -> Result<Plan, CommandError> {
    let shown = one_line(&path.display().to_string());
    let text = fs::read_to_string(path).map_err(|error| bad_input(format!("{shown}: {error}")))?;
    let plan: Plan = serde_json::from_str(&text).map_err(|error| {
        bad_input(format!(
            "{shown}: {error}, expected what `pneuma fleet plan` writes"
        ))
    })?;
    if plan.format != "fleet-plan/1" {
        let format = one_line(&plan.format);
        return Err(bad_input(format!(
            "{shown}: format \"{format}\", expected \"fleet-plan/1\""
        )));
    }
    Ok(plan)
}

/// A job of a plan.
enum Job<'p> {
    Reference(&'p AxisPlan),
    Night(&'p AxisPlan, &'p Night),
    Verdict(&'p AxisPlan, &'p Night, String),
}

impl Job<'_> {
    fn name(&self) -> &str {
        match self {
            Self::Reference(axis) => &axis.reference_job,
            Self::Night(_, night) => &night.job,
            Self::Verdict(_, _, job) => job,
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Reference(_) => Kind::Reference,
            Self::Night(..) => Kind::Night,
            Self::Verdict(..) => Kind::Verdict,
        }
    }

    fn axis(&self) -> &AxisPlan {
        match self {
            Self::Reference(axis) | Self::Night(axis, _) | Self::Verdict(axis, ..) => axis,
        }
    }
}

/// How a job ended.
enum End {
    Done,
    /// The same files give the same: it is not tried again.
    Failed(String),
    /// Nothing was written: it is tried again.
    Left(String),
}

fn work_on(arguments: &RunArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let plan = read_plan(&arguments.plan)?;
    let store = Store::of(&plan).map_err(bad_input)?;
    let stages = match arguments.stage {
        Some(stage) => vec![stage],
        None => vec![Kind::Reference, Kind::Night, Kind::Verdict],
    };
    let mut left = 0;
    for stage in stages {
        left += run_stage(&plan, &store, stage, arguments, out)?;
    }
    if left > 0 {
        return Err(CommandError::Untrusted(format!(
            "{left} jobs have no result: run it again when what they name is mended"
        )));
    }
    Ok(())
}

/// Does a stage's part; how many jobs were left without a result.
fn run_stage(
    plan: &Plan,
    store: &Store,
    stage: Kind,
    arguments: &RunArguments,
    out: &mut dyn Write,
) -> Result<usize, CommandError> {
    let (one, of) = arguments.part;
    let all = jobs(plan, store, stage).into_iter().enumerate();
    let part = all.filter(|(number, _)| number % of == one - 1);
    let (done, open): (Vec<Job<'_>>, Vec<Job<'_>>) = part
        .map(|(_, job)| job)
        .partition(|job| store.is_done(job.name(), job.kind()));
    let progress = spinner();
    let (mut ended, mut left) = (0, 0);
    side_by_side(
        &open,
        arguments.at_once,
        |job| (job.axis().name.clone(), end(job, store)),
        |(axis, end)| {
            ended += 1;
            progress.set_message(format!("{stage:?}: {ended} of {}, {axis}", open.len()));
            let why = match end {
                End::Done => return Ok::<_, CommandError>(()),
                End::Failed(why) => why,
                End::Left(why) => {
                    left += 1;
                    why
                }
            };
            progress.suspend(|| writeln!(out, "{axis}: {why}"))?;
            Ok(())
        },
    )?;
    progress.finish_and_clear();
    let stage = format!("{stage:?}").to_lowercase();
    writeln!(
        out,
        "{stage}: {} done now, {} before, {left} left",
        open.len() - left,
        done.len()
    )?;
    out.flush()?;
    Ok(left)
}

fn jobs<'p>(plan: &'p Plan, store: &Store, stage: Kind) -> Vec<Job<'p>> {
    match stage {
        Kind::Reference => plan.axes.iter().map(Job::Reference).collect(),
        Kind::Night => {
            let nights =
                |axis: &'p AxisPlan| axis.nights.iter().map(move |night| Job::Night(axis, night));
            plan.axes.iter().flat_map(nights).collect()
        }
        Kind::Verdict => {
            let summary = summary(plan, store);
            let jobs = summary.changed.iter().filter_map(|(axis, _)| {
                let (night, job) = night_for_verdict(axis)?;
                Some(Job::Verdict(axis.plan, night, job))
            });
            jobs.collect()
        }
    }
}

fn end(job: &Job<'_>, store: &Store) -> End {
    match job {
        Job::Reference(axis) => kept(store, job, || work::reference(axis)),
        Job::Night(axis, night) => match store.read::<Reference>(&axis.reference_job) {
            None => End::Left("its reference is not fitted yet".into()),
            Some(Outcome::Failed(why)) => End::Left(format!("its reference failed: {why}")),
            Some(Outcome::Done(reference)) => {
                kept(store, job, || work::night(axis, night, &reference))
            }
        },
        Job::Verdict(axis, night, _) => match store.read::<Reference>(&axis.reference_job) {
            Some(Outcome::Done(reference)) => {
                kept(store, job, || work::verdict(axis, night, &reference))
            }
            _ => End::Left("its reference is not fitted yet".into()),
        },
    }
}

/// Does a job and keeps what comes of it. A file that has changed since the plan was made is no
/// failure of the job, which is named by the file as it was.
fn kept<T: Serialize>(
    store: &Store,
    job: &Job<'_>,
    work: impl FnOnce() -> Result<T, String>,
) -> End {
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let outcome = outcome.unwrap_or_else(|_| Err("an internal failure of pneuma".into()));
    if let Err(why) = files_are_as_planned(job) {
        return End::Left(why);
    }
    let (outcome, failed) = match outcome {
        Ok(result) => (Outcome::Done(result), None),
        Err(why) => (Outcome::Failed(why.clone()), Some(why)),
    };
    match (store.write(job.name(), &outcome), failed) {
        (Err(why), _) => End::Left(why),
        (Ok(()), Some(why)) => End::Failed(why),
        (Ok(()), None) => End::Done,
    }
}

fn files_are_as_planned(job: &Job<'_>) -> Result<(), String> {
    let nights: &[Night] = match job {
        Job::Reference(axis) => &axis.nights[..axis.reference],
        Job::Night(_, night) | Job::Verdict(_, night, _) => std::slice::from_ref(*night),
    };
    nights.iter().try_for_each(|night| night.recording.check())
}

fn report(arguments: &ReportArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let plan = read_plan(&arguments.plan)?;
    let store = Store::of(&plan).map_err(bad_input)?;
    let summary = summary(&plan, &store);
    for group in &summary.groups {
        let first = &group.found[0];
        writeln!(
            out,
            "all of {}: {} ({:.1} of what matters)",
            group.name,
            first.title(),
            first.share()
        )?;
    }
    for (axis, changed) in &summary.changed {
        writeln!(
            out,
            "{}: {}",
            axis.plan.name,
            sentence(axis.plan, &changed.found[0])
        )?;
    }
    let changed = summary.changed.iter().chain(&summary.slightly);
    let faulty = changed.map(|(axis, _)| axis).chain(&summary.steady);
    for axis in faulty.filter(|axis| !axis.faults.is_empty()) {
        let what = axis.faults[0].1.first().map_or("", String::as_str);
        writeln!(
            out,
            "{}: {} nights with faults in the recording: {what}",
            axis.plan.name,
            axis.faults.len()
        )?;
    }
    writeln!(
        out,
        "{} of {} axes changed by what matters or will before long, {} by less; {} quantities of each are followed, {} false alarms an axis and year",
        summary.changed.len(),
        plan.axes.len(),
        summary.slightly.len(),
        watched::WATCHED.len(),
        plan.false_alarms_per_axis_year
    )?;
    if let Some(path) = &arguments.json {
        write_json(path, &summary.said())?;
    }
    if let Some(path) = &arguments.table {
        let bytes = table::table(&plan, &store).map_err(bad_input)?;
        write_whole(path, |out| out.write_all(&bytes))?;
    }
    if let Some(path) = &arguments.report {
        write_page(path, &page(&summary, &store))?;
    }
    Ok(())
}

fn submit(arguments: &SubmitArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    read_plan(&arguments.plan)?;
    let plan = fs::canonicalize(&arguments.plan)?;
    let program = std::env::current_exe()?;
    let parts = arguments.parts.get();
    let text = match arguments.to {
        Scheduler::Slurm => scheduler::slurm(&plan, &program, parts),
        Scheduler::Parallel => scheduler::parallel(&plan, &program, parts),
        Scheduler::Kubernetes => {
            let stages = scheduler::STAGES.iter();
            let jobs =
                stages.map(|stage| scheduler::kubernetes(&plan, &arguments.image, stage, parts));
            jobs.collect::<Vec<String>>().join("---\n")
        }
    };
    match &arguments.out {
        Some(path) => write_text(path, &text),
        None => Ok(write!(out, "{text}")?),
    }
}
