//! Cases of the truth plant for the tests of single stages.

use crate::estimate::candidates;
use crate::estimate::{Bench, Fitted};
use crate::laws::{Law, Track};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::search;
use truth_plant::{Kind, Request, Strength};

/// Rig and training recordings of a case with an effect of no list.
pub(crate) fn off_list(seed: u64, strength: Strength, effect: &str) -> (Rig, Vec<Recording>) {
    of_kind(Kind::OffList, seed, strength, effect)
}

/// Rig and training recordings of a case with one effect.
pub(crate) fn of_kind(
    kind: Kind,
    seed: u64,
    strength: Strength,
    effect: &str,
) -> (Rig, Vec<Recording>) {
    let request = Request::new(seed, kind).with_noise(1.0);
    read(&request.with_effect(effect).unwrap().with_strength(strength))
}

/// Rig and training recordings of a case with a gauge that is off by 3 kPa, under ten times the
/// usual noise (case 47 of the trial of seed 22).
pub(crate) fn weak_offset_under_noise() -> (Rig, Vec<Recording>) {
    let request = Request::new(2_845_893_508, Kind::Single).with_noise(10.0);
    let request = request.with_effect("pressure-sensor-offset").unwrap();
    read(&request.with_strength(Strength::Weak))
}

/// Rig and training recordings of a case.
pub(crate) fn read(request: &Request) -> (Rig, Vec<Recording>) {
    let case = request.draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").unwrap();
    let train = case.train.iter();
    let recordings = train.map(|file| recording(file, &rig)).collect();
    (rig, recordings)
}

/// A recording, by its name and what its file holds.
pub(crate) fn recording((name, text): &(String, String), rig: &Rig) -> Recording {
    Recording::read_from(text.as_bytes(), name, None, &rig.signals).unwrap()
}

/// The chambers as a search sees them: with noise and candidates, and their refitted model.
pub(crate) fn chambers<'a>(rig: &'a Rig, tracks: &'a [Track<'a>]) -> (Bench<'a>, Fitted) {
    searched(Law::Chambers, rig, tracks)
}

/// The same of any law.
pub(crate) fn searched<'a>(law: Law, rig: &'a Rig, tracks: &'a [Track<'a>]) -> (Bench<'a>, Fitted) {
    let mut bench = Bench::new(law, rig, tracks).for_search();
    let baseline = search::baseline(&bench).unwrap();
    bench.learn_noise(&baseline, &[]);
    let baseline = bench.in_own_noise(baseline);
    bench.candidates = candidates::candidates(law, rig, tracks, 1.0);
    (bench, baseline)
}

/// Where an effect stands among the candidates.
pub(crate) fn tried(bench: &Bench<'_>, effect: &str, place: &str) -> usize {
    let mut candidates = bench.candidates.iter();
    let is_it = |one: &candidates::Candidate| one.effect == effect && one.places.contains(&place);
    candidates.position(is_it).unwrap()
}
