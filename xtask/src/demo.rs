//! The demonstration: the firmware in QEMU tracks a motion, its own recording is
//! diagnosed, and then the gas spring.

use crate::setup;
use crate::shell::{self, Outcome, cargo};
use std::fs;

/// Where everything lands.
const FOLDER: &str = "out/demo";
/// Length of the firmware's recording, s: moves and the first sines. The model is
/// taught by the first half and judged by the second.
const SECONDS: &str = "16";
const RIG: &str = "host-sim/rigs/paper.toml";

/// The task `demo`. The program prints the path of its report last.
pub fn run() -> Outcome {
    setup::prepare();
    fs::create_dir_all(FOLDER).map_err(|error| format!("{FOLDER}: {error}"))?;
    let recording = format!("{FOLDER}/firmware.csv");
    let page = |name: &str| format!("{FOLDER}/{name}.html");

    println!(
        "\nThe firmware in QEMU moves the simulated axis; tick by tick, so this takes a while.\n"
    );
    let loop_page = page("firmware");
    let motion = ["loop", "--qemu", "--rig", RIG, "--seconds", SECONDS];
    pneuma(&[&motion[..], &["--out", &recording, "--report", &loop_page]].concat())?;

    println!("\nIts own recording, asked what the rig file leaves out.\n");
    let (train, held_out) = (format!("{recording}@0..8"), format!("{recording}@8..16"));
    let diagnosis_page = page("firmware-diagnosis");
    let question = [
        "diagnose",
        "--rig",
        RIG,
        "--train",
        &train,
        "--held-out",
        &held_out,
    ];
    pneuma(&[&question[..], &["--report", &diagnosis_page]].concat())?;

    println!("\nA gas spring that others measured.\n");
    pneuma(&["demo", "--out", FOLDER])
}

fn pneuma(arguments: &[&str]) -> Outcome {
    let mut run = vec!["run", "--release", "-p", "host-sim", "--bin", "pneuma"];
    if !shell::is_watched() {
        run.push("--quiet");
    }
    run.push("--");
    shell::run(&mut cargo(&[&run[..], arguments].concat()))
}
