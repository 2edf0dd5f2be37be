//! `pneuma identify` on bench recordings, and `pneuma paper`, as a person runs them.

#![allow(
    clippy::unwrap_used,
    reason = "the helpers of a test fail by panicking, as the tests do"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use host_sim::rig::Rig;
use serde_json::Value;
use truth_plant::bench::{Experiment, draw};

/// A drawn bench as files: the folder, its recordings.
fn bench(experiment: Experiment, seed: u64) -> (PathBuf, Vec<PathBuf>) {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("identify-{experiment}-{seed}"));
    fs::create_dir_all(&folder).unwrap();
    let case = draw(experiment, seed);
    fs::write(folder.join("rig.toml"), &case.rig_toml).unwrap();
    let write = |(name, text): &(String, String)| {
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let recordings = case.recordings.iter().map(write).collect();
    (folder, recordings)
}

fn pneuma(part: &str, folder: &Path, recordings: &[PathBuf], more: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(["identify", part, "--rig"])
        .arg(folder.join("rig.toml"))
        .args(recordings)
        .args(more)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap_or(-1), text)
}

#[test]
fn val_a_friction_bench_gives_rig_page_and_json() {
    let (folder, recordings) = bench(Experiment::Friction, 41);
    let outputs = [
        "--improved-rig",
        "measured.toml",
        "--report",
        "page.html",
        "--json",
        "out.json",
    ];
    let (status, text) = pneuma("friction", &folder, &recordings, &outputs);
    assert_eq!(status, 0, "{text}");
    let json: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("out.json")).unwrap()).unwrap();
    assert_eq!(json["format"], "identified/1");
    let numbers = json["numbers"].as_array().unwrap();
    assert!(
        numbers
            .iter()
            .any(|one| one["key"] == "friction.stribeck_velocity_m_s"),
        "{json}"
    );
    let rig = Rig::read(folder.join("measured.toml")).unwrap();
    for number in numbers {
        let (key, value) = (
            number["key"].as_str().unwrap(),
            number["value"].as_f64().unwrap(),
        );
        assert!(
            (rig.value(key).unwrap() / value - 1.0).abs() < 1e-6,
            "{key}"
        );
        let stated = number["deviation"].as_f64().unwrap();
        assert!(
            (rig.uncertainty_sd(key).unwrap() / stated - 1.0).abs() < 1e-3,
            "{key}"
        );
    }
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(page.contains("Friction over the speed") && page.contains("sliding-3bar.csv"));
}

/// The paper's friction bench: ports open, force recorded. The open ports are no fault of the gauges.
#[test]
fn val_open_ports_of_a_force_bench_are_no_fault() {
    let (folder, recordings) = bench(Experiment::Friction, 42);
    let output = Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(["inspect", "--rig"])
        .arg(folder.join("rig.toml"))
        .args(&recordings)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(!text.contains("FAULT"), "{text}");
    assert!(
        text.contains("p_a stays at 1.013 bar absolute") && text.contains("the port is open"),
        "{text}"
    );
}

/// A flow test's table replaces the flow of a data sheet.
#[test]
fn val_a_flow_bench_puts_its_areas_into_the_rig() {
    let (folder, recordings) = bench(Experiment::ValveFlow, 41);
    let (status, text) = pneuma(
        "valve-flow",
        &folder,
        &recordings,
        &["--improved-rig", "measured.toml"],
    );
    assert_eq!(status, 0, "{text}");
    let (before, after) = ["rig.toml", "measured.toml"]
        .map(|name| Rig::read(folder.join(name)).unwrap())
        .into();
    assert!(before.states_flow() && !after.states_flow());
    assert!(after.valve.unwrap().opening_v.len() > 10);
}

/// What lacks is said in a line, and what to do.
#[test]
fn val_what_an_experiment_lacks_is_said_in_a_line() {
    let (folder, recordings) = bench(Experiment::DeadVolume, 41);
    for (part, lacks) in [
        ("spool", "u is not recorded"),
        ("heat-transfer", "no command is recorded"),
        ("presliding", "no force is recorded"),
        ("valve-flow", "the rig file has no [valve]"),
    ] {
        let (status, text) = pneuma(part, &folder, &recordings, &[]);
        assert_eq!(status, 2, "{part}: {text}");
        let last = text.lines().last().unwrap_or_default();
        assert!(last.contains(lacks), "{part}: {last}");
    }
}
