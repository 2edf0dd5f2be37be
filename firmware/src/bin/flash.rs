//! `cargo run -p firmware`: builds the STM32F405's image, writes it into the chip
//! through a debug probe, and shows its log until Ctrl-C. Words behind `--` are
//! features to build it with besides: `cargo run -p firmware -- spi-dac 4khz`.

use std::env;
use std::process::{Command, ExitCode, Stdio};

const TARGET: &str = "thumbv7em-none-eabihf";
/// What cargo calls to run an image for the chip, see `.cargo/config.toml`.
const PROBE_RS: &str = "probe-rs";
/// The linker that puts the stack below the variables: one that grows too far
/// then faults instead of overwriting them.
const FLIP_LINK: &str = "flip-link";
const LINKER: &str = "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER";

fn main() -> ExitCode {
    match flash() {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("firmware: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn flash() -> Result<(), String> {
    if !is_installed(PROBE_RS) {
        return Err(format!(
            "{PROBE_RS}, which writes the image into the chip, is not installed.\n\
             Install it: cargo install probe-rs-tools --locked\n\
             (Debian needs libudev-dev and pkg-config for that), give your user access to the \
             probe (its udev rules), connect probe and board, and run this again.\n\
             Without a probe: `cargo xtask image` makes files for USB and other tools."
        ));
    }
    let mut cargo = cargo();
    let status = cargo
        .status()
        .map_err(|error| format!("cargo did not start: {error}"))?;
    if status.success() {
        return Ok(());
    }
    Err(format!(
        "flashing failed ({status}). `{PROBE_RS} list` shows the probes that it sees."
    ))
}

/// The build of the image; its runner flashes.
fn cargo() -> Command {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["run", "-p", "firmware", "--bin", "firmware"])
        .args(["--features", &features(), "--profile", "chip"])
        .args(["--target", TARGET])
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    if is_installed(FLIP_LINK) {
        cargo.env(LINKER, FLIP_LINK);
    } else {
        eprintln!(
            "firmware: {FLIP_LINK} is not installed: the stack is not guarded. \
             Install it: cargo install flip-link"
        );
    }
    cargo
}

fn features() -> String {
    let chosen = env::args().skip(1);
    let features: Vec<String> = std::iter::once("stm32f405".into()).chain(chosen).collect();
    features.join(",")
}

fn is_installed(program: &str) -> bool {
    let mut probe = Command::new(program);
    let probe = probe.arg("--version").stdin(Stdio::null());
    probe
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok()
}
