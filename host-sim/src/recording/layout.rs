//! How a file is laid out: separator, header, number of columns. Decided once
//! from the head of the file, then every row must comply.

use std::ops::Range;

/// What stands between two fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// One character.
    Byte(u8),
    /// A run of blanks and tabs; leading and trailing ones do not count.
    Blanks,
}

/// The characters that start a comment line.
const COMMENT: [u8; 2] = [b'#', b'%'];

/// The layout of a file.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub separator: Separator,
    /// Names of the columns, when the file gives them.
    pub names: Option<Vec<String>>,
    /// Line of the plain header, which is no data row.
    pub header_line: Option<u32>,
    pub columns: usize,
}

/// A line of the head of the file, without its line end.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub bytes: Vec<u8>,
    pub number: u32,
    pub terminated: bool,
}

pub(super) fn is_blank(line: &[u8]) -> bool {
    line.iter().all(u8::is_ascii_whitespace)
}

pub(super) fn is_comment(line: &[u8]) -> bool {
    let first = line.iter().find(|byte| !byte.is_ascii_whitespace());
    first.is_some_and(|byte| COMMENT.contains(byte))
}

impl Layout {
    /// The layout of the file whose head is given; `None` when the head holds
    /// neither a header nor a row.
    pub(super) fn detect(head: &[Line]) -> Option<Self> {
        let mut rows = head
            .iter()
            .filter(|line| !is_blank(&line.bytes) && !is_comment(&line.bytes));
        let first = rows.next()?;
        let sample = rows.next().unwrap_or(first);
        let separator = separator_of(&sample.bytes);
        let sample_fields = split(&sample.bytes, separator);
        let columns = without_trailing_empty(&sample.bytes, &sample_fields);
        if let Some(names) = plain_header(&first.bytes, separator, columns) {
            return Some(Self {
                separator,
                columns: names.len(),
                names: Some(names),
                header_line: Some(first.number),
            });
        }
        Some(Self {
            separator,
            names: commented_header(head, first.number, separator, columns),
            header_line: None,
            columns,
        })
    }

    /// Whether a row of `fields` fields complies.
    pub(super) fn admits(&self, line: &[u8], fields: &[Range<usize>]) -> bool {
        let trailing = fields.len() == self.columns + 1
            && fields
                .last()
                .is_some_and(|last| is_blank(&line[last.clone()]));
        fields.len() == self.columns || trailing
    }

    /// What error lines call a column.
    pub(super) fn label(&self, column: usize) -> String {
        match self.names.as_ref().and_then(|names| names.get(column)) {
            Some(name) => format!("\"{name}\""),
            None => column.to_string(),
        }
    }
}

/// A first line that is mostly text names the columns.
fn plain_header(line: &[u8], separator: Separator, columns: usize) -> Option<Vec<String>> {
    let names = header_names(&text_of(line), separator, columns);
    let numbers = names.iter().filter(|name| is_number(name)).count();
    let texts = names
        .iter()
        .filter(|name| !name.is_empty() && !is_number(name))
        .count();
    (texts > numbers).then_some(names)
}

/// The last comment before the data that has a name for every column.
fn commented_header(
    head: &[Line],
    first_row: u32,
    separator: Separator,
    columns: usize,
) -> Option<Vec<String>> {
    let comments = head
        .iter()
        .take_while(|line| line.number < first_row)
        .filter(|line| is_comment(&line.bytes));
    comments
        .map(|line| {
            let text = text_of(&line.bytes);
            let text = text.trim_start_matches(|one: char| {
                one.is_whitespace() || COMMENT.iter().any(|comment| char::from(*comment) == one)
            });
            header_names(text, separator, columns)
        })
        .filter(|names| columns > 1 && names.len() == columns)
        .last()
}

/// Splits a header into names; the header may use another separator than the
/// rows do, which shows by giving the right number of names.
fn header_names(text: &str, separator: Separator, columns: usize) -> Vec<String> {
    // From the one that names hold least often; blanks are common in names.
    let others = [b';', b'\t', b','].map(Separator::Byte);
    let own = Some(separator).filter(|own| *own != Separator::Blanks);
    let order = own.into_iter().chain(others).chain([Separator::Blanks]);
    let mut candidates = order.map(|separator| names_by(text, separator));
    candidates
        .find(|names| names.len() == columns)
        .unwrap_or_else(|| names_by(text, separator))
}

