//! The flash image of the board, executed on modelled registers: `tests/emulator`.

use crate::image;
use crate::packages::EMULATOR;
use crate::shell::{self, Outcome, command};
use std::path::Path;
use std::process::Command;

/// The task `emulate`; options are those of `tests/emulator/emulate.py`.
pub fn run(options: &[String]) -> Outcome {
    EMULATOR.need()?;
    let image = image::build(image::STM32F405)?;
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    shell::run(&mut emulation(&image, &options))
}

/// Runs an image with these options.
pub fn emulation(image: &Path, options: &[&str]) -> Command {
    let program = shell::root().join("tests/emulator/emulate.py");
    let mut emulation = command(EMULATOR.python(), &[]);
    emulation.arg(program).arg(image);
    emulation.args(options);
    emulation
}
