//! A diagnosis that is interrupted leaves nothing half-written.

#![cfg(unix)]

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;
use truth_plant::{Kind, Request, Strength};

const OLD: &str = "of the last run\n";

#[test]
fn val_an_interrupted_diagnosis_leaves_the_files_of_the_last_one() {
    let request = Request::new(11, Kind::Single).with_noise(1.0);
    let request = request.with_effect("tube-line").unwrap();
    let case = request.with_strength(Strength::Strong).draw();
    let folder = std::env::temp_dir().join(format!("interrupted-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let recordings = case.train.iter().chain(&case.held_out);
    for (name, text) in recordings.chain([&("rig.toml".to_owned(), case.rig_toml.clone())]) {
        fs::write(folder.join(name), text).unwrap();
    }
    let outputs = ["verdict.json", "report.html", "improved.toml"];
    for name in outputs {
        fs::write(folder.join(name), OLD).unwrap();
    }
    let before = fs::read_dir(&folder).unwrap().count();
    let names = |files: &[(String, String)]| files.iter().map(|file| file.0.clone()).collect();
    let (train, held_out): (Vec<String>, Vec<String>) = (names(&case.train), names(&case.held_out));
    // What is started in the background of a script is deaf to Ctrl-C, and so is what it starts.
    let mut command = Command::new("env");
    command.args(["--default-signal=INT", env!("CARGO_BIN_EXE_pneuma")]);
    command.current_dir(&folder).stderr(Stdio::null());
    command.args(["diagnose", "--rig", "rig.toml", "--train"]);
    command.args(train).arg("--held-out").args(held_out);
    for (option, name) in ["--json", "--report", "--improved-rig"].iter().zip(outputs) {
        command.args([option, name]);
    }
    let mut diagnosis = command.spawn().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let id = diagnosis.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let status = diagnosis.wait().unwrap();
    assert!(!status.success(), "it was done before it was interrupted");
    for name in outputs {
        assert_eq!(
            fs::read_to_string(folder.join(name)).unwrap(),
            OLD,
            "{name}"
        );
    }
    assert_eq!(
        fs::read_dir(&folder).unwrap().count(),
        before,
        "files were left"
    );
    fs::remove_dir_all(&folder).unwrap();
}