fn names_by(text: &str, separator: Separator) -> Vec<String> {
    let bytes = text.as_bytes();
    let fields = split(bytes, separator);
    let count = without_trailing_empty(bytes, &fields);
    fields
        .into_iter()
        .take(count)
        .map(|field| {
            let name = unquoted(&bytes[field]);
            String::from_utf8_lossy(name).trim().replace("\"\"", "\"")
        })
        .map(|name| name.trim_start_matches('#').trim().to_owned())
        .collect()
}

/// UTF-8, or else Latin-1, which every byte sequence is.
fn text_of(line: &[u8]) -> String {
    match std::str::from_utf8(line) {
        Ok(text) => text.into(),
        Err(_) => line.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// A number, also one with a decimal comma: that row is data to complain about.
fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok() || is_decimal_comma(text)
}

/// A number that would be one with a point in place of its comma.
pub(super) fn is_decimal_comma(text: &str) -> bool {
    text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok()
}

fn without_trailing_empty(line: &[u8], fields: &[Range<usize>]) -> usize {
    match fields.last() {
        Some(last) if fields.len() > 1 && is_blank(&line[last.clone()]) => fields.len() - 1,
        _ => fields.len(),
    }
}

/// The separator of a row. A blank inside a field means that the row is
/// separated by blanks and the other character is a decimal comma or padding.
fn separator_of(row: &[u8]) -> Separator {
    for byte in [b'\t', b';', b','] {
        let separator = Separator::Byte(byte);
        let fields = split(row, separator);
        if fields.len() < 2 {
            continue;
        }
        if fields
            .iter()
            .any(|field| numbers_with_blank(&row[field.clone()]))
        {
            continue;
        }
        return separator;
    }
    Separator::Blanks
}

fn numbers_with_blank(field: &[u8]) -> bool {
    let pieces = split(field, Separator::Blanks);
    pieces.len() > 1
        && pieces
            .iter()
            .all(|piece| std::str::from_utf8(&field[piece.clone()]).is_ok_and(is_number))
}

/// The fields of a line, trimmed of blanks, as ranges.
pub(super) fn split(line: &[u8], separator: Separator) -> Vec<Range<usize>> {
    let mut fields = Vec::new();
    split_into(line, separator, &mut fields);
    fields
}

/// As [`split`], into a list that is reused from row to row.
pub(super) fn split_into(line: &[u8], separator: Separator, fields: &mut Vec<Range<usize>>) {
    fields.clear();
    match separator {
        Separator::Byte(byte) => split_at_byte(line, byte, fields),
        Separator::Blanks => split_at_blanks(line, fields),
    }
}

fn split_at_byte(line: &[u8], separator: u8, fields: &mut Vec<Range<usize>>) {
    let mut start = 0;
    loop {
        let end = field_end(line, start, |byte| byte == separator);
        fields.push(trimmed(line, start..end));
        if end == line.len() {
            return;
        }
        start = end + 1;
    }
}

fn split_at_blanks(line: &[u8], fields: &mut Vec<Range<usize>>) {
    let mut start = 0;
    while start < line.len() {
        if line[start].is_ascii_whitespace() {
            start += 1;
            continue;
        }
        let end = field_end(line, start, |byte| byte.is_ascii_whitespace());
        fields.push(start..end);
        start = end;
    }
}

/// The end of the field that starts at `start`; separators inside a quoted
/// field do not count.
fn field_end(line: &[u8], start: usize, separates: impl Fn(u8) -> bool) -> usize {
    let mut quoted = false;
    let opens = |place: usize| is_blank(&line[start..place]);
    for (place, byte) in line.iter().enumerate().skip(start) {
        match byte {
            b'"' if quoted => quoted = false,
            b'"' if opens(place) || line[place - 1] == b'"' => quoted = true,
            byte if !quoted && separates(*byte) => return place,
            _ => {}
        }
    }
    line.len()
}

fn trimmed(line: &[u8], range: Range<usize>) -> Range<usize> {
    let field = &line[range.clone()];
    let start = field.iter().position(|byte| !byte.is_ascii_whitespace());
    let end = field.iter().rposition(|byte| !byte.is_ascii_whitespace());
    match (start, end) {
        (Some(start), Some(end)) => range.start + start..range.start + end + 1,
        _ => range.start..range.start,
    }
}

/// A field without the quotes around it.
pub(super) fn unquoted(field: &[u8]) -> &[u8] {
    match field {
        [b'"', inner @ .., b'"'] => inner,
        other => other,
    }
}
