//! The columns that the rig names while they grow, row by row.
//!
//! Rules: a row that lacks a value of one of them is left out and told; a row that repeats the
//! one before in all of them is left out and told; a column that has values in few rows only is
//! one of another rate and refused; everything else that is no number is an error.

use super::error::{TABLE, error};
use super::even::{self, Even};
use super::fields::Splitter;
use super::layout::{Layout, TextRow, bare};
use super::lines::{Line, text_of};
use super::number::{CellFault, Mark, Numbers, is_number};
use super::time::TimeColumn;
use super::{MAXIMUM_ROWS, Recording, RecordingError};
use crate::rig::{Column, Signal, Signals};
use crate::text::{did_you_mean, one_line, plain};
use crate::units::Written;

/// A column without a value in more than this share of the rows ...
const SPARSE_SHARE: f64 = 0.1;
/// ... whose values stand alone (this many in a row at most, on average) has another rate.
const LONELY_VALUES: f64 = 2.0;
/// More rows than this share that repeat the one before are no slip of the logger.
const DUPLICATE_SHARE: f64 = 0.01;

/// What an SI value may be: `(low, high, how a line says so)`.
type Plausible = (f64, f64, &'static str);

fn plausible(signal: &str) -> Option<Plausible> {
    match signal {
        "x" | "x_ref" => Some((-100.0, 100.0, "metres within 100 (is the unit right?)")),
        "v" => Some((-1000.0, 1000.0, "m/s within 1000 (is the unit right?)")),
        pressure if pressure.starts_with("p_") => Some((
            0.0,
            1e8,
            "Pa absolute from 0 to 1e8 (is the unit right, absolute or gauge?)",
        )),
        temperature if temperature.starts_with("temperature_") => {
            Some((0.0, 5000.0, "kelvin from 0 to 5000 (is the unit right?)"))
        }
        _ => None,
    }
}

/// One used column while it grows.
struct Channel<'s> {
    name: &'s str,
    signal: &'s Signal,
    column: usize,
    plausible: Option<Plausible>,
    values: Vec<f64>,
    blanks: Blanks,
}

/// Cells without a value.
#[derive(Clone, Copy, Debug, Default)]
struct Blanks {
    count: usize,
    first_line: u32,
    /// Runs of such cells from row to row.
    runs: usize,
    last_row: usize,
}

impl Blanks {
    fn note(&mut self, row: usize, line: u32) {
        if self.count == 0 {
            self.first_line = line;
        }
        if self.count == 0 || row > self.last_row + 1 {
            self.runs += 1;
        }
        self.count += 1;
        self.last_row = row;
    }

    /// True for a channel of another rate: values here and there, and nothing between.
    fn is_sparse(&self, rows: usize) -> bool {
        let values = (rows - self.count) as f64;
        let lonely = self.runs > 1 && values <= LONELY_VALUES * self.runs as f64;
        values == 0.0 || lonely && self.count as f64 > SPARSE_SHARE * rows as f64
    }
}

/// Rows that are not kept.
#[derive(Clone, Copy, Debug, Default)]
struct LeftOut {
    count: usize,
    first_line: u32,
}

impl LeftOut {
    fn note(&mut self, line: u32) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }
}

/// The table while it grows.
pub(super) struct Table<'s> {
    file: &'s str,
    layout: Layout,
    gauge_zero_pa: f64,
    numbers: Numbers,
    time: TimeColumn<'s>,
    /// The first stamp that runs backward by no more than a late one may.
    disorder: Option<RecordingError>,
    /// None where the rows are stated to be evenly apart.
    time_column: Option<usize>,
    /// Time from row to row in that case, s.
    row_s: f64,
    /// Signals that were not recorded, with their value.
    constants: Vec<(&'s str, f64)>,
    channels: Vec<Channel<'s>>,
    /// The values of the row at hand; kept once the row is complete.
    row: Vec<f64>,
    line: Vec<u32>,
    /// All rows, also those left out.
    rows: usize,
    incomplete: LeftOut,
    duplicates: LeftOut,
    /// The line at which the decimal mark was decided to be a comma.
    comma_line: Option<u32>,
    last_row_unterminated: bool,
}

