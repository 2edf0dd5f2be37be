//! How a file is laid out: where its table begins, separator, header, number of columns. Decided
//! once from the head of the file, then every row must comply.
//!
//! The header is the first line that has every name that the rig asks for; without one it is the
//! line of names above the first rows. What stands above the table is a logger's preamble, and
//! up to [`TEXT_ROWS`] lines of text between header and rows are units or comments.
//!
//! Limits: a table that begins below the head of the file is not found.

use super::fields::{Separator, Splitter};
use super::lines::{Line, text_of};
use super::number::{is_grouped, is_no_value, is_number};
use super::time::is_time;
use crate::rig::{Column, Signals};

/// Lines of text between header and rows: units, a long name, a comment.
const TEXT_ROWS: usize = 3;
/// Rows from which separator and number of columns are taken.
const SAMPLED_ROWS: usize = 50;

/// The layout of a file.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub separator: Separator,
    /// Names of the columns, when the file gives them.
    pub names: Option<Vec<String>>,
    /// Line of the plain header, which is no data row.
    pub header_line: Option<u32>,
    pub columns: usize,
    /// Rows begin at this line.
    pub first_row: u32,
    /// Lines of text between header and rows.
    pub text_rows: Vec<TextRow>,
    /// First and last line above the table that are neither blank nor comments.
    pub preamble: Option<(u32, u32)>,
    /// A row above the header: the lines above are no preamble.
    pub row_above: Option<u32>,
}

/// A line of text between header and rows.
#[derive(Clone, Debug)]
pub(super) struct TextRow {
    pub line: u32,
    pub cells: Vec<String>,
}

impl Layout {
    /// The layout of the file whose head is given; `None` when the head holds
    /// neither a header nor a row.
    pub(super) fn detect(head: &[Line], signals: &Signals) -> Option<Self> {
        let lines: Vec<&Line> = head.iter().filter(|line| line.has_content()).collect();
        let first = *lines.first()?;
        let mut search = Search::new(signals);
        Some(match search.named_header(head) {
            Some(header) => search.below(&lines, header),
            None => search.by_shape(head, &lines, first),
        })
    }

    /// What error lines call a column.
    pub(super) fn label(&self, column: usize) -> String {
        match self.names.as_ref().and_then(|names| names.get(column)) {
            Some(name) => format!("\"{name}\""),
            None => column.to_string(),
        }
    }
}

/// A name as headers are compared by: some loggers mark a header as a comment.
pub(super) fn bare(name: &str) -> &str {
    name.trim_start_matches('#').trim()
}

/// A header line.
struct Header {
    line: u32,
    commented: bool,
    names: Vec<String>,
    separator: Separator,
}

/// The search for the table, with a splitter for each separator.
struct Search<'s> {
    splitters: [Splitter; Separator::ALL.len()],
    /// Names that the header must have.
    names: Vec<&'s str>,
    /// Columns that rows must have, as far as they are known: time first.
    used: Vec<usize>,
}

impl<'s> Search<'s> {
    fn new(signals: &'s Signals) -> Self {
        let time = signals.get("t").into_iter();
        let others = signals.iter().filter(|(name, _)| *name != "t");
        let mut search = Self {
            splitters: Separator::ALL.map(Splitter::new),
            names: Vec::new(),
            used: Vec::new(),
        };
        for signal in time.chain(others.map(|(_, signal)| signal)) {
            match &signal.column {
                Column::Name(name) => search.names.push(bare(name)),
                Column::Number(number) => search.used.push(*number),
                Column::Constant(_) | Column::Every(_) => {}
            }
        }
        search
    }

    fn split(&mut self, line: &[u8], separator: Separator) -> &Splitter {
        let place = Separator::ALL.iter().position(|one| *one == separator);
        let splitter = &mut self.splitters[place.unwrap_or_default()];
        splitter.split(line);
        splitter
    }

