//! A force that is always there.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "constant-force",
    what: "A constant force beside the stated one.",
    parameters: &[signed("force_N", "N", "force against +x", "-30 to 30").said("force", "N")],
    meaning: "a constant force",
    shown_by: "slow strokes in both directions, as mounted and turned end for end",
    told_from: &[
        (&["direction-dependent-friction", "gauge-gain", "pressure-sensor-offset"], "Vent both chambers and record the sensors, then slow strokes in both directions, as mounted and turned end for end: a sensor offset appears in the vented recording, an external force changes its sign, directional friction keeps it."),
    ],
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The force against +x, N.
pub fn force_n<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "force_N")
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let is_stated = scene
        .rig
        .uncertainty_sd("carriage.external_force_N")
        .is_some();
    if !scene.is_of_forces() || is_stated {
        return Vec::new();
    }
    let force_n = scene.misfit_n;
    let most_n = 1e3 * force_n;
    let least = scene.least_force_n();
    let force = Candidate::new(EFFECT.name, PLACE)
        .free(
            "force_N",
            (-most_n, most_n),
            &[0.2 * force_n, -0.2 * force_n],
        )
        .matters(least.and_then(|least_n| scene.mark(Mark::From(least_n))));
    vec![force]
}