impl<'s> Table<'s> {
    pub(super) fn new(
        file: &'s str,
        layout: Layout,
        signals: &'s Signals,
        rows: usize,
    ) -> Result<Self, RecordingError> {
        let mut time = None;
        let (mut channels, mut constants, mut row_s) = (Vec::new(), Vec::new(), 0.0);
        for (name, signal) in signals.iter() {
            let column = match &signal.column {
                Column::Constant(value) => {
                    constants.push((name, signal.to_si(*value, signals.gauge_zero_pa)));
                    continue;
                }
                Column::Every(distance) => {
                    row_s = signal.to_si(*distance, 0.0);
                    time = Some((TimeColumn::new(signal, rows), None));
                    continue;
                }
                Column::Number(number) => find_number(file, &layout, name, *number)?,
                Column::Name(header) => find_name(file, &layout, name, header)?,
            };
            check_units(file, &layout, column, signal)?;
            if name == "t" {
                time = Some((TimeColumn::new(signal, rows), Some(column)));
                continue;
            }
            channels.push(Channel {
                name,
                signal,
                column,
                plausible: plausible(name),
                values: Vec::with_capacity(rows),
                blanks: Blanks::default(),
            });
        }
        let Some((time, time_column)) = time else {
            let expected = "t = { column = ..., unit = \"s\" } in the rig's [signals]";
            return Err(error(file, None, "the rig names no time column", expected));
        };
        Ok(Self {
            file,
            gauge_zero_pa: signals.gauge_zero_pa,
            numbers: Numbers::default(),
            time,
            disorder: None,
            time_column,
            row_s,
            constants,
            row: vec![0.0; channels.len()],
            channels,
            line: Vec::with_capacity(rows),
            rows: 0,
            incomplete: LeftOut::default(),
            duplicates: LeftOut::default(),
            comma_line: None,
            last_row_unterminated: false,
            layout,
        })
    }

    /// Lets the head of the file decide the decimal mark.
    pub(super) fn observe(&mut self, head: &[Line], splitter: &mut Splitter) {
        let columns = self.channels.iter().map(|channel| channel.column);
        let columns: Vec<usize> = columns.chain(self.time_column).collect();
        for line in head {
            if self.numbers.mark().is_some() {
                break;
            }
            if !self.is_row(line) || !splitter.split(&line.bytes) {
                continue;
            }
            let present = columns.iter().filter(|column| **column < splitter.len());
            for column in present {
                self.numbers.observe(splitter.field(*column));
            }
        }
        if self.numbers.mark() == Some(Mark::Comma) {
            self.comma_line = Some(self.layout.first_row);
        }
    }

    fn is_row(&self, line: &Line) -> bool {
        line.number >= self.layout.first_row && line.has_content()
    }

    pub(super) fn add_line(
        &mut self,
        line: &Line,
        splitter: &mut Splitter,
    ) -> Result<(), RecordingError> {
        if !self.is_row(line) {
            return Ok(());
        }
        if self.rows == MAXIMUM_ROWS {
            let problem = format!("holds more than {MAXIMUM_ROWS} rows");
            return Err(error(self.file, Some(line.number), problem, row_limit()));
        }
        if !splitter.split(&line.bytes) {
            let problem = "a quote is opened and not closed";
            let expected = "both quotes of a field on one line";
            return Err(error(self.file, Some(line.number), problem, expected));
        }
        let row = Row {
            line,
            fields: splitter,
        };
        self.check_length(&row)?;
        self.add_row(&row)
    }

    fn add_row(&mut self, row: &Row) -> Result<(), RecordingError> {
        let number = row.line.number;
        self.rows += 1;
        let time_s = match self.time_column {
            Some(column) => self
                .time
                .read(row.cell(column), number, &mut self.numbers)
                .map_err(|fault| self.cell_error(row, column, fault))?,
            None => Some(self.row_s * (self.rows - 1) as f64),
        };
        let complete = self.read_values(row)?;
        self.last_row_unterminated = !row.line.terminated;
        self.note_comma(number);
        let Some(time_s) = time_s.filter(|_| complete) else {
            self.incomplete.note(number);
            return Ok(());
        };
        if self.is_kept(row, time_s)? {
            self.time.values.push(time_s);
            for (channel, value) in self.channels.iter_mut().zip(&self.row) {
                channel.values.push(*value);
            }
            self.line.push(number);
        }
        Ok(())
    }

