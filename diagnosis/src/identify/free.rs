//! Which parameters a person wants free: `KEY[=START][,LOWER..UPPER]`.
//!
//! A key is taken if a law of the rig answers to it: the laws are run with its
//! derivative, so that no list of who reads what has to be kept.

use crate::estimate::candidates::{Candidate, candidates, ordinary, ordinary_parameter};
use crate::fit::law_problem::{FreeParameter, LawProblem, Scope};
use crate::fit::{LeastSquares, NormalEquations, Parameter, RowWeighting};
use crate::laws::{Law, Track};
use crate::rig::{Rig, ValveTable, key_bounds, numeric_keys};
use crate::text::{did_you_mean, one_line};

/// One parameter to free, as typed.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeRequest {
    /// `section.key` or `effects.NAME.key`.
    pub key: String,
    /// Where to start; the rig's own value unless told.
    pub start: Option<f64>,
    /// Lower and upper bound; those of the rig file's format unless told.
    pub bounds: Option<(f64, f64)>,
}

impl FreeRequest {
    /// Reads `KEY[=START][,LOWER..UPPER]`; the error is one line.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = |problem: &str| {
            let text = one_line(text);
            format!("--free {text}: {problem}, expected KEY[=START][,LOWER..UPPER]")
        };
        let number = |part: &str| {
            let value = part.trim().parse::<f64>().ok();
            value
                .filter(|value| value.is_finite())
                .ok_or_else(|| wrong(&format!("\"{}\" is no number", one_line(part))))
        };
        let (head, bounds) = match text.split_once(',') {
            Some((head, bounds)) => (head, Some(bounds)),
            None => (text, None),
        };
        let (key, start) = match head.split_once('=') {
            Some((key, start)) => (key, Some(number(start)?)),
            None => (head, None),
        };
        let bounds = bounds
            .map(|bounds| {
                let ends = bounds.split_once("..");
                let (lower, upper) = ends.ok_or_else(|| wrong("the bounds have no \"..\""))?;
                Ok::<_, String>((number(lower)?, number(upper)?))
            })
            .transpose()?;
        if bounds.is_some_and(|(lower, upper)| lower >= upper) {
            return Err(wrong("the lower bound is not below the upper one"));
        }
        Ok(Self {
            key: key.trim().to_owned(),
            start,
            bounds,
        })
    }
}

