//! Settings as bytes.
//!
//! | bytes | field |
//! |---|---|
//! | 0..4 | magic, `PNMA` |
//! | 4..6 | version, u16 |
//! | 6..8 | length of the content, u16 |
//! | 8..12 | sequence number, u32 |
//! | 12..16 | CRC-32 of bytes 0..12 and the content, u32 |
//! | 16.. | content: [`Settings`] in postcard's encoding |
//!
//! All little-endian. The version changes with every change of [`Settings`]: a
//! record of another version is refused, not guessed at.

use super::parameters::Settings;
use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec;

/// The version written and read.
pub const VERSION: u16 = 13;
/// The longest content: with full tables it is 1145 bytes.
pub const LONGEST_CONTENT: usize = 1148;
/// Bytes before the content.
pub const HEADER_BYTES: usize = 16;
/// The longest record.
pub const LONGEST_RECORD: usize = HEADER_BYTES + LONGEST_CONTENT;

const MAGIC: [u8; 4] = *b"PNMA";
/// Where the CRC stands; it covers what is before it and the content.
const CRC_AT: usize = 12;
/// What flash reads as after it is erased.
pub const ERASED: u8 = 0xFF;
/// The one CRC-32 of the board.
pub(crate) const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The content of a record.
pub type Content = Vec<u8, LONGEST_CONTENT>;

/// A whole record.
pub type Record = Vec<u8, LONGEST_RECORD>;

/// Why bytes are no settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordFault {
    /// Nothing was ever written there.
    Blank,
    /// They do not begin as a record does.
    NotARecord,
    /// Written by another version of the firmware.
    Version(u16),
    /// Shorter than the record says that it is, or longer than any is.
    Length(u16),
    /// The CRC does not hold: damaged, or cut off by a loss of power.
    Crc,
    /// The CRC holds but the content is none.
    Content,
}

impl fmt::Display for RecordFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Blank => write!(out, "blank: nothing was ever written there"),
            Self::NotARecord => write!(out, "no settings record: it does not begin with PNMA"),
            Self::Version(found) => write!(
                out,
                "a settings record of version {found}, expected {VERSION}: write it anew from the rig"
            ),
            Self::Length(length) => write!(
                out,
                "cut off, or no settings record: it says that it holds {length} bytes"
            ),
            Self::Crc => write!(out, "damaged: the CRC does not hold"),
            Self::Content => write!(out, "the CRC holds, but the content is no settings"),
        }
    }
}

/// A record that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// Number of the writing; the highest is the newest.
    pub sequence: u32,
    /// What it holds.
    pub settings: Settings,
}

/// CRC-32 of a content, as the transfer announces it.
pub fn content_crc(content: &[u8]) -> u32 {
    CRC.checksum(content)
}

/// Settings as the content of a record.
pub fn encode_content(settings: &Settings) -> Option<Content> {
    let mut content = Content::new();
    content.resize(LONGEST_CONTENT, 0).ok()?;
    let length = postcard::to_slice(settings, &mut content).ok()?.len();
    content.truncate(length);
    Some(content)
}

/// The settings of a content, all of which must be used up.
pub fn decode_content(content: &[u8]) -> Option<Settings> {
    let (settings, rest) = postcard::take_from_bytes(content).ok()?;
    rest.is_empty().then_some(settings)
}

/// Settings as a record; `None` only if the content outgrew
/// [`LONGEST_CONTENT`], which a test rules out.
pub fn encode(sequence: u32, settings: &Settings) -> Option<Record> {
    let content = encode_content(settings)?;
    let mut record = Record::new();
    record
        .extend_from_slice(&header(sequence, &content)?)
        .ok()?;
    record.extend_from_slice(&content).ok()?;
    Some(record)
}

/// The header of a content, what comes before it in a record.
pub fn header(sequence: u32, content: &[u8]) -> Option<[u8; HEADER_BYTES]> {
    let length = u16::try_from(content.len()).ok()?;
    let mut header: Vec<u8, HEADER_BYTES> = Vec::new();
    header.extend_from_slice(&MAGIC).ok()?;
    header.extend_from_slice(&VERSION.to_le_bytes()).ok()?;
    header.extend_from_slice(&length.to_le_bytes()).ok()?;
    header.extend_from_slice(&sequence.to_le_bytes()).ok()?;
    let crc = record_crc(&header, content);
    header.extend_from_slice(&crc.to_le_bytes()).ok()?;
    header.into_array().ok()
}