    /// Reads the row's values; false where one is missing.
    fn read_values(&mut self, row: &Row) -> Result<bool, RecordingError> {
        let mut complete = true;
        for place in 0..self.channels.len() {
            let channel = &mut self.channels[place];
            let column = channel.column;
            let recorded = match self.numbers.read(row.cell(column)) {
                Ok(Some(recorded)) => recorded,
                Ok(None) => {
                    channel.blanks.note(self.rows, row.line.number);
                    complete = false;
                    continue;
                }
                Err(fault) => return Err(self.cell_error(row, column, fault)),
            };
            let value = channel.signal.to_si(recorded, self.gauge_zero_pa);
            if let Some((low, high, expected)) = channel.plausible
                && !(low..=high).contains(&value)
            {
                let fault = CellFault {
                    problem: format!("{recorded} {} cannot be", channel.signal.unit),
                    expected: expected.into(),
                };
                return Err(self.column_error(row.line.number, column, fault));
            }
            self.row[place] = value;
        }
        Ok(complete)
    }

    /// False for a row that repeats the one before.
    fn is_kept(&mut self, row: &Row, time_s: f64) -> Result<bool, RecordingError> {
        let number = row.line.number;
        let (Some(last_s), Some(last_line)) = (self.time.values.last(), self.line.last()) else {
            return Ok(true);
        };
        if time_s > *last_s {
            return Ok(true);
        }
        if let (Some(column), Some(fault)) =
            (self.time_column, self.time.backward(time_s, *last_line))
        {
            let fault = self.column_error(number, column, fault);
            if !self.time.may_be_late(time_s) {
                return Err(fault);
            }
            self.disorder.get_or_insert(fault);
            return Ok(true);
        }
        let mut values = self.channels.iter().zip(&self.row);
        if values.all(|(channel, value)| channel.values.last() == Some(value)) {
            self.duplicates.note(number);
            return Ok(false);
        }
        self.time.note_repeat(number, *last_line);
        Ok(true)
    }

    fn note_comma(&mut self, line: u32) {
        if self.comma_line.is_none() && self.numbers.mark() == Some(Mark::Comma) {
            self.comma_line = Some(line);
        }
    }

    fn check_length(&self, row: &Row) -> Result<(), RecordingError> {
        let (found, columns) = (row.fields.len(), self.layout.columns);
        if found == columns || found > columns && row.fields.len_without_padding() <= columns {
            return Ok(());
        }
        let number = Some(row.line.number);
        if row.line.bytes.contains(&0) {
            return Err(damaged(self.file, row.line.number));
        }
        if found < columns && !row.line.terminated {
            let problem = format!("truncated: the file ends inside this row, field {found}");
            let expected = format!("{columns} fields; delete the row or copy the file again");
            return Err(error(self.file, number, problem, expected));
        }
        let problem = format!("the row has {found} fields");
        let hint = if found == 2 * columns {
            " (decimal commas? export with semicolons or tabs between the columns)"
        } else if found == 1 && self.has_other_separator(row) {
            "; do the columns have another separator from here on?"
        } else if found == 1 || found < columns && !is_number(&text_of(row.cell(0))) {
            "; is it a message? delete the line or mark it as a comment (#)"
        } else {
            ""
        };
        let expected = format!("{columns} as in the {}{hint}", self.length_origin());
        Err(error(self.file, number, problem, expected))
    }

    /// Whether a row of one field would have all columns with another separator.
    fn has_other_separator(&self, row: &Row) -> bool {
        let text = text_of(row.cell(0));
        [',', ';', '\t', '|'].iter().any(|separator| {
            let parts = text.split(*separator);
            parts.clone().count() == self.layout.columns && parts.clone().all(is_number)
        })
    }

