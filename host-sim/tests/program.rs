//! The program as a user runs it.

use std::path::Path;
use std::process::{Command, Output};

fn pneuma(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn rig() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/vessel-leak.toml");
    path.display().to_string()
}

#[test]
fn val_bad_input_is_one_line_and_status_2() {
    for arguments in [
        ["inspect", "--rig", "no-rig.toml", "run.csv"],
        ["inspect", "--rig", &rig(), "no-run.csv"],
        ["inspect", "--rig", &rig(), env!("CARGO_MANIFEST_DIR")],
    ] {
        let output = pneuma(&arguments);
        let text = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.starts_with("error: "), "{text}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn val_inspect_prints_and_writes_json() {
    let folder = std::env::temp_dir();
    let base = format!("pneuma-inspect-{}", std::process::id());
    let (run, json) = (
        folder.join(format!("{base}.csv")),
        folder.join(format!("{base}.json")),
    );
    let rows: String = (0..100)
        .map(|row| format!("{}.{},{}\n", row / 10, row % 10, 5.0))
        .collect();
    std::fs::write(&run, format!("time_s,pressure_bar_gauge\n{rows}")).expect("a file");
    let (run, json) = (run.display().to_string(), json.display().to_string());
    let output = pneuma(&["inspect", "--rig", &rig(), "--json", &json, &run]);
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.contains("FAULT: lines 2 to 101"), "{text}");
    let written = std::fs::read_to_string(&json).expect("the JSON");
    assert!(written.contains("\"kind\": \"dead\""), "{written}");
    for file in [run, json] {
        let _ = std::fs::remove_file(file);
    }
}

/// A decay by a laminar leak, as a leak test logs it.
fn leak_test(rows: u32) -> String {
    let mut text = String::from("time_s,pressure_bar_gauge\n");
    for row in 0..rows {
        let time = 0.1 * f64::from(row);
        let ripple = 0.001 * (7.3 * time).sin();
        text += &format!("{time:.1},{:.4}\n", 6.0 / (1.0 + 0.05 * time) + ripple);
    }
    text
}

#[test]
fn regress_diagnose_refuses_what_it_cannot_use_or_would_destroy() {
    let folder = std::env::temp_dir().join(format!("pneuma-diagnose-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = |name: &str, rows| {
        let path = folder.join(name);
        std::fs::write(&path, leak_test(rows)).expect("a file");
        path.display().to_string()
    };
    let (run, short) = (file("run.csv", 300), file("short.csv", 3));
    let before = std::fs::read_to_string(&run).expect("the recording");
    let part = format!("{run}@50..20");
    for arguments in [
        vec!["--train", &short],
        vec!["--train", &part],
        vec!["--train", &run, "--held-out", &run],
        vec!["--train", &run, "--json", &run],
    ] {
        let rig = rig();
        let all: Vec<&str> = ["diagnose", "--rig", &rig]
            .into_iter()
            .chain(arguments)
            .collect();
        let output = pneuma(&all);
        let text = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{all:?}: {text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
    let after = std::fs::read_to_string(&run).expect("the recording");
    assert_eq!(before, after, "the recording was overwritten");
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn prop_the_same_command_writes_the_same_bytes() {
    let folder = std::env::temp_dir().join(format!("pneuma-bytes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let run = folder.join("run.csv");
    std::fs::write(&run, leak_test(300)).expect("a file");
    let run = run.display().to_string();
    let (train, held) = (format!("{run}@0..60"), format!("{run}@60..100"));
    let verdict = |name: &str| {
        let json = folder.join(name).display().to_string();
        let rig = rig();
        let arguments = [
            "diagnose",
            "--rig",
            &rig,
            "--train",
            &train,
            "--held-out",
            &held,
            "--json",
            &json,
        ];
        let output = pneuma(&arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        std::fs::read(json).expect("the verdict")
    };
    let first = verdict("first.json");
    assert!(String::from_utf8_lossy(&first).contains("chamber-leakage"));
    assert_eq!(first, verdict("second.json"));
    let _ = std::fs::remove_dir_all(&folder);
}
