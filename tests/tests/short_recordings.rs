//! Six tenths of a second of an axis, and held-out recordings of whole motions: what so little
//! leaves open is no physics, and what is missing shows all the same.
//!
//! Where the recordings are missing the tests say so ([`tests::recordings`]).

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use std::convert::Infallible;

use diagnosis::diagnose::diagnose;
use diagnosis::verdict::Verdict;
use host_sim::recording::Recording;
use host_sim::rig::Rig;

/// The verdicts from every fourth tenth of the first training recording.
fn of_tenths(axis: &str) -> Vec<Verdict> {
    let Some(folder) = tests::recordings(axis) else {
        return Vec::new();
    };
    let rig = Rig::read(folder.join("rig.toml")).unwrap();
    let read = |name: &str| Recording::read(folder.join(name), &rig.signals).unwrap();
    let whole = read("train-1.csv");
    let tenth = whole.len() / 10;
    let verdict = |place: usize| {
        let train = vec![whole.part(place * tenth..(place + 1) * tenth)];
        let held_out = || Ok::<_, Infallible>(vec![read("held-1.csv"), read("held-2.csv")]);
        let Ok(diagnosis) = diagnose(&rig, train, held_out, &(), &|_| ());
        println!("{axis}, tenth {place}: {}", diagnosis.verdict.sentence);
        diagnosis.verdict
    };
    (0..10).step_by(4).map(verdict).collect()
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_what_little_data_leave_open_is_no_physics() {
    for axis in ["practice/p01", "shopfloor/s02"] {
        for verdict in of_tenths(axis) {
            let kind = serde_json::to_value(verdict.verdict).unwrap();
            assert_eq!(kind, "nothing-missing", "{axis}: {}", verdict.sentence);
        }
    }
}

/// Every verdict names this effect alone.
fn names(axis: &str, effect: &str) {
    for verdict in of_tenths(axis) {
        let effects = verdict.effects.iter();
        let named: Vec<&str> = effects.map(|one| one.effect.as_str()).collect();
        assert_eq!(named, [effect], "{axis}: {}", verdict.sentence);
    }
}

#[test]
fn val_a_leak_shows_in_little_data() {
    names("practice/p04", "piston-leakage");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_a_late_spool_shows_in_little_data() {
    names("practice/p06", "spool-dynamics");
}
