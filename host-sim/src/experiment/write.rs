//! Experiment files written: their steps, and the envelope of an axis as far as its rig file says.

use crate::rig::Rig;
use std::fmt::Write;

/// Pressures and forces that no sound run exceeds: as parts of the supply's.
const ROOM: f64 = 1.2;
/// Where the rig file says nothing of the supply, Pa.
const USUAL_SUPPLY_PA: f64 = 7e5;
/// The lowest pressure that gauges show of a chamber that empties fast, Pa.
const LOWEST_PA: f64 = 2e4;
/// The board's converters, m and Pa.
const FARTHEST_M: f64 = 0.25;
const HIGHEST_PA: f64 = 1e6;

/// As fast as the board's sensor of velocity shows, m/s.
pub const FASTEST_M_PER_S: f64 = 1.9;

/// The section `[envelope]` of an experiment file: these places, and what valve and supply can do.
pub fn envelope_text(rig: &Rig, [low_m, high_m]: [f64; 2], speed_m_per_s: f64) -> String {
    let supply_pa = rig.value("supply.pressure_Pa").unwrap_or(USUAL_SUPPLY_PA);
    let area_m2 = |key| rig.value(key).unwrap_or(1e-3);
    let area_m2 = area_m2("cylinder.area_a_m2").max(area_m2("cylinder.area_b_m2"));
    let most_pa = (ROOM * supply_pa).min(HIGHEST_PA);
    format!(
        "[envelope]\nposition_m = [{:?}, {:?}]\nspeed_m_s = {speed_m_per_s:?}\npressure_Pa = [{LOWEST_PA:.1}, {most_pa:.1}]\nforce_N = {:.1}\n",
        rounded(low_m.max(-FARTHEST_M)),
        rounded(high_m.min(FARTHEST_M)),
        ROOM * supply_pa * area_m2
    )
}

/// Four digits behind the point: tenths of a millivolt, of a millimetre, of a millisecond.
fn rounded(value: f64) -> f64 {
    (1e4 * value).round() / 1e4
}

/// A step, `[[step]]` and its keys.
pub fn step_text(kind: &str, numbers: &[(&str, f64)]) -> String {
    let mut text = format!("\n[[step]]\nkind = \"{kind}\"\n");
    for (key, value) in numbers {
        let _ = writeln!(text, "{key} = {:?}", rounded(*value));
    }
    text
}
