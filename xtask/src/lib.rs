//! `cargo xtask`: what CI does, runnable by anyone.
//!
//! - `shell`: running commands, headings, failures
//! - `setup`: what must be installed, and how it gets there
//! - `apt`: packages of Debian's
//! - `chip`: building `core` for the microcontroller, with or without rustup
//! - `checks`: the steps of CI and their summary
//! - `testing`: the tests, and which of their programs took longest
//! - `lint`, `features` and `licences`: rules of this repository that no compiler knows
//! - `dist`: archives of the program
//! - `bench` and `estimates`: benchmarks and their generated table
//! - `control`: the controller's scores and their generated tables
//! - `evidence`, `practice` and `trial`: the diagnoses of real recordings, of the practice axes and
//!   of concealed cases, and their tables, put by `generated` into a page that people write
//! - `faults`: the fault campaign and its generated tables
//! - `image` and `artefact`: building the images that boards run; as files for flashing tools
//! - `qemu` and `plant`: the firmware in QEMU, and an axis at its serial line
//! - `emulate`: the board's image on modelled registers
//! - `size`, `call_graph`, `thumb`: what the images cost, and that control cannot panic
//! - `profile`: where the control task's instructions go
//! - `demo`: the demonstration report

mod apt;
mod artefact;
mod bench;
mod call_graph;
mod checks;
mod chip;
mod circles;
mod control;
mod demo;
mod dist;
pub mod emulate;
mod estimates;
mod evidence;
mod faults;
mod features;
pub mod generated;
pub mod image;
mod lengths;
mod licences;
mod lint;
pub mod packages;
pub mod plant;
pub mod practice;
mod profile;
pub mod qemu;
mod setup;
pub mod shell;
mod size;
mod testing;
mod thumb;
mod trial;
mod verdicts;

use shell::Outcome;

const USAGE: &str = "\
cargo xtask <task>

  setup                   find or install what the other tasks need; safe to repeat
  test                    setup, then the tests of the workspace that ci runs
       [--all]            the long ones too: all practice axes and recordings, every fault
  ci                      everything a change must pass, in order, with a summary
  demo                    setup, then the demonstration; its report lands in out/demo
  bench [--reference ID]  run the benchmarks, write docs/benchmarks.md
        [--table-only]    write it from the last run
  control                 score the controller and a PID, write docs/control.md
  evidence                diagnose the real recordings and the practice axes, write their parts
                          of docs/evidence.md
  trial [CASES]           judge the diagnosis on concealed cases, write its part of docs/evidence.md
  faults [SEEDS [MINUTES [QEMU_SEEDS]]]
                          every fault at every moment, write docs/faults.md
  image [spi-dac] [2khz | 4khz | 8khz]
                          the STM32F405's image as files for flashing tools, in out/firmware;
                          for the valve behind 16 bits, for more ticks a second than 1000
  qemu --serial 127.0.0.1:PORT [--rig RIG.toml] [--seconds N]
                          the firmware in QEMU, waiting for a plant that connects
  emulate [--ticks N] [--plant PORT] [...]
                          the STM32F405's image on modelled registers; tests/emulator
  dist [TARGET...]        archives of the program for other machines, with checksums, in out/dist
  size [--bless]          instructions, flash, memory, stack; compared with the snapshot,
                          or made the snapshot
       [--where]          whose the control task's instructions are, and the tasks' stacks

steps of ci that can be repeated alone:
  lint                    rules of this repository that no compiler knows
  chip                    build and check the images for the microcontroller";

/// Runs a task.
pub fn run(arguments: &[String]) -> Outcome {
    let (task, rest) = match arguments.split_first() {
        Some((task, rest)) => (task.as_str(), rest),
        None => ("help", arguments),
    };
    match (task, rest) {
        ("help" | "--help" | "-h", []) => {
            println!("{USAGE}");
            Ok(())
        }
        ("setup", []) => setup::run(),
        ("test", options) => testing::run(options),
        ("ci", []) => checks::ci(),
        ("lint", []) => lint::run(),
        ("chip", []) => checks::chip(),
        ("demo", []) => demo::run(),
        ("control", []) => control::run(),
        ("evidence", []) => evidence::run(),
        ("bench", options) => bench::run(options),
        ("faults", options) => faults::run(options),
        ("trial", options) => trial::run(options),
        ("dist", targets) => dist::run(targets),
        ("image", choices) => artefact::run(choices),
        ("qemu", options) => qemu::run(options),
        ("emulate", options) => emulate::run(options),
        ("size", [option]) if option == "--where" => profile::run(),
        ("size", options) => size::run(options),
        _ => Err(format!("unknown task: {}\n\n{USAGE}", arguments.join(" ")).into()),
    }
}
