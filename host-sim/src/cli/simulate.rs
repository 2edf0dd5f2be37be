//! `pneuma simulate`: a scenario to a recording.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::CommandError;
use super::outputs::{check_outputs, write_page, write_with};
use crate::report::{Provenance, number};
use crate::scenario::Scenario;
use crate::simulate::ensemble::{Ensemble, ensemble};
use crate::simulate::{IntegrationError, Simulation, integration_error, page, recorded, simulate};
use crate::text::file_name;

/// Simulate an axis: rig and command in, recording out.
///
/// A carriage that leaves its stroke ends the simulation early: what was
/// simulated is written, a note says when, and the exit status is 0.
#[derive(Args, Clone, Debug)]
pub struct SimulateArguments {
    /// The scenario file.
    pub scenario: PathBuf,
    /// The recording to write, a CSV file that the same rig's signals read.
    #[arg(long)]
    pub out: PathBuf,
    /// Also run it so often with numbers drawn from the rig's uncertainties.
    #[arg(long, value_name = "RUNS", requires = "bands", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub ensemble: Option<u32>,
    /// Write between which values 90 of 100 of those runs lie, as CSV.
    #[arg(long, value_name = "FILE", requires = "ensemble")]
    pub bands: Option<PathBuf>,
    /// What those runs are drawn from.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Also write a page with plots and key figures.
    #[arg(long)]
    pub report: Option<PathBuf>,
}

/// Runs the command, writing a summary to `out`.
pub fn run(arguments: &SimulateArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let bad_input = |error: &dyn ToString| CommandError::BadInput(error.to_string());
    let scenario = Scenario::read(&arguments.scenario).map_err(|error| bad_input(&error))?;
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.scenario)
        .chain(&scenario.files)
        .collect();
    let outputs: Vec<&PathBuf> = std::iter::once(&arguments.out)
        .chain(&arguments.report)
        .chain(&arguments.bands)
        .collect();
    check_outputs(&inputs, &outputs)?;
    let simulation = simulate(&scenario).map_err(|error| bad_input(&error))?;
    let error = integration_error(&scenario, &simulation).map_err(|error| error.to_string());
    let table = recorded(&scenario, &simulation).map_err(|error| bad_input(&error))?;
    write_with(&arguments.out, |out| table.write(out))?;
    let runs = arguments
        .ensemble
        .map(|runs| ensemble(&scenario, runs as usize, arguments.seed));
    let runs = runs.transpose().map_err(|error| bad_input(&error))?;
    if let (Some(path), Some(runs)) = (&arguments.bands, &runs) {
        write_with(path, |out| runs.write(out))?;
    }
    if let Some(path) = &arguments.report {
        let mut page = page(&scenario, (&simulation, runs.as_ref()), error.as_ref().ok());
        page.provenance(provenance(arguments, &scenario));
        write_page(path, &page)?;
    }
    summarise(arguments, &simulation, &error, out)?;
    if let Some(runs) = &runs {
        summarise_runs(runs, out)?;
    }
    Ok(out.flush()?)
}

/// The widest band of each signal.
fn summarise_runs(runs: &Ensemble, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(
        out,
        "  of {} runs within the rig's uncertainty 90 of 100 lie within:",
        runs.runs
    )?;
    for band in &runs.bands {
        let (width, time_s) = runs.widest(band);
        let (title, unit) = band.title;
        let width = number::significant(width, 3);
        writeln!(out, "    {title}: {width} {unit} at most, at {time_s} s")?;
    }
    if runs.stopped > 0 {
        writeln!(
            out,
            "  note: {} runs met the end of the stroke early",
            runs.stopped
        )?;
    }
    Ok(())
}

fn summarise(
    arguments: &SimulateArguments,
    simulation: &Simulation,
    error: &Result<IntegrationError, String>,
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let figures = simulation.key_figures();
    let last_s = simulation.samples.last().map_or(0.0, |last| last.time_s);
    writeln!(
        out,
        "{}: {} rows, 0 to {last_s} s",
        file_name(&arguments.out.display().to_string()),
        simulation.samples.len(),
    )?;
    writeln!(
        out,
        "  peak speed {} m/s, travel {} mm, lowest gas temperature {} K in chamber {}",
        number::fixed(figures.peak_speed_m_s.0, 3),
        number::fixed(1e3 * figures.travel_m, 1),
        number::fixed(figures.lowest_temperature_k.0, 1),
        figures.coldest.letter(),
    )?;
    match error {
        Ok(error) => writeln!(
            out,
            "  integration error about {} um in position and {} Pa in chamber pressure (by a run at half the step)",
            number::significant(1e6 * error.position_m, 2),
            number::significant(error.pressure_pa, 2),
        )?,
        Err(reason) => writeln!(
            out,
            "  integration error not estimated: at half the step, {reason}"
        )?,
    }
    if let Some(note) = simulation.note() {
        writeln!(out, "  note: {note}")?;
    }
    out.flush()
}

fn provenance(arguments: &SimulateArguments, scenario: &Scenario) -> Provenance {
    let shown = |path: &Path| file_name(&path.display().to_string());
    let report = arguments.report.as_deref().map(shown).unwrap_or_default();
    let command = format!(
        "pneuma simulate {} --out {} --report {report}",
        shown(&arguments.scenario),
        shown(&arguments.out),
    );
    let seed = scenario
        .noise_seed
        .map_or("none".into(), |seed| seed.to_string());
    Provenance::new(command)
        .fact("version", env!("CARGO_PKG_VERSION"))
        .fact("integration step", format!("{} s", scenario.step_s()))
        .fact("row step", format!("{} s", scenario.sample_s))
        .fact("seed of the noise", seed)
}
