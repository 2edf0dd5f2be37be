//! Opens a source and streams its lines into the table.

use std::io::BufRead;
use std::path::Path;

use super::error::{TABLE, error};
use super::fields::Splitter;
use super::layout::Layout;
use super::lines::{Line, Lines};
use super::source::{Source, Text};
use super::table::{Table, row_limit};
use super::{MAXIMUM_ROWS, Recording, RecordingError};
use crate::rig::Signals;

/// A file must exceed the limit by this much, judged by its first lines,
/// before it is refused unread.
const ROW_ESTIMATE_MARGIN: u64 = 2;

impl Recording {
    /// Reads the columns that `signals` names; `-` is standard input.
    pub fn read(path: impl AsRef<Path>, signals: &Signals) -> Result<Self, RecordingError> {
        let source = Source::open(path.as_ref())?;
        Self::read_from(source.reader, &source.name, source.size, signals)
    }

    /// Reads from any source, once from front to end; `size` in bytes, where it is known, lets
    /// a file that is too large be refused at once.
    pub fn read_from(
        source: impl BufRead,
        name: &str,
        size: Option<u64>,
        signals: &Signals,
    ) -> Result<Self, RecordingError> {
        let text = Text::of(source, name, signals)?;
        let size = size.filter(|_| text.same_size);
        let mut lines = Lines::new(text.reader, name);
        let head = lines.head()?;
        check_text(name, &head)?;
        let layout = layout(name, &head, signals)?;
        let rows = expected_rows(name, size, &head)?;
        let mut splitter = Splitter::new(layout.separator);
        let mut table = Table::new(name, layout, signals, rows)?;
        table.observe(&head, &mut splitter);
        for line in &head {
            table.add_line(line, &mut splitter)?;
        }
        drop(head);
        while let Some(line) = lines.next()? {
            table.add_line(line, &mut splitter)?;
        }
        let mut recording = table.finish()?;
        recording.remarks.splice(0..0, text.remarks);
        Ok(recording)
    }
}

fn layout(name: &str, head: &[Line], signals: &Signals) -> Result<Layout, RecordingError> {
    let Some(layout) = Layout::detect(head, signals) else {
        let problem = if head.is_empty() {
            "is empty"
        } else {
            "holds no rows"
        };
        return Err(error(name, None, problem, TABLE));
    };
    if let Some(row) = layout.row_above {
        let problem = format!("the header stands below rows (line {row})");
        let expected = "the header above all rows, and one run in a file; cut it before this line";
        return Err(error(name, layout.header_line, problem, expected));
    }
    Ok(layout)
}

/// Refuses what is no text.
pub(super) fn check_text(name: &str, head: &[Line]) -> Result<(), RecordingError> {
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
    let table = || head.iter().filter(|line| line.has_content());
    let bytes: usize = table().map(|line| line.bytes.len() + 1).sum();
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
