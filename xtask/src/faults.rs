//! Run the fault campaign and write its tables, `docs/faults.md`.

use crate::shell::{self, Outcome, cargo};

/// Where the tables go.
const TABLE: &str = "docs/faults.md";

/// The task `faults`; options are the seeds, the minutes without a fault, and the
/// seeds of the runs with the firmware in QEMU beside the host.
pub fn run(options: &[String]) -> Outcome {
    let mut words = vec!["run", "--release", "-p", "tests", "--example", "faults"];
    words.extend(["--", TABLE]);
    words.extend(options.iter().map(String::as_str));
    shell::run(&mut cargo(&words))
}
