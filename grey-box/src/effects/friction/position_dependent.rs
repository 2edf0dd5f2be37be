//! Friction that varies along the stroke.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, parameter, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::{FRICTION_SHARE, Scene};
use model_core::left_out::{FrictionZone, PositionDependentFriction};
use model_core::real::Real;

/// The law divides by wavelength and zone; no seal or guide has a shorter one.
const SHORTEST_WAVE_M: f64 = 1e-3;
/// A step that the rows at a zone's borders can tell, m.
const ZONE_EDGE_M: f64 = 5e-4;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "position-dependent-friction",
    what: "Friction that varies along the stroke, as shares of the friction level.",
    parameters: &[
        signed("cosine", "1", "cosine amplitude", "0.05 to 0.3").said("cosine part", "%"),
        signed("sine", "1", "sine amplitude", "0.05 to 0.3").said("sine part", "%"),
        parameter("wavelength_m", "m", 0.1, SHORTEST_WAVE_M, "wavelength", "0.02 to 0.2").said("wavelength", "mm"),
        signed("slope_per_m", "1/m", "linear share", "-1 to 1").said("slope", "% per m"),
        signed("curvature_per_m2", "1/m2", "quadratic share", "-5 to 5").said("curvature", "% per m²"),
        signed("zone_share", "1", "share in one zone of the stroke", "0.1 to 1").said("share in the zone", "%"),
        signed("zone_middle_m", "m", "middle of that zone, as a position", "-0.2 to 0.2").said("middle of the zone", "mm"),
        parameter("zone_length_m", "m", 0.05, SHORTEST_WAVE_M, "length of that zone", "0.005 to 0.1").said("length of the zone", "mm"),
    ],
    meaning: "friction that varies periodically along the stroke",
    meaning_of_form: &[
        ("slope", "friction that changes linearly along the stroke"),
        ("zone", "friction that is different in one zone of the stroke (dirt, damage, a worn seal track)"),
    ],
    shown_by: "slow strokes over the full travel at two constant speeds in both directions",
    told_from: &[
        (&["constant-force", "direction-dependent-friction"], "Strokes over the full travel at several constant speeds in both directions: friction changes its sign with the direction, a force does not; only position-dependent friction repeats at the same position."),
    ],
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The shares along the stroke.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> PositionDependentFriction<R> {
    let number = |key| EFFECT.number(numbers, key);
    PositionDependentFriction {
        cosine: number("cosine"),
        sine: number("sine"),
        wavelength_m: number("wavelength_m"),
        slope_per_m: number("slope_per_m"),
        curvature_per_m2: number("curvature_per_m2"),
        zone: FrictionZone {
            share: number("zone_share"),
            middle_m: number("zone_middle_m"),
            length_m: number("zone_length_m"),
        },
    }
}

/// A wave along the stroke, a level that changes along it, or one zone. A wave's length and a
/// zone's place are found only from a start near them.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let rig = scene.rig;
    let stroke_m = rig.value("cylinder.stroke_m");
    let is_dry = scene.is_of_forces() && rig.value("friction.coulomb_N").is_some();
    let Some(stroke_m) = stroke_m.filter(|_| is_dry) else {
        return Vec::new();
    };
    let waves_m = [1.0, 0.7, 0.5, 0.36, 0.26, 0.2, 0.15, 0.11, 0.08, 0.06, 0.04]
        .map(|share| share * stroke_m);
    let share = scene.mark(Mark::From(FRICTION_SHARE));
    let half_way_m = 0.5 * stroke_m;
    let slope = scene.mark(Mark::From(FRICTION_SHARE / half_way_m));
    let curvature = scene.mark(Mark::From(FRICTION_SHARE / half_way_m.powi(2)));
    vec![
        Candidate::new(EFFECT.name, PLACE)
            .form("wave")
            .free("cosine", (-3.0, 3.0), &[0.05])
            .matters(share)
            .free("sine", (-3.0, 3.0), &[0.05])
            .matters(share)
            .free("wavelength_m", (0.02 * stroke_m, 3.0 * stroke_m), &waves_m),
        Candidate::new(EFFECT.name, PLACE)
            .form("slope")
            .free("slope_per_m", (-20.0, 20.0), &[0.1, -0.1])
            .matters(slope)
            .free("curvature_per_m2", (-100.0, 100.0), &[0.1])
            .matters(curvature),
        Candidate::new(EFFECT.name, PLACE)
            .form("zone")
            .free("zone_share", (-0.9, 10.0), &[0.1])
            .matters(share)
            .free(
                "zone_middle_m",
                (-half_way_m, half_way_m),
                &[0.0, -0.5, 0.5].map(|place| place * half_way_m),
            )
            .edge(ZONE_EDGE_M)
            .free(
                "zone_length_m",
                (0.01 * stroke_m, stroke_m),
                &[0.2 * stroke_m],
            ),
    ]
}
