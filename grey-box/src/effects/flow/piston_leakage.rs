//! Gas past the piston's seal.

use super::leak::{Leak, marks};
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::law::Law;
use crate::side::Side;
use model_core::left_out::PistonLeakage;
use model_core::real::Real;

/// 0.1 l/min (ANR) through the seal, as an orifice and as a gap between chambers half a bar apart.
const LEAST_ORIFICE_M2: f64 = 3e-9;
const LEAST_GAP_KG_S_PA2: f64 = 4e-17;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "piston-leakage",
    what: "Gas past the piston seal, through a gap, a hole, or both.",
    parameters: &[
        parameter("laminar_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap: mass flow over the difference of the squared pressures", "5e-17 to 5e-16").said("laminar conductance", "kg/(s Pa²)"),
        parameter("orifice_m2", "m2", 0.0, 0.0, "area of the hole; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7").said("leakage area", "mm²"),
    ],
    meaning: "leakage across the piston seal, laminar flow",
    meaning_of_form: &[("orifice", "leakage across the piston, orifice flow")],
    shown_by: "a minute's hold of the piston with shut ports and different pressures",
    candidates,
    ..PLAIN
};

/// The leak; `area_m2` makes of a stated area that of the law.
pub fn law<R: Real>(numbers: &impl Numbers<R>, area_m2: impl Fn(R) -> R) -> PistonLeakage<R> {
    PistonLeakage {
        laminar_kg_per_s_pa2: EFFECT.number(numbers, "laminar_kg_s_Pa2"),
        orifice_area_m2: area_m2(EFFECT.number(numbers, "orifice_m2")),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let is_whole =
        scene.law == Law::Chambers && scene.rig.vessel.is_none() && scene.sides.len() == 2;
    let Some(gas) = scene.gas_a.as_ref().filter(|_| is_whole) else {
        return Vec::new();
    };
    let [least_orifice, least_gap] = marks(scene, LEAST_ORIFICE_M2, LEAST_GAP_KG_S_PA2);
    let (gap, hole) = (Leak::gap(gas), Leak::hole(gas));
    let leak = |form| Candidate::new(EFFECT.name, &Side::BOTH.map(Side::place)).form(form);
    vec![
        leak("laminar")
            .free("laminar_kg_s_Pa2", gap.bounds, &gap.starts)
            .matters(least_gap),
        leak("orifice")
            .free("orifice_m2", hole.bounds, &hole.starts)
            .matters(least_orifice),
    ]
}
