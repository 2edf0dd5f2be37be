//! Dry friction.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, in_place_of_stated, signed};
use crate::effects::scene::Scene;
use model_core::real::Real;

/// The law divides by the bristle's stiffness.
const SOFTEST_BRISTLE_N_M: f64 = 1e-3;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "coulomb-friction",
    what: "Dry friction beside the stated one.",
    parameters: &[
        signed("coulomb_N", "N", "additional dry friction", "-10 to 40").said("level", "N"),
        in_place_of_stated("bristle_stiffness_N_m", "N/m", SOFTEST_BRISTLE_N_M, "stiffness before break-away, in place of the stated one", "1e4 to 1e6").said("presliding stiffness", "N/mm"),
    ],
    meaning: "dry (Coulomb) friction",
    shown_by: "a slow triangle of force with reversals below break-away",
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The level beside the stated one, N.
pub fn coulomb_n<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "coulomb_N")
}

/// Stiffness of the bristle in the place of the stated one, N/m.
pub fn bristle_stiffness_n_m<R: Real>(numbers: &impl Numbers<R>) -> Option<R> {
    numbers.stated("effects.coulomb-friction.bristle_stiffness_N_m")
}

/// All of it where the rig declares none, else what is there beside it.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_of_forces() {
        return Vec::new();
    }
    let candidate = Candidate::new(EFFECT.name, PLACE);
    let key = "friction.coulomb_N";
    if let Some(declared_n) = scene.rig.value(key) {
        let bounds = (-0.9 * declared_n, 20.0 * declared_n);
        let starts = [0.3, -0.3].map(|share| share * declared_n);
        let beside = candidate.free("coulomb_N", bounds, &starts);
        return vec![beside.beside(scene.rig, &[key, "friction.static_N"])];
    }
    let force_n = scene.misfit_n;
    // Presliding over 20 um (metal guides) to 300 um (rubber seals).
    let stiffness = [2e-5, 3e-4, 1e-4].map(|way_m| force_n / way_m);
    let bounds = (force_n / 1e-2, force_n / 1e-6);
    let all = candidate
        .free("coulomb_N", (0.0, 1e3 * force_n), &[force_n])
        .free("bristle_stiffness_N_m", bounds, &stiffness);
    vec![all]
}