/// The sequence number of what looks like a record, sound or not.
pub fn sequence_of(bytes: &[u8]) -> Option<u32> {
    let (header, _) = bytes.split_first_chunk::<HEADER_BYTES>()?;
    let [m0, m1, m2, m3, _, _, _, _, s0, s1, s2, s3, ..] = *header;
    ([m0, m1, m2, m3] == MAGIC).then(|| u32::from_le_bytes([s0, s1, s2, s3]))
}

/// The record at the beginning of `bytes`; what comes after it does not matter.
pub fn decode(bytes: &[u8]) -> Result<Stored, RecordFault> {
    let (header, rest) = bytes
        .split_first_chunk::<HEADER_BYTES>()
        .ok_or(RecordFault::NotARecord)?;
    if header.iter().all(|byte| *byte == ERASED) {
        return Err(RecordFault::Blank);
    }
    let [
        m0,
        m1,
        m2,
        m3,
        v0,
        v1,
        l0,
        l1,
        s0,
        s1,
        s2,
        s3,
        c0,
        c1,
        c2,
        c3,
    ] = *header;
    if [m0, m1, m2, m3] != MAGIC {
        return Err(RecordFault::NotARecord);
    }
    let version = u16::from_le_bytes([v0, v1]);
    if version != VERSION {
        return Err(RecordFault::Version(version));
    }
    let length = u16::from_le_bytes([l0, l1]);
    let content = rest
        .get(..usize::from(length))
        .filter(|content| content.len() <= LONGEST_CONTENT)
        .ok_or(RecordFault::Length(length))?;
    let (covered, _) = header.split_at(CRC_AT);
    if record_crc(covered, content) != u32::from_le_bytes([c0, c1, c2, c3]) {
        return Err(RecordFault::Crc);
    }
    Ok(Stored {
        sequence: u32::from_le_bytes([s0, s1, s2, s3]),
        settings: decode_content(content).ok_or(RecordFault::Content)?,
    })
}

fn record_crc(header: &[u8], content: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(header);
    digest.update(content);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{full_settings, random_settings};
    use super::*;

    #[test]
    fn val_crc_of_the_catalogue_s_check_string() {
        // CRC-32/ISO-HDLC of "123456789", RevEng catalogue.
        assert_eq!(content_crc(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn prop_a_record_comes_back_to_the_bit() {
        for seed in 0..200 {
            let settings = random_settings(seed);
            let record = encode(seed, &settings).expect("it fits");
            let stored = decode(&record).expect("it is sound");
            assert_eq!(stored.sequence, seed);
            assert_eq!(stored.settings, settings);
            let again = encode(seed, &stored.settings).expect("it fits");
            assert_eq!(again, record);
        }
    }

    #[test]
    fn prop_full_tables_fit() {
        let content = encode_content(&full_settings()).expect("it fits");
        assert!((600..=LONGEST_CONTENT).contains(&content.len()));
    }

    #[test]
    fn prop_every_flipped_bit_is_noticed() {
        let record = encode(7, &Settings::built_in()).expect("it fits");
        for place in 0..record.len() {
            for bit in 0..8 {
                let mut damaged = record.clone();
                damaged[place] ^= 1 << bit;
                assert!(decode(&damaged).is_err(), "byte {place} bit {bit}");
            }
        }
    }

    #[test]
    fn prop_a_record_cut_off_anywhere_is_refused() {
        let record = encode(7, &Settings::built_in()).expect("it fits");
        for length in 0..record.len() {
            assert!(decode(&record[..length]).is_err());
            let mut cut: std::vec::Vec<u8> = record[..length].to_vec();
            cut.resize(2048, ERASED);
            assert!(decode(&cut).is_err(), "{length} bytes and blank");
        }
        assert_eq!(decode(&[ERASED; 2048]), Err(RecordFault::Blank));
        assert_eq!(decode(&[0; 2048]), Err(RecordFault::NotARecord));
    }

    #[test]
    fn prop_another_version_is_refused_by_its_number() {
        let mut record = encode(7, &Settings::built_in()).expect("it fits");
        let other = VERSION + 1;
        record[4..6].copy_from_slice(&other.to_le_bytes());
        assert_eq!(decode(&record), Err(RecordFault::Version(other)));
    }
}
