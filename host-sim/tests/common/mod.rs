//! Where the tests find the recordings.

use std::path::{Path, PathBuf};

/// The recordings, or `None` with a loud line: `PNEUMA_RECORDINGS`, or
/// `../shared/recordings` beside the workspace.
pub fn recordings(test: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let folder = std::env::var_os("PNEUMA_RECORDINGS").map_or(beside, PathBuf::from);
    if folder.join("README.md").is_file() {
        return Some(folder);
    }
    eprintln!(
        "SKIPPED {test}: no recordings at {}; set PNEUMA_RECORDINGS",
        folder.display()
    );
    None
}

/// A rig file of this crate.
pub fn rig_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("rigs")
        .join(name)
}
