//! No file is lost: outputs never replace an input, two runs never share one
//! output, and the exit status says how a command ended.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::rig_file;

fn pneuma(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program runs")
}

/// A vessel that leaks: 400 rows with a little noise of their own.
fn leak(start_bar: f64, seed: u32) -> String {
    let mut state = seed;
    let mut rows = String::from("time_s,pressure_bar_gauge\n");
    for row in 0..400 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 8) / f64::from(1 << 24) - 0.5;
        let time_s = f64::from(row);
        let pressure = start_bar * (-time_s / 900.0).exp() + 0.01 * noise;
        rows.push_str(&format!("{time_s},{pressure:.4}\n"));
    }
    rows
}

/// The same through a laminar gap: `p' = (ambient^2 - p^2) / k`.
fn laminar(start_bar: f64, seed: u32) -> String {
    const AMBIENT_BAR: f64 = 1.013_25;
    const K_BAR_S: f64 = 8000.0;
    let noisy = leak(0.0, seed);
    let noise = noisy.lines().skip(1).map(|line| {
        let (_, value) = line.split_once(',').expect("two cells");
        value.parse::<f64>().expect("a number")
    });
    let mut absolute_bar = start_bar + AMBIENT_BAR;
    let mut rows = String::from("time_s,pressure_bar_gauge\n");
    for (row, noise) in noise.enumerate() {
        rows.push_str(&format!(
            "{row},{:.4}\n",
            absolute_bar - AMBIENT_BAR + noise
        ));
        absolute_bar += (AMBIENT_BAR.powi(2) - absolute_bar.powi(2)) / K_BAR_S;
    }
    rows
}

/// A folder with a rig and two recordings.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::copy(rig_file("vessel-leak.toml"), folder.path().join("rig.toml")).expect("copied");
    fs::write(folder.path().join("a.csv"), leak(5.0, 1)).expect("written");
    fs::write(folder.path().join("b.csv"), leak(4.0, 2)).expect("written");
    folder
}

fn refused(folder: &Path, arguments: &[&str], wanted: &str) {
    let output = pneuma(folder, arguments);
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert_eq!(said.lines().count(), 1, "{arguments:?}: {said}");
    assert!(
        said.contains(wanted),
        "{arguments:?}: {said} lacks {wanted}"
    );
}

#[cfg(unix)]
#[test]
fn prop_no_output_of_any_command_replaces_an_input() {
    let folder = folder();
    let root = folder.path();
    fs::create_dir(root.join("sub")).expect("a folder");
    std::os::unix::fs::symlink("a.csv", root.join("link.csv")).expect("a link");
    fs::hard_link(root.join("a.csv"), root.join("hard.csv")).expect("a link");
    let scenario = fs::read_to_string(rig_file("../scenarios/sine.toml")).expect("a scenario");
    let scenario = scenario.replace("../rigs/paper.toml", "paper.toml");
    fs::write(root.join("scenario.toml"), scenario).expect("written");
    fs::copy(rig_file("paper.toml"), root.join("paper.toml")).expect("copied");
    let before = ["a.csv", "b.csv", "rig.toml", "scenario.toml", "paper.toml"]
        .map(|name| (name, fs::read(root.join(name)).expect("read")));
    let over_a = ["a.csv", "./a.csv", "sub/../a.csv", "link.csv", "hard.csv"];
    for target in over_a {
        for command in ["inspect", "compare"] {
            for option in ["--json", "--report"] {
                refused(
                    root,
                    &[command, "--rig", "rig.toml", "a.csv", option, target],
                    "is an input",
                );
            }
        }
        for (command, train) in [
            ("fit", "a.csv"),
            ("diagnose", "a.csv"),
            ("diagnose", "a.csv@0..50"),
        ] {
            for option in ["--json", "--report", "--improved-rig"] {
                let arguments = [
                    command, "--rig", "rig.toml", "--train", train, option, target,
                ];
                refused(root, &arguments, "is an input");
            }
        }
    }
    let arguments = [
        "compare", "--rig", "rig.toml", "a.csv", "--json", "rig.toml",
    ];
    refused(root, &arguments, "is an input");
    for target in ["scenario.toml", "paper.toml"] {
        refused(
            root,
            &["simulate", "scenario.toml", "--out", target],
            "is an input",
        );
    }
    for target in ["rig.toml", "sub/../rig.toml"] {
        refused(
            root,
            &["settings", "--rig", "rig.toml", "--out", target],
            "is an input",
        );
    }
    let arguments = [
        "fit", "--rig", "rig.toml", "--train", "a.csv", "--json", "new", "--report", "./new",
    ];
    refused(root, &arguments, "two outputs");
    let arguments = [
        "compare",
        "--rig",
        "rig.toml",
        "a.csv",
        "--json",
        "none/out.json",
    ];
    refused(root, &arguments, "the folder does not exist");
    for (name, content) in before {
        assert_eq!(fs::read(root.join(name)).expect("read"), content, "{name}");
    }
}

#[test]
fn regress_a_file_called_partial_is_a_file_like_others() {
    let folder = folder();
    let root = folder.path();
    fs::rename(root.join("a.csv"), root.join("out.json.partial")).expect("renamed");
    let before = fs::read(root.join("out.json.partial")).expect("read");
    let arguments = [
        "inspect",
        "--rig",
        "rig.toml",
        "out.json.partial",
        "--json",
        "out.json",
    ];
    assert!(pneuma(root, &arguments).status.success());
    assert_eq!(
        fs::read(root.join("out.json.partial")).expect("read"),
        before
    );
    assert!(root.join("out.json").is_file());
}

