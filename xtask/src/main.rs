//! `cargo xtask`: what CI does, runnable by anyone.
//!
//! - `shell`: running commands, headings, failures
//! - `setup`: what must be installed, and how it gets there
//! - `chip`: building `core` for the microcontroller, with or without rustup
//! - `checks`: the steps of CI and their summary
//! - `lint`: rules of this repository that no compiler knows
//! - `bench` and `estimates`: benchmarks and their generated table
//! - `evidence`: the diagnoses of the real recordings and their generated table
//! - `faults`: the fault campaign and its generated tables
//! - `size`: flash and memory of a firmware image
//! - `demo`: the demonstration report

mod bench;
mod checks;
mod chip;
mod demo;
mod estimates;
mod evidence;
mod faults;
mod lint;
mod setup;
mod shell;
mod size;

use shell::Outcome;
use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask <task>

  setup                   find or install what the other tasks need; safe to repeat
  test                    setup, then all tests of the workspace
  ci                      everything a change must pass, in order, with a summary
  demo                    setup, then the demonstration; its report lands in out/demo
  bench [--reference ID]  run the benchmarks, write docs/benchmarks.md
        [--table-only]    write it from the last run
  evidence                diagnose the real recordings, write docs/evidence.md
  faults [SEEDS [MINUTES]]  every fault at every moment, write docs/faults.md
  size [IMAGE]            flash and memory of a firmware image (ELF)

steps of ci that can be repeated alone:
  lint                    rules of this repository that no compiler knows
  chip                    build model-core for the microcontroller";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Outcome {
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
        ("test", []) => checks::test(),
        ("ci", []) => checks::ci(),
        ("lint", []) => lint::run(),
        ("chip", []) => checks::chip(),
        ("demo", []) => demo::run(),
        ("evidence", []) => evidence::run(),
        ("bench", options) => bench::run(options),
        ("faults", options) => faults::run(options),
        ("size", images) => size::run(images),
        _ => Err(format!("unknown task: {}\n\n{USAGE}", arguments.join(" ")).into()),
    }
}
