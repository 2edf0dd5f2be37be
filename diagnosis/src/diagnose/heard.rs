//! The recordings with what inspection says of them.

use super::{gaps, instruments};
use crate::imprecise::with_built_in_priors;
use crate::inspect::{self, Fault, Inspection};
use crate::laws::Track;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::valve_flow::{self, ValveFlow};
use crate::verdict::Verdict;
use crate::verdict::remarks;

/// The recordings with what inspection says of them.
pub(super) struct Heard {
    pub(super) train: Vec<Recording>,
    pub(super) held_out: Vec<Recording>,
    inspections: Vec<Inspection>,
    pub(super) faults: Vec<(String, Fault)>,
    /// The rig with the noise that counts.
    pub(super) in_use: Rig,
}

impl Heard {
    pub(super) fn of(rig: &Rig, train: Vec<Recording>, held_out: Vec<Recording>) -> Self {
        let all = || train.iter().chain(&held_out);
        let inspections: Vec<Inspection> = all().map(|one| inspect::inspect(rig, one)).collect();
        let faults = faults(all(), &inspections);
        let in_use = inspect::with_noise_in_use(rig, &inspections);
        Self {
            train,
            held_out,
            inspections,
            faults,
            in_use,
        }
    }

    /// Gauges, wires and logger, by trial.
    pub(super) fn blame_instruments(&mut self, progress: &dyn Fn(&str)) {
        if self.faults.is_empty() && self.in_use.cylinder.is_some() {
            progress("whether gauges, wires and logger fit the rig");
            let stated = with_built_in_priors(&self.in_use);
            self.faults
                .extend(instruments::mistake(&stated, &self.train));
        }
    }

    /// Parts recordings at their gaps; says where.
    pub(super) fn part(&mut self) -> Vec<String> {
        let mut notes = Vec::new();
        for recordings in [&mut self.train, &mut self.held_out] {
            let (parted, of_these) = gaps::parted(&self.in_use, std::mem::take(recordings));
            *recordings = parted;
            notes.extend(of_these);
        }
        notes
    }

    /// The valve, where the rig file states one flow of it only.
    pub(super) fn measured_valve(&self, progress: &dyn Fn(&str)) -> Option<ValveFlow> {
        if !self.faults.is_empty() || !self.in_use.states_flow() {
            return None;
        }
        progress("the valve's areas over the opening, which the rig file does not state");
        let tracks: Vec<Track<'_>> = self.train.iter().map(Track::new).collect();
        valve_flow::measure(&self.in_use, &tracks).ok()
    }

    /// What is to be doubted of recordings and numbers.
    pub(super) fn doubts(&self, verdict: &Verdict) -> Vec<inspect::Doubt> {
        let mut doubts = remarks_on_reading(&self.train, &self.held_out);
        doubts.extend(inspect::noise_doubts(&self.inspections));
        doubts.extend(remarks::at_bounds(&verdict.parameters));
        doubts
    }
}

/// Faults of the recordings, with the name of the recording.
fn faults<'r>(
    recordings: impl Iterator<Item = &'r Recording>,
    inspections: &[Inspection],
) -> Vec<(String, Fault)> {
    let of_each = recordings.zip(inspections);
    of_each
        .flat_map(|(recording, inspection)| {
            let named = |fault: &Fault| (recording.name.clone(), fault.clone());
            inspection.faults.iter().map(named)
        })
        .collect()
}

/// What was decided or left out on reading the recordings; parts of one say it once.
fn remarks_on_reading(train: &[Recording], held_out: &[Recording]) -> Vec<inspect::Doubt> {
    let mut doubts: Vec<inspect::Doubt> = Vec::new();
    for recording in train.iter().chain(held_out) {
        let about = format!("recording {}", recording.name);
        for says in recording.named_remarks() {
            let is_new = doubts.iter().all(|doubt| doubt.says != says);
            doubts.extend(is_new.then(|| inspect::Doubt {
                about: about.clone(),
                says,
                p_value: None,
            }));
        }
    }
    doubts
}

/// Faults as remarks on signals.
pub(super) fn of_faults(faults: &[(String, Fault)]) -> impl Iterator<Item = inspect::Doubt> {
    faults.iter().map(|(recording, fault)| inspect::Doubt {
        about: format!("signals.{}", fault.signal),
        says: format!("{recording}: {}", fault.sentence),
        p_value: None,
    })
}