    fn length_origin(&self) -> &'static str {
        if self.layout.header_line.is_some() {
            "header"
        } else {
            "first rows"
        }
    }

    /// The error for a cell that is no number: the row may be damaged, or begin another run.
    fn cell_error(&self, row: &Row, column: usize, fault: CellFault) -> RecordingError {
        let number = row.line.number;
        if row.cell(column).contains(&0) {
            return damaged(self.file, number);
        }
        if self.is_header(row) {
            let problem = "the header stands here again: another run begins";
            let expected = "one run in a file; cut it before this line";
            return error(self.file, Some(number), problem, expected);
        }
        let last = column + 1 == row.fields.len();
        if last && !row.line.terminated {
            let text = String::from_utf8_lossy(row.cell(column));
            let problem = format!("truncated: the file ends inside \"{}\"", one_line(&text));
            let fault = CellFault {
                problem,
                expected: "a complete row; delete it or copy the file again".into(),
            };
            return self.column_error(number, column, fault);
        }
        self.column_error(number, column, fault)
    }

    fn is_header(&self, row: &Row) -> bool {
        let Some(names) = &self.layout.names else {
            return false;
        };
        let mut cells = row.fields.fields().zip(names);
        cells.all(|(cell, name)| bare(&text_of(cell)) == name)
    }

    fn column_error(&self, line: u32, column: usize, fault: CellFault) -> RecordingError {
        RecordingError {
            column: Some(self.layout.label(column)),
            ..error(self.file, Some(line), fault.problem, fault.expected)
        }
    }

    pub(super) fn finish(self) -> Result<Recording, RecordingError> {
        if self.rows == 0 {
            let line = self.layout.header_line;
            return Err(error(self.file, line, "holds a header but no rows", TABLE));
        }
        self.check_blanks()?;
        let even = self.even();
        if even.is_none() {
            self.check_stamps()?;
        }
        let mut remarks = self.remarks();
        let unused_columns = self.unused_columns();
        let rows = self.line.len();
        let constants = self.constants.into_iter();
        let constants = constants.map(|(name, value)| (name.to_owned(), vec![value; rows]));
        let signals = self.channels.into_iter();
        let time_s = match even {
            Some(even) => {
                remarks.push(even.remark);
                even.time_s
            }
            None => self.time.values,
        };
        Ok(Recording {
            name: self.file.into(),
            time_s,
            signals: signals
                .map(|channel| (channel.name.to_owned(), channel.values))
                .chain(constants)
                .collect(),
            line: self.line,
            unused_columns,
            remarks,
            last_row_unterminated: self.last_row_unterminated,
        })
    }

    /// Refuses columns of another rate, and a table of which nothing is left.
    fn check_blanks(&self) -> Result<(), RecordingError> {
        let sparse = |channel: &&Channel| channel.blanks.is_sparse(self.rows);
        let columns: Vec<String> = self
            .channels
            .iter()
            .filter(sparse)
            .map(|channel| self.layout.label(channel.column))
            .collect();
        let Some(channel) = self.channels.iter().find(sparse) else {
            if self.line.is_empty() {
                let problem = "no row has a value for every signal of the rig";
                let line = Some(self.incomplete.first_line);
                return Err(error(self.file, line, problem, RESAMPLED));
            }
            return Ok(());
        };
        let values = self.rows - channel.blanks.count;
        let problem = match values {
            0 => "no value in any row".into(),
            _ => format!(
                "values in {values} of {} rows{}",
                self.rows,
                self.rates(values)
            ),
        };
        Err(RecordingError {
            column: Some(columns.join(", ")),
            ..error(
                self.file,
                Some(channel.blanks.first_line),
                problem,
                RESAMPLED,
            )
        })
    }

    /// The rates of the rows and of a column that has so many values.
    fn rates(&self, values: usize) -> String {
        let times = &self.time.values;
        match (times.first(), times.last()) {
            (Some(first), Some(last)) if last > first => {
                let complete_hz = (times.len() - 1) as f64 / (last - first);
                let per_complete = 1.0 / times.len() as f64;
                let rate = |count: usize| plain(complete_hz * count as f64 * per_complete, 3);
                format!(
                    " ({} Hz in a table of {} Hz)",
                    rate(values),
                    rate(self.rows)
                )
            }
            _ => String::new(),
        }
    }

    /// The grid that the rows were sampled on, where their stamps are late by chance.
    fn even(&self) -> Option<Even> {
        // A command holds and leaps: it says nothing of instants.
        let measured = self
            .channels
            .iter()
            .filter(|channel| !matches!(channel.name, "u" | "x_ref"));
        let columns: Vec<&[f64]> = measured.map(|channel| &channel.values[..]).collect();
        let backward = self.disorder.as_ref().and_then(|fault| fault.line);
        let repeated = self.time.few_repeats();
        even::grid(&self.time.values, &columns, backward.or(repeated))
    }

    fn check_stamps(&self) -> Result<(), RecordingError> {
        let Some(time_column) = self.time_column else {
            return Ok(());
        };
        if let Some(fault) = &self.disorder {
            return Err(fault.clone());
        }
        if let Some((line, fault)) = self.time.repeats() {
            return Err(self.column_error(line, time_column, fault));
        }
        let duplicates = self.duplicates.count;
        if duplicates > 1 && duplicates as f64 > DUPLICATE_SHARE * self.rows as f64 {
            let fault = CellFault {
                problem: format!(
                    "the row repeats the one before with its time, as do {duplicates} of {} rows",
                    self.rows
                ),
                expected: "each row once, with a time of its own".into(),
            };
            let line = self.duplicates.first_line;
            return Err(self.column_error(line, time_column, fault));
        }
        Ok(())
    }

    /// What was decided or left out on reading.
    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Some((first, last)) = self.layout.preamble {
            let begin = self.layout.header_line.unwrap_or(self.layout.first_row);
            remarks.push(format!(
                "the table begins at line {begin}; not read: {} above it",
                lines(first, last)
            ));
        }
        remarks.extend(self.layout.text_rows.iter().map(|row| {
            let kind = if self.holds_units(row) {
                "units, which agree with the rig"
            } else {
                "text under the header, not read"
            };
            format!("line {}: {kind}", row.line)
        }));
        remarks.extend(self.unit_remarks());
        if let Some(line) = self.comma_line {
            remarks.push(format!("the decimal mark is a comma (from line {line})"));
        }
        remarks.extend(self.time.remarks());
        remarks.extend(self.incomplete_remark());
        if self.duplicates.count > 0 {
            remarks.push(format!(
                "{} that repeats the row before is left out, first at line {}",
                rows(self.duplicates.count),
                self.duplicates.first_line
            ));
        }
        remarks
    }

    /// Units in the names of columns that are not those of the rig. A name may lie, so this
    /// forbids nothing.
    fn unit_remarks(&self) -> impl Iterator<Item = String> {
        let columns = self
            .channels
            .iter()
            .map(|channel| (channel.column, channel.signal));
        columns
            .chain(self.time_column.map(|column| (column, self.time.signal)))
            .filter_map(|(column, signal)| {
                let name = self.layout.names.as_ref()?.get(column)?;
                let (_, unit) = name.rsplit_once(['[', '('])?;
                let written = Written::read(unit)?;
                let unit = unit.trim_end_matches([']', ')']);
                (written.measures_as(&signal.unit)
                    && written.contradicts(&signal.unit, signal.scale))
                .then(|| {
                    let label = self.layout.label(column);
                    let rig = &signal.unit;
                    format!("column {label}: its name says {unit}, the rig {rig}")
                })
            })
    }

    fn incomplete_remark(&self) -> Option<String> {
        let LeftOut { count, first_line } = self.incomplete;
        let lacking = self
            .channels
            .iter()
            .filter(|channel| channel.blanks.count > 0);
        let columns: Vec<String> = lacking
            .map(|channel| {
                let Blanks {
                    count, first_line, ..
                } = channel.blanks;
                let label = self.layout.label(channel.column);
                format!("column {label} in {count}, first at line {first_line}")
            })
            .collect();
        let columns = if columns.is_empty() {
            let time = self.time_column.map(|column| self.layout.label(column));
            format!("column {}", time.unwrap_or_default())
        } else {
            columns.join("; ")
        };
        (count > 0).then(|| {
            format!(
                "{} without a value (blank or NaN) left out, first at line {first_line}: {columns}",
                rows(count)
            )
        })
    }

    /// Whether a line of text holds units of the columns that are read.
    fn holds_units(&self, row: &TextRow) -> bool {
        let columns = self.channels.iter().map(|channel| channel.column);
        let mut cells = columns
            .chain(self.time_column)
            .filter_map(|column| row.cells.get(column));
        cells.any(|cell| Written::read(cell).is_some())
    }

    fn unused_columns(&self) -> Vec<String> {
        let used = |column: usize| {
            let mut channels = self.channels.iter().map(|channel| channel.column);
            self.time_column == Some(column) || channels.any(|used| used == column)
        };
        (0..self.layout.columns)
            .filter(|column| !used(*column))
            .map(|column| match &self.layout.names {
                Some(names) => names[column].clone(),
                None => format!("column {column}"),
            })
            .collect()
    }
}

