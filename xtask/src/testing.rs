//! The task `test`: the workspace's tests, and which of them took longest.
//!
//! Tests that take long are marked `#[ignore = "long: ..."]`. Continuous integration runs a
//! short one of each kind; `cargo xtask test --all` runs them too.

use crate::setup;
use crate::shell::{self, Outcome, RECORDINGS, as_typed, cargo};
use std::io::{self, BufRead, BufReader};
use std::num::NonZero;
use std::path::PathBuf;
use std::process::Command;
use std::thread::available_parallelism;

/// How many of the slowest programs are shown.
const SHOWN: usize = 8;

/// The model against an independent solver, which takes long to compile.
const STIFF_SOLVER: &str = "tests/stiff-solver";

/// The task. Works on what is there: only the tools of `ci` can be missing.
pub fn run(options: &[String]) -> Outcome {
    let is_all = match options {
        [] => false,
        [one] if one == "--all" => true,
        _ => {
            return Err(
                format!("test: unknown option {}, expected --all", options.join(" ")).into(),
            );
        }
    };
    setup::prepare();
    run_tests(is_all)
}

/// The tests without set-up; the long ones only if all are asked for.
pub fn run_tests(is_all: bool) -> Outcome {
    let recordings = find_recordings();
    match &recordings {
        Some(directory) => println!("RECORDINGS FOUND: {}", directory.display()),
        None => println!(
            "RECORDINGS NOT FOUND: tests against recordings are SKIPPED (looked for ${RECORDINGS} \
             and ../shared/recordings); where CI is set they fail"
        ),
    }
    let mut durations = Durations::default();
    let mut outcome = Ok(());
    for mut command in commands(is_all, has_nextest()) {
        if let Some(directory) = &recordings {
            command.env(RECORDINGS, directory);
        }
        outcome = each_line(&mut command, |line| durations.read(line));
        if outcome.is_err() {
            break;
        }
    }
    print!("{}", durations.slowest());
    outcome
}

/// cargo-nextest runs tests of several programs at a time, where `cargo test` lets a processor wait
/// for the last test of each: two thirds of its time. It runs no examples of documents.
fn commands(is_all: bool, has_nextest: bool) -> Vec<Command> {
    if !has_nextest {
        let mut tests = cargo(&["test", "--workspace"]);
        if is_all {
            tests.args(["--features", STIFF_SOLVER, "--", "--include-ignored"]);
        }
        return vec![tests];
    }
    let mut tests = cargo(&[
        "nextest",
        "run",
        "--workspace",
        "--lib",
        "--bins",
        "--tests",
    ]);
    tests.args([
        "--cargo-quiet",
        "--no-fail-fast",
        "--failure-output",
        "final",
        "--test-threads",
        &tests_at_once().to_string(),
    ]);
    if is_all {
        tests.args(["--features", STIFF_SOLVER, "--run-ignored", "all"]);
    }
    vec![tests, cargo(&["test", "--workspace", "--doc"])]
}

/// Half as many again as processors: tests against a board on the host, and those that compile, wait
/// for much of their time. On two processors a tenth of the tests' time is spared.
fn tests_at_once() -> usize {
    let processors = available_parallelism().map_or(1, NonZero::get);
    processors + processors.div_ceil(2)
}

fn has_nextest() -> bool {
    shell::succeeds(&mut cargo(&["nextest", "--version"]))
}

fn find_recordings() -> Option<PathBuf> {
    let folder = shell::recordings().canonicalize().ok();
    folder.filter(|path| path.is_dir())
}

