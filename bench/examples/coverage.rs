//! How far estimates lie from the truth of drawn benches, in stated deviations.
//!
//! `cargo run --release -p bench --example coverage -- 1 21 [experiment]`: seeds 1 to 20.

use std::collections::BTreeMap;

use bench::Experiment;
use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::bench::{BenchCase, Experiment as Drawn, draw};

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
        println!("{drawn}");
        for (key, errors) in all {
            report(&key, &errors);
        }
    }
}

fn report(key: &str, errors: &[(f64, f64)]) {
    let within = errors.iter().filter(|one| one.0.abs() <= 2.0).count();
    let rms = |of: fn(&(f64, f64)) -> f64| {
        (errors.iter().map(|one| of(one).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
    };
    let worst: Vec<String> = errors.iter().map(|one| format!("{:.1}", one.0)).collect();
    println!(
        "  {key:62} {within:2} of {:2} within two, rms {:6.2}, error {:6.2} %  [{}]",
        errors.len(),
        rms(|one| one.0),
        100.0 * rms(|one| one.1),
        worst.join(" ")
    );
}

/// Of each number its error in deviations, and as a part of the truth.
fn errors(drawn: Drawn, seed: u64) -> Vec<(String, (f64, f64))> {
    let case = draw(drawn, seed);
    let (rig, recordings) = read(&case, &format!("{drawn}-{seed}"));
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let outcome = match evaluated_by(drawn).evaluate(&rig, &tracks) {
        Ok(outcome) => outcome,
        Err(why) => {
            println!("  seed {seed}: {why}");
            return Vec::new();
        }
    };
    case.truth
        .iter()
        .filter_map(|(key, truth)| {
            let (value, deviation) = estimate(&outcome, key)?;
            let by = value - truth;
            Some((key.clone(), (by / deviation, by / truth)))
        })
        .collect()
}

/// The estimate under a key of the truth; areas stand at openings.
fn estimate(outcome: &bench::Outcome, key: &str) -> Option<(f64, f64)> {
    if let Some((path, opening)) = key.split_once('@') {
        let opening: f64 = opening.parse().ok()?;
        return outcome.area_at(usize::from(path.starts_with("exhaust")), opening);
    }
    let key = if key == "spool_gain_m_V" {
        "spool_gain_per_V"
    } else {
        key
    };
    outcome.number(key).map(|one| (one.value, one.deviation))
}

fn evaluated_by(drawn: Drawn) -> Experiment {
    match drawn {
        Drawn::ValveFlow | Drawn::VesselFlow => Experiment::ValveFlow,
        Drawn::Spool => Experiment::Spool,
        Drawn::HeatTransfer => Experiment::HeatTransfer,
        Drawn::Friction => Experiment::Friction,
        Drawn::Presliding => Experiment::Presliding,
        Drawn::DeadVolume => Experiment::DeadVolume,
    }
}

fn read(case: &BenchCase, name: &str) -> (Rig, Vec<Recording>) {
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig");
    let folder = std::env::temp_dir().join(format!("bench-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let recordings = case.recordings.iter().map(|(name, text)| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a file");
        Recording::read(&path, &rig.signals).expect("a recording")
    });
    let recordings = recordings.collect();
    std::fs::remove_dir_all(&folder).expect("removed");
    (rig, recordings)
}
