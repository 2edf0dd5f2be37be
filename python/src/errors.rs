//! One exception: what is wrong, where, and what was expected.

use grey_box::recording::RecordingError;
use grey_box::rig::RigError;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    pneuma,
    PneumaError,
    PyValueError,
    "An input that cannot be used: its text is one line, `file`, `line`, `key` (a key of the rig or a column) and `expected` are attributes."
);

/// An exception without a place.
pub fn unusable(cause: impl ToString) -> PyErr {
    PneumaError::new_err(cause.to_string())
}

fn placed(
    text: String,
    file: &str,
    line: Option<usize>,
    key: Option<&str>,
    expected: &str,
) -> PyErr {
    let error = PneumaError::new_err(text);
    Python::attach(|py| {
        let value = error.value(py);
        // An attribute that cannot be set leaves the text, which says all of it.
        let _ = value.setattr("file", file);
        let _ = value.setattr("line", line);
        let _ = value.setattr("key", key);
        let _ = value.setattr("expected", expected);
    });
    error
}

pub fn of_recording(cause: RecordingError) -> PyErr {
    let line = cause.line.and_then(|line| usize::try_from(line).ok());
    let text = cause.to_string();
    placed(
        text,
        &cause.file,
        line,
        cause.column.as_deref(),
        &cause.expected,
    )
}

pub fn of_rig(cause: RigError) -> PyErr {
    let text = cause.to_string();
    placed(
        text,
        &cause.file,
        cause.line,
        cause.key.as_deref(),
        &cause.expected,
    )
}
