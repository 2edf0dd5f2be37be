//! A load with play.

use super::coupling;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use model_core::left_out::LoadCoupling;
use model_core::real::Real;

/// A play below the bristle's deflection (20 to 30 um) does not matter.
const LEAST_PLAY_M: f64 = 2e-5;

/// The declaration. It stands for the compliance too where it has a mass.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "load-backlash",
    what: "A part of the moving mass behind a backlash and a spring.",
    parameters: &[
        parameter("load_mass_kg", "kg", 0.0, 0.0, "mass behind the backlash", "0.3 to 0.8 times mass_kg").said("load mass", "kg"),
        parameter("stiffness_N_m", "N/m", 0.0, 0.0, "stiffness in contact", "1e5 to 1e6").said("stiffness", "N/mm"),
        parameter("damping_Ns_m", "N s/m", 0.0, 0.0, "damping in contact", "10 to 500").said("damping", "N s/m"),
        parameter("gap_m", "m", 0.0, 0.0, "backlash, end to end", "2e-5 to 5e-4").said("total play", "mm").decisive(),
    ],
    meaning: "part of the moving mass is coupled with play",
    shown_by: "reversals at several accelerations with a small dither",
    told_from: &[
        (&["stribeck-friction", "dwell-stiction", "valve-hysteresis"], "Reversals at several accelerations with a small dither: a play is a constant distance at every acceleration, stiction a constant force."),
    ],
    acts_on: Half::Forces,
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

/// The load with its play.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> LoadCoupling<R> {
    coupling::law(&EFFECT, numbers, EFFECT.number(numbers, "gap_m"))
}

/// A hard contact bounces: behind a recorded motion its blows fall at random. A soft one that does
/// not bounce hands on the same momentum.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let load = coupling::candidate(&EFFECT, scene, (&[2e4], None), 700.0);
    let gaps_m = [1e-4, 4e-4, 1.2e-3, 3e-3];
    let with_play = |load: Candidate| load.free("gap_m", (LEAST_PLAY_M, 1e-2), &gaps_m).rough();
    load.map(with_play).into_iter().collect()
}
