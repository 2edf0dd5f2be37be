//! What no rig file states exactly: built-in priors of the baseline.
//!
//! A valve is smooth where its table is not, begins to open somewhere between two points of it,
//! and its orifices are not quite those of the published discharge; the bristles of a seal are
//! those of the literature. None of that is an effect: it is refitted with the ordinary
//! parameters, each with a prior, and said with them. What a rig states an uncertainty of is left
//! as it is.

use crate::gauge::GAIN_KEYS;
use crate::rig::{Rig, Valve};
use model_core::paper::DISCHARGE_SLOPE;
use model_core::valve::AreaTable;

/// One deviation, in parts of the number, of what has a number in every rig: published laminar
/// ratios run from 0.97 to 0.999 (Beater 2007, Pneumatic Drives), identified bristles of one
/// seal differ by factors.
const STATED: [(&str, f64); 3] = [
    ("valve.laminar_pressure_ratio", 0.01),
    ("friction.bristle_stiffness_N_m", 0.5),
    ("friction.bristle_damping_Ns_m", 0.5),
];

/// Number and deviation, in parts of it or in V, of what has a number in few rigs. Between chords
/// and a smooth curve one is as probable as the other; sharp edges and rounded ones differ by 5 %
/// of the discharge between choked and slow flow (Perry 1949). The lands of a spool that moves a
/// millimetre for 5 V are ground to some 5 um, a guess.
const SHAPE: [(&str, f64, f64); 3] = [
    ("valve.curve_roundness", 0.5, 1.0),
    ("valve.exhaust_shift_V", 0.0, 0.02),
    ("valve.discharge_slope", DISCHARGE_SLOPE, 0.5),
];

/// Gains of the chambers' gauges are known to half of a class of 0.5 % of what they show.
const GAIN_KNOWN_TO: f64 = 0.0025;

/// Numbers for which a bound is as good a value as any: chords, a smooth curve, an edge at a point.
pub const MAY_END_AT_A_BOUND: [&str; 2] = ["valve.curve_roundness", EDGE];

/// Where the areas begin to rise.
const EDGE: &str = "valve.edge_V";

/// The rig with what it does not state, and how well its numbers are known.
pub fn with_built_in_priors(rig: &Rig) -> Rig {
    let mut known = rig.clone();
    let mut is_known_to = |key: &str, deviation: f64| {
        let stated = known.uncertainty.entry(key.to_owned());
        stated.or_insert(deviation);
    };
    for (key, part) in STATED {
        if rig.value(key).is_some() {
            is_known_to(key, part);
        }
    }
    let Some(valve) = &rig.valve else {
        return known;
    };
    let gains = GAIN_KEYS.map(|key| (key, 1.0, GAIN_KNOWN_TO));
    let has_gauges = rig.chambers.is_some();
    let gains = gains.into_iter().filter(|_| has_gauges);
    let mut numbers = Vec::new();
    for (key, number, deviation) in SHAPE.into_iter().chain(gains) {
        is_known_to(key, deviation);
        numbers.push((key, number));
    }
    if let Some(((from_v, to_v), by_chord_v)) = edge(valve) {
        // The deviation of an even spread.
        is_known_to(EDGE, (to_v - from_v) / 12.0_f64.sqrt());
        numbers.push((EDGE, by_chord_v));
    }
    for (key, number) in numbers {
        if rig.value(key).is_none() {
            // Valve and chambers have a place for each.
            let _ = known.set_value(key, number);
        }
    }
    known
}

/// Whether a number has a prior here.
pub fn is_built_in(key: &str) -> bool {
    let stated = STATED.iter().map(|(key, _)| *key);
    let shape = SHAPE.iter().map(|(key, ..)| *key);
    let mut all = stated.chain(shape).chain(GAIN_KEYS).chain([EDGE]);
    all.any(|built_in| built_in == key)
}

/// Between which openings the areas begin to rise, V.
pub fn edge_between_v(valve: &Valve) -> Option<(f64, f64)> {
    edge(valve).map(|(between_v, _)| between_v)
}

/// The same, and where they do as the points past the gap have it.
fn edge(valve: &Valve) -> Option<((f64, f64), f64)> {
    let table = AreaTable::<f64>::new(&valve.opening_v, &valve.supply_area_m2).ok()?;
    table.edge_between_v().zip(table.edge_by_chord_v())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../host-sim/rigs/paper.toml");

    #[test]
    fn prop_what_a_rig_states_stays_and_what_it_does_not_is_free_about_the_published_law() {
        let mut rig = Rig::parse(PAPER, "paper.toml").unwrap();
        let stated = "friction.bristle_stiffness_N_m".to_owned();
        rig.uncertainty.insert(stated.clone(), 0.01);
        let known = with_built_in_priors(&rig);
        assert!((known.uncertainty[&stated] - 0.01).abs() < 1e-12);
        for (key, number, _) in SHAPE {
            assert_eq!(known.value(key), Some(number), "{key}");
            assert!(known.uncertainty_sd(key).unwrap() > 0.0, "{key}");
        }
        let (from_v, to_v) = edge_between_v(rig.valve.as_ref().unwrap()).unwrap();
        let edge_v = known.value(EDGE).unwrap();
        assert!(from_v < edge_v && edge_v < to_v);
        rig.valve = None;
        assert_eq!(with_built_in_priors(&rig).value("valve.edge_V"), None);
    }
}
