//! What to record next, on a plant that shares nothing with the model: the experiment that is
//! chosen tells two effects apart that the recordings at hand cannot.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use diagnosis::estimate::Bench;
use diagnosis::estimate::candidates;
use diagnosis::search;
use diagnosis::search::next_experiment::{self, NextExperiment};
use host_sim::laws::{Law, Track};
use host_sim::rehearsal::Rehearsals;
use host_sim::trial::refit::Seen;
use truth_plant::{Kind, Request, Strength};

/// Fits two effects to a case that holds the first, and looks for what tells them apart.
fn found(law: Law, (effect, rival): (&str, &str), strength: Strength) -> NextExperiment {
    let request = Request::new(5, Kind::Single).with_noise(1.0);
    let request = request.with_effect(effect).unwrap().with_strength(strength);
    let seen = Seen::of(&request.draw()).unwrap();
    let tracks: Vec<Track<'_>> = seen.train.iter().map(Track::new).collect();
    let mut bench = Bench::new(law, &seen.rig, &tracks);
    let baseline = search::baseline(&bench).expect("it is fitted");
    bench.candidates = candidates::candidates(law, &seen.rig, &tracks, 1.0);
    let model = |effect: &str| {
        let mut candidates = bench.candidates.iter();
        let place = candidates.position(|candidate| candidate.effect == effect);
        let set = [place.expect("it is tried")];
        bench.fit(&set, Some(&baseline)).expect("it is fitted")
    };
    next_experiment::find(&Rehearsals::all(), &bench, [&model(effect), &model(rival)])
        .expect("the axis has a bank")
}

/// A force from outside and a friction that depends on the direction are one as good as the
/// other however the axis is moved: only turning the drive tells them apart.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_a_force_is_told_from_a_friction_by_turning_the_drive() {
    let pair = ("constant-force", "direction-dependent-friction");
    let experiment = found(Law::Balance, pair, Strength::Weak);
    assert!(
        experiment.text.contains("turned end for end"),
        "{experiment:?}"
    );
    assert!(experiment.power() > 0.9, "{experiment:?}");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_a_delay_is_told_from_a_late_spool_by_what_is_fast() {
    let pair = ("valve-delay", "spool-dynamics");
    let experiment = found(Law::Chambers, pair, Strength::Medium);
    assert!(experiment.text.contains("clamped"), "{experiment:?}");
    assert!(experiment.power() > 0.9, "{experiment:?}");
}

/// Nothing tells a model from itself.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn prop_a_model_is_not_told_from_itself() {
    let pair = ("constant-force", "constant-force");
    let experiment = found(Law::Balance, pair, Strength::Weak);
    assert_eq!((experiment.told, experiment.times), (0, [1.0, 1.0]));
}
