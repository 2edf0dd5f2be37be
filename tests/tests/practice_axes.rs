//! The whole diagnosis on the practice axes: a plant that another program simulated, twelve
//! cases with their truth beside them.
//!
//! Three of them run in continuous integration, a kind each: nothing missing, a flow between the
//! chambers, a supply that sags. The others are long: `cargo xtask test --all`, and `cargo
//! xtask evidence` publishes them all.
//!
//! Where the recordings are missing the tests say so and pass ([`tests::recordings`]).

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use host_sim::rig::Rig;
use xtask::practice::Truth;

/// Verdict, effects, places and sizes are the true ones. The remarks beside them.
fn is_understood(axis: &str) -> Vec<String> {
    let Some(folder) = tests::recordings(&format!("practice/{axis}")) else {
        return Vec::new();
    };
    let diagnosis = tests::diagnosed(&folder);
    let verdict = serde_json::to_value(&diagnosis.verdict).unwrap();
    println!("{axis}: {}", diagnosis.verdict.sentence);
    let truth = Truth::read(&folder).unwrap();
    let objections = truth.objections(&verdict);
    assert!(objections.is_empty(), "{axis}: {}", objections.join("; "));
    diagnosis.verdict.notes
}

#[test]
fn val_p01_lacks_nothing() {
    is_understood("p01");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p02_lacks_nothing() {
    is_understood("p02");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p03_lacks_tubes() {
    is_understood("p03");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p04_lacks_a_leak_past_the_piston() {
    is_understood("p04");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p05_lacks_friction_by_pressure() {
    // Its dry friction is that of no pressure, and no error of the one stated.
    let remarks = is_understood("p05");
    assert!(remarks.iter().all(|one| !one.contains("hardly an error")));
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p06_lacks_the_spool() {
    is_understood("p06");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p07_lacks_a_supply_that_sags() {
    is_understood("p07");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p08_lacks_the_temperature_of_the_gas() {
    is_understood("p08");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p09_lacks_a_load_in_its_play() {
    is_understood("p09");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p10_lacks_tubes_and_friction_by_pressure() {
    is_understood("p10");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p11_lacks_nothing() {
    is_understood("p11");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_p12_lacks_stiction_that_grows_at_rest() {
    is_understood("p12");
}

/// A way to state a rig otherwise, in words and done.
type Restated = (&'static str, fn(&mut Rig));

/// What a data sheet is off by: every noise halved and doubled, every deviation a third and three
/// times as large.
const RESTATED: [Restated; 4] = [
    ("half the noise", |rig| restate_noise(rig, 0.5)),
    ("twice the noise", |rig| restate_noise(rig, 2.0)),
    ("a third of the deviations", |rig| {
        restate_deviations(rig, 1.0 / 3.0)
    }),
    ("three times the deviations", |rig| {
        restate_deviations(rig, 3.0)
    }),
];

fn restate_noise(rig: &mut Rig, times: f64) {
    for signal in rig.signals.by_name.values_mut() {
        signal.noise = signal.noise.map(|noise| times * noise);
    }
}

fn restate_deviations(rig: &mut Rig, times: f64) {
    rig.uncertainty.values_mut().for_each(|one| *one *= times);
}

/// What is named with a data sheet off by factors, where it is not what is there.
fn misled_by_the_sheet(axis: &str, ways: &[Restated]) -> Vec<String> {
    let Some(folder) = tests::recordings(&format!("practice/{axis}")) else {
        return Vec::new();
    };
    let truth = Truth::read(&folder).unwrap();
    let misled = |(what, restate): &Restated| {
        let verdict = tests::diagnosed_with(&folder, restate).verdict;
        println!("{axis}, {what}: {}", verdict.sentence);
        let verdict = serde_json::to_value(&verdict).unwrap();
        let objections = truth.objections_to_names(&verdict);
        let says = format!("{axis}, {what}: {}", objections.join("; "));
        (!objections.is_empty()).then_some(says)
    };
    ways.iter().filter_map(misled).collect()
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_deviations_too_small_by_a_factor_make_p01_no_patient() {
    let too_small = &RESTATED[2..3];
    assert_eq!(misled_by_the_sheet("p01", too_small), Vec::<String>::new());
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_no_factor_of_a_data_sheet_makes_a_verdict() {
    let axes = (1..=12).map(|number| format!("p{number:02}"));
    let of_axis = |axis: String| misled_by_the_sheet(&axis, &RESTATED);
    let misled: Vec<String> = axes.flat_map(of_axis).collect();
    assert_eq!(misled, Vec::<String>::new());
}

/// A nominal flow states the areas at no opening: they are measured in the training recordings.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_one_flow_of_a_data_sheet_is_enough() {
    let one_flow: [Restated; 1] = [("one flow", |rig| *rig = tests::with_one_flow(rig))];
    for axis in ["p01", "p04"] {
        assert_eq!(misled_by_the_sheet(axis, &one_flow), Vec::<String>::new());
    }
}
