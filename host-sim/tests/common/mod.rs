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
    // Continuous integration has them beside the workspace: there it is a failure.
    assert!(
        std::env::var_os("CI").is_none(),
        "{test}: no recordings at {}",
        folder.display()
    );
    eprintln!(
        "SKIPPED {test}: no recordings at {}; set PNEUMA_RECORDINGS",
        folder.display()
    );
    None
}

/// A rig file of this crate.
#[allow(dead_code, reason = "not every test needs one")]
pub fn rig_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("rigs")
        .join(name)
}

/// The situations from the field beside the recordings, or `None` with a loud line.
#[allow(dead_code, reason = "not every test needs them")]
pub fn cases(test: &str) -> Option<PathBuf> {
    let folder = recordings(test)?.join("../cases");
    assert!(
        folder.join("README.md").is_file(),
        "{test}: recordings without cases at {}",
        folder.display()
    );
    Some(folder)
}
