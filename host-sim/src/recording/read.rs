//! Streams a file row by row into the columns that the rig names.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;

use super::layout::{Layout, Line, is_blank, is_comment, is_decimal_comma, split_into, unquoted};
use super::{MAXIMUM_ROWS, Recording, RecordingError};
use crate::rig::{Column, Signal, Signals};
use crate::text::{did_you_mean, one_line};

/// A longer line is no table: a binary file, or one without line ends.
const LONGEST_LINE_BYTES: usize = 1 << 20;
/// Lines looked at to decide the layout: past any preamble of comments.
const HEAD_LINES: usize = 200;
/// Read-ahead; larger blocks no longer help.
const BUFFER_BYTES: usize = 1 << 18;
/// A file must exceed the limit by this much, judged by its first lines,
/// before it is refused unread.
const ROW_ESTIMATE_MARGIN: u64 = 2;

impl Recording {
    /// Reads the columns that `signals` names.
    pub fn read(path: impl AsRef<Path>, signals: &Signals) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let cannot =
            |cause: std::io::Error| error(&name, None, format!("cannot be read: {cause}"), TABLE);
        let metadata = fs::metadata(path).map_err(cannot)?;
        if metadata.is_dir() {
            return Err(error(&name, None, "is a directory", TABLE));
        }
        let size = metadata.is_file().then_some(metadata.len());
        let file = File::open(path).map_err(cannot)?;
        let reader = BufReader::with_capacity(BUFFER_BYTES, file);
        Self::read_from(reader, &name, size, signals)
    }

    /// Reads from any source; `size` in bytes, where it is known, lets a file
    /// that is too large be refused at once.
    pub fn read_from(
        source: impl BufRead,
        name: &str,
        size: Option<u64>,
        signals: &Signals,
    ) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(source, name);
        let head = lines.head()?;
        check_text(name, &head)?;
        let Some(layout) = Layout::detect(&head) else {
            let problem = if head.is_empty() {
                "is empty"
            } else {
                "holds no rows"
            };
            return Err(error(name, None, problem, TABLE));
        };
        let rows = expected_rows(name, size, &head)?;
        let mut table = Table::new(name, layout, signals, rows)?;
        for line in &head {
            table.add_line(&line.bytes, line.number, line.terminated)?;
        }
        drop(head);
        while lines.advance()? {
            table.add_line(&lines.bytes, lines.number, lines.terminated)?;
        }
        table.finish()
    }
}

const TABLE: &str = "a text table: rows of numbers";

fn error(
    file: &str,
    line: Option<u32>,
    problem: impl Into<String>,
    expected: impl Into<String>,
) -> RecordingError {
    RecordingError {
        file: file.into(),
        line,
        column: None,
        problem: problem.into(),
        expected: expected.into(),
    }
}

/// The lines of a source, one at a time, without their line ends.
struct Lines<'n, R> {
    source: R,
    name: &'n str,
    bytes: Vec<u8>,
    number: u32,
    terminated: bool,
}

impl<'n, R: BufRead> Lines<'n, R> {
    fn new(source: R, name: &'n str) -> Self {
        Self {
            source,
            name,
            bytes: Vec::new(),
            number: 0,
            terminated: true,
        }
    }

    /// Moves on to the next line; false at the end.
    fn advance(&mut self) -> Result<bool, RecordingError> {
        self.bytes.clear();
        let limit = u64::try_from(LONGEST_LINE_BYTES).unwrap_or(u64::MAX);
        let read = self
            .source
            .by_ref()
            .take(limit)
            .read_until(b'\n', &mut self.bytes)
            .map_err(|cause| {
                let problem = format!("cannot be read: {cause}");
                error(self.name, Some(self.number), problem, TABLE)
            })?;
        if read == 0 {
            return Ok(false);
        }
        self.number = self.number.saturating_add(1);
        self.terminated = self.bytes.last() == Some(&b'\n');
        if read == LONGEST_LINE_BYTES && !self.terminated {
            let problem = "the line is longer than 1 MiB";
            return Err(error(self.name, Some(self.number), problem, TABLE));
        }
        while matches!(self.bytes.last(), Some(b'\n' | b'\r')) {
            self.bytes.pop();
        }
        if self.number == 1 && self.bytes.starts_with(b"\xef\xbb\xbf") {
            self.bytes.drain(..3);
        }
        Ok(true)
    }

    fn head(&mut self) -> Result<Vec<Line>, RecordingError> {
        let mut head = Vec::new();
        let mut bytes = 0;
        while head.len() < HEAD_LINES && bytes < LONGEST_LINE_BYTES && self.advance()? {
            bytes += self.bytes.len();
            head.push(Line {
                bytes: self.bytes.clone(),
                number: self.number,
                terminated: self.terminated,
            });
        }
        Ok(head)
    }
}

