//! What the signals and the excitation cannot show, known before anything is
//! fitted.
//!
//! An effect whose action can hardly be told from one that is there anyway is
//! not tried: it would win or lose by accident. Declining it says nothing
//! against it, only that other recordings are needed.

use crate::effects;
use crate::estimate::candidates::Candidate;
use crate::laws::{Law, Track};
use crate::thresholds::LEAST_OWN_ENERGY;
use std::collections::BTreeSet;

/// Rows slower than this part of the fastest count as standing.
const SLIDING_SHARE: f64 = 0.2;

/// Removes the candidates that the excitation cannot show; returns why.
pub fn screen(law: Law, tracks: &[Track<'_>], candidates: &mut Vec<Candidate>) -> Vec<String> {
    if law != Law::Force {
        return Vec::new();
    }
    let screens = [
        (
            ["viscous-friction", "stribeck-friction"].as_slice(),
            "the sliding speeds vary",
            own_energy(&sliding_speeds(tracks)),
        ),
        (
            ["pressure-dependent-friction"].as_slice(),
            "the pressure varies",
            own_energy(&gauge_pressures(tracks)),
        ),
    ];
    let mut reasons = Vec::new();
    for (effects, varies, own) in screens {
        let before = candidates.len();
        if own < LEAST_OWN_ENERGY {
            candidates.retain(|candidate| !effects.contains(&candidate.effect));
        }
        if candidates.len() < before {
            reasons.push(format!(
                "{} is not detectable: {varies} so little that only {:.0} % of its force differs from a constant force",
                effects.join(" and "),
                100.0 * own
            ));
        }
    }
    reasons
}

/// Energy of a quantity about its mean, over its energy: what is left of a term
/// that follows it once a constant term is projected out. 1 for no data.
fn own_energy(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count.max(1.0);
    let square = values.iter().map(|value| value * value).sum::<f64>() / count.max(1.0);
    if square > 0.0 {
        (1.0 - mean * mean / square).max(0.0)
    } else {
        1.0
    }
}

fn sliding_speeds(tracks: &[Track<'_>]) -> Vec<f64> {
    let speeds: Vec<f64> = tracks
        .iter()
        .filter_map(|track| track.motion.as_ref())
        .flat_map(|motion| motion.velocity_m_per_s.iter().map(|v| v.abs()))
        .collect();
    let mut sorted = speeds.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    // The 99th percentile: a jump of the position is not a speed.
    let fastest = sorted.get(sorted.len() * 99 / 100).copied().unwrap_or(0.0);
    speeds
        .into_iter()
        .filter(|&speed| speed > SLIDING_SHARE * fastest && speed <= fastest)
        .collect()
}

/// Gauge pressures of chamber a; the atmosphere is near enough for this.
fn gauge_pressures(tracks: &[Track<'_>]) -> Vec<f64> {
    tracks
        .iter()
        .filter_map(|track| track.recording.signal("p_a"))
        .flatten()
        .map(|pressure| pressure - crate::rig::STANDARD_PRESSURE_PA)
        .collect()
}

/// Names of effects that none of the laws at hand could show.
pub fn not_observable<'a>(tried: impl Iterator<Item = &'a str>) -> Vec<String> {
    let tried: BTreeSet<&str> = tried.collect();
    effects::EFFECTS
        .iter()
        .map(|effect| effect.name)
        .filter(|name| !tried.contains(name) && !effects::is_unnamed(name))
        .map(Into::into)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_own_energy_is_nought_for_a_constant_and_grows_with_the_spread() {
        assert!(own_energy(&[3.0; 10]) < 1e-12);
        let narrow = own_energy(&[9.0, 10.0, 11.0]);
        let wide = own_energy(&[1.0, 10.0, 100.0]);
        assert!(narrow < LEAST_OWN_ENERGY && wide > 0.5);
    }
}
