//! Friction that grows with the pressures that push the seals.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::real::Real;

/// The part of the pressures' force that a seal may hold back. Makers count with 0.05 to 0.15; one
/// that held back all of it had nothing left to explain, with 2 % of the mass and of the friction.
const MOST_HELD_BACK: f64 = 0.3;
const BAR_PA: f64 = 1e5;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "pressure-dependent-friction",
    what: "Friction that grows with the chamber pressures.",
    parameters: &[
        signed("per_mean_pressure_N_Pa", "N/Pa", "growth with the mean gauge pressure", "2e-5 to 6e-5").said("per mean pressure", "N/bar"),
        signed("per_pressure_difference_N_Pa", "N/Pa", "growth with the pressure difference", "5e-6 to 3e-5").said("per pressure difference", "N/bar"),
        signed("static_rise_per_mean_pressure_N_Pa", "N/Pa", "further growth of the static level", "0 to 3e-5").said("additional break-away force per mean pressure", "N/bar"),
    ],
    meaning: "dry friction that increases with pressure",
    shown_by: "constant speeds in both directions at each of three supply pressures",
    told_from: &[
        (&["coulomb-friction", "viscous-friction", "stribeck-friction", "direction-dependent-friction", "position-dependent-friction", "constant-force"], "Strokes at four or more constant speeds in both directions, at each of three supply pressures."),
    ],
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// Growth with the mean gauge pressure, with the pressure difference, and of the static level
/// beyond that with the mean gauge pressure, N/Pa.
pub fn growth_n_pa<R: Real>(numbers: &impl Numbers<R>) -> [R; 3] {
    [
        "per_mean_pressure_N_Pa",
        "per_pressure_difference_N_Pa",
        "static_rise_per_mean_pressure_N_Pa",
    ]
    .map(|key| EFFECT.number(numbers, key))
}

/// Growth with the mean pressure, with the difference where both are recorded, and at break-away
/// otherwise than while sliding where the rig tells these two apart.
///
/// In the model the levels are those without pressure. At which pressure the stated ones were
/// measured nobody says: held to them, on two simulated axes where they are those of the
/// working pressure, the static level came out as 23.5 and 14.7 N of 18.6 and 11.8 built in, not
/// held to them as 19.9 and 12.8 N.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let rig = scene.rig;
    if !scene.is_of_forces() || !rig.signals.contains("p_a") {
        return Vec::new();
    }
    let start = scene.misfit_n / scene.highest_pressure_pa;
    let most = 1e3 * start;
    let starts = [start, 0.1 * start];
    let least = scene.least_force_n();
    let least = least.and_then(|least_n| scene.mark(Mark::From(least_n / BAR_PA)));
    let mut growing = Candidate::new(EFFECT.name, PLACE)
        .free("per_mean_pressure_N_Pa", (0.0, most), &starts)
        .matters(least);
    if rig.signals.contains("p_b") {
        let area_m2 = rig.value("cylinder.area_a_m2").unwrap_or(f64::INFINITY);
        let bounds = (0.0, most.min(MOST_HELD_BACK * area_m2));
        growing = growing
            .free("per_pressure_difference_N_Pa", bounds, &starts)
            .matters(least);
    }
    if rig.value("friction.static_N").is_some() {
        let key = "static_rise_per_mean_pressure_N_Pa";
        growing = growing.free(key, (-most, most), &starts);
    }
    vec![growing.voiding(&["friction.coulomb_N", "friction.static_N"])]
}
