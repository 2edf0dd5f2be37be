//! The flash image of the board, executed on modelled registers: `tests/emulator`.

use crate::image;
use crate::packages::EMULATOR;
use crate::qemu::checked_settings;
use crate::shell::{self, Outcome, command};
use std::path::Path;
use std::process::Command;

/// The task `emulate`; options are those of `tests/emulator/emulate.py`, and `--unchecked` for a
/// board as delivered: without it, and without slots of one's own, its wiring was checked.
pub fn run(options: &[String]) -> Outcome {
    EMULATOR.need()?;
    let image = image::build(image::STM32F405)?;
    let mut options: Vec<&str> = options.iter().map(String::as_str).collect();
    let is_given = options.iter().any(|option| option.starts_with("--slots"));
    let all = options.len();
    options.retain(|option| *option != "--unchecked");
    let checked = checked_settings()?;
    if !is_given && options.len() == all {
        options.extend(["--slots", &checked]);
    }
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
