//! The table of `docs/method.md`: the numbers that decide a verdict.

use diagnosis::thresholds::{Origin, THRESHOLDS};
use std::fmt::Write;

/// The table.
pub fn table() -> String {
    let count = |origin: Origin| THRESHOLDS.iter().filter(|one| one.origin == origin).count();
    let mut text = format!(
        "{} numbers: {} derived from statistics or from another number, {} calibrated between what axes of either kind were \
         seen to do, {} chosen.\n\n| number | value | what it decides, and why it is so large | from |\n|---|---:|---|---|\n",
        THRESHOLDS.len(),
        count(Origin::Derived),
        count(Origin::Calibrated),
        count(Origin::Chosen)
    );
    for one in THRESHOLDS {
        let words = one.name.to_lowercase().replace('_', " ");
        let origin = format!("{:?}", one.origin).to_lowercase();
        let value = (1e6 * one.value).round() / 1e6;
        let _ = writeln!(
            text,
            "| {words} | {value} | {} | {origin} |",
            one.what.trim()
        );
    }
    text
}
