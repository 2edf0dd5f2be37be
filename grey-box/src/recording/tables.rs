//! What a file holds, looked at without a rig: its tables, their columns, units and first values.

use std::path::Path;

use super::RecordingError;
use super::error::{TABLE, error};
use super::fields::Splitter;
use super::layout::Layout;
use super::lines::Lines;
use super::number::Numbers;
use super::read::check_text;
use super::source::{Opened, Source, Text};
use crate::rig::Signals;
use crate::units::Written;
use data_files::{Contents, Group, Sheet};

/// So many rows are looked at.
const ROWS: usize = 100_000;

/// A table of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct TableLook {
    /// Its name; empty where the file has one table.
    pub name: String,
    /// Number of rows; `None` where there are more than were looked at.
    pub rows: Option<usize>,
    /// Instants of the rows beside the columns, in words.
    pub clock: Option<String>,
    /// Its columns.
    pub columns: Vec<ColumnLook>,
}

/// A column of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnLook {
    /// Its name.
    pub name: String,
    /// Its unit, where the file states it beside the name.
    pub unit: Option<String>,
    /// What the file says of it.
    pub description: Option<String>,
    /// Its first values, as recorded; NaN for what is no number.
    pub values: Vec<f64>,
}

/// The tables of a file; `-` is standard input.
///
/// # Errors
/// One line where the file cannot be read, or holds no table with names.
pub fn tables(path: impl AsRef<Path>) -> Result<Vec<TableLook>, RecordingError> {
    let source = Source::open(path.as_ref())?;
    let name = &source.name;
    match Opened::of(source.reader, name)? {
        Opened::Text(text) => Ok(vec![of_text(text, name)?]),
        Opened::DataFile(Contents::Groups(groups)) => {
            let tables: Vec<TableLook> = groups.into_iter().map(of_group).collect();
            if tables.iter().all(|table| table.rows == Some(0)) {
                return Err(error(name, None, "holds no column of numbers", TABLE));
            }
            Ok(tables)
        }
        Opened::DataFile(Contents::Sheets(sheets)) => {
            let tables = sheets.into_iter().map(|sheet| of_sheet(sheet, name));
            let (tables, faults): (Vec<_>, Vec<_>) = tables.partition(Result::is_ok);
            // Sheets of text are no tables; a workbook without any table is none.
            match (tables.is_empty(), faults.into_iter().next()) {
                (true, Some(Err(fault))) => Err(fault),
                _ => Ok(tables.into_iter().flatten().collect()),
            }
        }
    }
}

fn of_group(group: Group) -> TableLook {
    let rows = group.rows();
    let columns = group.columns.into_iter().map(|column| {
        let mut values = column.cells.reals();
        values.truncate(ROWS);
        ColumnLook {
            name: column.name,
            unit: column.unit,
            description: column.description,
            values,
        }
    });
    TableLook {
        name: group.name,
        rows: Some(rows),
        clock: group.clock.map(|clock| clock.says),
        columns: columns.collect(),
    }
}

fn of_sheet(sheet: Sheet, file: &str) -> Result<TableLook, RecordingError> {
    let name = sheet.name.clone();
    let text = data_files::Text::from(sheet);
    Ok(TableLook {
        name,
        ..of_text(text.into(), file)?
    })
}

fn of_text(text: Text<'_>, file: &str) -> Result<TableLook, RecordingError> {
    let mut lines = Lines::new(text.reader, file);
    let head = lines.head()?;
    check_text(file, &head)?;
    let layout = Layout::detect(&head, &Signals::default());
    let named = layout.and_then(|layout| Some((layout.names.clone()?, layout)));
    let Some((names, layout)) = named else {
        let problem = "no header line with rows of numbers under it was found";
        return Err(error(file, None, problem, TABLE));
    };
    let unit = |place: usize| {
        let mut cells = layout
            .text_rows
            .iter()
            .filter_map(|row| row.cells.get(place));
        cells.find(|cell| Written::read(cell).is_some()).cloned()
    };
    let column = |(place, name): (usize, String)| ColumnLook {
        name,
        unit: unit(place),
        description: None,
        values: Vec::new(),
    };
    let mut columns: Vec<ColumnLook> = names.into_iter().enumerate().map(column).collect();
    let mut splitter = Splitter::new(layout.separator);
    let mut numbers = Numbers::default();
    let mut rows = 0;
    let mut head = head.into_iter();
    while rows < ROWS {
        let line = match head.next() {
            Some(line) => line,
            None => match lines.next()? {
                Some(line) => line.clone(),
                None => break,
            },
        };
        if line.number < layout.first_row || !line.has_content() || !splitter.split(&line.bytes) {
            continue;
        }
        rows += 1;
        for (column, cell) in columns.iter_mut().zip(splitter.fields()) {
            let value = numbers.read(cell).ok().flatten();
            column.values.push(value.unwrap_or(f64::NAN));
        }
    }
    Ok(TableLook {
        name: String::new(),
        rows: (rows < ROWS).then_some(rows),
        clock: None,
        columns,
    })
}
