//! The file `.fmu`: a ZIP archive of description, library and resources.

use super::kind::Kind;
use super::variables::variables;
use super::{KIND_FILE, LIBRARY, RIG_FILE, Standard, model_description, token};
use crate::model::AxisFault;
use crate::rig::Rig;
use object::read::File;
use object::{Architecture, BinaryFormat, Object};
use std::io::{Cursor, Write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Why there is no archive.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// The rig makes no unit.
    #[error("{}: {}, expected {}", .0.key, .0.problem, .0.expected)]
    Rig(AxisFault),
    /// The library is none for which the standard has a folder.
    #[error(
        "is no shared library for x86-64 or AArch64 of Linux or Windows, expected the library \
         that `cargo build --release -p fmu` makes"
    )]
    Library,
    /// The archive cannot be written.
    #[error("the archive cannot be made: {0}")]
    Zip(#[from] zip::result::ZipError),
    /// A part of it cannot be written.
    #[error("the archive cannot be made: {0}")]
    Io(#[from] std::io::Error),
}

/// The archive of a unit: the bytes of the file.
///
/// # Errors
/// Where the rig lacks what the unit needs, and where the library is none.
pub fn pack(
    standard: Standard,
    kind: Kind,
    rig: &Rig,
    library: &[u8],
) -> Result<Vec<u8>, ArchiveError> {
    let place = folder(standard, library).ok_or(ArchiveError::Library)?;
    let variables = variables(kind, rig).map_err(ArchiveError::Rig)?;
    let token = token(kind, rig);
    let description = model_description(standard, (kind, &token), &variables)?;
    let rig_text = rig.to_toml();
    let files: [(String, &[u8]); 4] = [
        ("modelDescription.xml".into(), description.as_bytes()),
        (format!("binaries/{place}"), library),
        (format!("resources/{RIG_FILE}"), rig_text.as_bytes()),
        (format!("resources/{KIND_FILE}"), kind.name().as_bytes()),
    ];
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // No time of day: the same inputs give the same bytes.
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    for (name, bytes) in files {
        archive.start_file(name, options)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Where a library lies below `binaries`: FMI 2.0, section 2.3, and FMI 3.0, section 2.5.1.
fn folder(standard: Standard, library: &[u8]) -> Option<String> {
    let file = File::parse(library).ok()?;
    let (system_2, system_3, ending) = match file.format() {
        BinaryFormat::Elf => ("linux", "linux", "so"),
        BinaryFormat::Pe => ("win", "windows", "dll"),
        _ => return None,
    };
    let folder = match (standard, file.architecture()) {
        (Standard::Two, Architecture::X86_64) => format!("{system_2}64"),
        (Standard::Three, Architecture::X86_64) => format!("x86_64-{system_3}"),
        (Standard::Three, Architecture::Aarch64) => format!("aarch64-{system_3}"),
        // FMI 2.0 has no folder for other processors.
        _ => return None,
    };
    Some(format!("{folder}/{LIBRARY}.{ending}"))
}
