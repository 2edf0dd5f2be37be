//! One line to its fields.
//!
//! Splitting and quoting is `csv-core`'s, the splitter of the `csv` crate, line by line: a quote
//! that is left open then costs one line and not the rest of the file, and line numbers stay
//! those of the file through comments and blank lines. Columns separated by blanks are brought
//! to tabs before.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

/// What stands between two fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// One character.
    Byte(u8),
    /// A run of blanks and tabs; leading and trailing ones do not count.
    Blanks,
}

impl Separator {
    /// From the one that fields hold least often.
    pub(super) const ALL: [Self; 5] = [
        Self::Byte(b'\t'),
        Self::Byte(b';'),
        Self::Byte(b'|'),
        Self::Byte(b','),
        Self::Blanks,
    ];

    fn byte(self) -> u8 {
        match self {
            Self::Byte(byte) => byte,
            Self::Blanks => b'\t',
        }
    }
}

/// Splits line after line and holds the fields of the last one.
pub(super) struct Splitter {
    separator: Separator,
    csv: Reader,
    tidy: Vec<u8>,
    text: Vec<u8>,
    ends: Vec<usize>,
    count: usize,
}

impl Splitter {
    pub(super) fn new(separator: Separator) -> Self {
        let csv = ReaderBuilder::new()
            .delimiter(separator.byte())
            .terminator(Terminator::Any(b'\n'))
            .build();
        Self {
            separator,
            csv,
            tidy: Vec::new(),
            text: Vec::new(),
            ends: Vec::new(),
            count: 0,
        }
    }

    /// Takes a line, given without its line end; false where a quote is left open.
    pub(super) fn split(&mut self, line: &[u8]) -> bool {
        self.count = 0;
        let line = match self.separator {
            Separator::Byte(byte) if line.contains(&b'"') => {
                without_padding(line, byte, &mut self.tidy);
                &self.tidy
            }
            Separator::Byte(_) => line,
            Separator::Blanks => {
                blanks_to_tabs(line, &mut self.tidy);
                &self.tidy
            }
        };
        if line.is_empty() {
            return true;
        }
        if self.ends.len() <= line.len() {
            self.text.resize(line.len() + 1, 0);
            self.ends.resize(line.len() + 1, 0);
        }
        let (_, _, written, ended) = self.csv.read_record(line, &mut self.text, &mut self.ends);
        let (rest, ends) = (&mut self.text[written..], &mut self.ends[ended..]);
        let (result, _, _, last) = self.csv.read_record(b"\n", rest, ends);
        if result != ReadRecordResult::Record {
            self.csv.reset();
            return false;
        }
        self.count = ended + last;
        true
    }

    /// Number of fields.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Number of fields, less those at the end that are blank.
    pub(super) fn len_without_padding(&self) -> usize {
        let filled = (0..self.count).rposition(|place| !self.field(place).is_empty());
        filled.map_or(self.count.min(1), |last| last + 1)
    }

    /// A field without its quotes and the blanks around it.
    pub(super) fn field(&self, place: usize) -> &[u8] {
        let start = place.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.text[start..self.ends[place]].trim_ascii()
    }

    /// All fields.
    pub(super) fn fields(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).map(|place| self.field(place))
    }
}

/// Drops the blanks before each field: a quote opens a field only at its beginning.
fn without_padding(line: &[u8], separator: u8, tidy: &mut Vec<u8>) {
    tidy.clear();
    let mut quotes = Quotes::default();
    let mut at_start = true;
    for byte in line {
        let quoted = quotes.pass(*byte, at_start);
        if at_start && !quoted && byte.is_ascii_whitespace() && *byte != separator {
            continue;
        }
        at_start = !quoted && *byte == separator;
        tidy.push(*byte);
    }
}

/// One tab for each run of blanks outside of quotes.
fn blanks_to_tabs(line: &[u8], tidy: &mut Vec<u8>) {
    tidy.clear();
    let mut quotes = Quotes::default();
    let mut at_start = true;
    for byte in line.trim_ascii() {
        let quoted = quotes.pass(*byte, at_start);
        let blank = !quoted && byte.is_ascii_whitespace();
        if !(blank && at_start) {
            tidy.push(if blank { b'\t' } else { *byte });
        }
        at_start = blank;
    }
}

/// Follows the quotes along a line.
#[derive(Default)]
struct Quotes {
    open: bool,
    /// The last byte closed a quote; another one right after it is a quote in the text.
    closed: bool,
}

impl Quotes {
    /// Whether the byte belongs to a quoted field.
    fn pass(&mut self, byte: u8, at_start: bool) -> bool {
        let quote = byte == b'"' && (self.open || self.closed || at_start);
        let inside = self.open || quote;
        self.closed = quote && self.open;
        self.open ^= quote;
        inside
    }
}
