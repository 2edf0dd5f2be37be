//! `pneuma fit` and `pneuma compare` as a user runs them.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::{recordings, rig_file};
use serde_json::Value;

fn pneuma(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A file in the temporary folder that goes away with it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let name = format!("pneuma-commands-{}-{name}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn with(name: &str, content: &str) -> Self {
        let scratch = Self::new(name);
        std::fs::write(&scratch.0, content).expect("a file");
        scratch
    }

    fn path(&self) -> String {
        text(&self.0)
    }

    fn read(&self) -> String {
        std::fs::read_to_string(&self.0).expect("the file was written")
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A vessel that leaks through an orifice, slowly: 200 rows.
fn leak(name: &str) -> Scratch {
    let mut rows = String::from("time_s,pressure_bar_gauge\n");
    for row in 0..200 {
        let time = f64::from(row);
        rows.push_str(&format!("{time},{:.4}\n", 5.0 * (-time / 900.0).exp()));
    }
    Scratch::with(name, &rows)
}

fn refused(arguments: &[&str], wanted: &str) {
    let output = pneuma(arguments);
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains(wanted), "{said} lacks {wanted}");
}

#[test]
fn val_fit_refuses_what_it_cannot_do_in_one_line() {
    let run = leak("refused.csv");
    let (rig, run) = (text(&rig_file("vessel-leak.toml")), run.path());
    let free = |key: &str, wanted: &str| {
        refused(
            &["fit", "--rig", &rig, "--train", &run, "--free", key],
            wanted,
        );
    };
    free(
        "vessel.volum_m3",
        "unknown key (did you mean \"vessel.volume_m3\"?)",
    );
    free(
        "carriage.mass_kg=2",
        "the rig has no place for \"carriage.mass_kg\"",
    );
    free(
        "effects.valve-delay.delay_s=0.01",
        "acts on no law of this rig, which has: chambers",
    );
    free(
        "effects.chamber-leakage.orifice_a_m",
        "(did you mean \"effects.chamber-leakage.orifice_a_m2\"?)",
    );
    free("vessel.volume_m3=-1", "lies outside");
    free("vessel.volume_m3,2", "expected KEY[=START][,LOWER..UPPER]");
    refused(&["fit", "--rig", &rig, "--train", &run], "nothing to fit");
    refused(&["fit", "--rig", &rig, "--train", "none.csv"], "none.csv");
}

#[test]
fn val_a_rig_without_the_signals_of_a_law_is_one_line() {
    let run = Scratch::with("time-only.csv", "t,x\n0,0\n1,0\n2,0\n3,1\n");
    let signals = "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\nx = { column = \"x\", unit = \"m\" }\n";
    let carriage = Scratch::with(
        "carriage.toml",
        &format!("{signals}[carriage]\nmass_kg = 2\n"),
    );
    let nothing = Scratch::with("nothing.toml", signals);
    for command in ["fit", "compare"] {
        let recordings: &[&str] = if command == "fit" { &["--train"] } else { &[] };
        let (run, carriage, nothing) = (run.path(), carriage.path(), nothing.path());
        let with = |rig: &str, wanted: &str| {
            let mut arguments = vec![command, "--rig", rig];
            arguments.extend(recordings);
            arguments.push(&run);
            refused(&arguments, wanted);
        };
        with(&carriage, "it lacks for [carriage] the signal p_a and p_b");
        with(&nothing, "the rig describes no law");
    }
    let vessel = text(&rig_file("vessel-leak.toml"));
    refused(
        &["compare", "--rig", &vessel, &run.path()],
        "no column \"pressure_bar_gauge\"",
    );
}

#[test]
fn val_without_recordings_the_status_is_2() {
    let rig = text(&rig_file("vessel-leak.toml"));
    for arguments in [["fit", "--rig", &rig], ["compare", "--rig", &rig]] {
        assert_eq!(pneuma(&arguments).status.code(), Some(2));
    }
}

#[test]
fn val_fit_and_compare_write_what_they_print() {
    let run = leak("written.csv");
    let rig = text(&rig_file("vessel-leak.toml"));
    let (json, page, improved) = (
        Scratch::new("fit.json"),
        Scratch::new("fit.html"),
        Scratch::new("improved.toml"),
    );
    let key = "effects.chamber-leakage.orifice_a_m2";
    let output = pneuma(&[
        "fit",
        "--rig",
        &rig,
        "--train",
        &run.path(),
        "--free",
        key,
        "--json",
        &json.path(),
        "--report",
        &page.path(),
        "--improved-rig",
        &improved.path(),
    ]);
    let said = String::from_utf8(output.stdout).expect("text");
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains(key) && !said.contains('\u{1b}'), "{said}");
    let told: Value = serde_json::from_str(&json.read()).expect("JSON");
    let errors = &told["laws"][0]["errors"][0]["train"];
    let (before, after) = (errors["before"].as_f64(), errors["after"].as_f64());
    assert!(after < before, "{errors}");
    assert!(page.read().starts_with("<!doctype html>"));
    assert!(improved.read().contains("[effects.chamber-leakage]"));
    let better = [
        "compare",
        "--rig",
        &improved.path(),
        &run.path(),
        "--json",
        &json.path(),
    ];
    assert_eq!(pneuma(&better).status.code(), Some(0));
    let told: Value = serde_json::from_str(&json.read()).expect("JSON");
    let rms = told["laws"][0]["signals"][0]["rms"]
        .as_f64()
        .expect("a number");
    let fitted = after.expect("a number");
    assert!((rms / fitted - 1.0).abs() < 0.05, "{rms} against {fitted}");
}

