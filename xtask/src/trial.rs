//! Run the concealed trial and write its part of `docs/evidence.md`.

use crate::evidence::PAGE;
use crate::generated::{self, Part};
use crate::shell::{self, Outcome, cargo};
use std::fs;

/// The part of the page.
const PART: Part = Part {
    name: "concealed trial",
    task: "cargo xtask trial",
};
/// Cases, unless told.
const CASES: &str = "200";
/// The plan's seed. Cases of seeds 1 to 30 were looked at while the diagnosis was
/// written; those of this one were not.
const SEED: &str = "31";
/// Where scorecard, seals and report land; a trial that was cut off goes on.
const FOLDER: &str = "out/trial";

/// The task `trial`; the option is the number of cases.
pub fn run(options: &[String]) -> Outcome {
    let cases = options.first().map_or(CASES, String::as_str);
    let folder = shell::root().join(FOLDER);
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut pneuma = cargo(&[
        "run",
        "--release",
        "--quiet",
        "-p",
        "host-sim",
        "--bin",
        "pneuma",
    ]);
    pneuma.args(["--", "trial", "--cases", cases, "--seed", SEED]);
    for (option, file) in [
        ("--json", "scorecard.json"),
        ("--report", "scorecard.html"),
        ("--markdown", "tables.md"),
    ] {
        pneuma.arg(option).arg(folder.join(file));
    }
    shell::run(&mut pneuma)?;
    let tables = folder.join("tables.md");
    let tables =
        fs::read_to_string(&tables).map_err(|error| format!("{}: {error}", tables.display()))?;
    let heading = format!(
        "`pneuma trial --cases {cases} --seed {SEED}`, commit {}.",
        generated::commit()
    );
    PART.write(PAGE, &format!("{heading}\n\n{HOW}\n{tables}"))
}

const HOW: &str = "\
Rigs drawn by `truth-plant`, which shares no code, formulation or integrator with the model: gas as mass and energy,
tubes as finite volumes, 25 us. Each truth was sealed by its hash before the diagnosis ran, and opened after. The
diagnosis read the case's files and nothing else. An effect counts if taking it out of the plant changes what an
honestly refitted model misses of the held-out recordings, and if it was not drawn at a tenth of what an engineer
would care about; where none counts, the right verdict is that nothing is missing. Place, false alarms and confident errors are counted over every case that they can be counted over, also
masked, noisy and brief ones. Counts stand beside the shares. Every case with its misses is in the report,
`out/trial/scorecard.html`.
";
