//! Sizes under which an effect does not matter on a servo-pneumatic axis, however plain
//! the recordings show it.
//!
//! They are about a fifth of the least that the literature calls typical (dossier
//! part C, and each effect's own file in `model_core::left_out`), or what the loop holds
//! anyway. An effect under them stays in the improved model and is not named.

use crate::laws::Law;
use crate::rig::Rig;

/// From which size on an effect matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// It matters from this size on.
    From(f64),
    /// It matters up to this size: smaller is stronger.
    UpTo(f64),
}

impl Mark {
    /// Whether a size is on the side that does not matter.
    pub fn leaves_out(self, size: f64) -> bool {
        match self {
            Self::From(least) => size.abs() < least,
            Self::UpTo(most) => size > most,
        }
    }

    /// A size that is so many times weaker.
    pub fn weaker(self, size: f64, times: f64) -> f64 {
        match self {
            Self::From(_) => size / times,
            Self::UpTo(_) => size * times,
        }
    }

    /// The size at which it begins to matter.
    pub fn size(self) -> f64 {
        match self {
            Self::From(size) | Self::UpTo(size) => size,
        }
    }
}

/// Part of the Coulomb level that an integrator holds: 0.4 N of 20 N, 0.8 kPa on the piston.
const FRICTION_SHARE: f64 = 0.02;
/// 0.1 l/min (ANR) through a seal: as an orifice and as a gap between chambers half a bar
/// apart, and to the surroundings from 5 bar.
const PISTON_ORIFICE_M2: f64 = 3e-9;
const PISTON_GAP_KG_S_PA2: f64 = 4e-17;
const CHAMBER_ORIFICE_M2: f64 = 2e-9;
const CHAMBER_GAP_KG_S_PA2: f64 = 8e-18;
/// No data sheet says to better than this part what a closed path of the valve leaks: a leak
/// under it cannot be told from the valve's own.
const VALVE_LEAKAGE_KNOWN_TO: f64 = 0.1;
/// Twice the largest regulator, and the largest silencer: three times the valve.
const REGULATOR_M2: f64 = 4e-5;
const SILENCER_M2: f64 = 5e-5;
/// 0.3 % of the pressure that a chamber settles at.
const WALL_K: f64 = 1.0;
/// A third of what still gas exchanges, and a tenth more over a density three times as high.
const FLOW_HEAT_W_M2K: f64 = 3.0;
const DENSITY_EXPONENT: f64 = 0.1;
/// Half of the play of a new spool, as a part of its stroke.
const PLAY_SHARE: f64 = 5e-4;
/// A spool's own full stroke at 1.0 to 1.5 kV/s, s: what is faster is no limit.
const FASTEST_STROKE_S: f64 = 7e-3;
/// Half a row of lag behind a ramp, 2 zeta / w at zeta = 0.7: the order of a logger.
const SPOOL_ROWS_PER_PERIOD: f64 = 0.45;
/// A load that hangs 10 um behind at 10 m/s2.
const COMPLIANCE_N_M_PER_KG: f64 = 1e6;
/// 4 kPa on the piston.
const BREAK_AWAY_RISE_N: f64 = 2.0;
const BAR_PA: f64 = 1e5;

/// Parameters by key and from which size on they matter, for a law of a whole axis.
pub fn marks(law: Law, rig: &Rig, row_s: f64) -> Vec<(String, Mark)> {
    let known = match law {
        Law::Balance => forces(rig),
        Law::Chambers if rig.valve.is_some() => gas_and_valve(rig, row_s),
        _ => Vec::new(),
    };
    let key = |(key, mark): (&str, Mark)| (format!("effects.{key}"), mark);
    known.into_iter().map(key).collect()
}

fn forces(rig: &Rig) -> Vec<(&'static str, Mark)> {
    let mut known = vec![
        (
            "direction-dependent-friction.asymmetry",
            Mark::From(FRICTION_SHARE),
        ),
        (
            "direction-dependent-friction.viscous_asymmetry",
            Mark::From(FRICTION_SHARE),
        ),
        (
            "position-dependent-friction.cosine",
            Mark::From(FRICTION_SHARE),
        ),
        (
            "position-dependent-friction.sine",
            Mark::From(FRICTION_SHARE),
        ),
        ("dwell-stiction.rise_N", Mark::From(BREAK_AWAY_RISE_N)),
    ];
    if let Some(stroke_m) = rig.value("cylinder.stroke_m") {
        let way_m = 0.5 * stroke_m;
        known.extend([
            (
                "position-dependent-friction.slope_per_m",
                Mark::From(FRICTION_SHARE / way_m),
            ),
            (
                "position-dependent-friction.curvature_per_m2",
                Mark::From(FRICTION_SHARE / way_m.powi(2)),
            ),
        ]);
    }
    if let Some(least_n) = least_force_n(rig) {
        let by_pressure = Mark::From(least_n / BAR_PA);
        known.extend([
            ("constant-force.force_N", Mark::From(least_n)),
            (
                "pressure-dependent-friction.per_mean_pressure_N_Pa",
                by_pressure,
            ),
            (
                "pressure-dependent-friction.per_pressure_difference_N_Pa",
                by_pressure,
            ),
        ]);
    }
    if let Some(mass_kg) = rig.value("carriage.mass_kg") {
        let stiffness = Mark::UpTo(COMPLIANCE_N_M_PER_KG * mass_kg);
        known.push(("load-compliance.stiffness_N_m", stiffness));
    }
    known
}

