//! The steps of CI and their summary.

use crate::shell::{self, Outcome, as_typed, cargo, command};
use crate::{image, lint, setup, size, testing};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// One thing that a change must pass.
struct Step {
    name: &'static str,
    /// What to type to repeat this step alone.
    repeat: String,
    work: Box<dyn FnOnce() -> Outcome>,
}

impl Step {
    fn new(name: &'static str, repeat: &str, work: impl FnOnce() -> Outcome + 'static) -> Self {
        Self {
            name,
            repeat: repeat.to_owned(),
            work: Box::new(work),
        }
    }

    fn of_command(name: &'static str, mut command: Command) -> Self {
        let repeat = as_typed(&command);
        Self::new(name, &repeat, move || shell::run(&mut command))
    }
}

/// The task `ci`.
pub fn ci() -> Outcome {
    let steps = vec![
        Step::new("setup", "cargo xtask setup", || {
            room()?;
            setup::prepare();
            Ok(())
        }),
        Step::of_command("fmt", cargo(&["fmt", "--all", "--check"])),
        Step::new("lint", "cargo xtask lint", lint::run),
        Step::of_command(
            "clippy",
            cargo(&[
                "clippy",
                "--workspace",
                "--all-targets",
                "--",
                "-D",
                "warnings",
            ]),
        ),
        Step::new("test", "cargo xtask test", || testing::run_tests(false)),
        Step::new("chip", "cargo xtask chip", chip),
        Step::of_command("doc", documentation()),
    ];
    run_steps(steps)
}

/// What a fresh clone builds for all steps, bytes: 5.2 GB as measured, and some.
const FRESH_BYTES: u64 = 6_000_000_000;
/// What is built anew where most is there.
const LATER_BYTES: u64 = 1_500_000_000;

/// A disk that is full fails whatever compiles last, and hardly says why. Where `df` is not to be had, nothing is said.
fn room() -> Outcome {
    let root = shell::root();
    let is_fresh = !root.join("target/debug/deps").is_dir();
    let needed = if is_fresh { FRESH_BYTES } else { LATER_BYTES };
    let mut df = command("df", &["--output=avail", "-B1"]);
    df.arg(&root);
    match shell::output_of(&mut df).and_then(|text| available(&text)) {
        Some(free) if free < needed => Err(too_little(free, needed, &root).into()),
        _ => Ok(()),
    }
}

fn too_little(free: u64, needed: u64, root: &Path) -> String {
    let giga = |bytes: u64| bytes as f64 / 1e9;
    format!(
        "{}: {:.1} GB free on its disk, the steps need {:.1}: remove what is not needed, such as old folders `target`",
        root.display(),
        giga(free),
        giga(needed)
    )
}

/// The number below the head of `df --output=avail`.
fn available(text: &str) -> Option<u64> {
    text.lines().nth(1)?.trim().parse().ok()
}

fn documentation() -> Command {
    let mut command = cargo(&["doc", "--workspace", "--no-deps"]);
    command.env("RUSTDOCFLAGS", "-D warnings");
    command
}

/// The task `chip`: the images for the microcontroller build, pass clippy, and
/// cost what they may.
pub fn chip() -> Outcome {
    image::clippy()?;
    size::run(&[])
}

/// Run in order, stop at the first failure, sum up at the end.
fn run_steps(steps: Vec<Step>) -> Outcome {
    let count = steps.len();
    let mut done = Vec::new();
    for (place, step) in steps.into_iter().enumerate() {
        println!("\n== {}/{count} {}: {}", place + 1, step.name, step.repeat);
        let begin = Instant::now();
        let outcome = (step.work)();
        let duration = begin.elapsed();
        if let Err(failure) = outcome {
            let (name, repeat) = (step.name, step.repeat);
            let text = summary(&done, count);
            println!(
                "\n{text}FAILED: {name}, after {}",
                shell::in_words(duration)
            );
            return Err(format!("step `{name}`: {failure}\nrepeat it with: {repeat}").into());
        }
        println!("== {}: passed in {}", step.name, shell::in_words(duration));
        done.push((step.name, duration));
    }
    print!("\n{}", summary(&done, count));
    Ok(())
}

fn summary(done: &[(&str, Duration)], count: usize) -> String {
    let mut text = format!("{} of {count} steps passed\n", done.len());
    for (name, duration) in done {
        text += &format!("  {name:8} {:>12}\n", shell::in_words(*duration));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_failure_stops_and_says_how_to_repeat() {
        let steps = vec![
            Step::new("good", "true", || Ok(())),
            Step::new("bad", "cargo xtask bad", || Err("broken".into())),
            Step::new("never", "false", || panic!("a step after a failure")),
        ];
        let message = run_steps(steps).unwrap_err().to_string();
        assert_eq!(
            message,
            "step `bad`: broken\nrepeat it with: cargo xtask bad"
        );
    }

    #[test]
    fn regress_a_full_disk_is_said_before_anything_is_built() {
        assert_eq!(available("     Avail\n60000000000\n"), Some(60_000_000_000));
        assert_eq!(available("df: unknown option\n"), None);
        let line = too_little(4_500_000_000, FRESH_BYTES, Path::new("clone"));
        assert!(
            line.starts_with("clone: 4.5 GB free on its disk, the steps need 6.0"),
            "{line}"
        );
    }

    #[test]
    fn the_summary_lists_steps_and_durations() {
        let text = summary(&[("fmt", Duration::from_millis(1500))], 3);
        assert_eq!(text, "1 of 3 steps passed\n  fmt             1.5 s\n");
    }
}
