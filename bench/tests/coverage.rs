//! Estimates of drawn benches lie within their deviations of the truth.
//!
//! The benches are those of `truth-plant`, which shares no law with the model. Of the twenty
//! seeds the share within two deviations is published (`docs/identify.md`); here are a few.

use truth_plant::bench::Experiment as Drawn;

#[path = "../examples/judge/mod.rs"]
mod judge;

/// Share of the numbers within two deviations: 95 % of a normal law, less three deviations of the
/// forty numbers of one seed.
const LEAST_SHARE: f64 = 0.85;
/// None is further off, in deviations.
const FURTHEST: f64 = 5.0;

fn judge_all(seeds: std::ops::Range<u64>) {
    let mut all = Vec::new();
    for drawn in Drawn::ALL {
        for seed in seeds.clone() {
            let errors = judge::errors(drawn, seed);
            assert!(
                errors.len() >= 2,
                "{drawn}, seed {seed}: {} numbers",
                errors.len()
            );
            for (key, (deviations, share)) in errors {
                assert!(
                    deviations.abs() < FURTHEST,
                    "{drawn}, seed {seed}: {key} is {deviations:.1} deviations off, {:.2} %",
                    100.0 * share
                );
                all.push(deviations.abs() <= 2.0);
            }
        }
    }
    let within = all.iter().filter(|one| **one).count() as f64 / all.len() as f64;
    assert!(
        within >= LEAST_SHARE,
        "{within:.3} of {} within two deviations",
        all.len()
    );
}

#[test]
fn val_estimates_of_drawn_benches_lie_within_their_deviations() {
    judge_all(31..32);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_estimates_of_twenty_drawn_benches_lie_within_their_deviations() {
    judge_all(301..321);
}
