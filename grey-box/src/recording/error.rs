//! What is wrong with a recording, on one line.

use std::fmt;

use crate::text::file_name;

/// A recording that cannot be used. Its `Display` is one line:
/// `file:line: column "name": problem, expected ...`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingError {
    /// The file as the caller named it.
    pub file: String,
    /// Line in the file, from 1, when the problem has a place.
    pub line: Option<u32>,
    /// The column's name or number, when the problem concerns one.
    pub column: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What was expected instead.
    pub expected: String,
}

impl fmt::Display for RecordingError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", file_name(&self.file))?;
        if let Some(line) = self.line {
            write!(formatter, ":{line}")?;
        }
        if let Some(column) = &self.column {
            write!(formatter, ": column {}", file_name(column))?;
        }
        write!(
            formatter,
            ": {}, expected {}",
            file_name(&self.problem),
            file_name(&self.expected)
        )
    }
}

impl std::error::Error for RecordingError {}

/// What a file is expected to be.
pub(super) const TABLE: &str = "a text table: rows of numbers";

/// An error that concerns no single column.
pub(super) fn error(
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
