//! Gas from a chamber to the surroundings.

use super::leak::{Leak, marks};
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::fit::free_parameter::Scope;
use crate::fit::levenberg_marquardt::Prior;
use crate::law::Law;
use crate::side::Side;
use model_core::left_out::ChamberLeakage;
use model_core::real::Real;

/// 0.1 l/min (ANR) to the surroundings from 5 bar, as an orifice and as a gap.
const LEAST_ORIFICE_M2: f64 = 2e-9;
const LEAST_GAP_KG_S_PA2: f64 = 8e-18;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "chamber-leakage",
    what: "Gas from the chambers to the surroundings, through gaps, holes, or both.",
    parameters: &[
        parameter("laminar_a_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap of chamber A", "5e-17 to 5e-16").said("laminar conductance of chamber A", "kg/(s Pa²)"),
        parameter("laminar_b_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap of chamber B", "5e-17 to 5e-16").said("laminar conductance of chamber B", "kg/(s Pa²)"),
        parameter("orifice_a_m2", "m2", 0.0, 0.0, "area of the hole of chamber A; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7").said("leakage area of chamber A", "mm²"),
        parameter("orifice_b_m2", "m2", 0.0, 0.0, "area of the hole of chamber B; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7").said("leakage area of chamber B", "mm²"),
        parameter("onset_s", "s", f64::NEG_INFINITY, f64::MIN, "time of the recording at which the leak opens", "-inf: always open").said("from", "s"),
    ],
    meaning: "leakage to ambient, laminar flow",
    meaning_of_form: &[
        ("orifice", "leakage to ambient, orifice flow"),
        ("gap and hole", "leakage to ambient, laminar and orifice flow"),
    ],
    shown_by: "a minute's hold of the piston with shut ports and equal pressures",
    told_from: &[
        (&["piston-leakage"], "Hold the piston, shut the ports, and dwell a minute at equal pressures and a minute at unequal ones: the piston seal leaks only at unequal pressures, and the sum of the pressures stays constant."),
        (&["gas-temperature-dynamics", "variable-heat-transfer", "wall-temperature"], "Fill, shut the valve and dwell for a minute, cold and warm: a leak continues to ambient pressure, heat exchange settles above it, at a pressure that follows the wall temperature."),
    ],
    off_board: Some((&["onset_s"], "is a time of one recording and means nothing to a board; without it the leak is always open")),
    candidates,
    ..PLAIN
};

/// The leak of one chamber; `area_m2` makes of a stated area that of the law.
pub fn law<R: Real>(
    numbers: &impl Numbers<R>,
    side: Side,
    area_m2: impl Fn(R) -> R,
) -> ChamberLeakage<R> {
    ChamberLeakage {
        laminar_kg_per_s_pa2: EFFECT.number(numbers, &gap_key(side)),
        orifice_area_m2: area_m2(EFFECT.number(numbers, &hole_key(side))),
    }
}

/// Time of the recording at which it opens, s.
pub fn onset_s<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "onset_s")
}

fn gap_key(side: Side) -> String {
    format!("laminar_{}_kg_s_Pa2", side.letter())
}

fn hole_key(side: Side) -> String {
    format!("orifice_{}_m2", side.letter())
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law != Law::Chambers {
        return Vec::new();
    }
    let of_side = |&side: &Side| of_chamber(scene, side);
    scene.sides.iter().flat_map(of_side).collect()
}

fn of_chamber(scene: &Scene<'_>, side: Side) -> Vec<Candidate> {
    let Some(gas) = scene.gas(side) else {
        return Vec::new();
    };
    let (gap, hole) = (Leak::gap(gas), Leak::hole(gas));
    let [least_orifice, least_gap] = marks(scene, LEAST_ORIFICE_M2, LEAST_GAP_KG_S_PA2);
    let leak = |form| Candidate::new(EFFECT.name, &[side.place()]).form(form);
    let laminar = leak("laminar").free(&gap_key(side), gap.bounds, &gap.starts);
    let orifice = leak("orifice").free(&hole_key(side), hole.bounds, &hole.starts);
    let mut all = vec![laminar.matters(least_gap), orifice.matters(least_orifice)];
    // A leak test asks for the leak itself, and one that is cracked or porous has both.
    if scene.rig.vessel.is_some() {
        let half = |leak: &Leak| leak.starts.map(|start| 0.5 * start);
        let both = leak("gap and hole").free(&gap_key(side), gap.bounds, &half(&gap));
        all.push(both.free(&hole_key(side), hole.bounds, &half(&hole)));
        all = all.into_iter().map(|one| opening(one, scene)).collect();
    }
    all
}

/// A leak test often begins with the vessel still connected: the instant at which the decay
/// begins is a property of the recording.
fn opening(candidate: Candidate, scene: &Scene<'_>) -> Candidate {
    let Some(onset_s) = scene.decay_begins_s else {
        return candidate;
    };
    let end_s = scene.end_s;
    let prior = Prior {
        mean: onset_s,
        standard_deviation: end_s.max(1e-9),
    };
    let bounds = (-end_s, end_s);
    candidate.free_as(
        "onset_s",
        Scope::PerRecording,
        bounds,
        Some(prior),
        &[onset_s],
    )
}
