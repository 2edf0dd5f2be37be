//! Diagnosis: from recordings to what is missing, how large, and the proof.
//!
//! The stages hand on plain records:
//!
//! 1. recordings are checked ([`crate::inspect`]); a fault there is the verdict;
//! 2. each law that the rig describes and the signals drive is fitted with its
//!    ordinary parameters ([`crate::estimate`]): the honest baseline;
//! 3. where the misfit sits ([`crate::locate`]);
//! 4. effects are put in, one set after another ([`crate::search`]),
//!    and judged by data that were left out of the fit; where that does not
//!    explain it, each is tried for a part of the time;
//! 5. what no effect explains becomes a table or an equation ([`crate::unlisted`]);
//! 6. every parameter is frozen, and the models are compared on the held-out
//!    recordings, of which until then only faults were looked for ([`crate::finding`]);
//! 7. the verdict is written ([`crate::verdict`]).

mod gaps;
mod heard;
mod hidden_gauge;
mod instruments;
pub(crate) mod known;
pub(crate) mod law;
mod scale;
pub mod summary;

use crate::finding::{Finding, proof};
use crate::imprecise::with_built_in_priors;
use crate::laws::needs::{self, Assumed};
use crate::laws::{Law, Output, Track};
use crate::locate::{self, Located, kinematics};
use crate::recording::Recording;
use crate::recording_set;
use crate::rig::Rig;
use crate::search::next_experiment::Bank;
use crate::valve_flow::ValveFlow;
use crate::verdict::{Verdict, assemble, remarks};
use heard::Heard;
use known::Known;
use std::borrow::Cow;

/// The whole diagnosis.
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// By law.
    pub laws: Vec<Finding>,
    /// Where the recorded velocity contradicts the recorded position.
    pub velocity: Option<Located>,
    /// The rig with refitted parameters and named effects.
    pub improved_rig: Rig,
    /// Training recordings.
    pub train: Vec<Recording>,
    /// Held-out recordings.
    pub held_out: Vec<Recording>,
}

impl Diagnosis {
    /// What the laws predict, in the order in which it is shown.
    pub fn outputs(&self) -> Vec<Output> {
        let laws = self.laws.iter();
        laws.flat_map(|law| law.law.outputs(&self.improved_rig))
            .collect()
    }
}

