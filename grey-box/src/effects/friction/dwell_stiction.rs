//! A break-away force that grows with the time at rest.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Numbers, PLAIN, parameter, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use crate::fit::free_parameter::Scope;
use crate::fit::levenberg_marquardt::Prior;
use model_core::left_out::{DwellStiction, FORGETTING_WAY_M};
use model_core::real::Real;

/// The law divides by the time constant; shorter is no growth but a level.
const SHORTEST_S: f64 = 1e-3;
/// No seal forgets on the way of an atom: the law divides by it.
const SHORTEST_WAY_M: f64 = 1e-6;
/// A stiction that has grown within less than this is grown at every break-away, s: a
/// static level.
const SHORTEST_DWELL_S: f64 = 0.1;
/// 4 kPa on the piston.
const LEAST_RISE_N: f64 = 2.0;
/// A seal that ages rises by up to 1.5 times its static level, which is some 1.4 times the
/// Coulomb level: what rests a second tells no rise from a slower and larger one.
const MOST_RISE: f64 = 2.0;
/// Over what way a seal forgets how long it stood, m: 0.05 to 0.5 mm. Rests and
/// break-aways say little of it, as a longer rise is forgotten on a shorter way.
const FORGETTING_WAY: Prior = Prior {
    mean: FORGETTING_WAY_M,
    standard_deviation: 0.15e-3,
};

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "dwell-stiction",
    what: "Break-away force that grows with the time at rest.",
    parameters: &[
        signed("rise_N", "N", "growth after a long rest", "0.2 to 1 times static_N").said("rise", "N"),
        parameter("time_constant_s", "s", 1.0, SHORTEST_S, "time constant of the growth", "1 to 100").said("time constant", "s").decisive(),
        parameter("forgetting_way_m", "m", FORGETTING_WAY_M, SHORTEST_WAY_M, "travel over which the growth is lost", "1e-5 to 1e-3").said("decay distance", "mm"),
    ],
    meaning: "break-away force that increases with the time at rest",
    shown_by: "a ladder of rests from 0.1 to 300 s, each ended by the same slow ramp of force",
    told_from: &[
        (&["stribeck-friction", "coulomb-friction", "valve-hysteresis"], "A ladder of rests from 0.1 to 300 s, each ended by the same slow ramp of force: only dwell stiction raises the break-away force with the time at rest."),
    ],
    acts_on: Half::Forces,
    candidates,
    ..PLAIN
};

/// The growth.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> DwellStiction<R> {
    DwellStiction {
        rise_n: EFFECT.number(numbers, "rise_N"),
        time_constant_s: EFFECT.number(numbers, "time_constant_s"),
        forgetting_way_m: EFFECT.number(numbers, "forgetting_way_m"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let coulomb_n = scene.rig.value("friction.coulomb_N");
    let Some(coulomb_n) = coulomb_n.filter(|_| scene.is_of_forces()) else {
        return Vec::new();
    };
    let usual = Prior {
        mean: 0.0,
        standard_deviation: MOST_RISE * coulomb_n,
    };
    let shared = Scope::Shared;
    let rises_n = [0.2 * coulomb_n, coulomb_n, coulomb_n];
    let ways_m = [FORGETTING_WAY.mean];
    let growing = Candidate::new(EFFECT.name, PLACE)
        .free_as(
            "rise_N",
            shared,
            (0.0, 20.0 * coulomb_n),
            Some(usual),
            &rises_n,
        )
        .matters(scene.mark(Mark::From(LEAST_RISE_N)))
        .free(
            "time_constant_s",
            (SHORTEST_DWELL_S, 50.0),
            &[1.0, 0.5, 3.0],
        )
        .free_as(
            "forgetting_way_m",
            shared,
            (2e-5, 1e-3),
            Some(FORGETTING_WAY),
            &ways_m,
        );
    vec![growing.of_rests()]
}