/// Runs to the end; each line of both outputs is shown as it comes, and handed on. One pipe
/// for both: which program the tests are of is on one, how long they took on the other.
fn each_line(command: &mut Command, mut take: impl FnMut(&str)) -> Outcome {
    let failure = |error: io::Error| format!("`{}` did not start: {error}", as_typed(command));
    let (reader, writer) = io::pipe().map_err(failure)?;
    let other = writer.try_clone().map_err(failure)?;
    let mut child = command
        .stdout(writer)
        .stderr(other)
        .spawn()
        .map_err(|error| format!("`{}` did not start: {error}", as_typed(command)))?;
    // The command holds the ends that are written to: with them open the pipe never ends.
    command.stdout(io::stdout()).stderr(io::stderr());
    for line in BufReader::new(reader).split(b'\n') {
        let Ok(line) = line else { break };
        let line = String::from_utf8_lossy(&line);
        println!("{line}");
        take(&line);
    }
    let typed = as_typed(command);
    let status = child
        .wait()
        .map_err(|error| format!("`{typed}`: {error}"))?;
    if status.success() {
        return Ok(());
    }
    Err(format!("`{typed}` failed ({status})").into())
}

/// How long each program of tests, or each test, ran, s.
#[derive(Default)]
struct Durations {
    of: String,
    all: Vec<(String, f64)>,
}

impl Durations {
    /// `Running tests/faults.rs (target/debug/deps/faults-46596297be4f44d6)`, `Doc-tests
    /// host_sim`; then `test result: ok. 9 passed; ...; finished in 12.34s`. Of nextest:
    /// `PASS [  12.340s] (  9/931) host-sim::faults val_a_fault`.
    fn read(&mut self, line: &str) {
        let line = line.trim();
        if let Some(rest) = line.strip_prefix("PASS [") {
            if let Some((time, name)) = rest.split_once("s]") {
                let name = name.trim_start_matches(|c: char| "() /0123456789".contains(c));
                let seconds = time.trim().parse().ok();
                self.all
                    .extend(seconds.map(|seconds| (name.to_owned(), seconds)));
            }
        } else if let Some(name) = line.strip_prefix("Running ") {
            let program = name.rsplit(['/', '(']).next().unwrap_or(name);
            let program = program.trim_end_matches(')');
            self.of = program
                .rsplit_once('-')
                .map_or(program, |(name, _)| name)
                .to_owned();
        } else if line.starts_with("Doc-tests ") {
            self.of = line.to_owned();
        } else if line.starts_with("test result: ") {
            let seconds = line.rsplit_once("finished in ").map(|(_, time)| time);
            let seconds = seconds.and_then(|time| time.trim_end_matches('s').parse().ok());
            self.all
                .extend(seconds.map(|seconds| (self.of.clone(), seconds)));
        }
    }

    /// The slowest of them, as a list for people.
    fn slowest(mut self) -> String {
        self.all.sort_by(|one, other| other.1.total_cmp(&one.1));
        let mut text = format!("\n{} programs or tests; the slowest:\n", self.all.len());
        for (name, seconds) in self.all.iter().take(SHOWN) {
            text += &format!("  {name:24} {seconds:8.1} s\n");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_slowest_programs_are_listed_by_name() {
        let mut durations = Durations::default();
        for line in [
            "     Running unittests src/lib.rs (target/debug/deps/host_sim-4e38b4f21b2afbe9)",
            "test a ... ok",
            "test result: ok. 240 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 6.85s",
            "     Running tests/board_orders.rs (target/debug/deps/board_orders-46596297be4f44d6)",
            "test result: ok. 9 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 71.20s",
            "        PASS [  33.210s] (  9/931) host-sim::faults val_a_fault",
            "   Doc-tests model_core",
            "test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s",
        ] {
            durations.read(line);
        }
        let text = durations.slowest();
        let names: Vec<&str> = text
            .lines()
            .skip(2)
            .filter_map(|line| line.split_whitespace().next())
            .collect();
        assert_eq!(
            names,
            ["board_orders", "host-sim::faults", "host_sim", "Doc-tests"],
            "{text}"
        );
    }

    #[test]
    fn prop_both_outputs_are_read_and_a_failure_is_one() {
        let mut lines = Vec::new();
        let both = "echo one; echo two >&2; exit 3";
        let failure = each_line(Command::new("sh").args(["-c", both]), |line| {
            lines.push(line.to_owned());
        });
        assert_eq!(lines, ["one", "two"]);
        let failure = failure.unwrap_err().to_string();
        assert!(failure.contains("exit status: 3"), "{failure}");
    }
}