/// The free parameters of each law, in the order of `laws`. Without a request,
/// all that the engineer typed with an uncertainty. The error is one line.
pub fn free_parameters(
    rig: &Rig,
    laws: &[Law],
    tracks: &[Track<'_>],
    requests: &[FreeRequest],
) -> Result<Vec<Vec<FreeParameter>>, String> {
    let mut by_law: Vec<Vec<FreeParameter>> = vec![Vec::new(); laws.len()];
    if requests.is_empty() {
        for (free, &law) in by_law.iter_mut().zip(laws) {
            *free = ordinary(law, rig);
        }
    } else {
        let started = with_starts(rig, laws, tracks, requests)?;
        for request in requests {
            add_request(&started, laws, tracks, request, &mut by_law)?;
        }
    }
    if by_law.iter().all(Vec::is_empty) {
        return Err(format!(
            "nothing to fit: [uncertainty] names no key that acts on {}; name parameters with --free",
            titles(laws)
        ));
    }
    Ok(by_law)
}

/// The rig with every effect's number that is asked for at its start: when a leak opens acts on
/// nothing where there is none.
fn with_starts(
    rig: &Rig,
    laws: &[Law],
    tracks: &[Track<'_>],
    requests: &[FreeRequest],
) -> Result<Rig, String> {
    let mut started = rig.clone();
    let of_effects = requests
        .iter()
        .filter(|request| request.key.starts_with("effects."));
    for request in of_effects {
        let offered: Vec<Candidate> = laws
            .iter()
            .flat_map(|&law| candidates(law, rig, tracks, misfit_scale(law, rig, tracks)))
            .collect();
        let free = effect_parameter(rig, request, offered.iter())?;
        let unknown = |_| no_start(&request.key);
        let stored = started.set_value(&request.key, free.parameter.start);
        stored.map_err(unknown)?;
    }
    Ok(started)
}

fn add_request(
    rig: &Rig,
    laws: &[Law],
    tracks: &[Track<'_>],
    request: &FreeRequest,
    by_law: &mut [Vec<FreeParameter>],
) -> Result<(), String> {
    let key = one_line(&request.key);
    if by_law.iter().flatten().any(|free| free.key == request.key) {
        return Err(format!("--free {key}: named twice"));
    }
    let offered: Vec<Vec<Candidate>> = laws
        .iter()
        .map(|&law| candidates(law, rig, tracks, misfit_scale(law, rig, tracks)))
        .collect();
    let mut start = None;
    for (place, &law) in laws.iter().enumerate() {
        let free = if request.key.starts_with("effects.") {
            effect_parameter(rig, request, offered.iter().flatten())?
        } else {
            rig_parameter(rig, request)?
        };
        start = Some(free.parameter.start);
        if acts(law, rig, tracks, &free) {
            by_law[place].push(free);
        }
    }
    if by_law.iter().flatten().any(|free| free.key == request.key) {
        return Ok(());
    }
    let known: Vec<&str> = offered
        .iter()
        .flatten()
        .flat_map(|candidate| candidate.free.iter().map(|free| free.key.as_str()))
        .collect();
    let hint = if request.key.starts_with("effects.") {
        did_you_mean(&request.key, &known)
    } else {
        String::new()
    };
    let start = start.unwrap_or(f64::NAN);
    Err(format!(
        "--free {key}: at {start} it acts on no law of this rig, which has: {}{hint}",
        titles(laws)
    ))
}

/// The size of a force or pressure that candidates are started from: the
/// spread of what the law predicts.
fn misfit_scale(law: Law, rig: &Rig, tracks: &[Track<'_>]) -> f64 {
    let bench = crate::estimate::Bench::new(law, rig, tracks);
    bench.spread().first().copied().unwrap_or(1.0)
}

/// A parameter of left-out physics. What the diagnosis would try knows its
/// bounds, whether it belongs to a recording, and a start.
fn effect_parameter<'c>(
    rig: &Rig,
    request: &FreeRequest,
    offered: impl Iterator<Item = &'c Candidate>,
) -> Result<FreeParameter, String> {
    let offered: Vec<&FreeParameter> = offered.flat_map(|one| &one.free).collect();
    let known = offered.iter().find(|free| free.key == request.key);
    let known: Option<FreeParameter> = known.map(|known| (*known).clone());
    let names: Vec<&str> = offered.iter().map(|free| free.key.as_str()).collect();
    let start = request
        .start
        .or_else(|| rig.value(&request.key))
        .or_else(|| known.as_ref().map(|known| known.parameter.start))
        .ok_or_else(|| no_start(&request.key) + &did_you_mean(&request.key, &names))?;
    let mut free = known.unwrap_or_else(|| FreeParameter {
        key: request.key.clone(),
        scope: Scope::Shared,
        parameter: Parameter::new(start),
    });
    free.parameter.start = start;
    within(request, free)
}

/// A number of the rig file. A prior comes from `[uncertainty]`.
fn rig_parameter(rig: &Rig, request: &FreeRequest) -> Result<FreeParameter, String> {
    let key = request.key.as_str();
    let Some((lower, upper)) = key_bounds(key) else {
        let known: Vec<&str> = numeric_keys()
            .chain(ValveTable::ALL.map(ValveTable::key))
            .collect();
        let hint = did_you_mean(key, &known);
        return Err(format!("--free {}: unknown key{hint}", one_line(key)));
    };
    if let Some(value) = request.start.filter(|_| rig.value(key).is_none()) {
        let mut probe = rig.clone();
        probe
            .set_value(key, value)
            .map_err(|error| format!("--free {key}: {error}"))?;
    }
    let start = request
        .start
        .or_else(|| rig.value(key))
        .ok_or_else(|| no_start(key))?;
    let mut free = ordinary_parameter(rig, key).unwrap_or_else(|| FreeParameter {
        key: key.to_owned(),
        scope: Scope::Shared,
        parameter: Parameter::new(start).bounded(lower, upper),
    });
    free.parameter.lower = free.parameter.lower.max(lower);
    free.parameter.upper = free.parameter.upper.min(upper);
    free.parameter.start = start;
    within(request, free)
}

fn no_start(key: &str) -> String {
    let key = one_line(key);
    format!("--free {key}: the rig file gives no value, write {key}=START")
}

/// The bounds that the person asked for, and a start inside of them.
fn within(request: &FreeRequest, mut free: FreeParameter) -> Result<FreeParameter, String> {
    let parameter = &mut free.parameter;
    if let Some((lower, upper)) = request.bounds {
        parameter.lower = lower;
        parameter.upper = upper;
    }
    if parameter.start < parameter.lower || parameter.start > parameter.upper {
        return Err(format!(
            "--free {}: the start {} lies outside {} to {}",
            one_line(&request.key),
            parameter.start,
            parameter.lower,
            parameter.upper
        ));
    }
    Ok(free)
}

/// Whether a law's prediction changes with the parameter, by its derivative.
fn acts(law: Law, rig: &Rig, tracks: &[Track<'_>], free: &FreeParameter) -> bool {
    let sigma = vec![1.0; law.outputs(rig).len()];
    let free = std::slice::from_ref(free);
    let mut problem = LawProblem {
        law,
        rig,
        tracks,
        free,
        sigma: &sigma,
        left_out: None,
        presence: None,
    };
    let names = problem.names();
    let starts: Vec<f64> = problem.parameters().iter().map(|one| one.start).collect();
    let mut equations = NormalEquations::new(starts.len(), RowWeighting::Squares);
    problem.accumulate(&starts, &mut equations);
    let curvature = equations.cost_curvature();
    names
        .iter()
        .enumerate()
        .any(|(index, name)| name.starts_with(&free[0].key) && curvature[(index, index)] > 0.0)
}

/// The laws as a list in words.
pub(super) fn titles(laws: &[Law]) -> String {
    let titles: Vec<&str> = laws.iter().map(|law| law.title()).collect();
    titles.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_request_has_key_start_and_bounds() {
        let parsed = FreeRequest::parse("friction.coulomb_N=17.5,0..1e2").expect("a request");
        assert_eq!(parsed.key, "friction.coulomb_N");
        assert_eq!(parsed.start, Some(17.5));
        assert_eq!(parsed.bounds, Some((0.0, 100.0)));
        let parsed = FreeRequest::parse("valve.null_V,-1.5..2").expect("a request");
        assert_eq!((parsed.start, parsed.bounds), (None, Some((-1.5, 2.0))));
    }

    #[test]
    fn val_a_bad_request_is_one_line() {
        for text in ["a=x", "a,1", "a,2..1", "a=nan", "a,1..\n"] {
            let error = FreeRequest::parse(text).expect_err(text);
            assert!(error.starts_with("--free a"), "{error}");
            assert_eq!(error.lines().count(), 1, "{error}");
        }
    }
}
