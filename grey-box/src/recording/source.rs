//! Where the text of a recording comes from: packed with gzip or plain, in UTF-16 or in a
//! superset of ASCII (UTF-8, Latin-1), or out of a file of another program ([`data_files`]). A
//! source is read once, from its front to its end, so a pipe serves as well as a file.
//!
//! Limits: what a file is shows in its first [`PEEKED_BYTES`]; UTF-16 without a byte order mark
//! is recognised where it begins with ASCII characters.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

use data_files::{Between, Contents, Kind, MAXIMUM_BYTES, Problem, Wanted};
use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};
use encoding_rs_io::DecodeReaderBytesBuilder;
use flate2::bufread::MultiGzDecoder;

use super::RecordingError;
use super::error::{TABLE, error};
use crate::rig::{Column, Signals};

/// Read-ahead; larger blocks no longer help.
pub(super) const BUFFER_BYTES: usize = 1 << 18;
/// Enough for the longest of [`FOREIGN`] and to tell UTF-16.
const PEEKED_BYTES: u64 = 64;
/// The beginning of a gzip file, RFC 1952.
const GZIP: &[u8] = b"\x1f\x8b";

/// Files that nothing here reads: how they begin, what they are.
const FOREIGN: &[(&[u8], &str)] = &[
    (b"#ROSBAG", "a bag file of ROS 1"),
    (
        b"SQLite format 3",
        "an SQLite database (a bag file of ROS 2?)",
    ),
    (b"FEA1", "a Feather file of version 1"),
    (b"\x93NUMPY", "an array of NumPy"),
    (b"CDF\x01", "a netCDF file of version 3"),
    (b"CDF\x02", "a netCDF file of version 3"),
    (b"UnFinMF", "an MDF file that was never finished"),
    (b"TDSh", "the index of a TDMS file, which stands beside it"),
    (b"BZh", "packed with bzip2"),
    (b"\xfd7zXZ", "packed with xz"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd"),
];

/// A path that means standard input.
const STANDARD_INPUT: &str = "-";

/// An open file or standard input.
pub(super) struct Source {
    pub reader: Box<dyn BufRead>,
    pub name: String,
    /// Size of a file, bytes.
    pub size: Option<u64>,
}

impl Source {
    pub(super) fn open(path: &Path) -> Result<Self, RecordingError> {
        if path.as_os_str() == STANDARD_INPUT {
            return Ok(Self {
                reader: Box::new(BufReader::with_capacity(BUFFER_BYTES, io::stdin())),
                name: "standard input".into(),
                size: None,
            });
        }
        let name = path.display().to_string();
        let cannot =
            |cause: io::Error| error(&name, None, format!("cannot be read: {cause}"), TABLE);
        let metadata = fs::metadata(path).map_err(cannot)?;
        if metadata.is_dir() {
            return Err(error(&name, None, "is a directory", TABLE));
        }
        let file = File::open(path).map_err(cannot)?;
        Ok(Self {
            reader: Box::new(BufReader::with_capacity(BUFFER_BYTES, file)),
            size: metadata.is_file().then_some(metadata.len()),
            name,
        })
    }
}

/// The text of a source.
pub(super) struct Text<'s> {
    pub reader: Box<dyn BufRead + 's>,
    /// The text is as long as the source, so that its size tells the number of rows.
    pub same_size: bool,
    /// What was decided on the way to it.
    pub remarks: Vec<String>,
}

impl<'s> Text<'s> {
    fn plain(reader: impl BufRead + 's) -> Self {
        Self {
            reader: Box::new(reader),
            same_size: false,
            remarks: Vec::new(),
        }
    }

    /// The text of a source, or that of the columns that the rig names in another program's file.
    pub(super) fn of(
        source: impl BufRead + 's,
        name: &str,
        signals: &Signals,
    ) -> Result<Self, RecordingError> {
        match Opened::of(source, name)? {
            Opened::Text(text) => Ok(text),
            Opened::DataFile(contents) => {
                let text = with_columns(contents, signals);
                text.map_err(|cause| error(name, None, cause.problem, cause.expected))
            }
        }
    }
}

impl From<data_files::Text> for Text<'_> {
    fn from(text: data_files::Text) -> Self {
        Self {
            remarks: text.remarks,
            ..Self::plain(BufReader::with_capacity(BUFFER_BYTES, text.reader))
        }
    }
}

