//! What the stated uncertainties of a rig do to the outcome of an experiment.
//!
//! A volume that is known to 5 % makes a heat transfer that is known to 5 % at best, however
//! quiet the gauges. Each number with a stated deviation is moved by one, the experiment is
//! evaluated again, and the differences are added in quadrature (first-order propagation, JCGM
//! 100:2008, 5.1.2).

use grey_box::laws::Track;
use grey_box::rig::Rig;

use crate::outcome::Outcome;

/// An evaluation of an experiment.
pub type Measure = fn(&Rig, &[Track<'_>]) -> Result<Outcome, String>;

/// The outcome, its deviations widened by the stated ones of the keys that begin with one of
/// `depends_on`.
///
/// # Errors
/// Those of the evaluation with the numbers as they are stated.
pub fn with_what_is_stated(
    rig: &Rig,
    tracks: &[Track<'_>],
    measure: Measure,
    depends_on: &[&str],
) -> Result<Outcome, String> {
    let mut outcome = measure(rig, tracks)?;
    let is_used = |key: &&String| {
        depends_on.iter().any(|start| key.starts_with(start)) && outcome.number(key).is_none()
    };
    let keys: Vec<String> = rig.uncertainty.keys().filter(is_used).cloned().collect();
    let mut widened: Vec<f64> = outcome.numbers.iter().map(|one| one.deviation).collect();
    for key in keys {
        let (Some(value), Some(deviation)) = (rig.value(&key), rig.uncertainty_sd(&key)) else {
            continue;
        };
        let moved = rig.with_values(&[(key, value + deviation)].into());
        let Ok(other) = measure(&moved, tracks) else {
            continue;
        };
        for (slot, number) in widened.iter_mut().zip(&outcome.numbers) {
            let by = other
                .number(&number.key)
                .map_or(0.0, |one| one.value - number.value);
            *slot = slot.hypot(by);
        }
    }
    for (number, deviation) in outcome.numbers.iter_mut().zip(widened) {
        number.deviation = deviation;
    }
    Ok(outcome)
}