#[test]
fn val_inspect_writes_a_page() {
    let (run, page) = (leak("inspected.csv"), Scratch::new("inspect.html"));
    let rig = text(&rig_file("vessel-leak.toml"));
    let output = pneuma(&[
        "inspect",
        "--rig",
        &rig,
        &run.path(),
        "--report",
        &page.path(),
    ]);
    assert_eq!(output.status.code(), Some(0));
    assert!(page.read().contains("and quantum, measured and declared"));
}

/// A fitted parameter of the JSON: given, fitted, standard deviation.
fn parameter(told: &Value, key: &str) -> [f64; 3] {
    let laws = told["laws"].as_array().expect("laws");
    let found = laws
        .iter()
        .flat_map(|law| law["parameters"].as_array().expect("parameters"))
        .find(|parameter| parameter["key"] == key)
        .expect(key);
    ["given", "fitted", "standard_deviation"].map(|field| found[field].as_f64().expect(field))
}

#[test]
fn val_p01_fit_moves_the_parameters_to_the_truth() {
    let Some(folder) = recordings("val_p01_fit_moves_the_parameters_to_the_truth") else {
        return;
    };
    /// A fitted value closes the gap to the truth to this part of it ...
    const GAP_LEFT: f64 = 0.2;
    /// ... or lies within this many standard deviations of it, where the
    /// given value was good already or the data say little.
    const DEVIATIONS: f64 = 3.0;
    let folder = folder.join("practice/p01");
    let file = |name: &str| text(&folder.join(name));
    let json = Scratch::new("p01.json");
    let output = pneuma(&[
        "fit",
        "--rig",
        &file("rig.toml"),
        "--train",
        &file("train-1.csv"),
        &file("train-2.csv"),
        "--held-out",
        &file("held-1.csv"),
        "--json",
        &json.path(),
        // The carriage's fit ends at a kink of stick and slip, which it says.
        "--accept",
    ]);
    assert_eq!(output.status.code(), Some(0));
    let told: Value = serde_json::from_str(&json.read()).expect("JSON");
    let truth = std::fs::read_to_string(folder.join("truth.json")).expect("the truth");
    let truth: Value = serde_json::from_str(&truth).expect("JSON");
    let pairs = [
        ("V0a", "cylinder.dead_volume_a_m3"),
        ("V0b", "cylinder.dead_volume_b_m3"),
        ("null", "valve.null_V"),
        ("b", "valve.critical_pressure_ratio"),
        ("hc", "chambers.heat_transfer_charging_W_m2K"),
        ("hd", "chambers.heat_transfer_discharging_W_m2K"),
        ("M", "carriage.mass_kg"),
        ("FC", "friction.coulomb_N"),
        ("FS", "friction.static_N"),
        ("s2", "friction.viscous_Ns_m"),
        ("vs", "friction.stribeck_velocity_m_s"),
    ];
    for (name, key) in pairs {
        let truth = truth["plant"][name].as_f64().expect(name);
        let [given, fitted, deviation] = parameter(&told, key);
        let (before, after) = ((given - truth).abs(), (fitted - truth).abs());
        assert!(
            after <= GAP_LEFT * before || after <= DEVIATIONS * deviation,
            "{key}: given {given}, fitted {fitted} +- {deviation}, truth {truth}"
        );
    }
    for law in told["laws"].as_array().expect("laws") {
        // The carriage may end at a kink of stick and slip.
        let is_smooth = law["law"] != "carriage";
        assert!(!is_smooth || law["converged"] == true, "{law}");
        for error in law["errors"].as_array().expect("errors") {
            // The supply was typed rightly: there is nothing to gain.
            if error["signal"] == "p_s" {
                continue;
            }
            let held = &error["held_out"];
            let (before, after) = (held["before"].as_f64(), held["after"].as_f64());
            assert!(
                after.expect("a number") < 0.2 * before.expect("a number"),
                "{held}"
            );
        }
    }
}
