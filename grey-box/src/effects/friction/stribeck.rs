//! A break-away force above the sliding friction.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, signed};
use crate::effects::scene::Scene;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "stribeck-friction",
    what: "Static level above the sliding one, beside the stated friction.",
    parameters: &[signed("static_excess_N", "N", "additional static level", "0 to 0.5 times coulomb_N").said("excess", "N")],
    meaning: "break-away force above the sliding friction (Stribeck)",
    shown_by: "slow ramps of force through break-away, and constant speeds down to 1 mm/s",
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The excess, N.
pub fn static_excess_n<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "static_excess_N")
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_of_forces() || scene.rig.value("friction.static_N").is_some() {
        return Vec::new();
    }
    let force_n = scene.misfit_n;
    let levels_n = [force_n, 0.2 * force_n];
    let excess = Candidate::new(EFFECT.name, PLACE);
    vec![excess.free("static_excess_N", (0.0, 1e3 * force_n), &levels_n)]
}
