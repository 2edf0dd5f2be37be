//! The steps of CI and their summary.

use crate::shell::{self, Outcome, as_typed, cargo};
use crate::{image, lint, setup, size, testing};
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
    fn the_summary_lists_steps_and_durations() {
        let text = summary(&[("fmt", Duration::from_millis(1500))], 3);
        assert_eq!(text, "1 of 3 steps passed\n  fmt             1.5 s\n");
    }
}
