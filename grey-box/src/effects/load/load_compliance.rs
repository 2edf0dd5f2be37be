//! A load behind a spring.

use super::coupling;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use model_core::left_out::LoadCoupling;
use model_core::real::Real;

/// A load that hangs 10 um behind at 10 m/s2 is rigid.
const RIGID_N_M_PER_KG: f64 = 1e6;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "load-compliance",
    what: "A part of the moving mass behind a spring.",
    parameters: &[
        parameter("load_mass_kg", "kg", 0.0, 0.0, "mass behind the spring", "0.3 to 0.8 times mass_kg").said("load mass", "kg"),
        parameter("stiffness_N_m", "N/m", 0.0, 0.0, "stiffness", "1e5 to 1e6").said("stiffness", "N/mm"),
        parameter("damping_Ns_m", "N s/m", 0.0, 0.0, "damping", "10 to 500").said("damping", "N s/m"),
    ],
    meaning: "part of the moving mass is coupled by a spring",
    shown_by: "sharp steps of force while sliding, without and with 5 kg more",
    told_from: &[
        (&["load-backlash", "coulomb-friction", "pressure-sensor-lag"], "Sharp reversals at several accelerations, without and with 5 kg more: a spring also rings during sliding, and at a lower frequency with the payload; a play has the same width at every acceleration; presliding acts only at rest."),
    ],
    acts_on: Half::Forces,
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

/// The load.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> LoadCoupling<R> {
    coupling::law(&EFFECT, numbers, R::ZERO)
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let stiffness = (&[6e3, 3e4, 2e5][..], Some(RIGID_N_M_PER_KG));
    let load = coupling::candidate(&EFFECT, scene, stiffness, 100.0);
    load.into_iter().collect()
}
