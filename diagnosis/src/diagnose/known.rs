//! What the laws diagnosed so far have shown of the sensors: the laws after them, which use the
//! same signals, must not take that for physics of their own.

use crate::estimate::candidates::{Candidate, TIMES_OF_SENSORS};
use crate::estimate::draws::Doubts;
use crate::estimate::sheet::Sheet;
use crate::finding::proof::Run;
use crate::finding::{self, Finding, Model};
use crate::fit::Presence;
use crate::gauge::GAIN_KEYS;
use crate::laws::{Output, Track, read_pressures_pa};
use crate::model::Side;
use crate::recording::Recording;
use crate::rig::Rig;
use std::borrow::Cow;

/// How well the chambers tell a time between signals, s, whatever their fit says of it: beside a
/// supply that droops 2.9 ms came out 0.23 ms off, which the balance of forces took for a load.
const TIME_KNOWN_TO_S: f64 = 2.5e-4;

/// A rig and its recordings as far as they are understood.
pub(crate) struct Known<'t> {
    /// The rig, with what was found of its sensors.
    pub rig: Rig,
    /// The recordings, with what their sensors did for a part of the time taken back.
    pub train: Cow<'t, [Recording]>,
    /// Of each recording what is not understood of the sensors, where something is.
    pub doubts: Vec<Doubts>,
    /// How well the rig file kept its word.
    pub sheet: Sheet,
}

impl<'t> Known<'t> {
    /// Nothing but the rig file and the recordings.
    pub fn new(rig: &Rig, train: &'t [Recording]) -> Self {
        Self {
            rig: rig.clone(),
            train: Cow::from(train),
            doubts: Vec::new(),
            sheet: Sheet::default(),
        }
    }

    /// Takes up what a law has shown. Where nothing explains a law, what it shows of sensors
    /// stands in for something else.
    pub fn learn(&mut self, law: &Finding) {
        let is_explained = !law.is_unexplained() || is_tabled(law);
        if law.is_open && (may_be_gauges(law) || !is_explained && law.input.is_none()) {
            self.doubts = doubts(law, &self.train);
        }
        if !is_explained {
            return;
        }
        self.sheet = self.sheet.and(&law.sheet(&self.rig));
        self.rig = with_sensors(&self.rig, law);
        if let Some(mended) = with_pressures_mended(&self.train, law) {
            self.train = Cow::from(mended);
        }
    }
}

/// Whether a table leaves little of what a law misses.
fn is_tabled(law: &Finding) -> bool {
    let term = law.term.as_ref();
    term.is_some_and(|term| finding::is_enough(term.explained()))
}

fn named(law: &Finding) -> impl Iterator<Item = &Candidate> {
    let set = law.improved.set.iter();
    set.map(|&index| &law.candidates[index])
}

/// Whether an effect of the gauges is in the model, or would do as well as one that is.
fn may_be_gauges(law: &Finding) -> bool {
    let is_of_pressure = |place: &&str| place.starts_with("sensor.p");
    let rivals = law.rivals.iter().map(|&(_, rival)| &law.candidates[rival]);
    let mut all = named(law).chain(rivals);
    all.any(|one| one.places.iter().any(is_of_pressure))
}

/// The rig with what a law has shown of the sensors.
fn with_sensors(rig: &Rig, law: &Finding) -> Rig {
    if law.improved.presence.is_some() {
        return rig.clone();
    }
    let of_sensors: Vec<&Candidate> = named(law).filter(|one| one.is_of_sensors()).collect();
    let is_theirs = |key: &str| {
        let mut free = of_sensors.iter().flat_map(|one| &one.free);
        free.any(|free| free.key == key)
    };
    let mut shared = law.improved.shared_values();
    shared.retain(|key, _| is_theirs(key));
    let switches = of_sensors
        .iter()
        .flat_map(|one| one.switches.iter().cloned());
    shared.extend(switches);
    let model = &law.improved;
    for key in GAIN_KEYS {
        let found = model.place(key).map(|place| model.values[place]);
        shared.extend(found.map(|gain| (key.to_owned(), gain)));
    }
    let mut known = rig.with_values(&shared);
    for key in TIMES_OF_SENSORS {
        if let Some(place) = model.place(key).filter(|&place| !model.at_bound[place]) {
            let found_to_s = model.standard_deviations[place].unwrap_or(0.0);
            let known_to = found_to_s.hypot(TIME_KNOWN_TO_S) / model.values[place].abs();
            known.uncertainty.insert(key.to_owned(), known_to);
        }
    }
    known
}