/// Diagnoses a rig by its recordings. Held-out recordings are checked for faults, and
/// nothing else of them is looked at before every parameter is frozen. What to record next is
/// chosen out of `bank`.
pub fn diagnose<E>(
    rig: &Rig,
    train: Vec<Recording>,
    read_held_out: impl FnOnce() -> Result<Vec<Recording>, E>,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, E> {
    progress("checking the recordings");
    let mut heard = Heard::of(
        rig,
        recording_set::sorted(train),
        recording_set::sorted(read_held_out()?),
    );
    heard.blame_instruments(progress);
    let mut notes = heard.part();
    let valve = heard.measured_valve(progress);
    let with_areas = |rig: &Rig| valve.as_ref().map(|valve| valve.applied(rig));
    let given = &with_areas(rig).unwrap_or_else(|| rig.clone());
    let rig = &with_built_in_priors(&with_areas(&heard.in_use).unwrap_or(heard.in_use.clone()));
    let mut laws = Vec::new();
    if heard.faults.is_empty() {
        laws = diagnosed_laws(rig, &heard.train, bank, progress);
        heard
            .faults
            .extend(instruments::late_gauges(&laws, &heard.train));
    }
    let is_sound = heard.faults.is_empty();
    if !is_sound {
        laws.clear();
    }
    let (train, held_out) = (&heard.train, &heard.held_out);
    progress("predicting the held-out recordings");
    prove(rig, &mut laws, (train, held_out), progress);
    let velocity = is_sound.then(|| velocity(rig, &laws, train)).flatten();
    let improved_rig = assemble::improved_rig(given, &laws);
    let mut verdict = assemble::verdict(
        rig,
        &laws,
        velocity.as_ref(),
        &heard.faults,
        train,
        held_out,
    );
    let doubts = heard.doubts(&verdict);
    notes.extend(doubts.iter().map(|doubt| doubt.says.clone()));
    verdict.doubts = heard::of_faults(&heard.faults).chain(doubts).collect();
    verdict.assumed = needs::assumed(rig);
    verdict.assumed.extend(valve.iter().map(measured_areas));
    notes.extend(remarks_on_rig(rig, &laws, &verdict, train));
    verdict.notes.extend(notes);
    Ok(Diagnosis {
        verdict,
        laws,
        velocity,
        improved_rig,
        train: heard.train,
        held_out: heard.held_out,
    })
}

/// The laws that the rig describes, one after the other: each knows what those before it have shown.
fn diagnosed_laws(
    rig: &Rig,
    train: &[Recording],
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Vec<Finding> {
    let mut laws = Vec::new();
    let mut known = Known::new(rig, train);
    for law in Law::of(rig, &|name| is_in_all(train, name)) {
        let diagnosis = law::diagnose_law(law, &known, bank, progress);
        if let Some(law) = &diagnosis {
            known.learn(law);
        }
        laws.extend(diagnosis);
    }
    scale::blame(&known, &mut laws);
    laws
}

fn is_in_all(recordings: &[Recording], name: &str) -> bool {
    let mut all = recordings.iter();
    all.all(|recording| recording.signal(name).is_some())
}

/// Lets held-out recordings judge what was found; what one law shows of their pressures, the next
/// hears.
fn prove(
    rig: &Rig,
    laws: &mut [Finding],
    (train, held_out): (&[Recording], &[Recording]),
    progress: &dyn Fn(&str),
) {
    let mut heard = Cow::from(held_out);
    for law in &mut *laws {
        let tracks: Vec<Track<'_>> = heard.iter().map(Track::new).collect();
        law.prove(rig, &tracks, &heard);
        if law.refuted.is_some() {
            progress("input error that explains the misfit");
            law::ask_for_input_anew(law, rig, train);
        }
        if proof::surprises(law, rig, &tracks, &heard) {
            law.leaves_numbers_open = proof::is_of_open_numbers(law, rig, &tracks, (train, &heard));
            law.is_surprised = !law.leaves_numbers_open;
        }
        if law.is_surprised {
            let misfits =
                locate::locate(law.law, rig, &tracks, &law.left_of_held_out(&tracks, rig));
            law.located = law::above_noise(misfits, &law.floor);
        }
        if let Some(mended) = known::with_held_out_pressures_mended(&heard, law) {
            heard = Cow::from(mended);
        }
    }
    hidden_gauge::put_beside_force(rig, laws);
}

/// What the laws say of the rig's numbers beside the verdict.
fn remarks_on_rig(
    rig: &Rig,
    laws: &[Finding],
    verdict: &Verdict,
    train: &[Recording],
) -> Vec<String> {
    let lacks = needs::lacks(rig, &|name| is_in_all(train, name));
    let mut notes: Vec<String> = lacks.iter().map(ToString::to_string).collect();
    notes.extend(remarks::unrefitted(rig));
    notes.extend(remarks::too_sure(rig, laws));
    notes.extend(remarks::stood_in(rig, laws));
    notes.extend(remarks::strayed(rig, laws, &verdict.parameters));
    notes.extend(remarks::assumed_curve(rig, laws));
    notes.extend(remarks::unjudged(rig, laws));
    notes.extend(remarks::open_numbers(laws));
    notes
}

/// What stands in the place of areas that the rig file does not state.
fn measured_areas(valve: &ValveFlow) -> Assumed {
    Assumed {
        key: "valve.null_V".into(),
        value: valve.null_v,
        unit: "V".into(),
        why: "the rig file states one flow of the valve: null, critical pressure ratio, areas over the \
              opening and dead volumes were measured in the training recordings before anything was judged; *as given* is with these"
            .into(),
    }
}

/// Where the recorded velocity contradicts the recorded position, once the laws have said what
/// they miss of the latter.
fn velocity(rig: &Rig, laws: &[Finding], train: &[Recording]) -> Option<Located> {
    let mut named = laws.iter().flat_map(Finding::named);
    let is_skew_named = named.any(|effect| effect == "position-time-skew");
    let is_position = laws.iter().any(Finding::is_unexplained);
    let tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
    kinematics::contradiction(rig, &tracks, is_skew_named, is_position)
}
