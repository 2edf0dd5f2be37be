//! The emulator's Python packages, and where it lies.

use crate::shell::{self, Failure, Outcome, command};
use std::path::PathBuf;

/// Where the emulator's Python packages are kept.
fn environment() -> PathBuf {
    shell::target_directory().join("emulator")
}

/// Where its programs lie.
pub fn folder() -> PathBuf {
    shell::root().join("tests/emulator")
}

/// Its Python.
pub fn python() -> PathBuf {
    environment().join("bin/python")
}

/// The emulator is there, or is made: Python's packages in a folder of their own.
///
/// # Errors
/// Where Python or a package is missing and cannot be had.
pub fn need_emulator() -> Outcome {
    if is_there() {
        return Ok(());
    }
    make().map_err(|failure| {
        let advice = "the emulator, which runs the board's image for `cargo xtask emulate` and its \
                      tests, needs python3 with venv (Debian: python3-venv) and, with a network, the \
                      package `unicorn` from PyPI. Everything else works without it.";
        Failure::from(format!("{failure}\n{advice}"))
    })
}

/// Whether the emulator's packages can be imported.
pub fn is_there() -> bool {
    shell::succeeds(&mut command(python(), &["-c", "import unicorn"]))
}

fn make() -> Outcome {
    let place = environment();
    println!("setup: emulator: packages into {}", place.display());
    let mut venv = command("python3", &["-m", "venv"]);
    shell::run(venv.arg(&place))?;
    let mut packages = command(python(), &["-m", "pip", "install", "--quiet", "-r"]);
    shell::run(packages.arg(folder().join("requirements.txt")))
}
