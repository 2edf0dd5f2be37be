//! How far estimates lie from the truth of drawn benches, in stated deviations: the table of
//! `docs/identify.md`.
//!
//! `cargo run --release -p bench --example coverage -- 301 321 [experiment]`: seeds 301 to 320.

use std::collections::BTreeMap;

use judge::errors;
use truth_plant::bench::Experiment as Drawn;

mod judge;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, otherwise: u64| {
        arguments
            .get(place)
            .and_then(|one| one.parse().ok())
            .unwrap_or(otherwise)
    };
    let (from, to) = (number(0, 1), number(1, 21));
    for drawn in Drawn::ALL {
        if arguments.get(2).is_some_and(|only| *only != drawn.name()) {
            continue;
        }
        let mut all: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
        for seed in from..to {
            for (key, errors) in errors(drawn, seed) {
                all.entry(key).or_default().push(errors);
            }
        }
        for (key, errors) in all {
            report(drawn, &key, &errors);
        }
    }
}

fn report(drawn: Drawn, key: &str, errors: &[(f64, f64)]) {
    let within = errors.iter().filter(|one| one.0.abs() <= 2.0).count();
    let rms = |of: fn(&(f64, f64)) -> f64| {
        (errors.iter().map(|one| of(one).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
    };
    println!(
        "| {drawn} | `{key}` | {within} of {} | {:.2} | {:.2} % |",
        errors.len(),
        rms(|one| one.0),
        100.0 * rms(|one| one.1)
    );
}