    fn names_by(&mut self, text: &str, separator: Separator) -> Vec<String> {
        let splitter = self.split(text.as_bytes(), separator);
        let count = splitter.len_without_padding();
        let name = |field| bare(&text_of(field)).to_owned();
        splitter.fields().take(count).map(name).collect()
    }

    /// The first line that has every name that is asked for.
    fn named_header(&mut self, head: &[Line]) -> Option<Header> {
        if self.names.is_empty() {
            return None;
        }
        for line in head {
            let text = line.text();
            for separator in Separator::ALL {
                let names = self.names_by(&text, separator);
                let has = |wanted: &&str| names.iter().any(|name| name == wanted);
                if self.names.iter().all(has) {
                    return Some(Header {
                        line: line.number,
                        commented: line.is_comment(),
                        names,
                        separator,
                    });
                }
            }
        }
        None
    }

    /// The layout with a header that has the names that are asked for.
    fn below(&mut self, lines: &[&Line], header: Header) -> Layout {
        self.use_columns_of(&header.names);
        let place = lines.partition_point(|line| line.number <= header.line);
        let rows = &lines[place..];
        let separator = self.common_separator(rows).unwrap_or(header.separator);
        let columns = self.columns_under(&header, rows, separator);
        let first = self.first_row_under_header(rows, separator);
        let above = &lines[..lines.partition_point(|line| line.number < header.line)];
        let row_above = above.iter().find(|line| {
            self.is_row(line, separator) && self.split(&line.bytes, separator).len() == columns
        });
        Layout {
            separator,
            columns,
            names: Some(header.names[..columns].to_vec()),
            header_line: Some(header.line).filter(|_| !header.commented),
            first_row: rows.get(first).map_or(header.line + 1, |row| row.number),
            text_rows: self.text_rows(&rows[..first], separator),
            preamble: ends(above),
            row_above: row_above.map(|line| line.number),
        }
    }

    /// Time first: its cell tells rows from text.
    fn use_columns_of(&mut self, header: &[String]) {
        let place = |wanted: &&str| header.iter().position(|name| name == wanted);
        let named: Vec<usize> = self.names.iter().filter_map(place).collect();
        let numbered = std::mem::replace(&mut self.used, named);
        self.used.extend(numbered);
    }

    /// As many as the header has names; one less where no row fills the last (a comment column).
    fn columns_under(&mut self, header: &Header, rows: &[&Line], separator: Separator) -> usize {
        let columns = header.names.len();
        let counts = self.row_lengths(rows, separator);
        let one_less = counts.len() > 1 && counts.iter().all(|(_, count)| count + 1 == columns);
        let unused = !self.used.contains(&(columns - 1));
        columns - usize::from(one_less && unused)
    }

    /// How many lines of text precede the rows.
    fn first_row_under_header(&mut self, rows: &[&Line], separator: Separator) -> usize {
        let text = rows.iter().take_while(|row| self.is_text(row, separator));
        let count = text.count();
        if count <= TEXT_ROWS && count < rows.len() {
            count
        } else {
            0
        }
    }

    fn text_rows(&mut self, rows: &[&Line], separator: Separator) -> Vec<TextRow> {
        rows.iter()
            .map(|row| TextRow {
                line: row.number,
                cells: self
                    .split(&row.bytes, separator)
                    .fields()
                    .map(text_of)
                    .collect(),
            })
            .collect()
    }

