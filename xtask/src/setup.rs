//! What must be installed, and how it gets there. Safe to repeat; quick when all is there.

use crate::apt;
use crate::chip::{self, CoreForChip, TARGET};
use crate::packages::{EMULATOR, PYTHON, Packages};
use crate::shell::{self, Outcome, cargo, command};

/// QEMU for Arm: the program and Debian's package have one name.
pub const QEMU: &str = "qemu-system-arm";

/// The task `setup`: fails if anything is missing.
pub fn run() -> Outcome {
    let missing = prepare();
    if missing.is_empty() {
        println!("setup: complete");
        return Ok(());
    }
    Err(format!("setup is not complete\n\n{}", missing.join("\n\n")).into())
}

/// Find or install; what is missing afterwards is told, one paragraph each with what
/// to do about it, and does not keep a task from running that can do without.
pub fn prepare() -> Vec<String> {
    let mut missing = Vec::new();
    for (component, probe) in [("rustfmt", "fmt"), ("clippy", "clippy")] {
        missing.extend(prepare_component(component, probe));
    }
    if prepare_core().is_none() {
        missing.push(advice_for_core());
    }
    missing.extend(prepare_qemu());
    missing.extend([EMULATOR, PYTHON].iter().filter_map(prepare_packages));
    for paragraph in &missing {
        println!("setup: MISSING: {paragraph}");
    }
    missing
}

/// `Some` advice if the component is neither there nor could be added.
fn prepare_component(component: &str, probe: &str) -> Option<String> {
    let is_there = || shell::succeeds(&mut cargo(&[probe, "--version"]));
    if is_there() {
        println!("setup: {component}: found");
        return None;
    }
    println!("setup: {component}: missing, asking rustup");
    let added = rustup(&["component", "add", component]) && is_there();
    (!added).then(|| {
        format!(
            "{component}, for `cargo xtask ci`. With a network: `rustup component add \
             {component}`; without rustup, the package of your system (Debian: `{component}`). \
             `cargo xtask test` runs without it."
        )
    })
}

/// `Some` advice if QEMU is neither there nor could be installed.
fn prepare_qemu() -> Option<String> {
    if has_qemu() {
        println!("setup: {QEMU}: found");
        return None;
    }
    println!("setup: {QEMU}: missing, asking Debian");
    let installed = apt::install(&[QEMU], &[]) && has_qemu();
    (!installed).then(|| {
        format!(
            "{QEMU}, which runs the firmware for `cargo xtask qemu`, `cargo xtask size` and the \
             tests of both. With a network, on Debian: `{}`. Everything else works without it.",
            apt::install_line(&[QEMU])
        )
    })
}

/// `Some` advice if a set of Python's packages could not be installed.
fn prepare_packages(packages: &Packages) -> Option<String> {
    let name = packages.name;
    if packages.are_there() {
        println!("setup: {name}: found");
        return None;
    }
    println!("setup: {name}: missing, asking PyPI");
    packages.need().err().map(|failure| failure.to_string())
}

/// Whether QEMU for Arm can be started.
pub fn has_qemu() -> bool {
    shell::succeeds(&mut command(QEMU, &["--version"]))
}

/// What is there comes first: asking rustup without a network can take long.
pub fn prepare_core() -> Option<CoreForChip> {
    if !chip::is_fallback_forced() {
        if chip::toolchain_has_core() {
            println!("setup: core for {TARGET}: found");
            return Some(CoreForChip::Toolchain);
        }
        if let Some(debian) = chip::find_debian() {
            println!("setup: core for {TARGET}: to be built from Debian's sources, found");
            return Some(debian);
        }
        println!("setup: core for {TARGET}: missing, asking rustup");
        if rustup(&["target", "add", TARGET]) && chip::toolchain_has_core() {
            return Some(CoreForChip::Toolchain);
        }
    }
    println!("setup: core for {TARGET}: to be built from Debian's sources");
    chip::find_debian().or_else(chip::install_debian)
}

/// Whether rustup could do it; says why not.
fn rustup(arguments: &[&str]) -> bool {
    let mut rustup = command("rustup", arguments);
    if !shell::is_watched() {
        rustup.env("RUSTUP_TERM_PROGRESS_WHEN", "never");
    }
    let outcome = shell::run(&mut rustup);
    if let Err(failure) = &outcome {
        println!("setup: {failure}");
    }
    outcome.is_ok()
}

/// What to do about a missing library `core`.
pub fn advice_for_core() -> String {
    format!(
        "the library `core` for {TARGET}, for everything that builds an image of the firmware. With a \
         network: `rustup target add {TARGET}`, or on Debian `{}`, then `cargo xtask setup` \
         again. Everything for the host works without it.",
        chip::debian_install_line()
    )
}
