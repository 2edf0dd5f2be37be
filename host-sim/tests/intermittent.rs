//! An effect that is there for a fifth of the time, on a plant that shares nothing
//! with the model: named, sized, and its spans found, also on held-out recordings.

use diagnosis::diagnose::diagnose;
use diagnosis::verdict::Kind as Verdict;
use host_sim::trial::refit::Seen;
use truth_plant::{Case, Kind, Request, Strength};

/// Seed of a rig with strong position-dependent friction in a fifth of the time.
const SEED: u64 = 3_068_299_711;
/// The balance of forces is averaged over 40 ms, and begun anew after it.
const SPAN_ERROR_S: f64 = 0.15;

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_an_effect_that_is_there_for_a_fifth_of_the_time_is_named() {
    let request = Request::new(SEED, Kind::Onset).with_strength(Strength::Strong);
    let case: Case = request.draw();
    let truth = &case.truth.effects[0];
    assert_eq!(truth.name, "position-dependent-friction");
    let onset = truth.onset.as_ref().unwrap();
    let seen = Seen::of(&case).unwrap();
    let held_out = || Ok::<_, std::convert::Infallible>(seen.held_out);
    let diagnosis = diagnose(&seen.rig, seen.train, held_out, &(), &|_| ()).unwrap();
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.verdict, Verdict::Named, "{}", verdict.sentence);
    assert_eq!(verdict.effects.len(), 1, "{}", verdict.sentence);
    assert_eq!(verdict.effects[0].effect, truth.name);
    for (key, value) in &truth.parameters {
        let found = verdict.effects[0].parameters[key].value;
        assert!(
            (found / value - 1.0).abs() < 0.15,
            "{key}: {found}, true {value}"
        );
    }
    let law = diagnosis
        .laws
        .iter()
        .find(|law| !law.improved.set.is_empty());
    let spans = &law.unwrap().improved.presence.as_ref().unwrap().spans_s;
    for (recording, spans_s) in diagnosis.train.iter().zip(spans) {
        let window = &onset.windows[&recording.name];
        // Inside the true window: friction that nothing moves against is unseen.
        let inside = window.from_s - SPAN_ERROR_S..=window.to_s + SPAN_ERROR_S;
        let is_inside = |(from, to): &(f64, f64)| inside.contains(from) && inside.contains(to);
        let is_right = !spans_s.is_empty() && spans_s.iter().all(is_inside);
        assert!(is_right, "{}: {spans_s:?} s", recording.name);
    }
    let rms = |figures: &diagnosis::verdict::FitFigures| figures.free_run_held_out["x"];
    assert!(rms(&verdict.fit.improved) < 0.5 * rms(&verdict.fit.refitted));
}