    /// The layout without the names that are asked for: by rows that are alike.
    fn by_shape(&mut self, head: &[Line], lines: &[&Line], first: &Line) -> Layout {
        if !self.names.is_empty() {
            self.used.clear();
        }
        let sample = lines.get(1).unwrap_or(&first);
        let separator = self.common_separator(lines);
        let separator = separator.unwrap_or_else(|| self.separator_of(&sample.bytes));
        let lengths = self.row_lengths(lines, separator);
        let columns = most_frequent(&lengths)
            .unwrap_or_else(|| self.split(&sample.bytes, separator).len_without_padding());
        let start = self.start_of_rows(lines, &lengths, columns, separator);
        let header = self.header_above(&lines[..start], separator, columns);
        let (place, names) = match header {
            Some((place, names)) => (Some(place), Some(names)),
            None => {
                let until = lines.get(start).map_or(u32::MAX, |line| line.number);
                (None, self.commented_header(head, until, separator, columns))
            }
        };
        let columns = match (place, &names) {
            (Some(_), Some(names)) => names.len(),
            _ => columns,
        };
        let begin = place.unwrap_or(start);
        Layout {
            separator,
            columns,
            header_line: place.map(|place| lines[place].number),
            names,
            first_row: lines
                .get(start)
                .map_or(first.number + 1, |line| line.number),
            text_rows: match place {
                Some(place) => self.text_rows(&lines[place + 1..start], separator),
                None => Vec::new(),
            },
            preamble: ends(&lines[..begin]),
            row_above: None,
        }
    }

    /// Place of the first row: of those that are alike, or of those that are not, lest more than
    /// one be taken for a preamble (one may be a line that was cut).
    fn start_of_rows(
        &mut self,
        lines: &[&Line],
        lengths: &[(usize, usize)],
        columns: usize,
        separator: Separator,
    ) -> usize {
        let alike = lengths.iter().position(|(_, length)| *length == columns);
        let Some(alike) = alike else {
            let names = self.names_by(&lines[0].text(), separator);
            return usize::from(is_mostly_text(&names));
        };
        let others = &lengths[..alike];
        others
            .first()
            .filter(|_| others.len() > 1)
            .map_or(lengths[alike].0, |(place, _)| *place)
    }

    /// Place and names of the line of names among the last lines above the rows: the topmost one
    /// that names every column, or else the nearest one.
    fn header_above(
        &mut self,
        above: &[&Line],
        separator: Separator,
        columns: usize,
    ) -> Option<(usize, Vec<String>)> {
        let from = above.len().saturating_sub(TEXT_ROWS + 1);
        let mut texts: Vec<(usize, Vec<String>)> = (from..above.len())
            .map(|place| {
                (
                    place,
                    self.header_names(&above[place].text(), separator, columns),
                )
            })
            .filter(|(_, names)| is_mostly_text(names))
            .collect();
        let complete = texts.iter().position(|(_, names)| names.len() == columns);
        match complete {
            Some(place) => Some(texts.swap_remove(place)),
            // The names that are asked for are in no line: list those that there are.
            None if !self.names.is_empty() => texts.pop(),
            None => None,
        }
    }

    /// The last comment above the rows that has a name for every column.
    fn commented_header(
        &mut self,
        head: &[Line],
        until: u32,
        separator: Separator,
        columns: usize,
    ) -> Option<Vec<String>> {
        head.iter()
            .filter(|line| line.number < until && line.is_comment() && columns > 1)
            .map(|line| self.header_names(&line.text(), separator, columns))
            .filter(|names| names.len() == columns)
            .last()
    }

    /// Splits a header into names; it may use another separator than the rows do, which shows by
    /// giving the right number of names.
    fn header_names(&mut self, text: &str, separator: Separator, columns: usize) -> Vec<String> {
        let own = Some(separator).filter(|own| *own != Separator::Blanks);
        own.into_iter()
            .chain(Separator::ALL)
            .map(|separator| self.names_by(text, separator))
            .find(|names| names.len() == columns)
            .unwrap_or_else(|| self.names_by(text, separator))
    }

    /// The separator of most rows.
    fn common_separator(&mut self, lines: &[&Line]) -> Option<Separator> {
        let mut counts = [0_usize; Separator::ALL.len()];
        for line in lines {
            let separator = self.separator_of(&line.bytes);
            if self.is_row(line, separator) {
                let place = Separator::ALL.iter().position(|one| *one == separator);
                counts[place.unwrap_or_default()] += 1;
            }
            if counts.iter().sum::<usize>() == SAMPLED_ROWS {
                break;
            }
        }
        let all = Separator::ALL.into_iter().zip(counts);
        let found = all.filter(|(_, count)| *count > 0);
        found
            .max_by_key(|(_, count)| *count)
            .map(|(separator, _)| separator)
    }

