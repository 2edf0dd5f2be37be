//! Situations from the field (`../shared/cases`), as `pneuma diagnose` judges them.

mod common;

use serde_json::Value;
use std::process::Command;

/// The verdict on a case, trained on some files and judged by others.
fn verdict(case: &str, train: &[&str], held_out: &[&str]) -> Option<Value> {
    let folder = common::cases(case)?.join(case);
    let scratch = tempfile::tempdir().expect("a folder");
    let json = scratch.path().join("verdict.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_pneuma"));
    command.current_dir(folder);
    command
        .args(["diagnose", "--rig", "rig.toml", "--train"])
        .args(train);
    if !held_out.is_empty() {
        command.arg("--held-out").args(held_out);
    }
    let output = command.arg("--json").arg(&json).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{case}: {said}");
    let text = std::fs::read_to_string(json).expect("written");
    Some(serde_json::from_str(&text).expect("JSON"))
}

fn named(verdict: &Value) -> Vec<&str> {
    let effects = verdict["effects"].as_array().expect("a list");
    effects
        .iter()
        .filter_map(|one| one["effect"].as_str())
        .collect()
}

/// The recording is at fault, the sentence says how, and no effect is named.
fn val_fault(case: &str, train: &[&str], held_out: &[&str], said: &[&str]) {
    let Some(verdict) = verdict(case, train, held_out) else {
        return;
    };
    assert_eq!(verdict["verdict"], "data-fault", "{case}: {verdict}");
    assert!(named(&verdict).is_empty(), "{case}");
    let all = verdict["doubts"].to_string() + &verdict["sentence"].to_string();
    for said in said {
        assert!(all.contains(said), "{case}: {all} lacks {said}");
    }
}

const ONE: (&[&str], &[&str]) = (&["train-1.csv"], &["held-1.csv"]);

#[test]
fn val_spikes_live_zeros_held_rows_and_smoothed_columns_are_data_faults() {
    let (train, held_out) = ONE;
    val_fault("D-emi-spikes", train, held_out, &["spike", "held-1.csv"]);
    let live_zero = "4 to 20 mA over 10 bar";
    val_fault("D-milliampere-live-zero", train, held_out, &[live_zero]);
    let smoothed = ["moving average over 20 rows", "the larger counts"];
    val_fault("D-moving-average-20ms", train, held_out, &smoothed);
    val_fault(
        "D-pressures-held-100Hz",
        train,
        held_out,
        &["every 10 rows"],
    );
    val_fault(
        "S-vented",
        &["run1.exp"],
        &["run2.exp"],
        &["does not hold gas"],
    );
}

#[test]
fn val_the_mistake_of_a_gauge_or_a_logger_is_named() {
    let (train, held_out) = ONE;
    let gauge = "p_a seems to be gauge pressure declared as absolute";
    val_fault("D-one-gauge-sensor", train, held_out, &[gauge]);
    let late = "u seems to be logged about 5.00 ms late";
    val_fault("D-command-logged-late", train, held_out, &[late]);
}

/// Time stamps that jitter are no physics.
#[test]
fn val_jitter_is_no_physics() {
    let (train, held_out) = ONE;
    let Some(jitter) = verdict("D-jitter-pc", train, held_out) else {
        return;
    };
    assert_eq!(jitter["verdict"], "nothing-missing", "{jitter}");
    assert!(jitter["notes"].to_string().contains("time stamps jitter"));
}

/// A late position is a late position; of two scales that contradict each other the sensors are
/// told.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_lateness_and_scale_are_those_of_the_sensors() {
    let (train, held_out) = ONE;
    let Some(late) = verdict("D-position-late-8ms", train, held_out) else {
        return;
    };
    assert_eq!(named(&late), ["position-time-skew"], "{late}");
    let delay = &late["effects"][0]["parameters"]["delay_s"]["value"];
    assert!(
        (delay.as_f64().expect("a time") - 8e-3).abs() < 2e-4,
        "{late}"
    );
    let scale = verdict("D-scale-x-2percent", train, held_out).expect("the cases are there");
    assert!(named(&scale).is_empty(), "{scale}");
    let sentence = scale["sentence"].to_string();
    assert!(sentence.contains("0.980 times"), "{sentence}");
}

