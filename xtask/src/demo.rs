//! The demonstration report.

use crate::setup;
use crate::shell::{self, Outcome, cargo};

/// The task `demo`. The program prints the path of its report last.
pub fn run() -> Outcome {
    setup::prepare();
    let mut arguments = vec!["run", "--release", "-p", "host-sim"];
    if !shell::is_watched() {
        arguments.push("--quiet");
    }
    arguments.extend(["--", "demo", "--out", "out/demo"]);
    shell::run(&mut cargo(&arguments))
}
