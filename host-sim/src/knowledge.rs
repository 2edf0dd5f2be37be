//! What an engineer knows of a rig: its parameters, wrong within the stated
//! uncertainty.

use crate::random::Noise;
use crate::rig::Rig;
use std::collections::BTreeMap;

/// Nobody types a number that is further off than this many deviations: such a
/// one would have been looked up again.
const LARGEST_DEVIATIONS: f64 = 2.0;

/// One standard deviation of what an engineer knows where a rig does not say:
/// data sheets (valve, volumes), a balance (mass), a tensiometer (friction).
/// Relative; for keys ending in `_V` that are no tables, absolute.
const USUAL_UNCERTAINTY: &[(&str, f64)] = &[
    ("supply.pressure_Pa", 0.004),
    ("valve.null_V", 0.025),
    ("valve.critical_pressure_ratio", 0.06),
    ("valve.opening_V", 0.03),
    ("valve.supply_area_m2", 0.05),
    ("valve.exhaust_area_m2", 0.05),
    ("cylinder.dead_volume_a_m3", 0.12),
    ("cylinder.dead_volume_b_m3", 0.12),
    ("chambers.heat_transfer_charging_W_m2K", 0.25),
    ("chambers.heat_transfer_discharging_W_m2K", 0.25),
    ("carriage.mass_kg", 0.02),
    ("friction.viscous_Ns_m", 0.15),
    ("friction.coulomb_N", 0.12),
    ("friction.static_N", 0.12),
    ("friction.stribeck_velocity_m_s", 0.2),
];

/// The rig as somebody would have typed it: every uncertain number drawn from
/// its normal distribution, cut at two deviations. The same seed gives the same
/// rig. Static friction stays at or above the sliding one, as anybody would
/// see to.
#[must_use]
pub fn wrongly_known(rig: &Rig, seed: u64) -> Rig {
    let stated = with_uncertainty(rig);
    let drawn: BTreeMap<String, f64> = stated
        .uncertainty
        .keys()
        .enumerate()
        .filter_map(|(stream, key)| {
            let deviation = stated.uncertainty_sd(key)?;
            let value = stated.value(key)?;
            Some((key.clone(), value + deviation * draw(seed, stream as u64)))
        })
        .collect();
    let mut typed = rig.with_values(&drawn);
    if let Some(friction) = &mut typed.friction
        && let (Some(sliding), Some(sticking)) = (friction.coulomb_n, friction.static_n)
    {
        friction.static_n = Some(sticking.max(sliding));
    }
    typed
}

fn with_uncertainty(rig: &Rig) -> Rig {
    let mut stated = rig.clone();
    if stated.uncertainty.is_empty() {
        stated.uncertainty = USUAL_UNCERTAINTY
            .iter()
            .map(|(key, deviation)| ((*key).to_owned(), *deviation))
            .collect();
    }
    stated
}

fn draw(seed: u64, stream: u64) -> f64 {
    /// Apart from the streams of the sensors' noise, which share the seed.
    const FIRST_STREAM: u64 = 1000;
    let mut noise = Noise::new(seed, FIRST_STREAM + stream);
    loop {
        let deviations = noise.normal();
        if deviations.abs() <= LARGEST_DEVIATIONS {
            return deviations;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper() -> Rig {
        Rig::parse(include_str!("../rigs/paper.toml"), "paper.toml").unwrap()
    }

    #[test]
    fn prop_a_seed_gives_one_rig_within_two_deviations() {
        let rig = paper();
        let stated = with_uncertainty(&rig);
        for seed in 0..50 {
            let typed = wrongly_known(&rig, seed);
            assert_eq!(typed, wrongly_known(&rig, seed));
            assert_ne!(typed, rig);
            for key in stated.uncertainty.keys() {
                let (Some(deviation), Some(value)) =
                    (stated.uncertainty_sd(key), stated.value(key))
                else {
                    continue;
                };
                let off = (typed.value(key).unwrap() - value).abs();
                // Static friction is lifted to the sliding one.
                let is_lifted = key == "friction.static_N";
                assert!(off <= 2.0 * deviation * 1.000_001 || is_lifted, "{key}");
            }
        }
    }
}
