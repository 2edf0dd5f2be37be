//! Building the images that boards run.

use crate::chip::TARGET;
use crate::setup;
use crate::shell::{self, Outcome, as_typed};
use std::path::PathBuf;
use std::process::Command;

/// The machine mps2-an386 of QEMU, as the firmware's feature is named.
pub const MPS2: &str = "mps2";
/// The chip between real converters and a real valve, as the feature is named.
pub const STM32F405: &str = "stm32f405";
/// The boards that the application is built for.
pub const BOARDS: [&str; 2] = [MPS2, STM32F405];
/// What its image may be built with besides, see `firmware/Cargo.toml`.
pub const CHOICES: [&str; 4] = ["spi-dac", "2khz", "4khz", "8khz"];
/// The profile of Cargo.toml that images are built with.
const PROFILE: &str = "chip";

/// Builds a board's image and returns where it lies.
pub fn build(board: &str) -> Outcome<PathBuf> {
    build_with(board, &[])
}

/// The same with these of its choices.
pub fn build_with(board: &str, choices: &[String]) -> Outcome<PathBuf> {
    let unknown = choices.iter().find(|one| !CHOICES.contains(&one.as_str()));
    if let Some(unknown) = unknown {
        let known = CHOICES.join(", ");
        return Err(format!("image: unknown choice {unknown}, expected some of {known}").into());
    }
    let features = [&[board.to_owned()], choices].concat().join(",");
    shell::run(&mut cargo("build", board, &features)?)?;
    let directory = directory(board).join(TARGET).join(PROFILE);
    Ok(directory.join("firmware"))
}

/// Clippy over the application, which the host's clippy does not see.
pub fn clippy() -> Outcome {
    let variants = [
        (MPS2, MPS2),
        (STM32F405, STM32F405),
        (STM32F405, "stm32f405,spi-dac,8khz"),
    ];
    for (board, features) in variants {
        let mut command = cargo("clippy", board, features)?;
        command.args(["--", "-D", "warnings"]);
        println!("{}", as_typed(&command));
        shell::run(&mut command)?;
    }
    Ok(())
}

/// A directory for each board: both images have the same name.
fn directory(board: &str) -> PathBuf {
    shell::target_directory().join(board)
}

fn cargo(verb: &str, board: &str, features: &str) -> Outcome<Command> {
    let core = setup::prepare_core().ok_or_else(setup::advice_for_core)?;
    let directory = directory(board);
    let directory = directory.to_string_lossy();
    let mut words = vec![verb, "-p", "firmware", "--bin", "firmware"];
    words.extend(["--features", features, "--profile", PROFILE]);
    words.extend(["--target-dir", &directory]);
    if !shell::is_watched() {
        words.push("--quiet");
    }
    let mut command = core.cargo(&words);
    if let Some(commit) = commit() {
        command.env("PNEUMA_COMMIT", commit);
    }
    Ok(command)
}

/// First digits of the commit that is checked out; none outside of a repository.
fn commit() -> Option<String> {
    let digits = shell::output_of(&mut shell::command(
        "git",
        &["rev-parse", "--short=8", "HEAD"],
    ))?;
    Some(digits.trim().to_owned()).filter(|digits| digits.len() == 8)
}
