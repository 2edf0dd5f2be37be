//! Friction that differs between the two directions.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::{FRICTION_SHARE, Scene};
use model_core::left_out::DirectionDependentFriction;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "direction-dependent-friction",
    what: "More friction towards +x, less towards -x, as shares of the friction level.",
    parameters: &[
        signed("asymmetry", "1", "share of the dry friction", "-0.3 to 0.3").said("excess towards +x", "%"),
        signed("viscous_asymmetry", "1", "share of the viscous friction", "-0.3 to 0.3").said("viscous excess towards +x", "%"),
    ],
    meaning: "friction that differs between the two directions",
    shown_by: "slow strokes in both directions, as mounted and turned end for end",
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The shares.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> DirectionDependentFriction<R> {
    DirectionDependentFriction {
        asymmetry: EFFECT.number(numbers, "asymmetry"),
        viscous_asymmetry: EFFECT.number(numbers, "viscous_asymmetry"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_of_forces() || scene.rig.value("friction.coulomb_N").is_none() {
        return Vec::new();
    }
    let share = scene.mark(Mark::From(FRICTION_SHARE));
    let uneven = Candidate::new(EFFECT.name, PLACE)
        .free("asymmetry", (-0.9, 0.9), &[0.05, -0.05])
        .matters(share)
        .free("viscous_asymmetry", (-0.9, 0.9), &[0.05, -0.05])
        .matters(share);
    vec![uneven]
}
