//! A wrong or half rig is said at once: laws that lack a number, numbers that are
//! assumed, fits that are not to be trusted.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A vessel whose leak through an orifice is declared, with its uncertainty.
const RIG: &str = r#"format = "rig/1"
[signals]
t = { column = "time_s", unit = "s" }
p_a = { column = "pressure_bar_gauge", unit = "bar(g)", noise = 200.0, resolution = 100.0 }
[vessel]
volume_m3 = 0.01
[chambers]
model = "polytropic-process"
polytropic_index = 1.0
[effects.chamber-leakage]
orifice_a_m2 = 1.0e-7
[uncertainty]
"effects.chamber-leakage.orifice_a_m2" = 0.3
"#;

fn pneuma(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program runs")
}

/// An isothermal decay by a choked leak: `p' = -p / tau`, down to three bar absolute.
fn decay(tau_s: f64, seed: u32) -> String {
    let mut state = seed;
    let mut rows = String::from("time_s,pressure_bar_gauge\n");
    for row in 0..400 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 8) / f64::from(1 << 24) - 0.5;
        let time_s = 0.1 * f64::from(row);
        let absolute_bar = 7.0 * (-time_s / tau_s).exp();
        rows.push_str(&format!(
            "{time_s:.1},{:.3}\n",
            absolute_bar - 1.01325 + 0.004 * noise
        ));
    }
    rows
}

fn folder(files: &[(&str, String)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("written");
    }
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Time constant of the declared leak, s: `V / (A C1 R sqrt(T))`, its area being the effective one.
fn declared_tau_s() -> f64 {
    0.01 / (1.0e-7 * 0.040_418 * 287.0 * 293.15_f64.sqrt())
}

#[test]
fn val_an_uncertain_effect_is_refitted_and_nothing_else_is_blamed() {
    let truth = 0.8 * declared_tau_s();
    let folder = folder(&[
        ("rig.toml", RIG.to_owned()),
        ("a.csv", decay(truth, 1)),
        ("b.csv", decay(truth, 2)),
    ]);
    let arguments = [
        "diagnose",
        "--rig",
        "rig.toml",
        "--train",
        "a.csv",
        "--held-out",
        "b.csv",
        "--json",
        "v.json",
    ];
    let output = pneuma(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let verdict: Value =
        serde_json::from_slice(&fs::read(folder.path().join("v.json")).expect("read"))
            .expect("JSON");
    assert_eq!(verdict["verdict"], "nothing-missing", "{verdict}");
    let found = &verdict["parameters"]["effects.chamber-leakage.orifice_a_m2"];
    let area_m2 = found["refitted"].as_f64().expect("refitted");
    assert!((area_m2 / 1.25e-7 - 1.0).abs() < 0.05, "{area_m2}");
}

#[test]
fn val_what_is_assumed_is_listed_in_report_and_json() {
    let tau_s = declared_tau_s();
    let folder = folder(&[("rig.toml", RIG.to_owned()), ("a.csv", decay(tau_s, 1))]);
    let arguments = [
        "diagnose", "--rig", "rig.toml", "--train", "a.csv", "--json", "v.json", "--report",
        "r.html",
    ];
    let output = pneuma(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let verdict: Value =
        serde_json::from_slice(&fs::read(folder.path().join("v.json")).expect("read"))
            .expect("JSON");
    let assumed = verdict["assumed"].as_array().expect("a list");
    let keys: Vec<&str> = assumed
        .iter()
        .filter_map(|one| one["key"].as_str())
        .collect();
    let wanted = [
        "gas.gamma",
        "gas.gas_constant_J_kgK",
        "environment.pressure_Pa",
        "environment.temperature_K",
    ];
    assert_eq!(keys, wanted);
    let page = fs::read_to_string(folder.path().join("r.html")).expect("read");
    let said = text(&output.stdout);
    for key in wanted {
        assert!(said.contains(key) && page.contains(key), "{key}");
    }
}

/// A rig without its stroke was compared with an error of 0.00.
#[test]
fn regress_a_law_that_lacks_a_number_is_refused_in_one_line() {
    let rig = r#"format = "rig/1"
[signals]
t = { column = "t", unit = "s" }
x = { column = "x", unit = "m" }
p_a = { column = "p", unit = "Pa(abs)" }
[cylinder]
area_a_m2 = 4.909e-4
dead_volume_a_m3 = 2e-5
[chambers]
model = "polytropic-process"
polytropic_index = 1.2
"#;
    let rows: String = (0..100).map(|row| format!("{row},0.1,3e5\n")).collect();
    let folder = folder(&[
        ("rig.toml", rig.to_owned()),
        ("a.csv", format!("t,x,p\n{rows}")),
    ]);
    for command in [
        ["compare", "--rig", "rig.toml", "a.csv"],
        ["fit", "--rig", "rig.toml", "--train"],
    ] {
        let arguments: Vec<&str> = if command[0] == "fit" {
            [
                &command[..],
                &["a.csv", "--free", "chambers.polytropic_index"],
            ]
            .concat()
        } else {
            command.to_vec()
        };
        let output = pneuma(folder.path(), &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(
            said.contains("[cylinder] stroke_m is missing (stroke; typically"),
            "{said}"
        );
    }
}

#[test]
fn val_a_fit_that_predicts_worse_says_so_first_and_exits_with_1() {
    let folder = folder(&[
        ("rig.toml", RIG.to_owned()),
        ("a.csv", decay(0.7 * declared_tau_s(), 1)),
        ("b.csv", decay(declared_tau_s(), 2)),
    ]);
    let arguments = [
        "fit",
        "--rig",
        "rig.toml",
        "--train",
        "a.csv",
        "--held-out",
        "b.csv",
        "--improved-rig",
        "i.toml",
    ];
    let output = pneuma(folder.path(), &arguments);
    let said = text(&output.stdout);
    assert_eq!(
        output.status.code(),
        Some(1),
        "{said}{}",
        text(&output.stderr)
    );
    let first = said
        .lines()
        .position(|line| line.starts_with("NOT TO BE TRUSTED"));
    let tables = said.lines().position(|line| line.starts_with("chambers"));
    assert!(first < tables && first.is_some(), "{said}");
    assert!(!folder.path().join("i.toml").exists());
    let accepted = pneuma(folder.path(), &[&arguments[..], &["--accept"]].concat());
    assert!(accepted.status.success() && folder.path().join("i.toml").exists());
}

#[test]
fn val_the_declared_noise_is_compared_with_the_rows_and_makes_no_verdict() {
    let truth = declared_tau_s();
    let verdict = |noise: &str| {
        let rig = RIG.replace("noise = 200.0", &format!("noise = {noise}"));
        let folder = folder(&[
            ("rig.toml", rig),
            ("a.csv", decay(truth, 1)),
            ("b.csv", decay(truth, 2)),
        ]);
        let arguments = [
            "diagnose",
            "--rig",
            "rig.toml",
            "--train",
            "a.csv",
            "--held-out",
            "b.csv",
            "--json",
            "v.json",
        ];
        assert!(pneuma(folder.path(), &arguments).status.success());
        let bytes = fs::read(folder.path().join("v.json")).expect("read");
        serde_json::from_slice::<Value>(&bytes).expect("JSON")
    };
    for noise in ["60.0", "120.0", "240.0", "500.0"] {
        assert_eq!(verdict(noise)["verdict"], "nothing-missing", "{noise}");
    }
    let doubts = verdict("30.0")["doubts"].to_string();
    assert!(
        doubts.contains("signals.p_a.noise") && doubts.contains("the larger counts"),
        "{doubts}"
    );
}
