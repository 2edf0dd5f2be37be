//! Estimates of drawn benches against their truth.

use bench::{Experiment, Outcome};
use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::bench::{BenchCase, Experiment as Drawn, draw};

/// Of each number its error in deviations, and as a part of the truth.
pub fn errors(drawn: Drawn, seed: u64) -> Vec<(String, (f64, f64))> {
    let case = draw(drawn, seed);
    let (rig, recordings) = read(&case, &format!("{drawn}-{seed}"));
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let outcome = evaluated_by(drawn)
        .evaluate(&rig, &tracks)
        .unwrap_or_else(|why| panic!("{drawn}, seed {seed}: {why}"));
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
fn estimate(outcome: &Outcome, key: &str) -> Option<(f64, f64)> {
    if let Some((path, opening)) = key.split_once('@') {
        let opening: f64 = opening.parse().ok()?;
        return outcome.area_at(usize::from(path.starts_with("exhaust")), opening);
    }
    let key = if key == "spool_gain_m_V" {
        "valve.spool_gain_m_V"
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
