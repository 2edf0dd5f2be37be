//! Healthy axes of another plant that lie outside of what their rig files can say: what their valves
//! and gauges leave is no effect.

use diagnosis::diagnose::diagnose;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use std::convert::Infallible;
use truth_plant::{Kind, Nature, Request};

/// The sentence of the verdict on a healthy axis, if it claims anything.
fn claim(seed: u64) -> Option<String> {
    let case = Request::new(seed, Kind::Nothing)
        .with_nature(Nature::ShopFloor)
        .draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig file");
    let read = |files: &[(String, String)]| -> Vec<Recording> {
        let read = |(name, text): &(String, String)| {
            Recording::read_from(text.as_bytes(), name, None, &rig.signals).expect("a recording")
        };
        files.iter().map(read).collect()
    };
    let held_out = || Ok::<_, Infallible>(read(&case.held_out));
    let Ok(diagnosis) = diagnose(&rig, read(&case.train), held_out, &(), &|_| ());
    let verdict = diagnosis.verdict;
    println!("{seed}: {}", verdict.sentence);
    let is_calm =
        verdict.sentence.starts_with("No physics") || verdict.sentence.starts_with("No relevant");
    (!is_calm).then_some(verdict.sentence)
}

/// The first opens somewhere between nought and the second of nine points, which left 9 kPa, *unknown* at
/// the valve; in the second a free run over held-out recordings strayed by 0.25 % of the pressure.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn regress_a_table_of_few_points_is_no_physics() {
    for seed in [1_699_208_945, 85_679_170] {
        assert_eq!(claim(seed), None, "{seed}");
    }
}

/// A leak of 0.005 mm2 always, the same at chosen moments, and *unknown*, before an effect that leaves
/// more than noise had to take next to all.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn regress_what_a_nearly_known_valve_leaves_is_no_effect() {
    for seed in [302, 306, 308] {
        assert_eq!(claim(seed), None, "{seed}");
    }
}
