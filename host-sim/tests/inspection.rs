//! Inspection: no fault in any recording at hand, a fault for each injected
//! one, and figures that agree with what the practice rigs declare.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use diagnosis::inspect::{FaultKind, inspect};
use host_sim::recording::Recording;
use host_sim::rig::Rig;

/// The real recordings: rig file, folder, and how their files end.
const REAL: &[(&str, &str)] = &[
    ("gas-cylinder", "exp"),
    ("seal-friction", "tsv"),
    ("positioning-stage", "csv"),
    ("plant-valve", "csv"),
    ("vessel-leak", "csv"),
];

fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|found| found == ending))
        .collect();
    files.sort();
    files
}

fn load(rig: &Path, recording: &Path) -> (Rig, Recording) {
    let rig = Rig::read(rig).unwrap_or_else(|error| panic!("{error}"));
    let recording =
        Recording::read(recording, &rig.signals).unwrap_or_else(|error| panic!("{error}"));
    (rig, recording)
}

#[test]
fn val_real_recordings_have_no_fault() {
    let Some(folder) = common::recordings("val_real_recordings_have_no_fault") else {
        return;
    };
    for (name, ending) in REAL {
        let found = files(&folder.join("real").join(name), ending);
        assert!(!found.is_empty(), "{name}");
        for path in found {
            let (rig, recording) = load(&common::rig_file(&format!("{name}.toml")), &path);
            assert_eq!(inspect(&rig, &recording).faults, [], "{}", path.display());
        }
    }
}

#[test]
fn val_practice_recordings_have_no_fault_and_the_declared_noise() {
    /// Quantisation widens the measured noise, up to this much.
    const WIDENED: f64 = 1.35;
    let Some(folder) = common::recordings("val_practice_recordings_have_no_fault") else {
        return;
    };
    for case in 1..=12 {
        let case = folder.join(format!("practice/p{case:02}"));
        for path in files(&case, "csv") {
            let (rig, recording) = load(&case.join("rig.toml"), &path);
            let inspection = inspect(&rig, &recording);
            assert_eq!(inspection.faults, [], "{}", path.display());
            for signal in &inspection.signals {
                let Some(declared) = signal.declared_noise else {
                    continue;
                };
                let ratio = signal.noise / declared;
                let shown = format!("{} {}: {ratio}", path.display(), signal.name);
                assert!((0.75..=WIDENED).contains(&ratio), "{shown}");
            }
        }
    }
}

/// Rows `from` to `to` of a recording, as if it had been cut there.
fn cut(recording: &Recording, from: usize, to: usize) -> Recording {
    let mut part = recording.clone();
    part.time_s = recording.time_s[from..to].to_vec();
    part.line = recording.line[from..to].to_vec();
    for values in part.signals.values_mut() {
        *values = values[from..to].to_vec();
    }
    part
}

/// Recordings kept back are other stretches of the same rigs: cutting the ones
/// at hand imitates them, with rests and extremes in other places.
#[test]
fn val_no_part_of_a_recording_has_a_fault() {
    let Some(folder) = common::recordings("val_no_part_of_a_recording_has_a_fault") else {
        return;
    };
    let mut found = Vec::new();
    let mut check = |rig: &Rig, recording: &Recording| {
        for parts in [3, 10, 40] {
            let rows = recording.len() / parts;
            for part in 0..parts {
                let part = cut(recording, part * rows, (part + 1) * rows);
                let faults = inspect(rig, &part).faults;
                found.extend(faults.iter().map(|fault| {
                    format!("{} in {parts} parts: {}", recording.name, fault.sentence)
                }));
            }
        }
    };
    for (name, ending) in REAL {
        for path in files(&folder.join("real").join(name), ending) {
            let (rig, recording) = load(&common::rig_file(&format!("{name}.toml")), &path);
            check(&rig, &recording);
        }
    }
    for case in 1..=12 {
        let case = folder.join(format!("practice/p{case:02}"));
        for path in files(&case, "csv") {
            let (rig, recording) = load(&case.join("rig.toml"), &path);
            check(&rig, &recording);
        }
    }
    assert!(found.is_empty(), "{}\n{}", found.len(), found.join("\n"));
}

/// A change to the recorded values of one signal.
type Injection = fn(&mut [f64]);

fn freeze(values: &mut [f64]) {
    let held = values[2000];
    values[2000..2400].fill(held);
}

fn kill(values: &mut [f64]) {
    let held = values[0];
    values.fill(held);
}

fn die_midway(values: &mut [f64]) {
    let from = values.len() / 2;
    let held = values[from];
    values[from..].fill(held);
}

fn drop_out(values: &mut [f64]) {
    values[3000..3040].fill(0.0);
}