/// What a table of several rates has to become.
const RESAMPLED: &str = "a value in each row: export the channels resampled to one rate, or keep only the rows that have all of them";

/// A row on its way into the table.
struct Row<'r> {
    line: &'r Line,
    fields: &'r Splitter,
}

impl Row<'_> {
    fn cell(&self, column: usize) -> &[u8] {
        self.fields.field(column)
    }
}

pub(super) fn row_limit() -> String {
    format!("at most {MAXIMUM_ROWS} rows; cut the recording into parts")
}

fn rows(count: usize) -> String {
    match count {
        1 => "1 row".into(),
        _ => format!("{count} rows"),
    }
}

fn lines(first: u32, last: u32) -> String {
    if first == last {
        format!("line {first}")
    } else {
        format!("lines {first} to {last}")
    }
}

fn damaged(file: &str, line: u32) -> RecordingError {
    let problem = "NUL bytes: the file is damaged here";
    error(file, Some(line), problem, TABLE)
}

/// Refuses a unit under the header that contradicts the rig.
fn check_units(
    file: &str,
    layout: &Layout,
    column: usize,
    signal: &Signal,
) -> Result<(), RecordingError> {
    for row in &layout.text_rows {
        let Some(cell) = row.cells.get(column) else {
            continue;
        };
        let Some(written) = Written::read(cell) else {
            continue;
        };
        if written.contradicts(&signal.unit, signal.scale) {
            let problem = format!(
                "the file says \"{}\", the rig \"{}\"",
                one_line(cell),
                signal.unit
            );
            return Err(RecordingError {
                column: Some(layout.label(column)),
                ..error(file, Some(row.line), problem, "the same unit in both")
            });
        }
    }
    Ok(())
}

