//! Friction in proportion to the velocity.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, signed};
use crate::effects::scene::Scene;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "viscous-friction",
    what: "Viscous friction beside the stated one.",
    parameters: &[signed("viscous_Ns_m", "N s/m", "additional viscous friction", "-50 to 100").said("coefficient", "N s/m")],
    meaning: "viscous friction",
    shown_by: "constant speeds from 1 to 500 mm/s in both directions",
    told_from: &[
        (&["coulomb-friction", "stribeck-friction", "direction-dependent-friction"], "Strokes at four or more constant speeds from 1 to 500 mm/s in both directions, at one pressure."),
    ],
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The coefficient beside the stated one, N s/m.
pub fn viscous_n_s_m<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "viscous_Ns_m")
}

/// All of it where the rig declares none, else what is there beside it.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_of_forces() {
        return Vec::new();
    }
    let start = scene.misfit_n / scene.typical_speed_m_s;
    let candidate = Candidate::new(EFFECT.name, PLACE);
    let key = "friction.viscous_Ns_m";
    if let Some(declared) = scene.rig.value(key) {
        let bounds = (-0.9 * declared, 1e3 * start.max(declared));
        let starts = [0.5, -0.5].map(|share| share * declared);
        let beside = candidate.free("viscous_Ns_m", bounds, &starts);
        return vec![beside.beside(scene.rig, &[key])];
    }
    vec![candidate.free("viscous_Ns_m", (0.0, 1e3 * start), &[start, 0.1 * start])]
}
