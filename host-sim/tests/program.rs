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