fn check_text(name: &str, head: &[Line]) -> Result<(), RecordingError> {
    let Some(first) = head.first() else {
        return Ok(());
    };
    if first.bytes.starts_with(b"\xff\xfe") || first.bytes.starts_with(b"\xfe\xff") {
        let expected = "UTF-8 text; save the file as UTF-8";
        return Err(error(name, Some(1), "is UTF-16 text", expected));
    }
    for line in head {
        if line.bytes.iter().any(|byte| is_binary(*byte)) {
            return Err(error(name, Some(line.number), "is a binary file", TABLE));
        }
        if line.bytes.contains(&b'\r') {
            let problem = "a carriage return inside the line";
            let expected = "lines that end with LF or CRLF";
            return Err(error(name, Some(line.number), problem, expected));
        }
    }
    Ok(())
}

/// Control characters that no table holds.
fn is_binary(byte: u8) -> bool {
    byte < 0x20 && !matches!(byte, b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | 0x1a)
}

/// The number of rows to reserve memory for; refuses what is far too large.
fn expected_rows(name: &str, size: Option<u64>, head: &[Line]) -> Result<usize, RecordingError> {
    let Some(size) = size else {
        return Ok(0);
    };
    let table = || {
        let lines = head.iter().map(|line| &line.bytes);
        lines.filter(|bytes| !is_blank(bytes) && !is_comment(bytes))
    };
    let bytes: usize = table().map(|bytes| bytes.len() + 1).sum();
    let lines = u64::try_from(table().count()).unwrap_or(1);
    let bytes = u64::try_from(bytes).unwrap_or(1).max(1);
    let rows = (u128::from(size) * u128::from(lines) / u128::from(bytes)) as u64;
    let limit = u64::try_from(MAXIMUM_ROWS).unwrap_or(u64::MAX);
    if rows > ROW_ESTIMATE_MARGIN * limit {
        let problem = format!("holds about {rows} rows");
        return Err(error(name, None, problem, row_limit()));
    }
    Ok(usize::try_from(rows.min(limit)).unwrap_or(0))
}

fn row_limit() -> String {
    format!("at most {MAXIMUM_ROWS} rows; cut the recording into parts")
}

/// What an SI value may be: `(low, high, how a line says so)`.
fn plausible(signal: &str) -> Option<(f64, f64, &'static str)> {
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
    plausible: Option<(f64, f64, &'static str)>,
    values: Vec<f64>,
}

/// The table while it grows.
struct Table<'s> {
    file: &'s str,
    layout: Layout,
    gauge_zero_pa: f64,
    time: Channel<'s>,
    channels: Vec<Channel<'s>>,
    line: Vec<u32>,
    fields: Vec<Range<usize>>,
    last_row_unterminated: bool,
}

impl<'s> Table<'s> {
    fn new(
        file: &'s str,
        layout: Layout,
        signals: &'s Signals,
        rows: usize,
    ) -> Result<Self, RecordingError> {
        let mut channels = Vec::new();
        for (name, signal) in signals.iter() {
            let column = find_column(file, &layout, name, &signal.column)?;
            channels.push(Channel {
                name,
                signal,
                column,
                plausible: plausible(name),
                values: Vec::with_capacity(rows),
            });
        }
        let time = channels.iter().position(|channel| channel.name == "t");
        let Some(time) = time else {
            let expected = "t = { column = ..., unit = \"s\" } in the rig's [signals]";
            return Err(error(file, None, "the rig names no time column", expected));
        };
        Ok(Self {
            file,
            layout,
            gauge_zero_pa: signals.gauge_zero_pa,
            time: channels.remove(time),
            channels,
            line: Vec::with_capacity(rows),
            fields: Vec::new(),
            last_row_unterminated: false,
        })
    }

    fn add_line(
        &mut self,
        bytes: &[u8],
        number: u32,
        terminated: bool,
    ) -> Result<(), RecordingError> {
        if is_blank(bytes) || is_comment(bytes) || self.layout.header_line == Some(number) {
            return Ok(());
        }
        if self.line.len() == MAXIMUM_ROWS {
            let problem = format!("holds more than {MAXIMUM_ROWS} rows");
            return Err(error(self.file, Some(number), problem, row_limit()));
        }
        let mut fields = std::mem::take(&mut self.fields);
        split_into(bytes, self.layout.separator, &mut fields);
        let row = Row {
            bytes,
            number,
            terminated,
            fields: &fields,
        };
        let added = self.add_row(&row);
        self.fields = fields;
        added
    }

    fn add_row(&mut self, row: &Row) -> Result<(), RecordingError> {
        self.check_length(row)?;
        self.add_time(row)?;
        for channel in &mut self.channels {
            let recorded = cell(self.file, &self.layout, row, channel.column)?;
            let value = channel.signal.to_si(recorded, self.gauge_zero_pa);
            if let Some((low, high, expected)) = channel.plausible
                && !(low..=high).contains(&value)
            {
                let problem = format!("{recorded} {} cannot be", channel.signal.unit);
                let mut error = error(self.file, Some(row.number), problem, expected);
                error.column = Some(self.layout.label(channel.column));
                return Err(error);
            }
            channel.values.push(value);
        }
        self.line.push(row.number);
        self.last_row_unterminated = !row.terminated;
        Ok(())
    }

