//! What might be missing: for a law and a rig, the effects worth trying, each
//! as parameters to free and switches to set. The effects themselves are declared in
//! [`crate::effects`].
//!
//! An effect whose parameter the engineer declared uncertain is no candidate:
//! it is an ordinary parameter, refitted in the baseline.

use crate::effects::{self, EFFECTS, Half};
use crate::estimate::scene::scene;
use crate::fit::Parameter;
use crate::fit::law_problem::{FreeParameter, Scope};
use crate::gauge::GAIN_KEYS;
use crate::imprecise::edge_between_v;
use crate::laws::{Law, Track};
use crate::rig::{Rig, key_bounds};

pub use crate::effects::{Candidate, Edge};

/// The pairs of candidates that are one effect at two places: what is wrong with one chamber
/// often is with the other, and neither explains much alone.
pub(crate) fn twins(candidates: &[Candidate]) -> Vec<[usize; 2]> {
    let later = |one: usize| (one + 1..candidates.len()).map(move |other| [one, other]);
    let pairs = (0..candidates.len()).flat_map(later);
    let are_twins = |[one, other]: &[usize; 2]| candidates[*one].is_twin_of(&candidates[*other]);
    pairs.filter(are_twins).collect()
}

/// The numbers that beside a set of effects are others than the ones the rig states.
pub(crate) fn voids<'c>(
    candidates: &'c [Candidate],
    set: &[usize],
) -> impl Iterator<Item = &'c String> {
    set.iter().flat_map(|&index| &candidates[index].voids)
}

/// Times by which signals are apart. Where the chambers have shown one, the forces know it better.
pub(crate) const TIMES_OF_SENSORS: [&str; 2] = [
    "effects.position-time-skew.delay_s",
    "effects.pressure-sensor-lag.time_constant_s",
];

/// The parameters that an engineer typed with an uncertainty and that act on
/// this law: they are refitted before anything is said to be missing.
pub fn ordinary(law: Law, rig: &Rig) -> Vec<FreeParameter> {
    rig.uncertainty
        .keys()
        .filter(|key| acts_on(law, rig, key))
        .filter_map(|key| ordinary_parameter(rig, key))
        .collect()
}

/// A number that the engineer typed with an uncertainty, free with its prior.
pub fn ordinary_parameter(rig: &Rig, key: &str) -> Option<FreeParameter> {
    let mean = rig.value(key)?;
    let standard_deviation = rig.uncertainty_sd(key)?;
    let (lower, upper) =
        bounds_of_shape(rig, key).unwrap_or_else(|| ordinary_bounds(key, mean, standard_deviation));
    Some(FreeParameter {
        key: key.to_owned(),
        scope: Scope::Shared,
        parameter: Parameter::new(mean)
            .bounded(lower, upper)
            .with_prior(mean, standard_deviation)
            .with_scale(standard_deviation),
    })
}

/// Bounds of the numbers that shape the valve's flow.
fn bounds_of_shape(rig: &Rig, key: &str) -> Option<(f64, f64)> {
    match key {
        "valve.curve_roundness" | "valve.discharge_slope" => key_bounds(key),
        // From the critical ratio on there is no law; at 1 its slope is infinite.
        "valve.laminar_pressure_ratio" => Some((0.9, 0.9995)),
        "valve.edge_V" => edge_between_v(rig.valve.as_ref()?),
        _ => None,
    }
}

/// Quantities that are positive by nature stay positive and may be off by a
/// factor of 20 (an engineer's standard deviation may itself be wrong: a heat
/// transfer five times the one typed, at 25 %, has been met); the others by ten
/// standard deviations. The prior does the rest.
fn ordinary_bounds(key: &str, mean: f64, standard_deviation: f64) -> (f64, f64) {
    let reach = 10.0 * standard_deviation;
    let signed = key.ends_with("_V") && !key.ends_with("opening_V")
        || key.ends_with("external_force_N")
        || key.ends_with("position-time-skew.delay_s")
        || key.starts_with("actuator.stem_");
    if key.ends_with("critical_pressure_ratio") {
        // ISO 6358 knows 0.05 to 0.5; a fit that lacks something else runs to nought.
        (mean.min(0.05), mean.max(0.7))
    } else if key.ends_with("_index") {
        (1.0, (mean + reach).min(1.8))
    } else if signed || mean <= 0.0 {
        (mean - reach, mean + reach)
    } else {
        (0.02 * mean, (mean + reach).max(20.0 * mean))
    }
}

/// Effects between the command and the spool.
const OF_COMMAND: [&str; 4] = [
    "spool-dynamics",
    "valve-hysteresis",
    "valve-delay",
    "slew-limit",
];
const SPOOL_GAIN: &str = "valve.spool_gain_m_V";

