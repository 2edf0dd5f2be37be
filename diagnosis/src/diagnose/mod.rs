//! Diagnosis: from recordings to what is missing, how large, and the proof.
//!
//! The stages hand on plain records:
//!
//! 1. recordings are checked ([`crate::inspect`]); a fault there is the verdict;
//! 2. each law that the rig describes and the signals drive is fitted with its
//!    ordinary parameters ([`fitted`]): the honest baseline;
//! 3. where the misfit sits ([`locate`]);
//! 4. effects are put in, one set after another ([`mod@candidates`], [`search`]),
//!    and judged by data that were left out of the fit; where that does not
//!    explain it, each is tried for a part of the time (`intermittent`);
//! 5. every parameter is frozen, and the models are compared on the held-out
//!    recordings, of which until then only faults were looked for ([`proof`]);
//! 6. the verdict is written ([`verdict`]).

mod alone;
mod between_rows;
mod break_aways;
pub mod candidates;
mod draws;
pub mod equation;
pub mod fitted;
mod fold_squares;
mod friction_wave;
mod gaps;
mod hidden_gauge;
mod instruments;
mod intermittent;
mod kinematics;
pub mod knowability;
mod known;
mod leaps;
pub mod limits;
pub mod locate;
mod located;
mod loose_load;
mod misfit;
mod missing_force;
mod missing_input;
pub mod next_experiment;
pub mod noise;
mod null;
mod own_noise;
mod phrase;
pub mod proof;
mod prospect;
mod refit;
mod remarks;
mod scale;
mod scene;
pub mod search;
mod sensor_noise;
mod sheet;
mod shown;
mod sliding;
mod strayed;
pub mod summary;
mod swinging_load;
mod swung;
mod unknown_input;
pub mod unknown_term;
pub mod verdict;
mod wave;
pub mod words;

mod assemble;
#[cfg(test)]
mod drawn;

pub use alone::Alone;

use crate::imprecise::with_built_in_priors;
use crate::inspect::{self, Fault, Inspection};
use crate::laws::needs::{self, Assumed};
use crate::laws::{Law, Output, Track, balance};
use crate::recording::Recording;
use crate::recording_set;
use crate::rig::Rig;
use crate::valve_flow::{self, ValveFlow};
use candidates::{Candidate, candidates};
use draws::Doubts;
use equation::Equation;
use fitted::{Bench, Fitted};
use known::Known;
use limits::Limit;
use locate::Located;
use loose_load::Refined;
use misfit::MISSED;
use next_experiment::{Bank, NextExperiment};
use proof::{Frozen, Run, Said};
use rayon::prelude::*;
use search::{Evidence, Outcome};
use std::borrow::Cow;
use std::collections::BTreeMap;
use strayed::Doubt;
use verdict::Verdict;

/// Rows that the search works on where a law may be thinned: the effects it can
/// have are slow against a recording of this many rows.
const SEARCH_ROWS: usize = 2500;

/// The models of the comparison, in the order in which they are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The rig as given.
    Given,
    /// Ordinary parameters refitted.
    Refitted,
    /// With the accepted effects.
    Improved,
}

impl Model {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Given, Self::Refitted, Self::Improved];
}

/// A moment in which the carriage left its place.
#[derive(Clone, Copy, Debug)]
pub struct BreakAway {
    /// How long it had stood, s.
    pub rest_s: f64,
    /// The force at which it left less that of the refitted model, N.
    pub refitted_n: f64,
    /// The same of the improved one.
    pub improved_n: f64,
}

