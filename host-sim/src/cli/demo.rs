//! `pneuma demo`: the main job from end to end, on recordings that the program
//! carries with it. With `--qemu`, in a clone of the repository, the firmware makes
//! one more itself.
//!
//! Each stage is a command that a user could have typed, and is shown as such. The
//! case `fixtures/leaking-axis` was drawn by `truth-plant`, which shares no code with
//! the model; its truth is sealed by its hash before the diagnosis, opened after.
//!
//! The demo writes into a folder of its own only, which its `MARK` shows to be its own.

use super::closed_loop::{self, LoopArguments};
use super::diagnose::{self, DiagnoseArguments};
use super::typed;
use super::{CommandError, inputs, outputs};
use crate::report::number::significant;
use clap::Args;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The file that shows a folder to be the demo's own.
const MARK: &str = "written-by-pneuma-demo.txt";
const MARK_TEXT: &str =
    "The files of this folder are written by `pneuma demo` and replaced by its next run.\n";
/// What is known of the axis that the firmware moves.
const PAPER: &str = include_str!("../../rigs/paper.toml");
/// How well its numbers are known, one standard deviation: as from data sheets and a kitchen balance.
const UNCERTAINTY: &str = include_str!("../../fixtures/paper-uncertainty.toml");
/// What that axis has besides: a leak past the piston of 0.15 mm2.
const CONCEALED: &str = "\n[effects.piston-leakage]\norifice_m2 = 1.5e-7\n";
/// Length of the firmware's recording, s: moves and the first sines.
const FIRMWARE_SECONDS: &str = "16";
/// The sealed case: what is known of the rig, and three recordings of it.
const CASE: [(&str, &str); 4] = [
    (
        "rig.toml",
        include_str!("../../fixtures/leaking-axis/rig.toml"),
    ),
    (
        "train-1.csv",
        include_str!("../../fixtures/leaking-axis/train-1.csv"),
    ),
    (
        "train-2.csv",
        include_str!("../../fixtures/leaking-axis/train-2.csv"),
    ),
    (
        "held-out.csv",
        include_str!("../../fixtures/leaking-axis/held-out.csv"),
    ),
];
/// Digits of a size that is shown.
const DIGITS: usize = 4;
/// What the plant of the sealed case has and its rig file does not say.
const TRUTH: &str = include_str!("../../fixtures/leaking-axis/truth.json");

/// Show the main job: recordings in, verdict, report and improved rig out.
#[derive(Args, Debug)]
pub struct DemoArguments {
    /// Folder for everything that is written: a new or empty one, or that of an earlier demo.
    #[arg(long, default_value = "out/demo")]
    pub out: PathBuf,
    /// Begin with the firmware in QEMU; in a clone of the repository only.
    #[arg(long)]
    pub qemu: bool,
}

/// Runs the command; the last line is the path of the report.
///
/// # Errors
/// If the folder holds files of somebody else's, a stage fails, or something cannot be written.
pub fn run(arguments: &DemoArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let folder = &arguments.out;
    claim(folder)?;
    if arguments.qemu {
        firmware_stages(folder, out)?;
    }
    let report = sealed_case(folder, out)?;
    writeln!(out, "{}", fs::canonicalize(report)?.display())?;
    Ok(())
}

/// Makes the folder the demo's own; one that holds files of somebody else's is refused.
fn claim(folder: &Path) -> Result<(), CommandError> {
    let cannot = |error| outputs::cannot_write(folder, &error);
    let mark = folder.join(MARK);
    fs::create_dir_all(folder).map_err(cannot)?;
    let is_empty = fs::read_dir(folder).map_err(cannot)?.next().is_none();
    if !is_empty && !mark.is_file() {
        return Err(inputs::bad_input(format!(
            "{}: holds files that are not the demo's, expected a new or empty folder (--out FOLDER)",
            folder.display()
        )));
    }
    outputs::write_text(&mark, MARK_TEXT)
}

/// The firmware moves an axis that conceals a leak; its recording is diagnosed.
fn firmware_stages(folder: &Path, out: &mut dyn Write) -> Result<(), CommandError> {
    let file = |name: &str| folder.join(name).display().to_string();
    let (known, plant, recording) = (
        file("paper.toml"),
        file("paper-with-a-leak.toml"),
        file("firmware.csv"),
    );
    outputs::write_text(Path::new(&known), &format!("{PAPER}{UNCERTAINTY}"))?;
    outputs::write_text(Path::new(&plant), &format!("{PAPER}{CONCEALED}"))?;

    let what = "The firmware in QEMU moves a simulated axis for 16 s. The axis conceals a leak past \
                the piston of 0.15 mm², and a valve with a spool of 100 Hz, of which the firmware's \
                rig file says nothing.";
    let mut words = vec![
        "loop",
        "--qemu",
        "--rig",
        &plant,
        "--controller-rig",
        &known,
    ];
    let page = file("firmware.html");
    words.extend(["--seconds", FIRMWARE_SECONDS, "--out", &recording]);
    words.extend(["--report", &page]);
    announce(what, &words, out)?;
    closed_loop::run(&typed::<LoopArguments>(&words)?, out)?;

    let what = "The recording of the firmware: what does its rig file leave out? Learnt from the first \
                half, judged by the second.";
    let (train, held_out) = (format!("{recording}@0..50"), format!("{recording}@50..100"));
    let mut words = vec!["diagnose", "--rig", &known, "--train", &train];
    let page = file("firmware-diagnosis.html");
    words.extend(["--held-out", &held_out, "--report", &page]);
    announce(what, &words, out)?;
    diagnose::run(&typed::<DiagnoseArguments>(&words)?, out)
}