fn acts_on(law: Law, rig: &Rig, key: &str) -> bool {
    let section = key.split('.').next().unwrap_or("");
    if section == "effects" && !TIMES_OF_SENSORS.contains(&key) {
        let effect = key.split('.').nth(1).and_then(effects::effect);
        let is_of_forces = effect.is_some_and(|effect| effect.acts_on == Half::Forces);
        return match law {
            Law::Chambers => !is_of_forces,
            Law::Force | Law::Carriage | Law::Balance => is_of_forces,
            Law::Actuator => true,
            Law::ValveFlow | Law::Spool => {
                OF_COMMAND.contains(&key.split('.').nth(1).unwrap_or(""))
            }
        };
    }
    match law {
        Law::Chambers => match section {
            "supply" => rig.valve.is_some(),
            "valve" | "chambers" | "vessel" | "gas" | "environment" => true,
            "cylinder" => !key.contains("stroke") && !key.contains("bore"),
            _ => false,
        },
        Law::Force | Law::Carriage | Law::Balance => {
            matches!(section, "carriage" | "friction")
                || key.starts_with("cylinder.area")
                || GAIN_KEYS.contains(&key)
                || TIMES_OF_SENSORS.contains(&key)
        }
        Law::Actuator => section == "actuator",
        Law::ValveFlow => match section {
            "supply" | "gas" | "environment" => true,
            "valve" => key != SPOOL_GAIN,
            _ => GAIN_KEYS.contains(&key),
        },
        Law::Spool => matches!(key, "valve.null_V" | SPOOL_GAIN),
    }
}

/// What may be tried on a law.
pub fn candidates(law: Law, rig: &Rig, tracks: &[Track<'_>], misfit: f64) -> Vec<Candidate> {
    let scene = scene(law, rig, tracks, misfit);
    let declared = EFFECTS
        .iter()
        .flat_map(|effect| (effect.candidates)(&scene));
    // What the rig states with an uncertainty is refitted like any other of its numbers.
    let is_stated = |candidate: &Candidate| {
        let mut free = candidate.free.iter();
        free.any(|free| rig.uncertainty_sd(&free.key).is_some())
    };
    declared.filter(|candidate| !is_stated(candidate)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::random::Noise;
    use crate::recording::Recording;
    use truth_plant::{Kind, Request, Strength};

    /// Friction that the rig holds uncertain is taken up by its refit; what it calls certain, or
    /// does not state, is not.
    #[test]
    fn prop_what_a_refit_takes_up_is_an_effect_for_a_part_of_the_time() {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let passing = |rig: &Rig| -> Vec<&'static str> {
            let all = candidates(Law::Balance, rig, &tracks, 1.0);
            let passing = all
                .iter()
                .filter(|candidate| !candidate.taken_up_by.is_empty());
            passing.map(|candidate| candidate.effect).collect()
        };
        assert_eq!(passing(&rig), ["coulomb-friction", "viscous-friction"]);
        let mut certain = rig.clone();
        certain.uncertainty.remove("friction.viscous_Ns_m");
        assert_eq!(passing(&certain), ["coulomb-friction"]);
    }

    /// A droop that the gauge does not show: it sits at the regulator.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_droop_behind_the_gauge_is_told_from_one_before_it() {
        let (rig, mut recordings, regulator_pa) = drooping();
        for (stream, recording) in recordings.iter_mut().enumerate() {
            still(recording, regulator_pa, stream as u64);
        }
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::chambers(&rig, &tracks);
        let missed = |form: Option<&str>| {
            let is_it = |one: &Candidate| one.effect == "supply-droop" && one.form == form;
            let candidate = bench.candidates.iter().position(is_it).unwrap();
            let given = bench.as_given(&baseline);
            let fitted = bench.fit(&[candidate], Some(&given)).unwrap();
            fitted.energy_above(&bench.noise)
        };
        let (at_tank, before_feed) = (missed(None), missed(Some("gauge before the feed")));
        // What is left is the form: the truth's tank cools.
        let refitted = baseline.energy_above(&bench.noise);
        assert!(before_feed < 0.02 * refitted, "{before_feed} {refitted}");
        assert!(at_tank > 10.0 * before_feed, "{at_tank} {before_feed}");
    }

    /// A case of the truth plant with a droop and a recorded supply pressure, and the pressure of
    /// its regulator, which the tank never quite reaches.
    fn drooping() -> (Rig, Vec<Recording>, f64) {
        let records = |seed| {
            let request = Request::new(seed, Kind::Single).with_noise(1.0);
            let request = request.with_effect("supply-droop").unwrap();
            let request = request.with_strength(Strength::Strong);
            let (rig, recordings) = drawn::read(&request);
            let has_gauge = rig.signals.contains("p_s");
            has_gauge.then(|| (rig, recordings, request.draw().truth.plant["ps"]))
        };
        (1..20).find_map(records).unwrap()
    }

    fn still(recording: &mut Recording, regulator_pa: f64, stream: u64) {
        let mut noise = Noise::new(7, stream);
        for value in recording.signals.get_mut("p_s").unwrap() {
            *value = regulator_pa + 250.0 * noise.normal();
        }
    }
}
