//! Recordings: text tables of numbers, one row per instant, to signals in SI and
//! back ([`Table`]).
//!
//! Responsibilities: take the files as loggers write them, convert the columns that the rig
//! names, say what was decided or left out on the way ([`Recording::remarks`]), and refuse with
//! one line whatever is not understood. What is read and by which rule stands in
//! `docs/recordings.md`.
//!
//! * `source`: files, pipes, gzip, UTF-16; `lines`: counted lines; `fields`: one line to fields.
//! * `layout`: where the table begins, separator, header, units.
//! * `even`: rows that were sampled evenly and stamped late.
//! * `tables`: what a file holds, without a rig.
//! * `number`, `time`: what a cell says; `table`: rows to columns, and what is left out.
//!
//! Limits: at most [`MAXIMUM_ROWS`] rows and lines of at most 1 MiB; the file
//! is streamed and read once, memory is 8 bytes per used cell plus 4 per row.

mod error;
mod even;
mod fields;
mod layout;
mod lines;
mod number;
mod read;
mod source;
mod table;
mod tables;
mod time;
mod write;

use std::collections::BTreeMap;

pub use error::RecordingError;
pub use tables::{ColumnLook, TableLook, tables};
pub use write::{Output, Table, arrange, as_recorded};

/// The largest number of rows that is read. At eight signals it is 1.4 GB.
pub const MAXIMUM_ROWS: usize = 20_000_000;

/// A recording in SI units, pressures absolute.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The file, as the caller named it.
    pub name: String,
    /// Time of the rows, s, strictly increasing; not part of `signals`.
    pub time_s: Vec<f64>,
    /// The signals that the rig names, by name, one value per row.
    pub signals: BTreeMap<String, Vec<f64>>,
    /// Line in the file of each row, from 1.
    pub line: Vec<u32>,
    /// The columns of the file that the rig does not name.
    pub unused_columns: Vec<String>,
    /// What was decided or left out on reading, with lines of the file.
    pub remarks: Vec<String>,
    /// The last row has all its fields but no line end: its last number may
    /// have been cut.
    pub last_row_unterminated: bool,
}

impl Recording {
    /// A recording that does not come from a file (a simulation); rows are
    /// numbered from line 1.
    pub fn from_signals(
        name: impl Into<String>,
        time_s: Vec<f64>,
        signals: BTreeMap<String, Vec<f64>>,
    ) -> Self {
        let line = (1..).take(time_s.len()).collect();
        Self {
            name: name.into(),
            time_s,
            signals,
            line,
            ..Self::default()
        }
    }

    /// The rows of a range; what lies beyond the end is not there.
    #[must_use]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Self {
        let rows = rows.start.min(self.len())..rows.end.min(self.len());
        Self {
            time_s: self.time_s[rows.clone()].to_vec(),
            signals: self
                .signals
                .iter()
                .map(|(name, column)| (name.clone(), column[rows.clone()].to_vec()))
                .collect(),
            line: self.line[rows].to_vec(),
            ..self.clone()
        }
    }

    /// Every `stride`-th row.
    #[must_use]
    pub fn thinned(&self, stride: usize) -> Self {
        fn pick<T: Copy>(column: &[T], stride: usize) -> Vec<T> {
            column.iter().copied().step_by(stride.max(1)).collect()
        }
        Self {
            time_s: pick(&self.time_s, stride),
            signals: self
                .signals
                .iter()
                .map(|(name, column)| (name.clone(), pick(column, stride)))
                .collect(),
            line: pick(&self.line, stride),
            ..self.clone()
        }
    }

    /// What was decided or left out on reading, each remark with the file's name.
    pub fn named_remarks(&self) -> impl Iterator<Item = String> {
        self.remarks
            .iter()
            .map(|remark| format!("{}: {remark}", self.name))
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// True if there is no row; a file without rows is an error on reading.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// The values of a signal; `t` gives the time.
    pub fn signal(&self, name: &str) -> Option<&[f64]> {
        if name == "t" {
            return Some(&self.time_s);
        }
        self.signals.get(name).map(Vec::as_slice)
    }

    /// Time between the first and the last row, s.
    pub fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}
