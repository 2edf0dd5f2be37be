//! The fault campaign on a rig, as tables on standard output:
//! `cargo run --release --example faults [SEEDS [MINUTES]]`.

use host_sim::closed_loop::{HostController, ScoreError, control_task, wrongly_known};
use host_sim::fault_campaign::{
    CASES, Case, Moment, NORMAL_RUN_S, NormalRun, Outcome, normal_run, reaction_table, run_case,
};
use host_sim::rig::Rig;
use std::error::Error;
use std::num::NonZero;
use std::thread::available_parallelism;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().map_or(Ok(20), |count| count.parse())?;
    let minutes: f64 = arguments.next().map_or(Ok(10.0), |count| count.parse())?;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/paper.toml");
    let rig = Rig::read(path)?;
    let outcomes = campaign(&rig, seeds)?;
    println!(
        "## Reaction times\n\nTicks of 1 ms from the first wrong sample to the command at the"
    );
    println!("valve's null, median / worst over {seeds} seeds.\n");
    print!("{}", reaction_table(&outcomes, CASES));
    let count = |bad: fn(&Case, &Outcome) -> bool| {
        outcomes
            .iter()
            .filter(|(case, _, outcome)| bad(case, outcome))
            .count()
    };
    println!(
        "\nRuns: {}. The command of the tick that sees the fault, or one after it, was",
        outcomes.len()
    );
    println!(
        "not the null in {} runs; the way back was not the right one in {}; another",
        count(|_, o| !o.was_at_null),
        count(|_, o| !o.came_back)
    );
    println!(
        "fault than those that fit was said in {}.",
        count(|case, o| o.fault.is_some_and(|fault| !case.faults.contains(&fault)))
    );
    for (case, moment, outcome) in &outcomes {
        let fits = outcome
            .fault
            .is_none_or(|fault| case.faults.contains(&fault));
        if !(outcome.was_at_null && outcome.came_back && fits) {
            println!("* {} {moment:?}: {outcome:?}", case.name);
        }
    }
    let runs = normal(&rig, (minutes * 60.0 / NORMAL_RUN_S).ceil() as u64)?;
    let time_s: f64 = runs.iter().map(|run| run.time_s).sum();
    let fastest = runs
        .iter()
        .map(|run| run.fastest_m_per_s)
        .fold(0.0, f64::max);
    let trips: Vec<_> = runs.iter().filter_map(|run| run.trip).collect();
    println!(
        "\n## False trips\n\n{} in {:.1} minutes of hard motion up to {fastest:.2} m/s, the rig known",
        trips.len(),
        time_s / 60.0
    );
    println!("wrongly, with payload doubled, 5 bar for 7, and pushes of 10 N in turn. {trips:?}");
    Ok(())
}

fn campaign(rig: &Rig, seeds: u64) -> Result<Vec<(Case, Moment, Outcome)>, ScoreError> {
    let jobs: Vec<(Case, Moment, u64)> = CASES
        .iter()
        .flat_map(|case| Moment::ALL.map(|moment| (*case, moment)))
        .flat_map(|(case, moment)| (1..=seeds).map(move |seed| (case, moment, seed)))
        .collect();
    spread(&jobs, |(case, moment, seed)| {
        let mut drive = HostController::new(control_task(&wrongly_known(rig, *seed))?);
        let outcome = run_case(rig, &mut drive, case, *moment, *seed)?;
        Ok((*case, *moment, outcome))
    })
}

fn normal(rig: &Rig, runs: u64) -> Result<Vec<NormalRun>, ScoreError> {
    let seeds: Vec<u64> = (1..=runs).collect();
    spread(&seeds, |seed| {
        let mut drive = HostController::new(control_task(&wrongly_known(rig, *seed))?);
        normal_run(rig, &mut drive, *seed)
    })
}

/// Every job, on all processors, in order.
fn spread<J: Sync, T: Send>(
    jobs: &[J],
    work: impl Fn(&J) -> Result<T, ScoreError> + Sync,
) -> Result<Vec<T>, ScoreError> {
    let workers = available_parallelism().map_or(1, NonZero::get);
    let share = jobs.len().div_ceil(workers).max(1);
    let work = &work;
    std::thread::scope(|scope| {
        let handles: Vec<_> = jobs
            .chunks(share)
            .map(|chunk| scope.spawn(move || chunk.iter().map(work).collect::<Vec<_>>()))
            .collect();
        handles
            .into_iter()
            .flat_map(|handle| {
                handle
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            })
            .collect()
    })
}
