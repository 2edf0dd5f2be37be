//! What was put into a law, in words.

use super::Finding;
use crate::estimate::candidates::Candidate;
use crate::fit::Presence;
use crate::search::Evidence;
use crate::words::{self, Size};

/// Name of a parameter without its effect's prefix and its recording.
fn short_name(name: &str) -> &str {
    let key = name.split(" of ").next().unwrap_or(name);
    key.rsplit_once('.').map_or(key, |(_, short)| short)
}

/// Fitted sizes of a candidate's parameters, by the last law that they were free in: what the
/// chambers have shown of sensors the forces may know better.
pub(crate) fn sizes(laws: &[Finding], law: &Finding, candidate: &Candidate) -> Vec<Size> {
    let has_it = |law: &&Finding| {
        let mut free = candidate.free.iter();
        free.any(|free| law.improved.place(&free.key).is_some())
    };
    let law = laws.iter().rev().find(has_it).unwrap_or(law);
    let (fitted, times) = (&law.improved, times_the_noise(law));
    fitted
        .names
        .iter()
        .zip(&fitted.values)
        .zip(&fitted.standard_deviations)
        .filter(|((name, _), _)| {
            candidate
                .free
                .iter()
                .any(|free| **name == free.key || name.starts_with(&format!("{} of ", free.key)))
        })
        .map(|((name, &value), &std)| Size {
            effect: candidate.effect.to_owned(),
            parameter: short_name(name).to_owned(),
            value,
            std: std.map(|std| std * times),
        })
        .collect()
}

/// What a law leaves of its outputs, in units of their noise, rms and 1 at the least: what is not
/// explained moves the numbers as noise of that size would (Birge's ratio).
pub(crate) fn times_the_noise(law: &Finding) -> f64 {
    let squares = law.improved.mean_square.iter().zip(&law.noise);
    let squares: Vec<f64> = squares
        .map(|(square, noise)| square / (noise * noise))
        .filter(|square| square.is_finite())
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    mean.max(1.0).sqrt()
}

/// When an effect is there, if for a part of the time only.
pub(crate) fn presence(law: &Finding, candidate: usize) -> Option<&Presence> {
    let presence = law.improved.presence.as_ref()?;
    (presence.effect == law.candidates[candidate].effect).then_some(presence)
}

/// The named effects of a law, or its table, in words.
pub(crate) fn what_was_put_in(law: &Finding) -> String {
    if let Some(term) = &law.term {
        return term.stand.phrase();
    }
    let named = named(std::slice::from_ref(law), law);
    if named.is_empty() {
        return "effects too small to name".into();
    }
    words::list(&named)
}

pub(crate) fn named(laws: &[Finding], law: &Finding) -> Vec<String> {
    let accepted = law.evidence.iter().filter(|evidence| evidence.accepted);
    let name = |evidence: &Evidence| {
        let candidate = &law.candidates[evidence.candidate];
        let now_and_then = if presence(law, evidence.candidate).is_some() {
            ", part of the time"
        } else {
            ""
        };
        let name = words::named(candidate, &sizes(laws, law, candidate));
        format!("{name}{now_and_then}")
    };
    accepted.map(name).collect()
}