    fn check_length(&self, row: &Row) -> Result<(), RecordingError> {
        if self.layout.admits(row.bytes, row.fields) {
            return Ok(());
        }
        let (found, columns) = (row.fields.len(), self.layout.columns);
        let number = Some(row.number);
        if row.bytes.contains(&0) {
            return Err(damaged(self.file, row.number));
        }
        if found < columns && !row.terminated {
            let problem = format!("truncated: the file ends inside this row, field {found}");
            let expected = format!("{columns} fields; delete the row or copy the file again");
            return Err(error(self.file, number, problem, expected));
        }
        let problem = format!("the row has {found} fields");
        let commas = if found == 2 * columns {
            " (decimal commas?)"
        } else {
            ""
        };
        let expected = format!("{columns} as in the {}{commas}", self.length_origin());
        Err(error(self.file, number, problem, expected))
    }

    fn length_origin(&self) -> &'static str {
        if self.layout.header_line.is_some() {
            "header"
        } else {
            "first rows"
        }
    }

    fn add_time(&mut self, row: &Row) -> Result<(), RecordingError> {
        let recorded = cell(self.file, &self.layout, row, self.time.column)?;
        let time_s = self.time.signal.to_si(recorded, self.gauge_zero_pa);
        if let (Some(previous_s), Some(line)) = (self.time.values.last(), self.line.last())
            && time_s <= *previous_s
        {
            let label = Some(self.layout.label(self.time.column));
            let how = if time_s < *previous_s {
                "runs backward from"
            } else {
                "repeats that of"
            };
            let problem = format!("time {time_s} s {how} line {line} ({previous_s} s)");
            let expected = "strictly increasing time";
            let mut error = error(self.file, Some(row.number), problem, expected);
            error.column = label;
            return Err(error);
        }
        self.time.values.push(time_s);
        Ok(())
    }

    fn finish(self) -> Result<Recording, RecordingError> {
        if self.line.is_empty() {
            let line = self.layout.header_line;
            return Err(error(self.file, line, "holds a header but no rows", TABLE));
        }
        let unused_columns = self.unused_columns();
        let signals = self.channels.into_iter();
        Ok(Recording {
            name: self.file.into(),
            time_s: self.time.values,
            signals: signals
                .map(|channel| (channel.name.to_owned(), channel.values))
                .collect(),
            line: self.line,
            unused_columns,
            last_row_unterminated: self.last_row_unterminated,
        })
    }

    fn unused_columns(&self) -> Vec<String> {
        let used = |column: usize| {
            let mut channels = self.channels.iter().chain([&self.time]);
            channels.any(|channel| channel.column == column)
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

/// A row on its way into the table.
struct Row<'r> {
    bytes: &'r [u8],
    number: u32,
    terminated: bool,
    fields: &'r [Range<usize>],
}

fn cell(file: &str, layout: &Layout, row: &Row, column: usize) -> Result<f64, RecordingError> {
    let field = unquoted(&row.bytes[row.fields[column].clone()]);
    let text = std::str::from_utf8(field).unwrap_or("");
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(bad_cell(file, layout, row, column, field)),
    }
}

fn bad_cell(file: &str, layout: &Layout, row: &Row, column: usize, field: &[u8]) -> RecordingError {
    if field.contains(&0) {
        return damaged(file, row.number);
    }
    let text = String::from_utf8_lossy(field);
    let last = column + 1 == row.fields.len();
    let (problem, expected) = if last && !row.terminated {
        let problem = format!("truncated: the file ends inside \"{}\"", one_line(&text));
        (
            problem,
            "a complete row; delete it or copy the file again".into(),
        )
    } else if field.is_empty() {
        ("the cell is empty".into(), "a number".into())
    } else if is_decimal_comma(&text) {
        let problem = format!("\"{}\" has a decimal comma", one_line(&text));
        (
            problem,
            format!("a decimal point: {}", text.replace(',', ".")),
        )
    } else {
        let problem = format!("\"{}\" is no finite number", one_line(&text));
        (problem, "a number".into())
    };
    RecordingError {
        column: Some(layout.label(column)),
        ..error(file, Some(row.number), problem, expected)
    }
}

fn damaged(file: &str, line: u32) -> RecordingError {
    let problem = "NUL bytes: the file is damaged here";
    error(file, Some(line), problem, TABLE)
}

fn find_column(
    file: &str,
    layout: &Layout,
    signal: &str,
    column: &Column,
) -> Result<usize, RecordingError> {
    match column {
        Column::Number(number) if *number < layout.columns => Ok(*number),
        Column::Number(number) => {
            let problem = format!("no column {number} for the signal {signal}");
            let expected = format!("a number from 0 to {}", layout.columns - 1);
            Err(error(file, layout.header_line, problem, expected))
        }
        Column::Name(name) => find_name(file, layout, signal, name),
    }
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
        let last = layout.columns - 1;
        let expected = format!("a column number from 0 to {last} in the rig");
        return Err(error(file, line, problem, expected));
    };
    let wanted = name.trim_start_matches('#').trim();
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
