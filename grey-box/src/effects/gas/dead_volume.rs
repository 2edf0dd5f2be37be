//! Gas volume beside the stated one.
//!
//! ```text
//! V = V_declared + dV + A (l0 + x)
//! ```
//!
//! Source: ports, fittings and grooves of the piston, of which drawings say little; some cm3 of a bore of 25 mm, the
//! more the nearer to an end the piston works. Confused with tubes (which hold gas too), with the valve's areas
//! (which fill it) and with heat; slow strokes to both ends with the valve at its null separate them, as the pressure then follows the volume
//! alone.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, signed};
use crate::effects::scene::Scene;
use crate::law::Law;
use crate::side::Side;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "dead-volume",
    what: "Gas volume beside the stated dead volumes.",
    parameters: &[
        signed("volume_a_m3", "m3", "additional volume of chamber A", "-1e-5 to 5e-5").said("additional volume of chamber A", "L"),
        signed("volume_b_m3", "m3", "additional volume of chamber B", "-1e-5 to 5e-5").said("additional volume of chamber B", "L"),
    ],
    meaning: "the dead volume of the chamber differs from the rig file",
    shown_by: "slow strokes to both ends with the valve at its null",
    told_from: &[
        (&["position-time-skew"], "Slow and fast strokes over the same travel: the effect of a volume does not depend on the speed, that of a time skew does."),
        (&["gas-temperature-dynamics"], "Strokes from 0.05 to 1 Hz with the valve at its null: the effect of a volume does not depend on the speed, heat exchange makes slow strokes up to 1.4 times as compliant as fast ones."),
    ],
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

fn volume_key(side: Side) -> String {
    format!("volume_{}_m3", side.letter())
}

/// Volume beside the stated one of a chamber, m3.
pub fn volume_m3<R: Real>(numbers: &impl Numbers<R>, side: Side) -> R {
    EFFECT.number(numbers, &volume_key(side))
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law != Law::Chambers {
        return Vec::new();
    }
    let of_side = |&side: &Side| {
        let stated = format!("cylinder.dead_volume_{}_m3", side.letter());
        let stated_m3 = scene.rig.value(&stated)?;
        let bounds = (-0.9 * stated_m3, 10.0 * stated_m3);
        let starts = [0.1 * stated_m3, -0.1 * stated_m3];
        let volume = Candidate::new(EFFECT.name, &[side.place()]);
        let volume = volume.free(&volume_key(side), bounds, &starts);
        Some(volume.beside(scene.rig, &[&stated]))
    };
    scene.sides.iter().filter_map(of_side).collect()
}