#[test]
fn val_an_output_that_standard_output_goes_to_is_refused() {
    let folder = folder();
    let target = fs::File::create(folder.path().join("out.json")).expect("made");
    let output = Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .current_dir(folder.path())
        .args([
            "inspect", "--rig", "rig.toml", "a.csv", "--json", "out.json",
        ])
        .stdout(target)
        .stderr(Stdio::piped())
        .output()
        .expect("the program runs");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("standard output"), "{said}");
}

#[test]
fn prop_two_runs_with_one_output_leave_the_whole_file_of_one() {
    let folder = folder();
    let root = folder.path();
    let alone = |name: &str| {
        let arguments = ["inspect", "--rig", "rig.toml", name, "--json", "alone.json"];
        assert!(pneuma(root, &arguments).status.success());
        fs::read(root.join("alone.json")).expect("read")
    };
    let whole = [alone("a.csv"), alone("b.csv")];
    for _ in 0..25 {
        let start = |name: &str| {
            Command::new(env!("CARGO_BIN_EXE_pneuma"))
                .current_dir(root)
                .args(["inspect", "--rig", "rig.toml", name, "--json", "out.json"])
                .stdout(Stdio::null())
                .spawn()
                .expect("the program runs")
        };
        let mut pair = [start("a.csv"), start("b.csv")];
        for run in &mut pair {
            assert!(run.wait().expect("it ends").success());
        }
        let written = fs::read(root.join("out.json")).expect("read");
        assert!(whole.contains(&written));
    }
    let left = fs::read_dir(root).expect("a folder").filter(|entry| {
        let entry = entry.as_ref().expect("an entry");
        entry.file_name().to_string_lossy().ends_with(".partial")
    });
    assert_eq!(left.count(), 0);
}

/// A copy under another name, with another clock and other line ends.
#[test]
fn val_rows_given_twice_are_refused_by_their_content() {
    let folder = folder();
    let root = folder.path();
    let mut copy = String::from("pressure_bar_gauge;time_s\r\n");
    for line in leak(5.0, 1).lines().skip(101) {
        let (time, pressure) = line.split_once(',').expect("two cells");
        let time_s: f64 = time.parse().expect("a number");
        copy.push_str(&format!("{pressure};{}\r\n", time_s + 1000.0));
    }
    fs::write(root.join("copy.csv"), copy).expect("written");
    let mut export = String::from("time_s,pressure_bar_gauge\n");
    for line in leak(5.0, 1).lines().skip(1).step_by(2) {
        let (time, pressure) = line.split_once(',').expect("two cells");
        let pressure: f64 = pressure.parse().expect("a number");
        export.push_str(&format!("{time},{pressure:.4}\n"));
    }
    fs::write(root.join("export.csv"), export).expect("written");
    for command in ["fit", "diagnose"] {
        let given = [command, "--rig", "rig.toml", "--train", "a.csv"];
        let held_out = [&given[..], &["--held-out", "copy.csv"]].concat();
        refused(
            root,
            &held_out,
            "copy.csv:2: rows from here on are trained on too (a.csv)",
        );
        let exported = [&given[..], &["--held-out", "export.csv"]].concat();
        let said = "export.csv:2: rows from here on have the noise of rows that are trained on too";
        refused(root, &exported, said);
        let twice = [&given[..], &["copy.csv"]].concat();
        refused(root, &twice, "given twice");
        let parts = [command, "--rig", "rig.toml", "--train", "a.csv@0..60"];
        let parts = [&parts[..], &["--held-out", "a.csv@40..100"]].concat();
        refused(root, &parts, "are trained on too");
    }
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn prop_the_order_of_recordings_changes_no_byte() {
    let folder = folder();
    let root = folder.path();
    // A declared leak that fits: nothing is searched for.
    let rig = fs::read_to_string(root.join("rig.toml")).expect("read");
    let rig = rig
        + "\n[effects.chamber-leakage]\nlaminar_a_kg_s_Pa2 = 1.0e-16\n[uncertainty]\n\"effects.chamber-leakage.laminar_a_kg_s_Pa2\" = 3.0\n";
    fs::write(root.join("rig.toml"), rig).expect("written");
    for (name, start_bar, seed) in [("a.csv", 5.0, 1), ("b.csv", 4.0, 2), ("c.csv", 3.0, 3)] {
        fs::write(root.join(name), laminar(start_bar, seed)).expect("written");
    }
    let verdict = |order: [&str; 2], name: &str| {
        let given = [
            "diagnose",
            "--rig",
            "rig.toml",
            "--held-out",
            "c.csv",
            "--json",
            name,
        ];
        let output = pneuma(root, &[&given[..], &["--train"], &order].concat());
        assert!(output.status.success());
        fs::read_to_string(root.join(name)).expect("read")
    };
    let (first, second) = (
        verdict(["a.csv", "b.csv"], "1"),
        verdict(["b.csv", "a.csv"], "2"),
    );
    assert_eq!(first, second);
}

/// A pipe is read once and its report does not wait for a second writer.
#[cfg(unix)]
#[test]
fn val_recordings_and_rigs_come_through_pipes() {
    let folder = folder();
    let script = format!(
        "{} inspect --rig <(cat rig.toml) --report r.html --json j.json <(cat a.csv)",
        env!("CARGO_BIN_EXE_pneuma")
    );
    let output = Command::new("timeout")
        .args(["60", "bash", "-c", &script])
        .current_dir(folder.path())
        .output()
        .expect("bash runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let page = fs::read_to_string(folder.path().join("r.html")).expect("read");
    assert!(page.contains("read once from a pipe"));
}