#[test]
fn val_a_declared_orifice_is_refitted_and_nothing_else_is_blamed() {
    let Some(verdict) = verdict("V-declared-orifice", &["run1.csv"], &["run2.csv"]) else {
        return;
    };
    assert_eq!(verdict["verdict"], "nothing-missing", "{verdict}");
    let found = &verdict["parameters"]["effects.chamber-leakage.orifice_a_m2"]["refitted"];
    let found_m2 = found.as_f64().expect("refitted");
    assert!((found_m2 / 3.4e-6 - 1.0).abs() < 0.01, "{found_m2}");
}

#[test]
fn val_a_leak_is_gap_and_hole_at_once_beside_a_gauge_zero() {
    let Some(verdict) = verdict("V-gap-and-hole-offset", &["run.csv"], &[]) else {
        return;
    };
    assert_eq!(
        named(&verdict),
        ["chamber-leakage", "pressure-sensor-offset"]
    );
    let number = |effect: usize, name: &str| {
        let value = &verdict["effects"][effect]["parameters"][name]["value"];
        value.as_f64().expect("a number")
    };
    let gap = number(0, "laminar_a_kg_s_Pa2");
    assert!((gap / 2.07e-16 - 1.0).abs() < 0.05, "{gap}");
    assert!((number(0, "onset_s") - 5.0).abs() < 0.05);
    assert!((number(1, "offset_a_Pa") - 4480.0).abs() < 200.0);
    let Some(real) = self::verdict("R-leak-020", &["run.csv"], &[]) else {
        return;
    };
    assert!(named(&real).contains(&"chamber-leakage"), "{real}");
    assert!(!named(&real).contains(&"pressure-sensor-lag"), "{real}");
}

/// Both gauges read 12 ms late, on a healthy axis of another plant: one cause, no delay of the valve and
/// no skew of the position.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_gauges_that_are_late_together_are_late_gauges() {
    let case = truth_plant::Request::new(11, truth_plant::Kind::Nothing).draw();
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
        name.to_owned()
    };
    write("rig.toml", &case.rig_toml);
    let late = |text: &str| with_late_columns(text, &["p_a", "p_b"], 12);
    let recordings = |of: &[(String, String)]| -> Vec<String> {
        let late = of.iter().map(|(name, text)| write(name, &late(text)));
        late.collect()
    };
    let (train, held_out) = (recordings(&case.train), recordings(&case.held_out));
    let json = folder.path().join("verdict.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_pneuma"));
    command.current_dir(folder.path());
    command.args(["diagnose", "--rig", "rig.toml", "--train"]);
    command.args(&train).arg("--held-out").args(&held_out);
    let output = command.arg("--json").arg(&json).output().expect("it runs");
    assert!(output.status.success());
    let text = std::fs::read_to_string(json).expect("written");
    let verdict: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(verdict["verdict"], "data-fault", "{}", verdict["sentence"]);
    let sentence = verdict["sentence"].as_str().unwrap_or_default();
    assert!(
        sentence.contains("late against command and position"),
        "{sentence}"
    );
}

/// A table in which columns, found by what their names begin with, come so many rows later.
fn with_late_columns(text: &str, begins: &[&str], rows: usize) -> String {
    let mut lines: Vec<Vec<String>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    let header = lines[0].clone();
    for (column, name) in header.iter().enumerate() {
        if !begins.iter().any(|begin| name.starts_with(begin)) {
            continue;
        }
        for row in (2..lines.len()).rev() {
            lines[row][column] = lines[row.saturating_sub(rows).max(1)][column].clone();
        }
    }
    let text: Vec<String> = lines.iter().map(|cells| cells.join(",")).collect();
    text.join("\n") + "\n"
}
