//! The archive of a unit, and the library of this system in it.
#![expect(unsafe_code, reason = "a library of others is loaded")]

use crate::UnitError;
use crate::description::Standard;
use libloading::Library;
use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use zip::ZipArchive;

/// More than that is some other archive.
const MOST_BYTES: u64 = 1 << 30;

/// An archive in a folder of its own, for as long as this lives.
pub(crate) struct Extracted {
    folder: TempDir,
}

impl Extracted {
    pub(crate) fn of(path: &Path) -> Result<Self, UnitError> {
        let archive = |cause: &dyn std::fmt::Display| UnitError::Archive(cause.to_string());
        let file = File::open(path).map_err(|cause| archive(&cause))?;
        let mut zip = ZipArchive::new(file).map_err(|cause| archive(&cause))?;
        let bytes = zip.decompressed_size().unwrap_or(0);
        if bytes > u128::from(MOST_BYTES) {
            return Err(archive(&format!(
                "its archive holds {bytes} bytes, expected 1 GiB at most"
            )));
        }
        let folder = tempfile::tempdir().map_err(|cause| archive(&cause))?;
        // Names that lead out of the folder are refused.
        zip.extract(folder.path())
            .map_err(|cause| archive(&cause))?;
        Ok(Self { folder })
    }

    pub(crate) fn description(&self) -> Result<String, UnitError> {
        let path = self.folder.path().join("modelDescription.xml");
        fs::read_to_string(path)
            .map_err(|cause| UnitError::Archive(format!("modelDescription.xml: {cause}")))
    }

    pub(crate) fn resources(&self) -> PathBuf {
        self.folder.path().join("resources")
    }

    /// The library, loaded.
    pub(crate) fn library(&self, standard: Standard, model: &str) -> Result<Library, UnitError> {
        let place = format!("binaries/{}/{model}{DLL_SUFFIX}", folder_name(standard));
        let path = self.folder.path().join(&place);
        if !path.is_file() {
            return Err(UnitError::Library(format!(
                "{place}: is not there: the unit was not made for this system"
            )));
        }
        // SAFETY: what a library does when it is loaded is its author's; whoever names a unit
        // asks for it.
        let loaded = unsafe { Library::new(path) };
        loaded.map_err(|cause| UnitError::Library(format!("{place}: cannot be loaded: {cause}")))
    }
}

/// Where the library of this system lies: FMI 2.0, section 2.3, and FMI 3.0, section 2.5.1.
fn folder_name(standard: Standard) -> String {
    match standard {
        Standard::Two => {
            let system = match OS {
                "macos" => "darwin",
                "windows" => "win",
                other => other,
            };
            format!("{system}{}", usize::BITS)
        }
        Standard::Three => {
            let system = if OS == "macos" { "darwin" } else { OS };
            format!("{ARCH}-{system}")
        }
    }
}

/// A function of a library by its name.
///
/// # Safety
/// `F` must be the type that the standard's header gives the function.
pub(crate) unsafe fn function<F: Copy>(
    library: &Library,
    name: &'static str,
) -> Result<F, UnitError> {
    // SAFETY: the caller answers for the type.
    let symbol = unsafe { library.get::<F>(name.as_bytes()) };
    let symbol = symbol.map_err(|_| UnitError::Library(format!("its library has no {name}")))?;
    Ok(*symbol)
}