/// Diagnoses the sealed case, then opens its truth; the path of the report.
fn sealed_case(folder: &Path, out: &mut dyn Write) -> Result<PathBuf, CommandError> {
    for (name, text) in CASE {
        outputs::write_text(&folder.join(name), text)?;
    }
    let file = |name: &str| folder.join(name).display().to_string();
    let [rig, train_1, train_2, held_out] = CASE.map(|(name, _)| file(name));
    let [json, report, improved] = ["verdict.json", "report.html", "improved.toml"].map(file);
    let what = format!(
        "Another axis, simulated by a program that shares no code with the model. What it conceals is \
         sealed: SHA-256 of truth.json is {}.",
        hash(TRUTH)
    );
    let mut words = vec!["diagnose", "--rig", &rig, "--train", &train_1, &train_2];
    words.extend(["--held-out", &held_out, "--json", &json]);
    words.extend(["--report", &report, "--improved-rig", &improved]);
    announce(&what, &words, out)?;
    diagnose::run(&typed::<DiagnoseArguments>(&words)?, out)?;

    outputs::write_text(&folder.join("truth.json"), TRUTH)?;
    let verdict = fs::read_to_string(&json)?;
    writeln!(out, "\nThe seal opened, truth.json:")?;
    for line in comparison(&parsed(TRUTH)?, &parsed(&verdict)?) {
        writeln!(out, "{line}")?;
    }
    writeln!(out, "\nThe report, for a browser:")?;
    Ok(report.into())
}

fn announce(what: &str, words: &[&str], out: &mut dyn Write) -> Result<(), CommandError> {
    writeln!(out, "\n{what}\n$ pneuma {}\n", words.join(" "))?;
    Ok(())
}

fn parsed(text: &str) -> Result<Value, CommandError> {
    serde_json::from_str(text).map_err(inputs::bad_input)
}

/// SHA-256 in hexadecimal.
fn hash(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A line for each size of each true effect, beside what was found, and for each
/// effect that was named and is not there.
fn comparison(truth: &Value, verdict: &Value) -> Vec<String> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let (there, named) = (list(&truth["truth"]["effects"]), list(&verdict["effects"]));
    let name = |effect: &Value, key: &str| effect[key].as_str().unwrap_or_default().to_owned();
    let mut lines = Vec::new();
    for effect in &there {
        let effect_name = name(effect, "name");
        let found = named.iter().find(|one| name(one, "effect") == effect_name);
        let Some(found) = found else {
            lines.push(format!("  {effect_name}: is there and was not named"));
            continue;
        };
        for (key, value) in effect["parameters"].as_object().into_iter().flatten() {
            let size = &found["parameters"][key];
            lines.push(format!(
                "  {effect_name}, {key}: true {}, found {}",
                shown(value),
                estimate(size)
            ));
        }
    }
    for effect in &named {
        let effect_name = name(effect, "effect");
        if there.iter().all(|one| name(one, "name") != effect_name) {
            lines.push(format!("  {effect_name}: was named and is not there"));
        }
    }
    lines
}

fn shown(value: &Value) -> String {
    value
        .as_f64()
        .map_or_else(|| "not stated".into(), |value| significant(value, DIGITS))
}

/// A size with its standard deviation.
fn estimate(size: &Value) -> String {
    match size["std"].as_f64() {
        Some(deviation) => format!("{} ± {}", shown(&size["value"]), significant(deviation, 2)),
        None => shown(&size["value"]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn prop_a_folder_with_other_files_is_refused_and_the_demo_s_own_is_taken_again() {
        let folder = tempfile::tempdir().unwrap();
        let other = folder.path().join("rig.toml");
        fs::write(&other, "mine").unwrap();
        let refused = claim(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("new or empty folder"), "{refused}");
        assert_eq!(fs::read_to_string(&other).unwrap(), "mine");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

        let own = folder.path().join("new/demo");
        claim(&own).unwrap();
        fs::write(own.join("report.html"), "of an earlier run").unwrap();
        claim(&own).unwrap();
    }

    #[test]
    fn prop_what_was_missed_and_what_is_not_there_is_said() {
        let truth = json!({"truth": {"effects": [
            {"name": "tube-line", "parameters": {"length_m": 1.5}},
            {"name": "supply-droop", "parameters": {}},
        ]}});
        let verdict = json!({"effects": [
            {"effect": "tube-line", "parameters": {"length_m": {"value": 1.4, "std": 0.1}}},
            {"effect": "dead-volume", "parameters": {}},
        ]});
        assert_eq!(
            comparison(&truth, &verdict),
            [
                "  tube-line, length_m: true 1.500, found 1.400 ± 0.10",
                "  supply-droop: is there and was not named",
                "  dead-volume: was named and is not there",
            ]
        );
    }
}
