//! One law: the honest refit, the search for effects, a table where none explains it, and what
//! was found with its models frozen.

use super::known::Known;
use crate::estimate::candidates::candidates;
use crate::estimate::draws::Doubts;
use crate::estimate::{Bench, Fitted};
use crate::estimate::{between_rows, fitted, noise};
use crate::finding::proof::{Frozen, runs};
use crate::finding::{self, BreakAway, Finding};
use crate::laws::{Law, Track, balance};
use crate::locate::{self, Located};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::search::alone::{self, Alone};
use crate::search::limits::{self, Limit};
use crate::search::loose_load::{self, Refined};
use crate::search::next_experiment::{self, Bank, NextExperiment};
use crate::search::strayed::{self, Doubt};
use crate::search::{self, Outcome, knowability, swinging_load};
use crate::thresholds::MISSED;
use crate::unlisted::equation::Equation;
use crate::unlisted::{missing_force, unknown_input, unknown_term};
use std::collections::BTreeMap;
/// Rows that the search works on where a law may be thinned: the effects it can
/// have are slow against a recording of this many rows.
const SEARCH_ROWS: usize = 2500;

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
            explained: finding::explained(&outcome.baseline, &outcome.improved, &full.noise),
            improved: outcome.improved.clone(),
            term: None,
        }
    }
}

pub(crate) fn diagnose_law(
    law: Law,
    known: &Known<'_>,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Option<Finding> {
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
    let is_formless = is_smooth || !finding::is_enough(settled.explained);
    let is_missed = is_formless && full.is_unsound(&settled.improved);
    let is_open = (comes_and_goes || is_missed) && !searched.outcome.evidence.is_empty();
    let of_effects = written(law, &full, &searched, settled, bank, &progress);
    let mut diagnosis = if is_open {
        tabled(law, &mut full, &mut searched, of_effects, bank, &progress)
    } else {
        of_effects
    };
    if diagnosis.is_unexplained() {
        progress("input error that explains the misfit");
        ask_for_input(&mut diagnosis, &full);
    }
    Some(diagnosis)
}

/// A table in the place of a force that the effects do not explain, if it predicts plainly
/// better: then none of them is named, unless held-out recordings refute the table.
fn tabled(
    law: Law,
    full: &mut Bench<'_>,
    searched: &mut Searched,
    of_effects: Finding,
    bank: &dyn Bank,
    progress: &dyn Fn(&str),
) -> Finding {
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
    Finding {
        of_effects: of_effects.has_named().then(|| Box::new(of_effects)),
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
) -> Finding {
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
    Finding {
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
        bench.begin_frictions_of_place_where_missed(&[&baseline, &given]);
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
pub(super) fn above_noise(misfits: Vec<Located>, noise: &[f64]) -> Vec<Located> {
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

/// What the chambers would explain by one input, or the forces by an equation, if no effect does.
pub(super) fn ask_for_input(law: &mut Finding, bench: &Bench<'_>) {
    let found = unknown_input::find(bench, &law.baseline);
    // What a table explains needs no input that explains less.
    let tabled = law.term.as_ref().map_or(0.0, unknown_term::Term::explained);
    let found = found.filter(|found| found.located.share > tabled);
    (law.input, law.equation) = match found {
        Some(found) => (Some(found.located), found.equation),
        None => (None, force_equation(law, bench)),
    };
    law.lost_commands = between_rows::share(bench, &law.baseline);
}

/// The equation of a force that the model has no place for.
fn force_equation(law: &Finding, bench: &Bench<'_>) -> Option<Equation> {
    let is_in_model = law
        .term
        .as_ref()
        .is_some_and(unknown_term::Term::is_equation);
    if is_in_model {
        return None;
    }
    missing_force::equation(bench, &law.baseline)
}

/// The same of a law whose effects were taken back.
pub(super) fn ask_for_input_anew(law: &mut Finding, rig: &Rig, train: &[Recording]) {
    if law.law == Law::Chambers && law.is_unexplained() {
        let tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
        let mut bench = Bench::new(law.law, rig, &tracks);
        bench.noise.clone_from(&law.noise);
        ask_for_input(law, &bench);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use truth_plant::{Kind, Strength};

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
