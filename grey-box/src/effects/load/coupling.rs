//! A part of the moving mass behind a spring, with play or without.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::LoadCoupling;
use model_core::real::Real;

/// Mass, spring and damper of an effect, with a gap.
pub fn law<R: Real>(effect: &Effect, numbers: &impl Numbers<R>, gap_m: R) -> LoadCoupling<R> {
    LoadCoupling {
        load_mass_kg: effect.number(numbers, "load_mass_kg"),
        stiffness_n_per_m: effect.number(numbers, "stiffness_N_m"),
        damping_n_s_per_m: effect.number(numbers, "damping_Ns_m"),
        gap_m,
    }
}

/// The same as something to try, where the rig states the moving mass.
pub fn candidate(
    effect: &Effect,
    scene: &Scene<'_>,
    stiffness: (&[f64], Option<f64>),
    damping: f64,
) -> Option<Candidate> {
    let mass_kg = scene.rig.value("carriage.mass_kg")?;
    let (stiffness_n_m, rigid_n_m_per_kg) = stiffness;
    let rigid = rigid_n_m_per_kg.and_then(|rigid| scene.mark(Mark::UpTo(rigid * mass_kg)));
    let load = Candidate::new(effect.name, super::PLACE)
        .free("load_mass_kg", (0.0, 0.95 * mass_kg), &[0.5 * mass_kg])
        .free("stiffness_N_m", (1e3, 5e6), stiffness_n_m)
        .matters(rigid)
        .free("damping_Ns_m", (0.0, 5e3), &[damping]);
    scene.is_of_forces().then_some(load)
}