fn find_number(
    file: &str,
    layout: &Layout,
    signal: &str,
    number: usize,
) -> Result<usize, RecordingError> {
    if number < layout.columns {
        return Ok(number);
    }
    let problem = format!("no column {number} for the signal {signal}");
    let expected = format!("a number from 0 to {}", layout.columns.saturating_sub(1));
    Err(error(file, layout.header_line, problem, expected))
}

fn find_name(
    file: &str,
    layout: &Layout,
    signal: &str,
    name: &str,
) -> Result<usize, RecordingError> {
    let line = layout.header_line;
    let shown = one_line(name);
    let Some(names) = &layout.names else {
        let problem = format!("no header line to find \"{shown}\" for the signal {signal} in");
        let last = layout.columns.saturating_sub(1);
        let expected = format!("a column number from 0 to {last} in the rig");
        return Err(error(file, line, problem, expected));
    };
    let wanted = bare(name);
    let mut places = (0..names.len()).filter(|place| names[*place] == wanted);
    match (places.next(), places.next()) {
        (Some(place), None) => Ok(place),
        (Some(_), Some(_)) => {
            let problem = format!("two columns are named \"{shown}\"");
            let expected = "one; give the column by its number in the rig";
            Err(error(file, line, problem, expected))
        }
        (None, _) => {
            let problem = format!("no column \"{shown}\" for the signal {signal}");
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            let hint = did_you_mean(name, &known);
            let expected = format!("one of the file's columns: {}{hint}", listed(names));
            Err(error(file, line, problem, expected))
        }
    }
}

/// At most this many of a file's columns are listed in an error line.
const LISTED_COLUMNS: usize = 40;

fn listed(names: &[String]) -> String {
    let shown: Vec<String> = names
        .iter()
        .take(LISTED_COLUMNS)
        .map(|name| one_line(name))
        .collect();
    let more = if names.len() > LISTED_COLUMNS {
        ", …"
    } else {
        ""
    };
    format!("{}{more}", shown.join(", "))
}
