//! The demonstration: set-up, compiling, then `pneuma demo`. What will be done and how
//! long it takes is said before it is begun.

use crate::setup;
use crate::shell::{self, Outcome, cargo};
use crate::{image, qemu};
use std::path::Path;
use std::time::Instant;

/// Where everything lands.
const FOLDER: &str = "out/demo";
const PLAN: &str = "\
demo: the main job from end to end; everything lands in out/demo
  1/4 set-up: find QEMU and the microcontroller's library, install what is missing
  2/4 compile the program `pneuma` as a release: about four minutes on two free cores, once
  3/4 compile the firmware for QEMU: about half a minute, once
  4/4 the firmware in QEMU moves an axis that conceals a leak; its recording is diagnosed; then
      the recordings of a sealed case are: about one minute";
const STAGES: usize = 4;

/// The task `demo`. The program prints the path of its report last.
pub fn run() -> Outcome {
    println!("{PLAN}");
    stage(1, "set-up", || {
        setup::prepare();
        Ok(())
    })?;
    stage(2, "compile pneuma", || {
        let release = ["build", "--release", "-p", "host-sim", "--bin", "pneuma"];
        shell::run(&mut cargo(&release))
    })?;
    let mut is_with_firmware = true;
    stage(3, "compile the firmware", || {
        let built = qemu::need_qemu().and_then(|()| image::build(image::MPS2));
        if let Err(failure) = built {
            println!("SKIPPED: the firmware in QEMU: {failure}");
            is_with_firmware = false;
        }
        Ok(())
    })?;
    stage(4, "run and diagnose", || pneuma_demo(is_with_firmware))
}

fn stage(place: usize, name: &str, work: impl FnOnce() -> Outcome) -> Outcome {
    println!("\n== {place}/{STAGES} {name}");
    let begin = Instant::now();
    work()?;
    // After the last stage the report's path stays the last line.
    if place < STAGES {
        let duration = shell::in_words(begin.elapsed());
        println!("== {place}/{STAGES} {name}: done in {duration}");
    }
    Ok(())
}

fn pneuma_demo(is_with_firmware: bool) -> Outcome {
    let program = shell::target_directory().join("release/pneuma");
    let mut words = vec!["demo", "--out", FOLDER];
    words.extend(is_with_firmware.then_some("--qemu"));
    shell::run(&mut shell::command(Path::new(&program), &words))
}