/// What a law leaves of the pressures: a lag of another form than the library's left 0.4 kPa, and
/// the 0.3 N of that were a load on a spring to the balance of forces.
fn doubts(law: &Finding, recordings: &[Recording]) -> Vec<Doubts> {
    let outputs = law.law.outputs(&law.frozen[Model::Improved as usize].rig);
    let runs = &law.train[Model::Improved as usize];
    let of_recording = |(run, recording): (&Option<Run>, &Recording)| {
        let Some(run) = run else {
            return Doubts::new();
        };
        let of_output = |(output, predicted): (&Output, &Vec<f64>)| {
            let recorded = recording.signal(output.signal)?.iter();
            let left = predicted.iter().zip(recorded).map(|(p, r)| p - r);
            Some((output.signal.to_owned(), left.collect()))
        };
        outputs
            .iter()
            .zip(&run.predicted)
            .filter_map(of_output)
            .collect()
    };
    runs.iter().zip(recordings).map(of_recording).collect()
}

/// The recordings with the pressures as they are once what a law has shown of their sensors for a
/// part of the time is taken back: no number of a rig holds that. None where it has shown no
/// such thing.
fn with_pressures_mended(recordings: &[Recording], law: &Finding) -> Option<Vec<Recording>> {
    mended(recordings, law, law.improved.presence.as_ref()?)
}

/// The same of the held-out recordings, when the law's frozen model found it in them.
pub(crate) fn with_held_out_pressures_mended(
    recordings: &[Recording],
    law: &Finding,
) -> Option<Vec<Recording>> {
    let effect = law.improved.presence.as_ref()?.effect;
    let runs = &law.held_out[Model::Improved as usize];
    let spans_s = |run: &Option<Run>| run.as_ref().map_or(Vec::new(), |run| run.spans_s.clone());
    let found = Presence {
        effect,
        spans_s: runs.iter().map(spans_s).collect(),
    };
    mended(recordings, law, &found)
}

fn mended(recordings: &[Recording], law: &Finding, presence: &Presence) -> Option<Vec<Recording>> {
    if !named(law).all(Candidate::is_of_sensors) {
        return None;
    }
    let rig = &law.frozen[Model::Improved as usize].rig;
    let mended = |(number, recording): (usize, &Recording)| {
        let mut mended = recording.clone();
        let there = presence.rows(number, &recording.time_s);
        let read_pa = read_pressures_pa(rig, &Track::new(recording))?;
        for (side, read_pa) in Side::BOTH.iter().zip(read_pa) {
            let column = mended.signals.get_mut(side.pressure_signal())?;
            for rows in &there {
                column[rows.clone()].copy_from_slice(&read_pa[rows.clone()]);
            }
        }
        Some(mended)
    };
    recordings.iter().enumerate().map(mended).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::law::diagnose_law;
    use crate::drawn;
    use crate::laws::Law;
    use truth_plant::{Kind, Request, Strength};

    /// A gauge that is off for a fifth of the time was taken to be off throughout the held-out
    /// recordings: a carriage that lacks nothing was left 299 times its noise.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_held_out_pressures_are_mended_where_they_are_off() {
        let request = Request::new(4_084_749_717, Kind::Onset).with_noise(1.0);
        let (rig, mut train) = drawn::read(&request.with_strength(Strength::Strong));
        let held_out = train.split_off(train.len() - 1);
        let mut law = diagnose_law(Law::Chambers, &Known::new(&rig, &train), &(), &|_| ()).unwrap();
        let tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
        law.prove(&rig, &tracks, &held_out);
        let mended = with_held_out_pressures_mended(&held_out, &law).unwrap();
        let [as_is_pa, mended_pa] =
            [&held_out, &mended].map(|recordings| recordings[0].signal("p_a").unwrap());
        let off_pa = as_is_pa
            .iter()
            .zip(mended_pa)
            .map(|(as_is, mended)| mended - as_is);
        let off_pa: Vec<f64> = off_pa.filter(|off| off.abs() > 0.0).collect();
        assert!(off_pa.iter().all(|off| (off.abs() - 22.5e3).abs() < 300.0));
        let share = off_pa.len() as f64 / as_is_pa.len() as f64;
        assert!((0.05..0.5).contains(&share), "{share}");
    }
}