/// What was found of one law.
pub struct LawDiagnosis {
    /// The law.
    pub law: Law,
    /// What was tried.
    pub candidates: Vec<Candidate>,
    /// Noise of each output that the search works on, SI.
    pub noise: Vec<f64>,
    /// Noise of each output that is shown, SI.
    pub floor: Vec<f64>,
    /// The refitted baseline.
    pub baseline: Fitted,
    /// With the accepted effects.
    pub improved: Fitted,
    /// What speaks for and against each candidate.
    pub evidence: Vec<Evidence>,
    /// An accepted effect and one that would do as well.
    pub rivals: Vec<(usize, usize)>,
    /// The recording that would tell the first of these apart, as simulated.
    pub next_experiment: Option<NextExperiment>,
    /// Where the refitted baseline fails.
    pub located: Vec<Located>,
    /// Of a carriage, when it left its place in the training recordings, and what was missed.
    pub break_aways: Vec<BreakAway>,
    /// The input that would explain what the chambers' baseline misses.
    pub input: Option<Located>,
    /// What the law misses as an equation that its model does not hold.
    pub equation: Option<Equation>,
    /// What commands lost between the rows would leave, over what the baseline misses.
    pub lost_commands: Option<f64>,
    /// Whether the refitted baseline misses something that can be trusted to show it.
    pub missed: bool,
    /// Whether the improved model still misses something plainly, or a table stands for it.
    pub is_open: bool,
    /// Whether the refitted baseline leaves more than a sound model of such a rig does.
    is_unsound: bool,
    /// Part of what the baseline misses that the named effects explain.
    pub explained: f64,
    /// What was put into the model and held-out recordings spoke against.
    pub refuted: Option<Refuted>,
    /// Whether held-out recordings are predicted worse with the named effects, though not so
    /// plainly that this refutes them: the improved rig does not hold them.
    pub is_unproven: bool,
    /// Whether only held-out recordings show that something is missing.
    pub is_surprised: bool,
    /// Whether held-out recordings are predicted beyond the noise because the training recordings
    /// leave numbers of the rig open.
    pub leaves_numbers_open: bool,
    /// A table in the place of a force that no effect explains.
    pub term: Option<unknown_term::Term>,
    /// What the effects came to that a table was put in the place of.
    of_effects: Option<Box<LawDiagnosis>>,
    /// Each effect of the improved model beside the model without it.
    pub alone: BTreeMap<usize, Alone>,
    /// The frozen models.
    pub frozen: Vec<Frozen>,
    /// Their runs on the training recordings, by model.
    pub train: Vec<Vec<Option<Run>>>,
    /// Their runs on the held-out recordings, by model.
    pub held_out: Vec<Vec<Option<Run>>>,
    /// What the excitation cannot show, and why.
    pub screened: Vec<String>,
    /// From which size on each candidate would have shown, where nothing does.
    pub limits: Vec<Limit>,
    /// Number of fits made.
    pub fits: usize,
    /// Work done, as seconds of a reference core (see [`fitted::Bench::seconds`]).
    pub seconds: f64,
}

/// What was put into a law and held-out recordings speak against.
#[derive(Clone, Debug)]
pub struct Refuted {
    /// The effects or the table, in words.
    pub what: String,
    /// How predictions are with it, in words.
    pub how: &'static str,
}

/// The whole diagnosis.
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// By law.
    pub laws: Vec<LawDiagnosis>,
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

