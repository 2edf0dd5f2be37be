//! Diagnose the real recordings and the practice axes and write their tables into
//! `docs/evidence.md`.

use crate::generated::{self, Part};
use crate::practice;
use crate::shell::{self, Outcome, cargo};
use crate::verdicts::{PAGE, diagnosed, strings};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// This table's part of it.
const PART: Part = Part {
    name: "recordings measured by others",
    task: "cargo xtask evidence",
};

/// One diagnosis: rig, folder, training and held-out recordings, the signals
/// with their unit (name, SI per unit), and what was reached by hand.
struct Case {
    title: &'static str,
    rig: &'static str,
    train: &'static [&'static str],
    held_out: &'static str,
    unit: (&'static str, f64),
    by_hand: &'static str,
}

const PSI: (&str, f64) = ("psi", 6894.757);
const CASES: [Case; 7] = [
    Case {
        title: "gas cylinder, 2021 to 2022",
        rig: "gas-cylinder",
        train: &["run-2021-07-26.exp"],
        held_out: "run-2022-01-28.exp",
        unit: PSI,
        by_hand: "1.7 upper, 2.1 lower",
    },
    Case {
        title: "gas cylinder, 2022 to 2021",
        rig: "gas-cylinder",
        train: &["run-2022-01-28.exp"],
        held_out: "run-2021-07-26.exp",
        unit: PSI,
        by_hand: "",
    },
    Case {
        title: "seal friction, O-ring",
        rig: "seal-friction",
        train: &["O-ring_1bar.tsv", "O-ring_3bar.tsv", "O-ring_5bar.tsv"],
        held_out: "O-ring_7bar.tsv",
        unit: ("N", 1.0),
        by_hand: "1.45",
    },
    Case {
        title: "seal friction, NAPN",
        rig: "seal-friction",
        train: &["NAPN_1bar.tsv", "NAPN_3bar.tsv", "NAPN_5bar.tsv"],
        held_out: "NAPN_7bar.tsv",
        unit: ("N", 1.0),
        by_hand: "2.0",
    },
    Case {
        title: "positioning stage",
        rig: "positioning-stage",
        train: &["emps.csv@0..50"],
        held_out: "emps.csv@50..100",
        unit: ("N", 1.0),
        by_hand: "4.4",
    },
    Case {
        title: "plant valve",
        rig: "plant-valve",
        train: &["actuator3-first-half-hour.csv@0..50"],
        held_out: "actuator3-first-half-hour.csv@50..100",
        unit: ("%", 0.01),
        by_hand: "1.36",
    },
    Case {
        title: "vessel leak",
        rig: "vessel-leak",
        train: &["Ultimaker_015.csv@0..30"],
        held_out: "Ultimaker_015.csv@30..100",
        unit: ("bar", 1e5),
        by_hand: "0.18",
    },
];

/// The task `evidence`.
pub fn run() -> Outcome {
    let recordings = recordings()?;
    shell::run(&mut cargo(&["build", "-p", "host-sim", "--bin", "pneuma"]))?;
    let mut text = heading();
    for case in &CASES {
        println!("{}", case.title);
        let verdict = diagnose(case, &recordings.join("real"))?;
        rows(&mut text, case, &verdict);
    }
    PART.write(PAGE, &text)?;
    practice::run()
}

fn recordings() -> Result<PathBuf, shell::Failure> {
    let root = shell::recordings();
    if root.join("real").is_dir() {
        return Ok(root);
    }
    Err(format!("no recordings at {}: set PNEUMA_RECORDINGS", root.display()).into())
}

fn diagnose(case: &Case, recordings: &Path) -> Result<Value, shell::Failure> {
    let folder = recordings.join(case.rig);
    let rig = shell::root().join(format!("host-sim/rigs/{}.toml", case.rig));
    let train: Vec<PathBuf> = case.train.iter().map(|file| folder.join(file)).collect();
    diagnosed(&rig, &train, &[folder.join(case.held_out)])
}

fn heading() -> String {
    format!(
        "Commit {}.\n\n\
         | recording | named | signal | unit | as given | refitted | improved | by hand |\n\
         |---|---|---|---|---|---|---|---|\n",
        generated::commit()
    )
}

fn rows(text: &mut String, case: &Case, verdict: &Value) {
    let names: Vec<String> = verdict["effects"]
        .as_array()
        .into_iter()
        .flatten()
        .map(named)
        .collect();
    let figures = |model: &str| &verdict["fit"][model]["free_run_held_out"];
    let Some(improved) = figures("improved").as_object() else {
        return;
    };
    for signal in improved.keys() {
        let shown = |model: &str| {
            let error = figures(model)[signal.as_str()].as_f64().unwrap_or(f64::NAN);
            format!("{:.3}", error / case.unit.1)
        };
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {signal} | {} | {} | {} | **{}** | {} |",
            case.title,
            names.join(", "),
            case.unit.0,
            shown("as_given"),
            shown("refitted"),
            shown("improved"),
            case.by_hand
        );
    }
}

fn named(effect: &Value) -> String {
    let name = effect["effect"].as_str().unwrap_or("?");
    format!("{name} ({})", strings(&effect["places"]).join(", "))
}
