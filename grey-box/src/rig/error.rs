//! What is wrong with a rig file, on one line.

use std::fmt;

use crate::text::file_name;

/// A rig file that cannot be used. Its `Display` is one line:
/// `file:line: key: problem, expected ...`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RigError {
    /// The file as the caller named it.
    pub file: String,
    /// Line in the file, from 1, when the problem has a place.
    pub line: Option<usize>,
    /// The key, `section.key`, when the problem concerns one.
    pub key: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What should stand there.
    pub expected: String,
}

impl fmt::Display for RigError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", file_name(&self.file))?;
        if let Some(line) = self.line {
            write!(formatter, ":{line}")?;
        }
        if let Some(key) = &self.key {
            write!(formatter, ": {}", file_name(key))?;
        }
        write!(formatter, ": {}", file_name(&self.problem))?;
        if !self.expected.is_empty() {
            write!(formatter, ", expected {}", file_name(&self.expected))?;
        }
        Ok(())
    }
}

impl std::error::Error for RigError {}

/// A key that a rig cannot hold, or whose section the rig does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the rig has no place for \"{0}\"")]
pub struct UnknownKey(pub String);

/// What is wrong with one `[effects.NAME]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EffectFault {
    /// The parameter, when it is one; else the effect's own name.
    pub parameter: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What should stand there.
    pub expected: String,
}
