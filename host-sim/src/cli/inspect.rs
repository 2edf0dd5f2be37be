//! `pneuma inspect`: what recordings are worth before anything is fitted.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::CommandError;
use super::inputs::{bad_input, provenance, read_recording, read_rig};
use super::outputs::{check_outputs, write_json, write_page};
use crate::recording::{ColumnLook, Recording, TableLook, tables};
use crate::text::{Columns, file_name, plain};
use diagnosis::inspect::{Inspection, inspect, lateness};

/// Check recordings: timing, noise, quantum, excitation and faults. Without a rig: which columns are there.
#[derive(Args, Clone, Debug)]
pub struct InspectArguments {
    /// The rig file that names the columns; without it the columns of each file are listed.
    #[arg(long)]
    pub rig: Option<PathBuf>,
    /// Also write the findings as JSON, a list with one entry per recording.
    #[arg(long, requires = "rig")]
    pub json: Option<PathBuf>,
    /// Write a page with plots.
    #[arg(long, requires = "rig")]
    pub report: Option<PathBuf>,
    /// The recordings.
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &InspectArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let Some(rig_path) = &arguments.rig else {
        return list_columns(&arguments.recordings, out);
    };
    let inputs: Vec<&PathBuf> = std::iter::once(rig_path)
        .chain(&arguments.recordings)
        .collect();
    let outputs: Vec<&PathBuf> = arguments.json.iter().chain(&arguments.report).collect();
    check_outputs(&inputs, &outputs)?;
    let rig = read_rig(rig_path)?;
    let mut inspections: Vec<Inspection> = Vec::new();
    // A page needs the samples; without one they are dropped file by file.
    let mut kept: Vec<Recording> = Vec::new();
    for path in &arguments.recordings {
        let recording = read_recording(path, &rig)?;
        let mut inspection = inspect(&rig, &recording);
        inspection.notes.extend(lateness::remarks(&rig, &recording));
        writeln!(out, "{inspection}")?;
        inspections.push(inspection);
        if arguments.report.is_some() {
            kept.push(recording);
        }
    }
    out.flush()?;
    if let Some(path) = &arguments.json {
        write_json(path, &inspections)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = crate::charts::inspection_page(&rig, &kept, &inspections);
        page.provenance(provenance(
            std::iter::once(rig_path).chain(&arguments.recordings),
        ));
        write_page(path, &page)?;
    }
    Ok(())
}

/// Lists the tables of files, their columns, units and values.
fn list_columns(paths: &[PathBuf], out: &mut dyn Write) -> Result<(), CommandError> {
    for path in paths {
        for table in tables(path).map_err(bad_input)? {
            write_table(path, &table, out)?;
        }
    }
    writeln!(
        out,
        "no rig file was given: `pneuma init` makes one of a data sheet and a recording, docs/rig.md describes it"
    )?;
    Ok(())
}

fn write_table(path: &Path, table: &TableLook, out: &mut dyn Write) -> std::io::Result<()> {
    let named = match table.name.as_str() {
        "" => String::new(),
        name => format!(", table \"{name}\""),
    };
    let rows = table.rows.map_or("many".into(), |rows| rows.to_string());
    let file = file_name(&path.display().to_string());
    writeln!(out, "{file}{}: {rows} rows", file_name(&named))?;
    let headings = ["column", "unit", "first", "least", "greatest", ""];
    let mut lines = Columns::new(2, &headings);
    for column in &table.columns {
        lines.row(column_line(column));
    }
    write!(out, "{lines}")?;
    if let Some(clock) = &table.clock {
        writeln!(out, "  time beside the columns: {}", file_name(clock))?;
    }
    Ok(())
}

/// Name, unit, first, least and greatest value, and what the file says of a column.
fn column_line(column: &ColumnLook) -> [String; 6] {
    let finite = || {
        column
            .values
            .iter()
            .copied()
            .filter(|value| value.is_finite())
    };
    let shown = |value: Option<f64>| value.map_or("-".into(), |value| plain(value, 6));
    [
        file_name(&column.name),
        column.unit.as_deref().map_or_else(|| "-".into(), file_name),
        shown(column.values.first().copied().filter(|one| one.is_finite())),
        shown(finite().reduce(f64::min)),
        shown(finite().reduce(f64::max)),
        column
            .description
            .as_deref()
            .map_or_else(String::new, file_name),
    ]
}
