//! Workbooks (xlsx, xls, ods): sheets of cells, as `calamine` reads them.
//!
//! A sheet is what its export as CSV would be: its cells as text, with preamble, units and all.

use std::io::Cursor;

use calamine::{Data, Range, Reader, SheetVisible, open_workbook_auto_from_rs};
use serde::{Deserialize, Serialize};

use crate::asked::Wanted;
use crate::text::{Text, clock_text};
use crate::{Problem, said};

/// A sheet, cells as text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sheet {
    /// Its name.
    pub name: String,
    /// Its rows from the first that holds something.
    pub rows: Vec<Vec<String>>,
}

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    let mut book = open_workbook_auto_from_rs(Cursor::new(bytes)).map_err(said)?;
    let sheets = book.sheets_metadata().iter();
    let visible = sheets.filter(|sheet| sheet.visible == SheetVisible::Visible);
    let names: Vec<String> = visible.map(|sheet| sheet.name.clone()).collect();
    let sheet = |name: String| {
        let range = book.worksheet_range(&name).map_err(said)?;
        let rows = rows(&range);
        Ok(Sheet { name, rows })
    };
    names.into_iter().map(sheet).collect()
}

/// The rows of a sheet from its first line on, so that lines are those of the sheet.
fn rows(range: &Range<Data>) -> Vec<Vec<String>> {
    let above = range.start().map_or(0, |(row, _)| row as usize);
    let own = range.rows().map(|row| row.iter().map(text_of).collect());
    std::iter::repeat_n(Vec::new(), above).chain(own).collect()
}

/// A cell as text that reads as the same value.
fn text_of(cell: &Data) -> String {
    match cell {
        Data::Float(value) => format!("{value:?}"),
        Data::DateTime(stamp) if stamp.is_datetime() => date(stamp),
        Data::DateTime(duration) => clock(duration.as_f64()),
        Data::Error(error) => format!("{error}"),
        other => other.to_string(),
    }
}

/// A duration in days as a clock text, to a microsecond.
fn clock(days: f64) -> String {
    const US_PER_S: u64 = 1_000_000;
    clock_text((days * 86_400.0 * US_PER_S as f64).round() as i64, US_PER_S)
}

/// A date and time with milliseconds, which is as fine as a workbook's day fractions are.
fn date(stamp: &calamine::ExcelDateTime) -> String {
    let (year, month, day, hour, minute, second, millisecond) = stamp.to_ymd_hms_milli();
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{millisecond:03}")
}

impl From<Sheet> for Text {
    fn from(sheet: Sheet) -> Self {
        Self::of_rows(sheet.rows.into_iter(), Vec::new())
    }
}

/// The sheet that holds the names that are asked for; without names, the first with rows.
pub(crate) fn text(
    sheets: Vec<Sheet>,
    time: Option<&str>,
    wanted: &[Wanted<'_>],
) -> Result<Text, Problem> {
    let names: Vec<&str> = time
        .into_iter()
        .chain(wanted.iter().map(|one| one.name))
        .collect();
    let has_names = |sheet: &Sheet| {
        let has = |row: &Vec<String>| {
            names
                .iter()
                .all(|name| row.iter().any(|cell| cell.trim() == *name))
        };
        !names.is_empty() && sheet.rows.iter().any(has)
    };
    let named: Vec<usize> = (0..sheets.len())
        .filter(|at| has_names(&sheets[*at]))
        .collect();
    if named.len() > 1 {
        let shown: Vec<String> = named
            .iter()
            .map(|at| format!("\"{}\"", sheets[*at].name))
            .collect();
        return Err(Problem::new(
            format!(
                "several sheets hold every column of the rig: {}",
                shown.join(", ")
            ),
            "one run in a workbook; save the sheet as a workbook or CSV file of its own",
        ));
    }
    let longest = (0..sheets.len())
        .rev()
        .max_by_key(|at| sheets[*at].rows.len());
    let Some(place) = named.first().copied().or(longest) else {
        return Err(Problem::new("holds no sheet", "a recording"));
    };
    let mut remarks = Vec::new();
    if sheets.len() > 1 {
        let (name, others) = (&sheets[place].name, sheets.len() - 1);
        remarks.push(format!("sheet \"{name}\" is read, {others} others are not"));
    }
    let sheet = sheets.into_iter().nth(place);
    let rows = sheet.map_or(Vec::new(), |sheet| sheet.rows);
    Ok(Text::of_rows(rows.into_iter(), remarks))
}
