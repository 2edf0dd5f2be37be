//! A gauge whose gain is wrong, on a plant that shares nothing with the model: within the class
//! of a gauge it is refitted and named nothing, far beyond it is named.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use diagnosis::diagnose::diagnose;
use diagnosis::verdict::{Kind as Verdict, Verdict as Said};
use host_sim::trial::refit::Seen;
use std::convert::Infallible;
use truth_plant::{Case, Kind, Request, Strength};

fn said_of(seed: u64, strength: Strength) -> (Case, Said) {
    let request = Request::new(seed, Kind::Single).with_strength(strength);
    let case = request.with_effect("gauge-gain").unwrap().draw();
    let seen = Seen::of(&case).unwrap();
    let held_out = || Ok::<_, Infallible>(seen.held_out);
    let diagnosis = diagnose(&seen.rig, seen.train, held_out, &(), &|_| ()).unwrap();
    (case, diagnosis.verdict)
}

#[test]
fn val_a_gain_wrong_by_its_class_is_refitted() {
    let (case, said) = said_of(11, Strength::Weak);
    assert_eq!(said.verdict, Verdict::NothingMissing, "{}", said.sentence);
    let error = case.truth.effects[0].parameters.values().next().unwrap();
    assert!(error.abs() > 0.003, "{error}");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_a_gain_wrong_by_three_per_cent_is_named() {
    let (case, said) = said_of(12, Strength::Strong);
    assert_eq!(said.verdict, Verdict::Named, "{}", said.sentence);
    let names: Vec<&str> = said.effects.iter().map(|one| one.effect.as_str()).collect();
    assert_eq!(names, ["gauge-gain"]);
    assert_eq!(said.effects[0].places, case.truth.effects[0].places);
}