/// A source, unpacked and decoded.
pub(super) enum Opened<'s> {
    Text(Text<'s>),
    /// A file of another program.
    DataFile(Contents),
}

impl<'s> Opened<'s> {
    /// Looks at the first bytes and unpacks and decodes what follows.
    pub(super) fn of(source: impl BufRead + 's, name: &str) -> Result<Self, RecordingError> {
        let (start, source) = peeked(source);
        if !start.starts_with(GZIP) {
            return decoded(&start, source, true, name);
        }
        let unpacked = BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(source));
        let (start, source) = peeked(unpacked);
        decoded(&start, source, false, name)
    }
}

fn decoded<'s>(
    start: &[u8],
    source: impl BufRead + 's,
    same_size: bool,
    name: &str,
) -> Result<Opened<'s>, RecordingError> {
    let refused = |problem: String, expected: String| error(name, None, problem, expected);
    if let Some(kind) = Kind::of(start) {
        let expected = format!("a whole file of at most {} GiB", MAXIMUM_BYTES >> 30);
        let bytes = whole(source).map_err(|problem| refused(problem, expected))?;
        let contents = data_files::read(kind, &bytes);
        let contents = contents.map_err(|cause| refused(cause.problem, cause.expected))?;
        return Ok(Opened::DataFile(contents));
    }
    if let Some((_, what)) = FOREIGN.iter().find(|(magic, _)| start.starts_with(magic)) {
        let expected = format!("{TABLE}; export it as CSV");
        return Err(refused(format!("is {what}"), expected));
    }
    Ok(Opened::Text(match utf_16(start) {
        None => Text {
            same_size,
            ..Text::plain(source)
        },
        Some(encoding) => {
            let utf_8 = DecodeReaderBytesBuilder::new()
                .encoding(Some(encoding))
                .build(source);
            Text::plain(BufReader::with_capacity(BUFFER_BYTES, utf_8))
        }
    }))
}

/// The columns that the rig names as text.
fn with_columns<'s>(contents: Contents, signals: &Signals) -> Result<Text<'s>, Problem> {
    let names = columns(signals);
    let time = names.iter().find(|(signal, _)| *signal == "t");
    let others = names.iter().filter(|(signal, _)| *signal != "t");
    let wanted: Vec<Wanted<'_>> = others
        .map(|(signal, name)| Wanted {
            name,
            between: between(signal),
        })
        .collect();
    let text = contents.into_text(time.map(|(_, name)| *name), &wanted)?;
    Ok(text.into())
}

/// All bytes of a source.
fn whole(source: impl BufRead) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let read = source.take(MAXIMUM_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|cause| format!("cannot be read: {cause}"))?;
    if bytes.len() as u64 > MAXIMUM_BYTES {
        return Err("is too large".into());
    }
    Ok(bytes)
}

/// The columns that have a name, by signal.
fn columns(signals: &Signals) -> Vec<(&str, &str)> {
    let named = signals
        .iter()
        .filter_map(|(signal, facts)| match &facts.column {
            Column::Name(name) => Some((signal, name.trim())),
            _ => None,
        });
    named.collect()
}

/// What a signal is between two of its rows, where it is put on the rows of others.
fn between(signal: &str) -> Between {
    match signal {
        "u" => Between::Held,
        "x" | "x_ref" | "v" => Between::Line,
        temperature if temperature.starts_with("temperature_") => Between::Line,
        _ => Between::Nothing,
    }
}

/// The first bytes, and the source as if they had not been taken. A fault of the source comes
/// again when its lines are read, and is told there.
fn peeked<'s>(mut source: impl BufRead + 's) -> (Vec<u8>, impl BufRead + 's) {
    let mut start = Vec::new();
    let _ = source.by_ref().take(PEEKED_BYTES).read_to_end(&mut start);
    (start.clone(), Cursor::new(start).chain(source))
}

/// UTF-16, told by its byte order mark or by the zeros of its first two characters.
fn utf_16(start: &[u8]) -> Option<&'static Encoding> {
    match *start {
        [0xff, 0xfe, ..] => Some(UTF_16LE),
        [0xfe, 0xff, ..] => Some(UTF_16BE),
        [1..=0x7f, 0, 1..=0x7f, 0, ..] => Some(UTF_16LE),
        [0, 1..=0x7f, 0, 1..=0x7f, ..] => Some(UTF_16BE),
        _ => None,
    }
}
