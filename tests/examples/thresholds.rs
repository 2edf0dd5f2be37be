//! Writes the table of deciding numbers into `docs/method.md`:
//! `cargo run -p tests --example thresholds`.

use tests::thresholds;
use xtask::generated::Part;
use xtask::shell::Outcome;

fn main() -> Outcome {
    let part = Part {
        name: "deciding numbers",
        task: "cargo run -p tests --example thresholds",
    };
    part.write("docs/method.md", &thresholds::table())
}
