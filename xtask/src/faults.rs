//! Run the fault campaign and write its tables, `docs/faults.md`.

use crate::shell::{self, Outcome, cargo};

/// Where the tables go.
const TABLE: &str = "docs/faults.md";

/// The task `faults`; options are the seeds and the minutes without a fault.
pub fn run(options: &[String]) -> Outcome {
    let mut words = vec!["run", "--release", "-p", "host-sim", "--example", "faults"];
    words.extend(["--", TABLE]);
    words.extend(options.iter().map(String::as_str));
    shell::run(&mut cargo(&words))
}
