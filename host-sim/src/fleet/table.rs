//! All estimates of a fleet as one Parquet table, a row a night and quantity: for DuckDB, pandas, polars.

use super::plan::Plan;
use super::store::{Outcome, Store};
use super::work::NightResult;
use data_files::{Cells, Column, Target, write};

/// The table's bytes. The error is one line.
pub fn table(plan: &Plan, store: &Store) -> Result<Vec<u8>, String> {
    let mut texts: [Vec<String>; 6] = Default::default();
    let mut numbers: [Vec<f64>; 3] = Default::default();
    for axis in &plan.axes {
        for night in &axis.nights {
            let Some(Outcome::Done(result)) = store.read::<NightResult>(&night.job) else {
                continue;
            };
            for estimate in result.estimates {
                let recording = night.recording.path.to_string_lossy().into_owned();
                let date = night.date.clone().unwrap_or_default();
                let row = [
                    axis.name.clone(),
                    axis.group.clone(),
                    date,
                    estimate.key,
                    recording,
                    night.job.clone(),
                ];
                texts
                    .iter_mut()
                    .zip(row)
                    .for_each(|(column, cell)| column.push(cell));
                let deviation = estimate.standard_deviation.unwrap_or(f64::NAN);
                let row = [night.day, estimate.value, deviation];
                numbers
                    .iter_mut()
                    .zip(row)
                    .for_each(|(column, cell)| column.push(cell));
            }
        }
    }
    let names = ["axis", "group", "date", "quantity", "recording", "job"];
    let texts = names
        .into_iter()
        .zip(texts)
        .map(|(name, cells)| Column::new(name, Cells::Texts(cells)));
    let names = ["day", "value", "standard_deviation"];
    let numbers = names
        .into_iter()
        .zip(numbers)
        .map(|(name, cells)| Column::new(name, Cells::Reals(cells)));
    let columns: Vec<Column> = texts.chain(numbers).collect();
    write(Target::Parquet, &columns, &[])
}