impl LawDiagnosis {
    /// What the improved model leaves of held-out recordings: predicted less recorded, by
    /// output, recording and row.
    fn left_of_held_out(&self, tracks: &[Track<'_>], rig: &Rig) -> Vec<Vec<Vec<f64>>> {
        let runs = &self.held_out[Model::Improved as usize];
        let of_output = |(number, output): (usize, &Output)| {
            let of_track = |(run, track): (&Option<Run>, &Track<'_>)| {
                let predicted = run.as_ref().map_or(&[][..], |run| &run.predicted[number]);
                let recorded = track.recorded(output).iter();
                predicted.iter().zip(recorded).map(|(p, r)| p - r).collect()
            };
            runs.iter().zip(tracks).map(of_track).collect()
        };
        let outputs = self.law.outputs(rig);
        outputs.iter().enumerate().map(of_output).collect()
    }

    /// What the chambers would explain by one input, or the forces by an equation, if no effect does.
    fn ask_for_input(&mut self, bench: &Bench<'_>) {
        let found = unknown_input::find(bench, &self.baseline);
        // What a table explains needs no input that explains less.
        let tabled = self
            .term
            .as_ref()
            .map_or(0.0, unknown_term::Term::explained);
        let found = found.filter(|found| found.located.share > tabled);
        (self.input, self.equation) = match found {
            Some(found) => (Some(found.located), found.equation),
            None => (None, self.force_equation(bench)),
        };
        self.lost_commands = between_rows::share(bench, &self.baseline);
    }

    /// The equation of a force that the model has no place for.
    fn force_equation(&self, bench: &Bench<'_>) -> Option<Equation> {
        let is_in_model = self
            .term
            .as_ref()
            .is_some_and(unknown_term::Term::is_equation);
        if is_in_model {
            return None;
        }
        missing_force::equation(bench, &self.baseline)
    }

    /// The same of a law whose effects were taken back.
    fn ask_for_input_anew(&mut self, rig: &Rig, train: &[Recording]) {
        if self.law == Law::Chambers && assemble::is_unexplained(self) {
            let tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
            let mut bench = Bench::new(self.law, rig, &tracks);
            bench.noise.clone_from(&self.noise);
            self.ask_for_input(&bench);
        }
    }

    /// Runs the frozen models on the held-out recordings, and takes back what those refute: a
    /// table for the effects in whose place it was put, then effects too.
    fn prove(&mut self, rig: &Rig, tracks: &[Track<'_>], held_out: &[Recording]) {
        self.held_out = runs(self.law, rig, tracks, &self.frozen);
        self.judge_held_out(rig, tracks, held_out);
    }

    /// Takes back what the runs on the held-out recordings refute.
    fn judge_held_out(&mut self, rig: &Rig, tracks: &[Track<'_>], held_out: &[Recording]) {
        if assemble::is_unnamed(self) && proof::worsens_a_signal(self, held_out) {
            return self.leave_out();
        }
        match (proof::said(self, held_out), self.of_effects.take()) {
            (Said::Worse, Some(of_effects)) => {
                *self = *of_effects;
                self.prove(rig, tracks, held_out);
            }
            (Said::Worse, None) => self.take_back("worse"),
            (Said::Nothing | Said::WorseByChance, _) if self.improved.presence.is_some() => {
                self.doubt_moments(tracks, held_out);
            }
            (Said::WorseByChance, _) => self.leave_unproven(),
            (Said::Nothing, _) => {}
        }
    }

    /// Whether break-aways alone show what was put in.
    fn is_of_rests(&self) -> bool {
        let is_of_rests = |index: &usize| self.candidates[*index].is_of_rests;
        !self.improved.set.is_empty() && self.improved.set.iter().all(is_of_rests)
    }

    /// The names of the accepted effects.
    fn named(&self) -> impl Iterator<Item = &'static str> {
        let accepted = self.evidence.iter().filter(|one| one.accepted);
        accepted.map(|one| self.candidates[one.candidate].effect)
    }

    /// The model that goes into the improved rig.
    pub fn for_the_rig(&self) -> &Fitted {
        if self.is_unproven {
            &self.baseline
        } else {
            &self.improved
        }
    }

    /// Recordings to which an effect that comes and goes was fitted had its moments chosen to suit
    /// it: it is no surer than by what it explains of others. (A force of no list that swings with
    /// time was a load in its play, 0.95, in many short spans, with two fifths of what was missed
    /// held out explained; of twelve that do come and go the least was 97 %.)
    ///
    /// What break-aways alone show is judged by them. Motions that are predicted worse, as a
    /// carriage that sticks may be, say nothing of it, but the improved rig does not hold it.
    fn doubt_moments(&mut self, tracks: &[Track<'_>], held_out: &[Recording]) {
        let share = if self.is_of_rests() {
            proof::explained_at_break_aways(self, tracks)
        } else {
            proof::explained(self, held_out)
        };
        if let Some(share) = share {
            let shown = search::probability_of(share);
            for one in self.evidence.iter_mut().filter(|one| one.accepted) {
                one.probability = one.probability.min(shown);
            }
            if shown < search::LIKELIER_THAN_NOT {
                return self.take_back("hardly better");
            }
        }
        if self.is_of_rests() && proof::is_worse(self, held_out) {
            self.leave_unproven();
        }
    }

    /// What was put into the law keeps its name, and the improved rig does not hold it.
    fn leave_unproven(&mut self) {
        self.is_unproven = true;
        self.show_refitted();
    }

    /// Held-out recordings refute what was put into the law: the refitted model stands.
    fn take_back(&mut self, how: &'static str) {
        let what = assemble::what_was_put_in(self);
        self.refuted = Some(Refuted { what, how });
        self.explained = 0.0;
        self.term = None;
        self.leave_out();
    }

    /// The refitted model stands for the improved one.
    fn leave_out(&mut self) {
        self.evidence.iter_mut().for_each(Evidence::refute);
        self.improved = self.baseline.clone();
        self.is_open = self.is_unsound;
        for event in &mut self.break_aways {
            event.improved_n = event.refitted_n;
        }
        self.rivals.clear();
        self.next_experiment = None;
        self.show_refitted();
    }

    /// What the refitted model predicts stands for what the improved one does.
    fn show_refitted(&mut self) {
        let (refitted, improved) = (Model::Refitted as usize, Model::Improved as usize);
        self.frozen[improved] = self.frozen[refitted].clone();
        self.train[improved] = self.train[refitted].clone();
        self.held_out[improved] = self.held_out[refitted].clone();
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
    verdict.doubts = of_faults(&heard.faults).chain(doubts).collect();
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

/// The recordings with what inspection says of them.
struct Heard {
    train: Vec<Recording>,
    held_out: Vec<Recording>,
    inspections: Vec<Inspection>,
    faults: Vec<(String, Fault)>,
    /// The rig with the noise that counts.
    in_use: Rig,
}

impl Heard {
    fn of(rig: &Rig, train: Vec<Recording>, held_out: Vec<Recording>) -> Self {
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
    fn blame_instruments(&mut self, progress: &dyn Fn(&str)) {
        if self.faults.is_empty() && self.in_use.cylinder.is_some() {
            progress("whether gauges, wires and logger fit the rig");
            let stated = with_built_in_priors(&self.in_use);
            self.faults
                .extend(instruments::mistake(&stated, &self.train));
        }
    }

    /// Parts recordings at their gaps; says where.
    fn part(&mut self) -> Vec<String> {
        let mut notes = Vec::new();
        for recordings in [&mut self.train, &mut self.held_out] {
            let (parted, of_these) = gaps::parted(&self.in_use, std::mem::take(recordings));
            *recordings = parted;
            notes.extend(of_these);
        }
        notes
    }

    /// The valve, where the rig file states one flow of it only.
    fn measured_valve(&self, progress: &dyn Fn(&str)) -> Option<ValveFlow> {
        if !self.faults.is_empty() || !self.in_use.states_flow() {
            return None;
        }
        progress("the valve's areas over the opening, which the rig file does not state");
        let tracks: Vec<Track<'_>> = self.train.iter().map(Track::new).collect();
        valve_flow::measure(&self.in_use, &tracks).ok()
    }

    /// What is to be doubted of recordings and numbers.
    fn doubts(&self, verdict: &Verdict) -> Vec<inspect::Doubt> {
        let mut doubts = remarks_on_reading(&self.train, &self.held_out);
        doubts.extend(inspect::noise_doubts(&self.inspections));
        doubts.extend(remarks::at_bounds(&verdict.parameters));
        doubts
    }
}

/// The laws that the rig describes, one after the other: each knows what those before it have shown.
fn diagnosed_laws(
    rig: &Rig,
    train: &[Recording],
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Vec<LawDiagnosis> {
    let mut laws = Vec::new();
    let mut known = Known::new(rig, train);
    for law in Law::of(rig, &|name| is_in_all(train, name)) {
        let diagnosis = diagnose_law(law, &known, bank, progress);
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
    laws: &mut [LawDiagnosis],
    (train, held_out): (&[Recording], &[Recording]),
    progress: &dyn Fn(&str),
) {
    let mut heard = Cow::from(held_out);
    for law in &mut *laws {
        let tracks: Vec<Track<'_>> = heard.iter().map(Track::new).collect();
        law.prove(rig, &tracks, &heard);
        if law.refuted.is_some() {
            progress("input error that explains the misfit");
            law.ask_for_input_anew(rig, train);
        }
        if proof::surprises(law, rig, &tracks, &heard) {
            law.leaves_numbers_open = proof::is_of_open_numbers(law, rig, &tracks, (train, &heard));
            law.is_surprised = !law.leaves_numbers_open;
        }
        if law.is_surprised {
            let misfits =
                locate::locate(law.law, rig, &tracks, &law.left_of_held_out(&tracks, rig));
            law.located = above_noise(misfits, &law.floor);
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
    laws: &[LawDiagnosis],
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
fn velocity(rig: &Rig, laws: &[LawDiagnosis], train: &[Recording]) -> Option<Located> {
    let mut named = laws.iter().flat_map(LawDiagnosis::named);
    let is_skew_named = named.any(|effect| effect == "position-time-skew");
    let is_position = laws.iter().any(assemble::is_unexplained);
    let tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
    kinematics::contradiction(rig, &tracks, is_skew_named, is_position)
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
fn of_faults(faults: &[(String, Fault)]) -> impl Iterator<Item = inspect::Doubt> {
    faults.iter().map(|(recording, fault)| inspect::Doubt {
        about: format!("signals.{}", fault.signal),
        says: format!("{recording}: {}", fault.sentence),
        p_value: None,
    })
}

/// What a search of the effects brought, its models fitted to the end.
struct Searched {
    outcome: Outcome,
    alone: BTreeMap<usize, Alone>,
    screened: Vec<String>,
    limits: Vec<Limit>,
    seconds: f64,
}

/// What the misfit comes to in the end.
struct Settled {
    /// Part of the misfit that named effects explain.
    explained: f64,
    /// The model with them, or with a table.
    improved: Fitted,
    term: Option<unknown_term::Term>,
}

impl Settled {
    /// What the effects of a search alone come to.
    fn of(full: &Bench<'_>, outcome: &Outcome) -> Self {
        Self {
            explained: assemble::explained(&outcome.baseline, &outcome.improved, &full.noise),
            improved: outcome.improved.clone(),
            term: None,
        }
    }
}

fn diagnose_law(
    law: Law,
    known: &Known<'_>,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Option<LawDiagnosis> {
    let title = law.title();
    let progress = |stage: &str| progress(&format!("{title}: {stage}"));
    let tracks: Vec<Track<'_>> = known.train.iter().map(Track::new).collect();
    let mut full = Bench::new(law.searched_by(), &known.rig, &tracks);
    full.sheet = known.sheet.clone();
    let mut searched = searched(law, &mut full, known, &progress)?;
    let settled = settled(&full, &mut searched, &known.doubts);
    // What comes and goes at moments that suit it may be there always, over the state.
    let comes_and_goes = settled.improved.presence.is_some();
    // A law of another form than the library's leaves something; where a table leaves plainly less
    // it is another law. (A loose load leaves blows that no model meets.)
    let mut effects = settled
        .improved
        .set
        .iter()
        .map(|&index| &full.candidates[index]);
    let is_smooth = !effects.any(|one| one.is_rough);
    let is_formless = is_smooth || !assemble::is_enough(settled.explained);
    let is_missed = is_formless && full.is_unsound(&settled.improved);
    let is_open = (comes_and_goes || is_missed) && !searched.outcome.evidence.is_empty();
    let of_effects = written(law, &full, &searched, settled, bank, &progress);
    let mut diagnosis = if is_open {
        tabled(law, &mut full, &mut searched, of_effects, bank, &progress)
    } else {
        of_effects
    };
    if assemble::is_unexplained(&diagnosis) {
        progress("input error that explains the misfit");
        diagnosis.ask_for_input(&full);
    }
    Some(diagnosis)
}

/// A table in the place of a force that the effects do not explain, if it predicts plainly
/// better: then none of them is named, unless held-out recordings refute the table.
fn tabled(
    law: Law,
    full: &mut Bench<'_>,
    searched: &mut Searched,
    of_effects: LawDiagnosis,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> LawDiagnosis {
    progress("table in place of a law");
    let found = unknown_term::find(full, &searched.outcome.baseline, &of_effects.improved);
    let Some((term, improved)) = found else {
        return of_effects;
    };
    searched.outcome.decline_all();
    let settled = Settled {
        explained: 0.0,
        improved,
        term: Some(term),
    };
    let of_table = written(law, full, searched, settled, bank, progress);
    LawDiagnosis {
        of_effects: assemble::has_named(&of_effects).then(|| Box::new(of_effects)),
        ..of_table
    }
}

/// What was found, with the models frozen and run on the training recordings.
fn written(
    law: Law,
    full: &Bench<'_>,
    searched: &Searched,
    settled: Settled,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> LawDiagnosis {
    let outcome = &searched.outcome;
    let baseline = &outcome.baseline;
    if !outcome.rivals.is_empty() {
        progress("next experiment to separate the alternatives");
    }
    let next_experiment = next_experiment(bank, full, &settled.improved, &outcome.rivals);
    let frozen = vec![
        Frozen::given(full.rig),
        Frozen::new(full, baseline),
        Frozen::new(full, &settled.improved),
    ];
    let (missed, is_unsound) = (full.misses_plainly(baseline), full.is_unsound(baseline));
    let shown = shown(full, law, baseline);
    let located = missed.then(|| {
        let misfits = locate::locate(law, full.rig, full.tracks, &shown.residuals);
        above_noise(misfits, &shown.noise)
    });
    LawDiagnosis {
        law,
        located: located.unwrap_or_default(),
        break_aways: break_aways(full, baseline, &settled.improved),
        input: None,
        equation: None,
        lost_commands: None,
        missed,
        is_unsound,
        is_open: settled.term.is_some() || full.is_unsound(&settled.improved),
        explained: settled.explained,
        refuted: None,
        is_unproven: false,
        is_surprised: false,
        leaves_numbers_open: false,
        term: settled.term,
        of_effects: None,
        alone: searched.alone.clone(),
        train: runs(law, full.rig, full.tracks, &frozen),
        held_out: Vec::new(),
        frozen,
        noise: full.noise.clone(),
        floor: shown.noise,
        candidates: full.candidates.clone(),
        baseline: baseline.clone(),
        improved: settled.improved,
        evidence: outcome.evidence.clone(),
        rivals: outcome.rivals.clone(),
        next_experiment,
        screened: searched.screened.clone(),
        limits: searched.limits.clone(),
        fits: outcome.fits,
        seconds: searched.seconds + full.seconds(),
    }
}

/// The honest refit and the search, on fewer rows where the law allows it; what they find,
/// fitted to the end on all rows. The bench gets the noise and the candidates.
fn searched(
    law: Law,
    full: &mut Bench<'_>,
    known: &Known<'_>,
    progress: &dyn Fn(&str),
) -> Option<Searched> {
    progress("refitting the ordinary parameters");
    let stride = if law.may_be_thinned(full.rig) {
        (full.rows() / SEARCH_ROWS).max(1)
    } else {
        1
    };
    let train = known.train.iter();
    let thinned: Vec<Recording> = train.map(|recording| recording.thinned(stride)).collect();
    let tracks: Vec<Track<'_>> = thinned.iter().map(Track::new).collect();
    let mut bench = Bench::new(full.law, full.rig, &tracks).for_search();
    let baseline = search::baseline(&bench)?;
    bench.learn_noise(&baseline, &known.doubts);
    let baseline = bench.in_own_noise(baseline);
    let misfit = baseline.mean_square[0].sqrt();
    bench.candidates = candidates(bench.law, bench.rig, &tracks, misfit);
    let screened = knowability::screen(bench.law, &tracks, &mut bench.candidates);
    let baseline = bench.learn_break_aways(baseline);
    let mut outcome = if bench.is_worth_a_search(&baseline) {
        let given = bench.as_given(&baseline);
        bench.begin_waves_where_missed(&[&baseline, &given]);
        bench.keep_best_starts(&[&baseline, &given]);
        search::search(&bench, &baseline, progress)
    } else {
        Outcome::nothing(&baseline)
    };
    let mut limits = Vec::new();
    if outcome.improved.set.is_empty() && !bench.misses_plainly(&baseline) {
        progress("detection limits");
        limits = limits::limits(&bench, &baseline);
    }
    progress("final fits");
    full.learn_from(&bench);
    if stride > 1 || bench.is_coarse() {
        (outcome.baseline, outcome.improved) = polished(full, &outcome)?;
    }
    let mut outcome = strayed::explained(full, outcome, progress);
    match Doubt::of(full, &outcome.improved) {
        Doubt::None => {}
        Doubt::RigOrEffects => outcome.doubt(),
        Doubt::Disguise => outcome.decline_all(),
    }
    Some(Searched {
        alone: alone::against_chance(full, &mut outcome),
        screened,
        limits,
        seconds: bench.seconds(),
        outcome,
    })
}

/// What the free running axis adds: a loose load as its motion shows it, or that it shows none. And
/// one on a spring as the windows show it that know it best.
fn settled(full: &Bench<'_>, searched: &mut Searched, doubts: &[Doubts]) -> Settled {
    let outcome = &mut searched.outcome;
    let refined = loose_load::refined(full, &outcome.baseline, &outcome.improved);
    let is_none = |one: &Refined| search::is_no_load(full, &one.model, one.candidate);
    if let Some(one) = refined.as_ref().filter(|one| is_none(one)) {
        if let Some(others) = full.without(&outcome.improved, one.candidate) {
            outcome.decline(one.candidate);
            outcome.improved = others;
        }
        return Settled::of(full, outcome);
    }
    if let Some(one) = refined.as_ref().filter(|one| !one.needless.is_empty()) {
        one.needless
            .iter()
            .for_each(|&needless| outcome.decline(needless));
        outcome.improved = one.begun.clone();
        outcome.judge_again(full);
    }
    if let Some(sized) = swinging_load::sized(full, &outcome.improved, doubts) {
        outcome.improved = sized;
    }
    let mut settled = Settled::of(full, outcome);
    if let Some(one) = refined {
        outcome.explains(one.candidate, one.share);
        settled.explained = settled.explained.max(one.share);
        settled.improved = one.model;
    }
    settled
}

/// What a search on fewer rows, or with fits that end early, found: baseline and improved
/// model fitted to the end on all rows.
fn polished(full: &Bench<'_>, outcome: &Outcome) -> Option<(Fitted, Fitted)> {
    let baseline = full.fit(&[], Some(&outcome.baseline))?;
    let improved = if outcome.improved.set.is_empty() {
        baseline.clone()
    } else {
        let improved = full.fit(&outcome.improved.set, Some(&outcome.improved))?;
        full.centred_at_edges(improved)
    };
    Some((baseline, improved))
}

/// The experiment that would tell an accepted effect from the one that does as well.
fn next_experiment(
    bank: &dyn Bank,
    bench: &Bench<'_>,
    improved: &Fitted,
    rivals: &[(usize, usize)],
) -> Option<NextExperiment> {
    let &(accepted, rival) = rivals.first()?;
    let others = fitted::without(&improved.set, accepted);
    let swapped = fitted::with(&others, rival);
    let other = bench.fit(&swapped, Some(&bench.restricted(improved, &others)))?;
    next_experiment::find(bank, bench, [improved, &other])
}

/// The misfits above their noise, each with its part of the energy above the noise,
/// which is counted in the noise's own units: the spread of a signal that hardly
/// moves says nothing.
fn above_noise(misfits: Vec<Located>, noise: &[f64]) -> Vec<Located> {
    let excess = |(located, noise): (Located, &f64)| {
        let excess = located.rms.powi(2) / noise.powi(2) - 1.0;
        (located, excess)
    };
    let mut above: Vec<(Located, f64)> = misfits
        .into_iter()
        .zip(noise)
        .map(excess)
        .filter(|(_, excess)| *excess > MISSED)
        .collect();
    let whole: f64 = above.iter().map(|(_, excess)| excess).sum();
    for (located, excess) in &mut above {
        located.share = *excess / whole;
    }
    above.into_iter().map(|(located, _)| located).collect()
}

/// What the refitted baseline leaves of the outputs that are shown, and their
/// noise.
struct Shown {
    residuals: Vec<Vec<Vec<f64>>>,
    noise: Vec<f64>,
}

/// A law is shown by its own outputs, whatever it was searched by.
fn shown(searched: &Bench<'_>, law: Law, baseline: &Fitted) -> Shown {
    if searched.law == law {
        return Shown {
            residuals: searched.residuals_of(baseline),
            noise: searched.noise.clone(),
        };
    }
    let bench = Bench::new(law, searched.rig, searched.tracks);
    let model = bench.restricted(baseline, &[]);
    Shown {
        residuals: bench.residuals_of(&model),
        noise: bench.floor_under(&model, &noise::shaken(&bench, &[])),
    }
}

/// The break-aways that both models follow.
fn break_aways(bench: &Bench<'_>, baseline: &Fitted, improved: &Fitted) -> Vec<BreakAway> {
    if bench.law != Law::Balance {
        return Vec::new();
    }
    let [refitted, improved] =
        [baseline, improved].map(|model| bench.residuals_of(model).swap_remove(balance::BREAKAWAY));
    let of_recording = |(recording, track): (usize, &Track<'_>)| {
        let (refitted, improved) = (&refitted[recording], &improved[recording]);
        let event = |(row, rest_s): (usize, f64)| BreakAway {
            rest_s,
            refitted_n: refitted[row],
            improved_n: improved[row],
        };
        let rests = balance::rests_s(bench.rig, track).into_iter();
        let events: Vec<BreakAway> = rests.map(event).collect();
        events
    };
    let tracks = bench.tracks.iter().enumerate();
    let mut events: Vec<BreakAway> = tracks.flat_map(of_recording).collect();
    events.retain(|event| event.refitted_n.is_finite() && event.improved_n.is_finite());
    events
}

/// Every frozen model against every recording.
fn runs(law: Law, rig: &Rig, tracks: &[Track<'_>], frozen: &[Frozen]) -> Vec<Vec<Option<Run>>> {
    let bench = Bench::new(law, rig, tracks);
    let own = candidates(law, rig, tracks, 1.0);
    let run = |model: &Frozen| model.run(&bench, &own);
    frozen.par_iter().map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Presence;
    use truth_plant::{Kind, Request, Strength};

    const FRICTION: &str = "pressure-dependent-friction";

    /// An axis with a strong friction by pressure, its last recording held out.
    fn with_friction() -> (Rig, Vec<Recording>, Vec<Recording>) {
        let (rig, mut recordings) = drawn::of_kind(Kind::Single, 3, Strength::Strong, FRICTION);
        let held_out = recordings.split_off(recordings.len() - 1);
        (rig, recordings, held_out)
    }

    /// A strong load in its play was declined for a table over the velocity; held-out recordings
    /// refuted that, and nothing was named.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_effects_stand_again_where_a_table_in_their_place_is_refuted() {
        let (rig, recordings, held_out) = with_friction();
        let found =
            || diagnose_law(Law::Carriage, &Known::new(&rig, &recordings), &(), &|_| ()).unwrap();
        let mut law = found();
        assert!(assemble::has_named(&law));
        let mut heavy = BTreeMap::new();
        heavy.insert("carriage.mass_kg".to_owned(), 100.0);
        let frozen = &mut law.frozen[Model::Improved as usize];
        frozen.rig = frozen.rig.with_values(&heavy);
        law.evidence.iter_mut().for_each(|one| one.accepted = false);
        law.term = Some(unknown_term::Term {
            candidate: 0,
            stand: unknown_term::Stand::Table(unknown_term::Shape::ForceOverVelocity),
            share: 0.9,
        });
        law.of_effects = Some(Box::new(found()));
        let tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
        law.prove(&rig, &tracks, &held_out);
        assert!(law.term.is_none() && law.refuted.is_none());
        assert!(assemble::has_named(&law));
        let left = |model: Model| law.held_out[model as usize][0].as_ref().unwrap().horizon[0];
        assert!(left(Model::Improved) < left(Model::Refitted));
    }

    /// A load that came and went in many short spans was named, with 0.95, for a force that swings.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_what_comes_and_goes_is_no_surer_than_held_out_recordings_make_it() {
        let (rig, recordings, held_out) = with_friction();
        let tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
        let proven = |helps: bool| {
            let known = Known::new(&rig, &recordings);
            let mut law = diagnose_law(Law::Carriage, &known, &(), &|_| ()).unwrap();
            law.improved.presence = Some(Presence::nowhere(FRICTION, recordings.len()));
            if !helps {
                law.frozen[Model::Improved as usize] = law.frozen[Model::Refitted as usize].clone();
            }
            law.prove(&rig, &tracks, &held_out);
            law
        };
        let helped = proven(true);
        assert!(assemble::has_named(&helped) && helped.refuted.is_none());
        let unhelped = proven(false);
        assert!(!assemble::has_named(&unhelped));
        assert_eq!(unhelped.refuted.unwrap().how, "hardly better");
    }

    /// A seal that aged for half of the time left a seventh of what was missed at break-aways, and was
    /// taken back for how long the carriage stuck in the free run.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_what_break_aways_alone_show_is_judged_by_them() {
        let request = Request::new(2_333_996_632, Kind::Onset).with_noise(1.0);
        let case = request.with_strength(Strength::Medium).draw();
        let rig = Rig::parse(&case.rig_toml, "rig.toml").unwrap();
        let read = |files: &[(String, String)]| -> Vec<Recording> {
            let files = files.iter();
            files.map(|file| drawn::recording(file, &rig)).collect()
        };
        let (recordings, held_out) = (read(&case.train), read(&case.held_out));
        let known = Known::new(&rig, &recordings);
        let mut law = diagnose_law(Law::Carriage, &known, &(), &|_| ()).unwrap();
        let tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
        law.prove(&rig, &tracks, &held_out);
        assert!(law.named().eq(["dwell-stiction"]) && law.refuted.is_none());
        assert!(law.improved.presence.is_some());
        law.frozen[Model::Improved as usize] = law.frozen[Model::Refitted as usize].clone();
        law.prove(&rig, &tracks, &held_out);
        assert_eq!(law.refuted.unwrap().how, "hardly better");
    }

    /// A rise of the stiction that took break-aways from 2.4 times their noise down to it was taken
    /// back for two windows of 48, in which the carriage stayed where it was.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_few_windows_leave_an_effect_its_name_and_the_rig_as_refitted() {
        let (rig, recordings, held_out) = with_friction();
        let tracks: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
        let proven = |worse_in: usize| {
            let known = Known::new(&rig, &recordings);
            let mut law = diagnose_law(Law::Carriage, &known, &(), &|_| ()).unwrap();
            law.held_out = runs(law.law, &rig, &tracks, &law.frozen);
            let [refitted, improved] = [Model::Refitted, Model::Improved].map(|one| one as usize);
            law.held_out[improved] = law.held_out[refitted].clone();
            for run in law.held_out[improved].iter_mut().flatten() {
                run.windows
                    .iter_mut()
                    .take(worse_in)
                    .flatten()
                    .for_each(|one| *one += 1e-4);
                run.horizon.iter_mut().for_each(|one| *one *= 2.0);
            }
            law.judge_held_out(&rig, &tracks, &held_out);
            law
        };
        let unproven = proven(1);
        assert!(assemble::has_named(&unproven) && unproven.refuted.is_none());
        assert!(unproven.is_unproven);
        let laws = [unproven];
        assert!(assemble::improved_rig(&rig, &laws).effects.is_empty());
        let note = assemble::unproven_note(&laws[0]).unwrap();
        assert!(note.contains("may be chance"), "{note}");
        let refuted = proven(20);
        assert!(!assemble::has_named(&refuted) && refuted.refuted.is_some());
    }

    /// Without held-out recordings what was named of a carriage was "not borne out" by them.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_recordings_that_were_not_given_say_nothing() {
        let (rig, recordings, _) = with_friction();
        let known = Known::new(&rig, &recordings);
        let mut law = diagnose_law(Law::Carriage, &known, &(), &|_| ()).unwrap();
        law.prove(&rig, &[], &[]);
        assert!(assemble::has_named(&law) && !law.is_unproven && law.refuted.is_none());
    }

    /// Four times the work would be of the square.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_twice_as_long_recordings_take_about_twice_the_work() {
        let strong = Strength::Strong;
        let (rig, whole) = drawn::of_kind(Kind::Single, 3, strong, "piston-leakage");
        let half: Vec<Recording> = whole.iter().map(|one| one.part(0..one.len() / 2)).collect();
        let work = |recordings: &[Recording]| {
            let found = diagnose_law(Law::Chambers, &Known::new(&rig, recordings), &(), &|_| ());
            found.unwrap().seconds
        };
        let ratio = work(&whole) / work(&half);
        println!("{ratio:.2} times the work");
        assert!((1.0..3.0).contains(&ratio), "{ratio}");
    }
}