/// What an axis loses without anybody minding, or its valve in any case.
fn leaks(rig: &Rig) -> Vec<(&'static str, Mark)> {
    let closed = rig
        .valve
        .as_ref()
        .and_then(|valve| valve.exhaust_area_m2.first());
    let of_valve_m2 = VALVE_LEAKAGE_KNOWN_TO * closed.copied().unwrap_or(0.0);
    let from = |orifice_m2: f64, gap: f64| {
        let times = (of_valve_m2 / orifice_m2).max(1.0);
        [Mark::From(times * orifice_m2), Mark::From(times * gap)]
    };
    let [orifice, gap] = from(PISTON_ORIFICE_M2, PISTON_GAP_KG_S_PA2);
    let [chamber_orifice, chamber_gap] = from(CHAMBER_ORIFICE_M2, CHAMBER_GAP_KG_S_PA2);
    vec![
        ("piston-leakage.orifice_m2", orifice),
        ("piston-leakage.laminar_kg_s_Pa2", gap),
        ("chamber-leakage.orifice_a_m2", chamber_orifice),
        ("chamber-leakage.orifice_b_m2", chamber_orifice),
        ("chamber-leakage.laminar_a_kg_s_Pa2", chamber_gap),
        ("chamber-leakage.laminar_b_kg_s_Pa2", chamber_gap),
    ]
}

fn gas_and_valve(rig: &Rig, row_s: f64) -> Vec<(&'static str, Mark)> {
    let mut known = leaks(rig);
    known.extend([
        ("supply-droop.feed_area_m2", Mark::UpTo(REGULATOR_M2)),
        (
            "exhaust-back-pressure.silencer_area_m2",
            Mark::UpTo(SILENCER_M2),
        ),
        ("wall-temperature.offset_K", Mark::From(WALL_K)),
        (
            "variable-heat-transfer.flow_W_m2K",
            Mark::From(FLOW_HEAT_W_M2K),
        ),
        (
            "variable-heat-transfer.density_exponent",
            Mark::From(DENSITY_EXPONENT),
        ),
        (
            "spool-dynamics.natural_frequency_Hz",
            Mark::UpTo(SPOOL_ROWS_PER_PERIOD / row_s),
        ),
    ]);
    let opening = rig.valve.as_ref().and_then(|valve| valve.opening_v.last());
    if let Some(stroke) = opening.map(|opening| 2.0 * opening) {
        let rate = Mark::UpTo(stroke / FASTEST_STROKE_S);
        known.extend([
            ("valve-hysteresis.width", Mark::From(PLAY_SHARE * stroke)),
            ("slew-limit.rising_per_s", rate),
            ("slew-limit.falling_per_s", rate),
        ]);
    }
    // An offset that pushes no more than a force that does not matter.
    if let Some((least_n, area_m2)) = least_force_n(rig).zip(rig.value("cylinder.area_a_m2")) {
        let offset = Mark::From(least_n / area_m2);
        known.extend([
            ("pressure-sensor-offset.offset_a_Pa", offset),
            ("pressure-sensor-offset.offset_b_Pa", offset),
        ]);
    }
    // The same of a gain, at the supply pressure.
    let force_n = rig
        .value("cylinder.area_a_m2")
        .zip(rig.value("supply.pressure_Pa"));
    if let Some((least_n, (area_m2, supply_pa))) = least_force_n(rig).zip(force_n) {
        let gain = Mark::From(least_n / (area_m2 * supply_pa));
        known.extend([
            ("gauge-gain.gain_error_a", gain),
            ("gauge-gain.gain_error_b", gain),
        ]);
    }
    known
}

/// The force that matters, N, where friction is declared.
fn least_force_n(rig: &Rig) -> Option<f64> {
    rig.value("friction.coulomb_N")
        .map(|coulomb_n| FRICTION_SHARE * coulomb_n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::candidates::candidates;
    use crate::diagnose::drawn;
    use crate::laws::Track;
    use truth_plant::{Kind, Strength};

    /// A mark on a parameter that no candidate has would never be asked.
    #[test]
    fn prop_every_mark_is_of_a_parameter_that_is_fitted() {
        let (rig, recordings) = drawn::of_kind(Kind::Single, 5, Strength::Weak, "slew-limit");
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        for law in [Law::Chambers, Law::Balance] {
            let free: Vec<String> = candidates(law, &rig, &tracks, 1.0)
                .into_iter()
                .flat_map(|candidate| candidate.free)
                .map(|free| free.key)
                .collect();
            for (key, _) in marks(law, &rig, 1e-3) {
                assert!(free.contains(&key), "{key}");
            }
        }
    }

    #[test]
    fn prop_a_leak_matters_from_a_tenth_of_what_the_closed_valve_leaks() {
        let (mut rig, _) = drawn::of_kind(Kind::Single, 5, Strength::Weak, "slew-limit");
        let from = |rig: &Rig, key: &str| {
            let all = marks(Law::Chambers, rig, 1e-3);
            let mark = all.iter().find(|(one, _)| one == key);
            mark.map(|(_, mark)| mark.size()).unwrap_or_default()
        };
        let orifice = "effects.piston-leakage.orifice_m2";
        let gap = "effects.piston-leakage.laminar_kg_s_Pa2";
        for (closed_m2, times) in [(1e-9, 1.0), (1e-7, 10.0 / 3.0), (1e-6, 100.0 / 3.0)] {
            let valve = rig.valve.as_mut().unwrap();
            valve.exhaust_area_m2[0] = closed_m2;
            let near = |found: f64, wanted: f64| (found / wanted - 1.0).abs() < 1e-9;
            assert!(near(from(&rig, orifice), times * PISTON_ORIFICE_M2));
            assert!(near(from(&rig, gap), times * PISTON_GAP_KG_S_PA2));
        }
    }
}
