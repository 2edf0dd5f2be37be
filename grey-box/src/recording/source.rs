//! Where the bytes of a recording come from: packed with gzip or plain, in UTF-16 or in a
//! superset of ASCII (UTF-8, Latin-1). A source is read once, from its front to its end, so a
//! pipe serves as well as a file.
//!
//! Limits: what a file is shows in its first [`PEEKED_BYTES`]; UTF-16 without a byte order mark
//! is recognised where it begins with ASCII characters.

use std::io::{BufRead, BufReader, Cursor, Read};

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};
use encoding_rs_io::DecodeReaderBytesBuilder;
use flate2::bufread::MultiGzDecoder;

/// Read-ahead; larger blocks no longer help.
pub(super) const BUFFER_BYTES: usize = 1 << 18;
/// Enough for the longest of [`FOREIGN`] and to tell UTF-16.
const PEEKED_BYTES: u64 = 64;
/// The beginning of a gzip file, RFC 1952.
const GZIP: &[u8] = b"\x1f\x8b";

/// Formats that are no text: how they begin, what they are.
const FOREIGN: &[(&[u8], &str)] = &[
    (b"PK\x03\x04", "an Excel workbook or another zip archive"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook"),
    (b"\x89HDF", "an HDF5 or MATLAB 7.3 file"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"TDSm", "a TDMS file of LabVIEW"),
    (b"MDF  ", "an MDF file of a measurement system"),
    (b"\x89MCAP0", "an MCAP file of ROS"),
    (b"#ROSBAG", "a bag file of ROS"),
    (b"SQLite format 3", "an SQLite database"),
    (b"PAR1", "a Parquet file"),
    (b"BZh", "packed with bzip2"),
    (b"\xfd7zXZ", "packed with xz"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd"),
];

/// The text of a source.
pub(super) struct Text<'s> {
    pub reader: Box<dyn BufRead + 's>,
    /// The text is as long as the source, so that its size tells the number of rows.
    pub same_size: bool,
}

impl<'s> Text<'s> {
    /// Looks at the first bytes and unpacks and decodes what follows; or names the format that
    /// is no text.
    pub(super) fn of(source: impl BufRead + 's) -> Result<Self, &'static str> {
        let (start, source) = peeked(source);
        if !start.starts_with(GZIP) {
            return decoded(&start, source);
        }
        let unpacked = BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(source));
        let (start, source) = peeked(unpacked);
        Ok(Self {
            same_size: false,
            ..decoded(&start, source)?
        })
    }
}

fn decoded<'s>(start: &[u8], source: impl BufRead + 's) -> Result<Text<'s>, &'static str> {
    if let Some((_, what)) = FOREIGN.iter().find(|(magic, _)| start.starts_with(magic)) {
        return Err(what);
    }
    let Some(encoding) = utf_16(start) else {
        return Ok(Text {
            reader: Box::new(source),
            same_size: true,
        });
    };
    let utf_8 = DecodeReaderBytesBuilder::new()
        .encoding(Some(encoding))
        .build(source);
    Ok(Text {
        reader: Box::new(BufReader::with_capacity(BUFFER_BYTES, utf_8)),
        same_size: false,
    })
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
