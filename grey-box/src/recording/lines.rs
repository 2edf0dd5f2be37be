//! The lines of a source, one at a time, counted.

use std::io::{BufRead, ErrorKind, Read};

use super::RecordingError;
use super::error::{TABLE, error};

/// A longer line is no table: a binary file, or one without line ends.
const LONGEST_LINE_BYTES: usize = 1 << 20;
/// Lines looked at to decide the layout: past any preamble.
const HEAD_LINES: usize = 1000;
/// The characters that start a comment line.
const COMMENT: [u8; 2] = [b'#', b'%'];
/// Lines over which the cells of a header may go: spreadsheets break long names.
const HEADER_LINES: usize = 8;
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// A line without its line end.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    pub bytes: Vec<u8>,
    /// From 1.
    pub number: u32,
    pub terminated: bool,
}

impl Line {
    /// Neither blank nor a comment.
    pub(super) fn has_content(&self) -> bool {
        !is_blank(&self.bytes) && !self.is_comment()
    }

    pub(super) fn is_comment(&self) -> bool {
        let first = self.bytes.trim_ascii_start().first();
        first.is_some_and(|byte| COMMENT.contains(byte))
    }

    /// The text, without the sign of a comment: UTF-8, or else Latin-1, which every byte
    /// sequence is.
    pub(super) fn text(&self) -> String {
        let text = text_of(&self.bytes);
        if !self.is_comment() {
            return text;
        }
        let signs = |one: char| one.is_whitespace() || COMMENT.map(char::from).contains(&one);
        text.trim_start_matches(signs).into()
    }
}

pub(super) fn is_blank(text: &[u8]) -> bool {
    text.iter().all(u8::is_ascii_whitespace)
}

/// UTF-8, or else Latin-1.
pub(super) fn text_of(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// Reads line after line into one buffer.
pub(super) struct Lines<'n, R> {
    source: R,
    file: &'n str,
    line: Line,
}

impl<'n, R: BufRead> Lines<'n, R> {
    pub(super) fn new(source: R, file: &'n str) -> Self {
        Self {
            source,
            file,
            line: Line::default(),
        }
    }

    /// The next line; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<&Line>, RecordingError> {
        let Line {
            bytes,
            number,
            terminated,
        } = &mut self.line;
        bytes.clear();
        let limit = u64::try_from(LONGEST_LINE_BYTES).unwrap_or(u64::MAX);
        let mut limited = self.source.by_ref().take(limit);
        let read = limited.read_until(b'\n', bytes).map_err(|cause| {
            let problem = match cause.kind() {
                ErrorKind::UnexpectedEof => "the packed file ends too early".into(),
                _ => format!("cannot be read: {cause}"),
            };
            error(self.file, Some(*number), problem, TABLE)
        })?;
        if read == 0 {
            return Ok(None);
        }
        *number = number.saturating_add(1);
        *terminated = bytes.last() == Some(&b'\n');
        if read == LONGEST_LINE_BYTES && !*terminated {
            let problem = "the line is longer than 1 MiB";
            return Err(error(self.file, Some(*number), problem, TABLE));
        }
        while matches!(bytes.last(), Some(b'\n' | b'\r')) {
            bytes.pop();
        }
        if *number == 1 && bytes.starts_with(BYTE_ORDER_MARK) {
            bytes.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(Some(&self.line))
    }

    /// The first lines of the file.
    pub(super) fn head(&mut self) -> Result<Vec<Line>, RecordingError> {
        let mut head: Vec<Line> = Vec::new();
        let mut bytes = 0;
        while head.len() < HEAD_LINES && bytes < LONGEST_LINE_BYTES {
            let Some(line) = self.next()? else {
                break;
            };
            bytes += line.bytes.len();
            head.push(line.clone());
        }
        Ok(joined(head))
    }
}

/// The lines, those joined between which a quote is open.
fn joined(lines: Vec<Line>) -> Vec<Line> {
    let mut joined: Vec<Line> = Vec::with_capacity(lines.len());
    let mut rest = lines.into_iter();
    while let Some(mut line) = rest.next() {
        let mut following = rest.as_slice().iter().take(HEADER_LINES);
        let closes = has_open_quote(&line.bytes)
            .then(|| following.position(|next| has_open_quote(&next.bytes)));
        for next in rest
            .by_ref()
            .take(closes.flatten().map_or(0, |place| place + 1))
        {
            line.bytes.push(b' ');
            line.bytes.extend(next.bytes);
            line.terminated = next.terminated;
        }
        joined.push(line);
    }
    joined
}

fn has_open_quote(text: &[u8]) -> bool {
    text.iter().filter(|byte| **byte == b'"').count() % 2 == 1
}
