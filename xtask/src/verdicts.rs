//! Verdicts of the program, and the page that their tables go into.

use crate::shell::{self, command};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The page that the tables go into.
pub const PAGE: &str = "docs/evidence.md";
/// The verdict of the program.
pub fn diagnosed(
    rig: &Path,
    train: &[PathBuf],
    held_out: &[PathBuf],
) -> Result<Value, shell::Failure> {
    let json = shell::target_directory().join("evidence.json");
    let program = shell::target_directory().join("debug/pneuma");
    let mut pneuma = command(&program, &["diagnose"]);
    pneuma.arg("--rig").arg(rig).arg("--train").args(train);
    pneuma.arg("--held-out").args(held_out);
    pneuma.arg("--json").arg(&json);
    shell::run(&mut pneuma)?;
    shell::read_json(&json)
}

/// The strings of a list.
pub fn strings(list: &Value) -> Vec<String> {
    let all = list.as_array().into_iter().flatten();
    all.filter_map(Value::as_str).map(str::to_owned).collect()
}
