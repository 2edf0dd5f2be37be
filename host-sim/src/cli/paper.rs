//! `pneuma paper`: the paper's figures and its procedure on one page.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::CommandError;
use super::inputs::spinner;
use super::outputs::{check_outputs, write_page, write_text};
use crate::paper::{figures, page, procedure};
use crate::report::Provenance;
use bench::Picture;

/// The paper, experiment by experiment: every figure, and its procedure on a virtual bench.
///
/// Meng, Tao, Chen, Ban, "Modeling of a Pneumatic System for High-Accuracy Position Control" (FPM
/// 2011): figures 2 to 14 by the numbers of its text and this model; then bench experiments of a
/// drawn axis, the rig file that they give, step responses predicted and measured, and what the
/// procedure leaves out, found by the diagnosis.
#[derive(Args, Clone, Debug)]
pub struct PaperArguments {
    /// The page to write.
    #[arg(long)]
    out: PathBuf,
    /// Write the points of every picture as CSV files into this folder.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Write the rig file that the procedure gives.
    #[arg(long)]
    rig_out: Option<PathBuf>,
    /// The axis that the procedure is run on.
    #[arg(long, default_value_t = 2011)]
    seed: u64,
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If the procedure fails on that axis, or an output cannot be written.
pub fn run(arguments: &PaperArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let outputs: Vec<&PathBuf> = std::iter::once(&arguments.out)
        .chain(&arguments.rig_out)
        .collect();
    check_outputs(&[], &outputs)?;
    let failed = |why: String| CommandError::BadInput(why);
    let progress = spinner();
    let figures = figures().map_err(failed)?;
    let tell = |what: &str| progress.set_message(what.to_owned());
    let procedure = procedure(arguments.seed, true, &tell).map_err(failed)?;
    progress.finish_and_clear();
    let mut page = page(&figures, &procedure);
    page.provenance(
        Provenance::new(format!("pneuma paper --seed {}", arguments.seed))
            .fact("version", env!("CARGO_PKG_VERSION"))
            .fact("seed of the axis", arguments.seed),
    );
    write_page(&arguments.out, &page)?;
    if let Some(path) = &arguments.rig_out {
        write_text(path, &procedure.rig.to_toml())?;
    }
    if let Some(folder) = &arguments.csv {
        fs::create_dir_all(folder)
            .map_err(|error| CommandError::BadInput(format!("{}: {error}", folder.display())))?;
        for figure in &figures {
            let name: String = figure
                .number
                .chars()
                .filter(|one| one.is_ascii_alphanumeric() || *one == ',')
                .collect();
            for (place, picture) in figure.pictures.iter().enumerate() {
                let file = format!("figure-{}-{}.csv", name.replace(',', "-"), place + 1);
                write_text(&folder.join(file), &csv(picture))?;
            }
        }
        for step in &procedure.steps {
            for (place, picture) in step.outcome.pictures.iter().enumerate() {
                let file = format!("{}-{}.csv", step.command, place + 1);
                write_text(&folder.join(file), &csv(picture))?;
            }
        }
    }
    summarise(&procedure, out)
}

fn summarise(procedure: &crate::paper::Procedure, out: &mut dyn Write) -> Result<(), CommandError> {
    let count: usize = procedure
        .steps
        .iter()
        .map(|step| step.outcome.numbers.len())
        .sum();
    writeln!(
        out,
        "{count} numbers from {} experiments on the axis of seed {}",
        procedure.steps.len(),
        procedure.seed
    )?;
    let after = procedure.left_out.first().map(|found| &found.responses);
    for (place, response) in procedure.responses.iter().enumerate() {
        let better = after
            .and_then(|after| after.get(place))
            .map(|one| format!(", {:.2} mm with what was left out", 1e3 * one.errors[0]));
        writeln!(
            out,
            "  step of {} V: position within {:.2} mm rms{}",
            response.opening_v,
            1e3 * response.errors[0],
            better.unwrap_or_default()
        )?;
    }
    for found in &procedure.left_out {
        writeln!(out, "{}: {}", found.title.to_lowercase(), found.sentence)?;
    }
    Ok(())
}

/// The points of a picture: curve, x, y.
fn csv(picture: &Picture) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let with_unit = |scale: &bench::Scale| match scale.unit.as_str() {
        "" => quoted(&scale.name),
        unit => quoted(&format!("{} [{unit}]", scale.name)),
    };
    let mut text = format!(
        "curve,{},{}\n",
        with_unit(&picture.x),
        with_unit(&picture.y)
    );
    for curve in &picture.curves {
        for (x, y) in &curve.points {
            text += &format!("{},{x},{y}\n", quoted(&curve.name));
        }
    }
    text
}