    /// The separator of a row. Numbers with a blank between them inside a field mean that the
    /// row is separated by blanks and the other character is a decimal comma or padding.
    fn separator_of(&mut self, row: &[u8]) -> Separator {
        for separator in Separator::ALL {
            let splitter = self.split(row, separator);
            if splitter.len() > 1 && !splitter.fields().any(is_several_numbers) {
                return separator;
            }
        }
        Separator::Blanks
    }

    /// Place and number of fields of each row among the first lines.
    fn row_lengths(&mut self, lines: &[&Line], separator: Separator) -> Vec<(usize, usize)> {
        let mut lengths = Vec::new();
        for (place, line) in lines.iter().enumerate() {
            if lengths.len() < SAMPLED_ROWS && self.is_row(line, separator) {
                lengths.push((place, self.split(&line.bytes, separator).len()));
            }
        }
        lengths
    }

    /// Whether a line is a row: a time and a value in a column that is asked for; as long as
    /// none is known, values in at least half of its cells.
    fn is_row(&mut self, line: &Line, separator: Separator) -> bool {
        let cells = self.cells(line, separator);
        let values = cells
            .iter()
            .filter(|cell| **cell == CellKind::Value)
            .count();
        if self.used.is_empty() {
            let texts = cells.iter().filter(|cell| **cell == CellKind::Text).count();
            return values > 0 && values >= texts;
        }
        values > 0 && cells.len() == self.used.len() && cells[0] != CellKind::Text
    }

    /// Whether a line below the header is text: its time is none and neither are most others.
    fn is_text(&mut self, line: &Line, separator: Separator) -> bool {
        let cells = self.cells(line, separator);
        let count = |kind| cells.iter().filter(|cell| **cell == kind).count();
        cells.first() == Some(&CellKind::Text) && count(CellKind::Text) > count(CellKind::Value)
    }

    /// The cells of the columns that are asked for, or all while none is known.
    fn cells(&mut self, line: &Line, separator: Separator) -> Vec<CellKind> {
        let used = std::mem::take(&mut self.used);
        let splitter = self.split(&line.bytes, separator);
        let cells = if used.is_empty() {
            splitter.fields().map(CellKind::of).collect()
        } else {
            let places = used.iter().filter(|place| **place < splitter.len());
            places
                .map(|place| CellKind::of(splitter.field(*place)))
                .collect()
        };
        self.used = used;
        cells
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CellKind {
    Value,
    Blank,
    Text,
}

impl CellKind {
    fn of(cell: &[u8]) -> Self {
        let text = text_of(cell);
        if is_no_value(&text) {
            Self::Blank
        } else if is_number(&text) || is_time(&text) {
            Self::Value
        } else {
            Self::Text
        }
    }
}

/// First and last line.
fn ends(lines: &[&Line]) -> Option<(u32, u32)> {
    Some((lines.first()?.number, lines.last()?.number))
}

/// The most frequent number of fields; of two that are as frequent the greater one.
fn most_frequent(lengths: &[(usize, usize)]) -> Option<usize> {
    let count = |length: usize| lengths.iter().filter(|(_, other)| *other == length).count();
    let all = lengths.iter().map(|(_, length)| *length);
    all.max_by_key(|length| (count(*length), *length))
}

/// A line that names columns.
fn is_mostly_text(names: &[String]) -> bool {
    let numbers = names.iter().filter(|name| is_number(name)).count();
    let texts = names.iter().filter(|name| !name.is_empty()).count() - numbers;
    texts > numbers
}

fn is_several_numbers(field: &[u8]) -> bool {
    let text = text_of(field);
    let mut pieces = text.split_ascii_whitespace();
    pieces.clone().count() > 1 && pieces.all(is_number) && !is_grouped(&text)
}
