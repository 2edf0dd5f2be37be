//! Files of other programs as tables of text: workbooks, MATLAB, HDF5, MDF, TDMS, Parquet, Arrow, MCAP.
//!
//! [`Kind::of`] tells a file by its first bytes; [`read`] reads it whole, by a library of that
//! format, to tables ([`Group`]) or sheets; [`Contents::into_text`] picks the columns that are asked
//! for and gives them as the text of one table, which is then read as any text table is: one set of
//! rules on units, times, missing values and repeated rows for all formats. Numbers are written so
//! that reading gives the same bits.
//!
//! Responsibilities: what a format's file holds, and which of its tables. Not: what a column means.
//!
//! * `workbook`, `matlab`, `hdf5`, `columnar` (Parquet, Arrow), `mdf`, `tdms`, `mcap_file`: a format each.
//! * `protobuf`, `cdr`: messages of MCAP that are not JSON, as values (`values`).
//! * `groups`: tables with names, units and clocks; `asked`: which columns; `choose`: of which table;
//!   `merge`: of several rates.
//! * `apart`: reading in a process of its own; `quiet`: panics as errors.
//! * `text`: columns as the text of a table; `write`: as a file.
//!
//! Limits: a file is read whole, at most [`MAXIMUM_BYTES`].

mod apart;
mod asked;
mod cdr;
mod choose;
mod columnar;
mod groups;
mod hdf5;
mod matlab;
mod mcap_file;
mod mdf;
mod merge;
mod protobuf;
mod quiet;
mod tdms;
mod text;
mod values;
mod workbook;
mod write;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use apart::{read_apart, serve};
pub use asked::{Between, Wanted};
pub use groups::{Cells, Clock, Column, Group};
pub use text::Text;
pub use workbook::Sheet;
pub use write::{Target, write};

/// The largest file that is read: it is held in memory with its numbers.
pub const MAXIMUM_BYTES: u64 = 4 << 30;

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// xlsx, ods.
    Workbook,
    /// xls.
    OldWorkbook,
    /// MATLAB 5 to 7.
    Matlab,
    /// HDF5; MATLAB 7.3 is that.
    Hdf5,
    /// MDF 4.
    Mdf,
    /// TDMS.
    Tdms,
    /// Parquet.
    Parquet,
    /// An Arrow file, Feather 2.
    Arrow,
    /// MCAP.
    Mcap,
}

/// How files begin.
const BEGINNINGS: &[(&[u8], Kind)] = &[
    (b"PK\x03\x04", Kind::Workbook),
    (b"\xd0\xcf\x11\xe0", Kind::OldWorkbook),
    (b"MATLAB 5.0", Kind::Matlab),
    (b"MATLAB 7.3", Kind::Hdf5),
    (b"\x89HDF", Kind::Hdf5),
    (b"MDF  ", Kind::Mdf),
    (b"TDSm", Kind::Tdms),
    (b"PAR1", Kind::Parquet),
    (b"ARROW1", Kind::Arrow),
    (b"\x89MCAP0", Kind::Mcap),
];

impl Kind {
    /// What a file is whose first bytes these are.
    pub fn of(start: &[u8]) -> Option<Self> {
        let mut all = BEGINNINGS.iter();
        let found = all.find(|(beginning, _)| start.starts_with(beginning));
        found.map(|(_, kind)| *kind)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Workbook => "workbook",
            Self::OldWorkbook => "old Excel workbook",
            Self::Matlab => "MATLAB file",
            Self::Hdf5 => "HDF5 or MATLAB 7.3 file",
            Self::Mdf => "MDF file",
            Self::Tdms => "TDMS file",
            Self::Parquet => "Parquet file",
            Self::Arrow => "Arrow file",
            Self::Mcap => "MCAP file",
        })
    }
}

/// Why a file is not read: what is wrong, and what was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What is wrong.
    pub problem: String,
    /// What was expected.
    pub expected: String,
}

impl Problem {
    pub(crate) fn new(problem: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            problem: problem.into(),
            expected: expected.into(),
        }
    }
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Contents {
    /// The sheets of a workbook, cells as text.
    Sheets(Vec<Sheet>),
    /// Tables of columns.
    Groups(Vec<Group>),
}

/// What a file holds, or why it is not read.
type Outcome = Result<Contents, String>;

/// Reads a file of a kind.
///
/// # Errors
/// Where it is damaged, or holds what is not read.
pub fn read(kind: Kind, bytes: &[u8]) -> Result<Contents, Problem> {
    apart::read(kind, bytes).map_err(|cause| {
        Problem::new(
            format!("cannot be read as {} {kind}: {cause}", article(kind)),
            "a whole file of that format; copy it again, or export it plainly packed or as CSV",
        )
    })
}

/// Reads a file in this process.
fn read_here(kind: Kind, bytes: &[u8]) -> Outcome {
    let contents = || {
        let tables = match kind {
            Kind::Workbook | Kind::OldWorkbook => {
                return workbook::read(bytes).map(Contents::Sheets);
            }
            Kind::Matlab => matlab::read(bytes),
            Kind::Hdf5 => hdf5::read(bytes),
            Kind::Mdf => mdf::read(bytes),
            Kind::Tdms => tdms::read(bytes),
            Kind::Parquet => columnar::parquet(bytes),
            Kind::Arrow => columnar::arrow(bytes),
            Kind::Mcap => mcap_file::read(bytes),
        };
        Ok(Contents::Groups(groups::told_apart(tables?)))
    };
    quiet::or_panics(contents).unwrap_or_else(|| Err("it is damaged".into()))
}

fn article(kind: Kind) -> &'static str {
    match kind {
        Kind::OldWorkbook | Kind::Hdf5 | Kind::Mdf | Kind::Arrow | Kind::Mcap => "an",
        _ => "a",
    }
}

impl Contents {
    /// The table that has the columns that are asked for, time first, as text.
    pub fn into_text(self, time: Option<&str>, wanted: &[Wanted<'_>]) -> Result<Text, Problem> {
        match self {
            Self::Sheets(sheets) => workbook::text(sheets, time, wanted),
            Self::Groups(groups) => choose::text(groups, time, wanted),
        }
    }
}

/// Longer causes are traces of a library's parser.
const LONGEST_CAUSE: usize = 120;

/// A cause in words, from a library's error, on one line.
fn said(cause: impl fmt::Display) -> String {
    let text = cause.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    let line = words.join(" ");
    match line.char_indices().nth(LONGEST_CAUSE) {
        Some((end, _)) => format!("{} ...", &line[..end]),
        None => line,
    }
}
