//! Columns as the text of a table: names, units where any is known, rows.

use std::io::{self, Read};

use crate::groups::{Cells, Column};

/// A unit that the file does not state.
const NO_UNIT: &str = "?";

/// The text of a table, and what was decided on the way.
pub struct Text {
    /// The text, in UTF-8, fields separated by commas.
    pub reader: Box<dyn Read>,
    /// What was decided.
    pub remarks: Vec<String>,
}

impl Text {
    pub(crate) fn of_columns(columns: Vec<Column>, remarks: Vec<String>) -> Self {
        let fields = |of: &dyn Fn(&Column) -> String| columns.iter().map(of).collect();
        let mut head = vec![fields(&|column| column.name.clone())];
        if columns.iter().any(|column| column.unit.is_some()) {
            let unit = |column: &Column| column.unit.clone().unwrap_or(NO_UNIT.into());
            head.push(fields(&unit));
        }
        let rows = columns.first().map_or(0, |column| column.cells.len());
        let cells: Vec<Cells> = columns.into_iter().map(|column| column.cells).collect();
        let body = (0..rows).map(move |row| {
            let cell = |cells: &Cells| cell(cells, row);
            cells.iter().map(cell).collect()
        });
        Self::of_rows(head.into_iter().chain(body), remarks)
    }

    pub(crate) fn of_rows(
        rows: impl Iterator<Item = Vec<String>> + 'static,
        remarks: Vec<String>,
    ) -> Self {
        let lines = Lines {
            rows: Box::new(rows),
            line: Vec::new(),
            given: 0,
        };
        Self {
            reader: Box::new(lines),
            remarks,
        }
    }
}

impl From<Vec<Column>> for Text {
    fn from(columns: Vec<Column>) -> Self {
        Self::of_columns(columns, Vec::new())
    }
}

/// A cell so that reading gives the same bits.
fn cell(cells: &Cells, row: usize) -> String {
    match cells {
        Cells::Reals(cells) if cells[row].is_nan() => String::new(),
        Cells::Reals(cells) => format!("{:?}", cells[row]),
        Cells::Wholes(cells) => cells[row].to_string(),
        Cells::Texts(cells) => cells[row].clone(),
    }
}

/// A duration as hours, minutes and seconds, to a nanosecond.
pub(crate) fn clock_text(count: i64, per_s: u64) -> String {
    let sign = if count < 0 { "-" } else { "" };
    let (seconds, rest) = (count.unsigned_abs() / per_s, count.unsigned_abs() % per_s);
    let ns = rest * (1_000_000_000 / per_s);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{sign}{hours}:{minutes:02}:{seconds:02}.{ns:09}")
}

/// Rows as lines, one at a time.
struct Lines {
    rows: Box<dyn Iterator<Item = Vec<String>>>,
    line: Vec<u8>,
    given: usize,
}

impl Read for Lines {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.given == self.line.len() {
            self.line.clear();
            self.given = 0;
            if let Some(row) = self.rows.next() {
                let fields: Vec<String> = row.iter().map(|field| quoted(field)).collect();
                self.line.extend(fields.join(",").into_bytes());
                self.line.push(b'\n');
            }
        }
        let rest = &self.line[self.given..];
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.given += count;
        Ok(count)
    }
}

/// A field on one line, in quotes where it needs them.
fn quoted(field: &str) -> String {
    let field = field.replace(|one: char| one.is_control(), " ");
    if field.contains([',', '"']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(mut text: Text) -> String {
        let mut all = String::new();
        text.reader.read_to_string(&mut all).unwrap();
        all
    }

    #[test]
    fn val_a_duration_is_a_clock_text() {
        assert_eq!(
            clock_text(3_723_000_001, 1_000_000_000),
            "0:00:03.723000001"
        );
        assert_eq!(clock_text(-90_061_500, 1_000), "-25:01:01.500000000");
    }

    #[test]
    fn prop_columns_are_lines_that_give_the_same_bits() {
        let values = [0.1 + 0.2, 1e300, -5e-324, f64::NAN];
        let mut first = Column::new("a, \"b\"", Cells::Reals(values.to_vec()));
        first.unit = Some("V".into());
        let second = Column::new("n", Cells::Wholes(vec![i64::MAX, 0, -1, 2]));
        let text = read(Text::of_columns(vec![first, second], Vec::new()));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[..2], ["\"a, \"\"b\"\"\",n", "V,?"]);
        for (line, value) in lines[2..5].iter().zip(values) {
            let (cell, _) = line.split_once(',').unwrap();
            assert_eq!(cell.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert_eq!(lines[5], ",2");
        assert!(lines[2].ends_with("9223372036854775807"));
    }
}
