//! The whole diagnosis on recordings measured by others: what is named, what
//! is declined, and the error on data that were not fitted.
//!
//! The marks are those of `docs/evidence.md`: what a competent person got by
//! hand, to be met or beaten. Held-out data are never looked at before every
//! parameter is frozen; their initial states are estimated for every model
//! alike. A second direction of the gas cylinder and a second seal are long: `cargo xtask test
//! --all`. Where the recordings are missing the tests say so and pass
//! ([`tests::recordings`]).

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use diagnosis::diagnose::{Diagnosis, diagnose};
use diagnosis::verdict::{Kind, Verdict};
use host_sim::recording::Recording;
use host_sim::rig::Rig;
use std::convert::Infallible;
use std::path::Path;

const PSI_PA: f64 = 6894.757;
const BAR_PA: f64 = 1e5;

/// A recording, or the part of one between two percentages of its rows.
type Part = (&'static str, f64, f64);

fn rig(name: &str) -> Rig {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/rigs");
    Rig::read(rigs.join(format!("{name}.toml"))).unwrap()
}

fn run(name: &str, train: &[Part], held_out: &[Part]) -> Option<Diagnosis> {
    let folder = tests::recordings(&format!("real/{name}"))?;
    let rig = rig(name);
    let read = |parts: &[Part]| -> Vec<Recording> {
        parts
            .iter()
            .map(|&(file, from, to)| {
                let whole = Recording::read(folder.join(file), &rig.signals).unwrap();
                let row = |percent: f64| (whole.len() as f64 * percent / 100.0) as usize;
                whole.part(row(from)..row(to))
            })
            .collect()
    };
    let diagnosis = diagnose(
        &rig,
        read(train),
        || Ok::<_, Infallible>(read(held_out)),
        &(),
        &|_| (),
    );
    let Ok(diagnosis) = diagnosis;
    println!("{}", diagnosis.verdict.sentence);
    Some(diagnosis)
}

fn named(verdict: &Verdict) -> Vec<(&str, Vec<&str>)> {
    let mut all: Vec<(&str, Vec<&str>)> = verdict
        .effects
        .iter()
        .map(|effect| {
            let places = effect.places.iter().map(String::as_str).collect();
            (effect.effect.as_str(), places)
        })
        .collect();
    all.sort_unstable();
    all
}

/// Error of the free run on held-out data: refitted baseline, improved.
fn held_out(verdict: &Verdict, signal: &str, unit: f64) -> (f64, f64) {
    let fit = &verdict.fit;
    let before = fit.refitted.free_run_held_out[signal] / unit;
    let after = fit.improved.free_run_held_out[signal] / unit;
    println!("{signal}: {before:.3} refitted, {after:.3} improved");
    (before, after)
}

const BOTH: [&str; 2] = ["chamber-a", "chamber-b"];

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_gas_cylinder_lacks_heat_exchange_and_a_dead_volume() {
    let run_2021 = ("run-2021-07-26.exp", 0.0, 100.0);
    let run_2022 = ("run-2022-01-28.exp", 0.0, 100.0);
    let Some(diagnosis) = run("gas-cylinder", &[run_2021], &[run_2022]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.verdict, Kind::Named);
    // The skew is in the 2021 file itself: pressures set in 0.3 s after the
    // motion, visible at t = 382 s without any model.
    let expected = [
        ("dead-volume", vec!["chamber-b"]),
        ("gas-temperature-dynamics", BOTH.to_vec()),
        ("position-time-skew", vec!["sensor.x"]),
    ];
    assert_eq!(named(verdict), expected);
    let (_, upper) = held_out(verdict, "p_a", PSI_PA);
    let (_, lower) = held_out(verdict, "p_b", PSI_PA);
    assert!(upper <= 1.9 && lower <= 2.2, "{upper}, {lower} psi");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_gas_cylinder_the_other_way_round() {
    let run_2021 = ("run-2021-07-26.exp", 0.0, 100.0);
    let run_2022 = ("run-2022-01-28.exp", 0.0, 100.0);
    let Some(diagnosis) = run("gas-cylinder", &[run_2022], &[run_2021]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    let expected = [
        ("dead-volume", vec!["chamber-b"]),
        ("gas-temperature-dynamics", BOTH.to_vec()),
    ];
    assert_eq!(named(verdict), expected);
    let (_, upper) = held_out(verdict, "p_a", PSI_PA);
    let (_, lower) = held_out(verdict, "p_b", PSI_PA);
    assert!(upper <= 1.9 && lower <= 2.2, "{upper}, {lower} psi");
}

fn seal(seal: [&'static str; 4], mark_n: f64) {
    let train: Vec<Part> = seal[..3].iter().map(|&file| (file, 0.0, 100.0)).collect();
    let Some(diagnosis) = run("seal-friction", &train, &[(seal[3], 0.0, 100.0)]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.verdict, Kind::Named);
    let expected = [
        ("coulomb-friction", vec!["force-balance"]),
        ("pressure-dependent-friction", vec!["force-balance"]),
    ];
    assert_eq!(named(verdict), expected);
    assert_eq!(verdict.located[0].place, "force-balance");
    let (before, after) = held_out(verdict, "force", 1.0);
    assert!(
        after <= mark_n && before > 4.0 * mark_n,
        "{before}, {after} N"
    );
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_o_ring_has_dry_friction_that_grows_with_pressure() {
    seal(
        [
            "O-ring_1bar.tsv",
            "O-ring_3bar.tsv",
            "O-ring_5bar.tsv",
            "O-ring_7bar.tsv",
        ],
        1.5,
    );
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_napn_seal_has_dry_friction_that_grows_with_pressure() {
    seal(
        [
            "NAPN_1bar.tsv",
            "NAPN_3bar.tsv",
            "NAPN_5bar.tsv",
            "NAPN_7bar.tsv",
        ],
        2.1,
    );
}

#[test]
fn val_positioning_stage_has_coulomb_friction_and_no_stribeck() {
    let halves = [("emps.csv", 0.0, 50.0), ("emps.csv", 50.0, 100.0)];
    let Some(diagnosis) = run("positioning-stage", &halves[..1], &halves[1..]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    assert_eq!(
        named(verdict),
        [("coulomb-friction", vec!["force-balance"])]
    );
    let (before, after) = held_out(verdict, "force", 1.0);
    assert!(after <= 4.4 && before > 9.0, "{before}, {after} N");
    // Published by Janot, Gautier and Brunot: 20.3935 N.
    let level = verdict.effects[0].parameters["coulomb_N"].value;
    assert!((level / 20.39 - 1.0).abs() < 0.02, "{level} N");
}

#[test]
fn val_plant_valve_is_limited_in_rate_by_direction_and_has_no_backlash() {
    let file = "actuator3-first-half-hour.csv";
    let Some(diagnosis) = run("plant-valve", &[(file, 0.0, 50.0)], &[(file, 50.0, 100.0)]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    let effect = |name: &str| verdict.effects.iter().find(|effect| effect.effect == name);
    let slew = effect("slew-limit").unwrap();
    assert!(slew.parameters["rising_per_s"].value > 2.0 * slew.parameters["falling_per_s"].value);
    assert!(effect("valve-hysteresis").is_none());
    let (_, after) = held_out(verdict, "x", 0.01);
    assert!(after <= 1.36, "{after} %");
}

#[test]
fn val_vessel_leaks_through_a_gap_and_not_an_orifice() {
    let file = "Ultimaker_015.csv";
    let Some(diagnosis) = run("vessel-leak", &[(file, 0.0, 30.0)], &[(file, 30.0, 100.0)]) else {
        return;
    };
    let verdict = &diagnosis.verdict;
    assert_eq!(named(verdict), [("chamber-leakage", vec!["chamber-a"])]);
    // A printed wall may have a hole beside its gaps; a hole alone it is not.
    assert_ne!(verdict.effects[0].form.as_deref(), Some("orifice"));
    let (_, after) = held_out(verdict, "p_a", BAR_PA);
    assert!(after <= 0.18, "{after} bar");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_whole_axis_with_nothing_missing_is_told_so() {
    let Some(case) = tests::recordings("practice/p01") else {
        return;
    };
    let rig = Rig::read(case.join("rig.toml")).unwrap();
    let read = |names: &[&str]| -> Vec<Recording> {
        let path = |name: &&str| case.join(format!("{name}.csv"));
        names
            .iter()
            .map(|name| Recording::read(path(name), &rig.signals).unwrap())
            .collect()
    };
    let train = read(&["train-1", "train-2", "train-3", "train-4"]);
    let held = || Ok::<_, Infallible>(read(&["held-1", "held-2"]));
    let Ok(diagnosis) = diagnose(&rig, train, held, &(), &|_| ());
    let verdict = &diagnosis.verdict;
    assert_eq!(
        verdict.verdict,
        Kind::NothingMissing,
        "{}",
        verdict.sentence
    );
    let truth = [
        ("cylinder.dead_volume_a_m3", 2.4333e-5, 0.002),
        ("valve.null_V", 5.08, 1e-4),
        ("friction.coulomb_N", 15.958, 0.02),
        ("friction.viscous_Ns_m", 70.778, 0.02),
        ("carriage.mass_kg", 1.7382, 0.01),
    ];
    for (key, value, tolerance) in truth {
        let found = verdict.parameters[key].refitted.unwrap();
        assert!((found / value - 1.0).abs() < tolerance, "{key} {found}");
    }
}