fn spike(values: &mut [f64]) {
    let peak = values.iter().copied().fold(0.0, f64::max);
    values[3000] = 3.0 * peak;
}

fn clip(values: &mut [f64]) {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rail = sorted[sorted.len() * 9 / 10];
    for value in values {
        *value = value.min(rail);
    }
}

fn scale_by_1000(values: &mut [f64]) {
    for value in values {
        *value *= 1000.0;
    }
}

fn negate(values: &mut [f64]) {
    for value in values {
        *value = -*value;
    }
}

/// What is done to which signals, and the fault that must be found.
const INJECTIONS: &[(&str, Injection, &[&str], FaultKind)] = &[
    (
        "freeze",
        freeze,
        &["p_a", "p_b", "v", "p_s"],
        FaultKind::Frozen,
    ),
    (
        "kill",
        kill,
        &["p_a", "p_b", "p_s", "x", "v", "u"],
        FaultKind::Dead,
    ),
    (
        "die midway",
        die_midway,
        &["p_a", "p_b", "p_s", "v"],
        FaultKind::Frozen,
    ),
    (
        "drop out",
        drop_out,
        &["p_a", "p_b", "p_s"],
        FaultKind::Dropout,
    ),
    (
        "spike",
        spike,
        &["p_a", "p_b", "p_s", "x", "v"],
        FaultKind::Spike,
    ),
    ("clip", clip, &["p_a", "p_b", "v"], FaultKind::Saturated),
    ("scale", scale_by_1000, &["v", "x"], FaultKind::Inconsistent),
    ("negate", negate, &["v"], FaultKind::Inconsistent),
];

const INJECTED_INTO: [&str; 5] = [
    "train-1.csv",
    "train-2.csv",
    "train-3.csv",
    "train-4.csv",
    "held-1.csv",
];

#[test]
fn val_injected_faults_are_found_in_the_injected_channel() {
    // Each file of the five comes by, in two axes or three.
    injected_faults_are_found(|case| &INJECTED_INTO[case % 5..][..1]);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_injected_faults_are_found_in_all_recordings() {
    injected_faults_are_found(|_| &INJECTED_INTO);
}

fn injected_faults_are_found(files: fn(usize) -> &'static [&'static str]) {
    let Some(folder) = common::recordings("val_injected_faults_are_found") else {
        return;
    };
    let (mut missed, mut injected) = (Vec::new(), 0);
    for case in 1..=12 {
        let axis = folder.join(format!("practice/p{case:02}"));
        for file in files(case) {
            let (rig, recording) = load(&axis.join("rig.toml"), &axis.join(file));
            injected += injections(&recording);
            missed.extend(missed_injections(&rig, &recording));
        }
    }
    let listed = missed.join("\n");
    println!(
        "{} of {injected} injected faults missed\n{listed}",
        missed.len()
    );
    // Known misses: a dead command in recordings with few reversals, and a rail
    // that cuts plateaus no longer than the rests of the same recording.
    assert!(missed.len() * 20 <= injected, "{}\n{listed}", missed.len());
}

fn injections(recording: &Recording) -> usize {
    let names = INJECTIONS.iter().flat_map(|injection| injection.2);
    names
        .filter(|name| recording.signals.contains_key(**name))
        .count()
}

fn missed_injections(rig: &Rig, recording: &Recording) -> Vec<String> {
    let mut missed = Vec::new();
    for (title, inject, names, kind) in INJECTIONS {
        for name in *names {
            let mut changed = recording.clone();
            let Some(values) = changed.signals.get_mut(*name) else {
                continue;
            };
            inject(values);
            let faults = inspect(rig, &changed).faults;
            let found = faults.iter().any(|fault| {
                fault.kind == *kind && (fault.signal == *name || *kind == FaultKind::Inconsistent)
            });
            if !found {
                missed.push(format!("{}: {title} {name}: {faults:?}", recording.name));
            }
        }
    }
    missed
}

/// What is done to the wiring of a rig, and the signal that is to be blamed.
type Miswiring = (&'static str, fn(&mut Recording), &'static str);

fn change(recording: &mut Recording, names: &[&str], by: fn(f64) -> f64) {
    for name in names {
        if let Some(values) = recording.signals.get_mut(*name) {
            values.iter_mut().for_each(|value| *value = by(*value));
        }
    }
}

