//! What no rig file states exactly: built-in priors of the baseline.
//!
//! A valve is smooth where its table is not, begins to open somewhere between two points of it,
//! and its orifices are not quite those of the published discharge. None of that is an effect:
//! it is refitted with the ordinary parameters, each with a prior, and said with them. What a rig
//! states itself, or states an uncertainty of, is left as it is.

use crate::rig::{Rig, Valve};
use model_core::paper::DISCHARGE_SLOPE;

/// One deviation of the laminar pressure ratio, in parts of it: published ones run from 0.97 to
/// 0.999 (Beater 2007, Pneumatic Drives, names 0.999; the paper's is 0.9813).
const LAMINAR_RATIO: f64 = 0.01;
/// One deviation of the discharge coefficient's linear term, in parts of it: sharp edges and
/// rounded ones differ by 5 % of the coefficient between choked and slow flow (Perry 1949).
const DISCHARGE_SLOPE_PART: f64 = 0.5;
/// Chords or a smooth curve: between them, one as probable as the other.
const ROUNDNESS: (f64, f64) = (0.5, 1.0);

/// The rig with what it does not state and what its numbers are known to.
pub fn with_built_in_priors(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    let Some(valve) = &mut rig.valve else {
        return rig;
    };
    let edge = edge_between_v(valve);
    let mut uncertain = vec![("valve.laminar_pressure_ratio", LAMINAR_RATIO)];
    if valve.curve_roundness.is_none() {
        let (roundness, part) = ROUNDNESS;
        valve.curve_roundness = Some(roundness);
        uncertain.push(("valve.curve_roundness", part));
    }
    if valve.discharge_slope.is_none() {
        valve.discharge_slope = Some(DISCHARGE_SLOPE);
        uncertain.push(("valve.discharge_slope", DISCHARGE_SLOPE_PART));
    }
    if let (None, Some((from_v, to_v))) = (valve.edge_v, edge) {
        valve.edge_v = Some(f64::midpoint(from_v, to_v));
        // That of an even spread over the gap.
        uncertain.push(("valve.edge_V", (to_v - from_v) / 12.0_f64.sqrt()));
    }
    for (key, deviation) in uncertain {
        let stated = rig.uncertainty.entry(key.to_owned());
        stated.or_insert(deviation);
    }
    rig
}

/// Between which openings the areas begin to rise, V.
pub(super) fn edge_between_v(valve: &Valve) -> Option<(f64, f64)> {
    let leakage_m2 = *valve.supply_area_m2.first()?;
    let rises = |area_m2: &f64| *area_m2 > leakage_m2;
    let next = valve.supply_area_m2.iter().position(rises)?;
    let edge = next.checked_sub(1).filter(|edge| *edge > 0)?;
    Some((*valve.opening_v.get(edge)?, *valve.opening_v.get(next)?))
}
