//! From a data sheet to a rig file that its recordings pass: `pneuma init` and `pneuma check`.

#![allow(
    clippy::unwrap_used,
    reason = "the helpers of a test fail by panicking, as the tests do"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use host_sim::rig::Rig;

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("first_rig")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Runs the program without a terminal.
fn pneuma(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

const SHEET: [&str; 13] = [
    "init",
    "--bore-mm",
    "25",
    "--rod-mm",
    "0",
    "--stroke-mm",
    "500",
    "--mass-kg",
    "2",
    "--valve",
    "MPYE-5-1/8",
    "--supply-bar-absolute",
    "7",
];

/// The paper's axis in motion, as its rig records it.
fn simulated(folder: &Path) -> String {
    let rig = common::rig_file("paper.toml");
    let scenario = folder.join("scenario.toml");
    let run = folder.join("run.csv");
    let content = format!(
        "format = \"scenario/1\"\nrig = {:?}\nduration_s = 2.0\n\
         [command]\nkind = \"sine\"\ncenter_V = 5.0\namplitude_V = 1.2\nfrequency_Hz = 1.0\n[noise]\nseed = 3\n",
        rig.display().to_string()
    );
    fs::write(&scenario, content).unwrap();
    let run = run.display().to_string();
    let output = pneuma(&["simulate", &scenario.display().to_string(), "--out", &run]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    run
}

fn init(folder: &Path, more: &[&str]) -> (Output, String) {
    let out = folder.join("rig.toml").display().to_string();
    let arguments = [&SHEET[..], more, &["--out", &out]].concat();
    (pneuma(&arguments), out)
}

#[test]
fn val_a_data_sheet_gives_a_commented_rig_with_the_areas_of_the_nominal_flow() {
    let (output, path) = init(&scratch("sheet"), &[]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = fs::read_to_string(&path).unwrap();
    for marked in [
        "# typical",
        "7 bar absolute",
        "from memory",
        "[uncertainty]",
    ] {
        assert!(written.contains(marked), "{marked} is not in\n{written}");
    }
    let rig = Rig::read(&path).unwrap();
    // By hand: 700 l/min at b = 0.3 are 13.8 mm2 of area times Cd, and Cd(6.013/7.013) is 0.819.
    let widest = *rig.valve.as_ref().unwrap().supply_area_m2.last().unwrap();
    assert!((widest * 1e6 - 16.86).abs() < 0.05, "{widest}");
    assert_eq!(rig.uncertainty_sd("valve.exhaust_area_m2"), Some(0.3));
    assert_eq!(rig.value("supply.pressure_Pa"), Some(7e5));
    assert_eq!(rig.uncertainty_sd("valve.null_V"), Some(0.1));
    for key in ["friction.coulomb_N", "cylinder.dead_volume_a_m3"] {
        let (value, deviation) = (rig.value(key).unwrap(), rig.uncertainty_sd(key).unwrap());
        assert!((deviation / value - 0.5).abs() < 1e-9, "{key}");
    }
}

#[test]
fn val_a_rig_from_data_sheet_and_recording_passes_the_check() {
    let folder = scratch("whole");
    let run = simulated(&folder);
    let (refused, path) = init(&folder, &["--csv", &run]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused.stderr).contains("--yes"),
        "{}",
        text(&refused.stderr)
    );
    assert!(!Path::new(&path).exists());
    let (output, path) = init(&folder, &["--csv", &run, "--yes"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let rig = Rig::read(&path).unwrap();
    for (signal, unit) in [
        ("t", "s"),
        ("u", "V"),
        ("p_a", "Pa(abs)"),
        ("x", "m"),
        ("v", "m/s"),
    ] {
        let found = rig
            .signals
            .get(signal)
            .unwrap_or_else(|| panic!("{signal} was not found"));
        assert_eq!(found.unit.as_str(), unit, "{signal}");
    }
    let noise = rig.signals.get("p_a").unwrap().noise.unwrap();
    assert!((150.0..400.0).contains(&noise), "{noise}");
    let json = folder.join("check.json").display().to_string();
    let check = pneuma(&["check", "--rig", &path, "--json", &json, &run]);
    let shown = text(&check.stdout);
    assert!(check.status.success(), "{shown}{}", text(&check.stderr));
    assert!(
        shown.contains("law chambers: runs, predicts p_a, p_b"),
        "{shown}"
    );
    assert!(shown.contains("law carriage: runs, predicts x"), "{shown}");
    assert!(shown.contains("noise of p_a: measured"), "{shown}");
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(json["format"], "check/1");
    assert_eq!(json["usable"], true);
}

/// Whoever has a board has no recording yet: the board makes the first one.
#[test]
fn val_a_rig_for_a_board_has_the_signals_that_a_board_records() {
    let (output, path) = init(&scratch("board"), &["--board", "--position-noise-um", "9"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(
        text(&output.stdout).contains("pneuma commission --rig"),
        "{}",
        text(&output.stdout)
    );
    let rig = Rig::read(&path).unwrap();
    host_sim::board::recorder::check_signals(&rig, &path).unwrap();
    let named: Vec<&str> = rig.signals.iter().map(|(name, _)| name).collect();
    assert_eq!(named.len(), 7, "{named:?}");
    assert_eq!(rig.signals.get("x").unwrap().noise, Some(9e-6));
    // 10 bar in 12 bits.
    let step_pa = rig.signals.get("p_b").unwrap().resolution.unwrap();
    assert!((step_pa - 1e6 / 4096.0).abs() < 0.1, "{step_pa}");
    host_sim::settings::controller(&rig, 1e-3).unwrap();
    let (output, _) = init(&scratch("both"), &["--board", "--csv", "run.csv"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn prop_a_file_that_is_there_is_kept_and_an_input_is_no_output() {
    let folder = scratch("kept");
    let path = folder.join("rig.toml");
    fs::write(&path, "mine").unwrap();
    let (output, _) = init(&folder, &[]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    let (output, _) = init(
        &folder,
        &["--csv", &path.display().to_string(), "--yes", "--force"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    let (output, _) = init(&folder, &["--force"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(Rig::read(&path).is_ok());
}

#[test]
fn val_without_a_terminal_all_missing_flags_are_said_on_one_line() {
    let out = scratch("missing").join("rig.toml").display().to_string();
    let output = pneuma(&["init", "--bore-mm", "25", "--out", &out]);
    assert_eq!(output.status.code(), Some(2));
    let line = text(&output.stderr);
    assert_eq!(line.lines().count(), 1, "{line}");
    for flag in [
        "--rod-mm",
        "--stroke-mm",
        "--mass-kg",
        "--valve",
        "--supply-bar-gauge",
    ] {
        assert!(line.contains(flag), "{flag}: {line}");
    }
    assert!(!line.contains("--bore-mm"), "{line}");
}

#[test]
fn val_check_says_every_fault_and_what_each_law_lacks_at_once() {
    let folder = scratch("faults");
    let path = folder.join("rig.toml");
    let rig = "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\n\
        x = { column = \"x\", unit = \"mmm\" }\np_a = { column = \"p\", unit = \"Pa(abs)\" }\n\
        [gas]\ngama = 1.4\n[supply]\npressure_Pa = 6.5\n[cylinder]\nstroke_m = 0.5\n\
        position_zero = \"end-a\"\n[chambers]\nmodel = \"polytropic-process\"\npolytropic_index = 1.2\n";
    fs::write(&path, rig).unwrap();
    let output = pneuma(&["check", "--rig", &path.display().to_string(), "no-run.csv"]);
    assert_eq!(output.status.code(), Some(2));
    let shown = text(&output.stdout);
    for told in [
        "signals.x.unit: unknown unit \"mmm\"",
        "gas.gama: unknown key",
        "gas.gamma: missing",
        "supply.pressure_Pa: 6.5 is out of range",
        "law chambers: NOT RUN",
        "cylinder.area_a_m2: piston area",
        "typical 10e-6 to 50e-6",
        "environment.pressure_Pa = 101325 Pa(abs): no [environment]",
        "no-run.csv",
        "NOT USABLE",
    ] {
        assert!(shown.contains(told), "{told} is not in\n{shown}");
    }
    assert_eq!(text(&output.stderr).lines().count(), 1);
}

#[test]
fn val_the_paper_axis_of_the_practice_recordings_starts_from_its_data_sheet() {
    let test = "val_the_paper_axis_of_the_practice_recordings_starts_from_its_data_sheet";
    let Some(recordings) = common::recordings(test) else {
        return;
    };
    let folder = scratch("practice");
    let run = |name: &str| {
        recordings
            .join("practice/p01")
            .join(name)
            .display()
            .to_string()
    };
    let out = folder.join("rig.toml").display().to_string();
    let output = pneuma(&[
        "init",
        "--bore-mm",
        "25",
        "--rod-mm",
        "0",
        "--stroke-mm",
        "500",
        "--mass-kg",
        "1.74",
        "--valve",
        "MPYE-5-1/8",
        "--supply-bar-absolute",
        "6.58",
        "--csv",
        &run("train-1.csv"),
        "--yes",
        "--out",
        &out,
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let rig = Rig::read(&out).unwrap();
    let given = Rig::read(run("rig.toml")).unwrap();
    assert_eq!(
        rig.valve.unwrap().feeds_a_when,
        given.valve.unwrap().feeds_a_when
    );
    assert_eq!(
        rig.cylinder.unwrap().position_zero,
        given.cylinder.unwrap().position_zero
    );
    let check = pneuma(&[
        "check",
        "--rig",
        &out,
        &run("train-1.csv"),
        &run("held-1.csv"),
    ]);
    assert!(check.status.success(), "{}", text(&check.stdout));
}

#[test]
fn prop_what_a_rig_offers_of_sensors_can_be_uncommented() {
    let folder = scratch("sensors");
    let path = folder.join("rig.toml");
    let path = path.to_string_lossy();
    let output = pneuma(&[&SHEET[..], &["--out", &path]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = fs::read_to_string(&*path).unwrap();
    let (before, offered) = written.split_once("# [board.p_a]").unwrap();
    let offered = offered.replace("\n# ", "\n");
    let rig = Rig::parse(&format!("{before}[board.p_a]{offered}"), "rig.toml").unwrap();
    assert_eq!(rig.board.len(), 2);
}
