//! The flash image of the board, executed on modelled registers: `tests/emulator`.

use crate::image;
use crate::shell::{self, Failure, Outcome, command};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where the emulator's Python packages are kept.
fn environment() -> PathBuf {
    shell::target_directory().join("emulator")
}

fn folder() -> PathBuf {
    shell::root().join("tests/emulator")
}

fn python() -> PathBuf {
    environment().join("bin/python")
}

/// The task `emulate`; options are those of `tests/emulator/emulate.py`.
pub fn run(options: &[String]) -> Outcome {
    need_emulator()?;
    let image = image::build(image::STM32F405)?;
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    shell::run(&mut emulation(&image, &options))
}

/// Runs an image with these options.
pub fn emulation(image: &Path, options: &[&str]) -> Command {
    let mut emulation = command(python(), &[]);
    emulation.arg(folder().join("emulate.py")).arg(image);
    emulation.args(options);
    emulation
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
