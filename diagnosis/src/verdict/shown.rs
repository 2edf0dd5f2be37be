//! What the recordings would have shown of what they do not show, in words.

use crate::effects::Mark;
use crate::estimate::candidates::Candidate;
use crate::finding::Finding;
use crate::search::limits::Limit;
use crate::verdict::WouldShow;
use crate::words;
use std::collections::{BTreeMap, BTreeSet};

/// Every limit, with the candidate that it is of.
fn all(laws: &[Finding]) -> impl Iterator<Item = (&Limit, &Candidate)> {
    laws.iter().flat_map(|law| {
        let limits = law.limits.iter();
        limits.map(|limit| (limit, &law.candidates[limit.candidate]))
    })
}

/// The effects of laws in which nothing is missing.
pub(crate) fn tried(laws: &[Finding]) -> BTreeSet<&'static str> {
    all(laws).map(|(_, candidate)| candidate.effect).collect()
}

/// Those among them that would not have shown in any size, form or place.
pub(crate) fn at_no_size(laws: &[Finding]) -> BTreeSet<&'static str> {
    let mut silent = tried(laws);
    for (_, candidate) in all(laws).filter(|(limit, _)| limit.sizes.is_some()) {
        silent.remove(candidate.effect);
    }
    silent
}

pub(crate) fn would_show(laws: &[Finding]) -> Vec<WouldShow> {
    let one = |(limit, candidate): (&Limit, &Candidate)| WouldShow {
        effect: candidate.effect.into(),
        form: candidate.form.map(Into::into),
        places: candidate.places.iter().map(|&place| place.into()).collect(),
        from: limit.sizes.as_deref().map(by_parameter),
        matters_from: matters_from(candidate),
        hides: limit.hides(candidate),
    };
    all(laws).map(one).collect()
}

fn by_parameter(sizes: &[(String, f64)]) -> BTreeMap<String, f64> {
    let sizes = sizes.iter();
    sizes
        .map(|(key, size)| (short(key).into(), *size))
        .collect()
}

fn matters_from(candidate: &Candidate) -> BTreeMap<String, f64> {
    let marks = candidate.marks.iter();
    marks
        .map(|(key, mark)| (short(key).into(), mark.size()))
        .collect()
}

/// The candidates that could be there in a size that matters, though some size would show,
/// with that size.
fn weak(laws: &[Finding]) -> impl Iterator<Item = (&Candidate, BTreeMap<String, f64>)> {
    let hides = all(laws).filter(|(limit, candidate)| limit.hides(candidate));
    hides.filter_map(|(limit, candidate)| Some((candidate, by_parameter(limit.sizes.as_ref()?))))
}

/// What could be there all the same, in one line.
pub(crate) fn hidden_note(laws: &[Finding]) -> Option<String> {
    let in_words = |(candidate, sizes): (&Candidate, BTreeMap<String, f64>)| {
        let what = words::effect_at_places(candidate.effect, candidate.form, &candidate.places);
        let marks = candidate.marks.iter();
        let is_stronger_below = marks
            .filter(|(_, mark)| matches!(mark, Mark::UpTo(_)))
            .any(|(key, _)| sizes.keys().any(|one| key.ends_with(one.as_str())));
        let side = if is_stronger_below { "above" } else { "below" };
        format!("{what} {side} {}", words::sizes(candidate.effect, &sizes))
    };
    let mut hidden: Vec<String> = weak(laws).map(in_words).collect();
    let silent = at_no_size(laws).into_iter();
    let silent: Vec<String> = silent.map(|name| name.replace('-', " ")).collect();
    if !silent.is_empty() {
        hidden.push(format!("{} of any size", words::list(&silent)));
    }
    let hidden = (!hidden.is_empty()).then(|| hidden.join("; "))?;
    Some(format!(
        "not detectable in these recordings although relevant: {hidden}"
    ))
}

/// The effects that could be there in a size that matters.
pub(crate) fn hidden(laws: &[Finding]) -> Vec<&'static str> {
    let mut hidden = at_no_size(laws);
    hidden.extend(weak(laws).map(|(candidate, _)| candidate.effect));
    hidden.into_iter().collect()
}

/// Whether no effect would have shown, in whatever size.
pub(crate) fn is_blind(laws: &[Finding]) -> bool {
    let tried = tried(laws);
    !tried.is_empty() && tried == at_no_size(laws)
}

/// A key without its effect.
fn short(key: &str) -> &str {
    key.rsplit_once('.').map_or(key, |(_, short)| short)
}

#[cfg(test)]
mod tests {
    use crate::diagnose::diagnose;
    use crate::drawn;
    use crate::recording::Recording;
    use crate::verdict::Kind;
    use std::convert::Infallible;
    use truth_plant::Request;

    /// An axis that stands with its valve shut is predicted to the noise by any model.
    #[test]
    fn regress_an_axis_at_rest_shows_little() {
        let (rig, recordings) = drawn::read(&Request::new(1, truth_plant::Kind::Nothing));
        let mut resting = recordings[0].part(0..600);
        let null_v = rig.value("valve.null_V").unwrap();
        for (signal, column) in &mut resting.signals {
            let (standing, noise) = match signal.as_str() {
                "u" => (null_v, 0.0),
                "x" => (column[0], 8e-6),
                "v" => (0.0, 3e-3),
                _ => (column[0], 500.0),
            };
            for (row, value) in column.iter_mut().enumerate() {
                // The golden ratio's multiples fall evenly and never repeat.
                *value = standing + noise * ((row as f64 * 0.618_034).fract() - 0.5);
            }
        }
        let nothing = || Ok::<Vec<Recording>, Infallible>(Vec::new());
        let diagnosis = diagnose(&rig, vec![resting], nothing, &(), &|_| {}).unwrap();
        let verdict = diagnosis.verdict;
        let is_silent = matches!(verdict.verdict, Kind::NothingMissing | Kind::NotObservable);
        assert!(is_silent, "{}", verdict.sentence);
        for silent in ["tube-line", "valve-hysteresis", "constant-force"] {
            let is_told = verdict.not_observable.iter().any(|name| name == silent);
            assert!(is_told, "{silent}: {}", verdict.sentence);
        }
    }
}