const MISWIRINGS: &[Miswiring] = &[
    (
        "pressures exchanged",
        |run| {
            let p_a = run.signals.remove("p_a").expect("p_a");
            let p_b = run.signals.insert("p_b".into(), p_a).expect("p_b");
            run.signals.insert("p_a".into(), p_b);
        },
        "p_a",
    ),
    (
        "position negated",
        |run| change(run, &["x", "v"], |x| -x),
        "x",
    ),
    (
        "command mirrored at 5 V",
        |run| change(run, &["u"], |u| 10.0 - u),
        "u",
    ),
    (
        "command in millivolts",
        |run| change(run, &["u"], |u| 1e3 * u),
        "u",
    ),
    (
        "pressures in kilopascals",
        |run| change(run, &["p_a", "p_b"], |p| 1e-3 * p),
        "p_a",
    ),
    (
        "pressures in hundredths of a bar",
        |run| change(run, &["p_a", "p_b"], |p| 1e2 * p),
        "p_b",
    ),
    (
        "position from an end",
        |run| change(run, &["x"], |x| x + 0.4),
        "x",
    ),
];

/// Whatever else the rig leaves out: every practice axis, in every way that this can be
/// done to it, as far as it strokes to and fro.
#[test]
fn val_what_is_wired_wrong_is_told() {
    let Some(folder) = common::recordings("val_what_is_wired_wrong_is_told") else {
        return;
    };
    let (mut missed, mut told) = (Vec::new(), 0);
    for case in 1..=12 {
        let case = folder.join(format!("practice/p{case:02}"));
        for path in files(&case, "csv") {
            let (rig, recording) = load(&case.join("rig.toml"), &path);
            for (title, miswire, signal) in MISWIRINGS {
                let mut miswired = recording.clone();
                miswire(&mut miswired);
                let faults = inspect(&rig, &miswired).faults;
                let is_told = faults.iter().any(|fault| fault.signal == *signal);
                told += usize::from(is_told);
                if !is_told {
                    missed.push(format!("{} {title}", path.display()));
                }
            }
        }
    }
    println!("{told} told, {} not:\n{}", missed.len(), missed.join("\n"));
    // Signs show in strokes to and fro, which one recording in four has not.
    assert!(missed.len() * 4 <= told, "{}", missed.join("\n"));
}

#[test]
fn val_a_fault_names_its_lines() {
    let rig = "format = \"rig/1\"\n[signals]\nt = { column = 0, unit = \"s\" }\n\
               x = { column = 1, unit = \"m\" }\np_a = { column = 2, unit = \"Pa(abs)\" }\n";
    let rig = Rig::parse(rig, "rig.toml").expect("a rig");
    let text: String = (0..600)
        .map(|row| {
            let phase = f64::from(row) * 0.05;
            let frozen = f64::from(row.clamp(0, 299)) * 0.05;
            format!("{row},{:.6},{:.1}\n", phase.sin(), 5e5 + 1e5 * frozen.cos())
        })
        .collect();
    let recording = Recording::read_from(text.as_bytes(), "run.csv", None, &rig.signals);
    let inspection = inspect(&rig, &recording.expect("a recording"));
    let [fault] = &inspection.faults[..] else {
        panic!("{:?}", inspection.faults);
    };
    assert_eq!((fault.first_line, fault.last_line), (300, 600));
    assert!(inspection.to_string().contains("FAULT: lines 300 to 600"));
}

#[test]
fn val_a_response_shows_what_the_model_does_not_know() {
    let axis = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/leaking-axis");
    let place = tempfile::tempdir().unwrap();
    let json = place.path().join("response.json");
    let arguments = host_sim::cli::response::ResponseArguments {
        rig: axis.join("rig.toml"),
        from: "u".into(),
        to: vec!["p_a".into()],
        window_s: Some(0.5),
        report: Some(place.path().join("response.html")),
        json: Some(json.clone()),
        recordings: vec![axis.join("train-1.csv")],
    };
    let mut out = Vec::new();
    host_sim::cli::response::run(&arguments, &mut out).unwrap();
    let text = String::from_utf8(out).unwrap();
    assert!(
        text.contains("u to p_a") && text.contains("coherence"),
        "{text}"
    );
    let found: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let points = |which: &str| found["responses"][0][which].as_array().unwrap().clone();
    let (recorded, model) = (points("recorded"), points("model"));
    assert_eq!(recorded.len(), model.len());
    // Where most of the pressure follows the command, the model says so too, within a factor.
    let plain: Vec<f64> = recorded
        .iter()
        .zip(&model)
        .filter(|(point, _)| point["coherence"].as_f64().unwrap() > 0.8)
        .map(|(one, other)| {
            other["magnitude"].as_f64().unwrap() / one["magnitude"].as_f64().unwrap()
        })
        .collect();
    assert!(plain.len() > 3, "{text}");
    assert!(
        plain.iter().all(|ratio| (0.5..2.0).contains(ratio)),
        "{plain:?}"
    );
}
