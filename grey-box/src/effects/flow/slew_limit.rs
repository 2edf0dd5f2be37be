//! A spool or stem with a largest speed.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use crate::law::Law;
use model_core::left_out::SlewLimit;
use model_core::real::Real;

/// A spool's own full stroke at 1.0 to 1.5 kV/s, s: what is faster is no limit.
const FASTEST_STROKE_S: f64 = 7e-3;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "slew-limit",
    what: "Largest rate of spool or stem, by direction; 0 is none.",
    parameters: &[
        parameter("rising_per_s", "signal/s", 0.0, 0.0, "largest rate upwards", "1000 V/s for a spool").said("rising rate", "command units per s"),
        parameter("falling_per_s", "signal/s", 0.0, 0.0, "largest rate downwards", "1000 V/s for a spool").said("falling rate", "command units per s"),
    ],
    meaning: "the speed of the stem or spool is limited, with one limit per direction",
    shown_by: "steps of the command of several sizes at fixed piston",
    told_from: &[
        (&["valve-delay", "spool-dynamics"], "Steps of the command of several sizes at fixed piston: a limited rate takes longer for a larger step, a lag or a delay does not."),
    ],
    candidates,
    ..PLAIN
};

/// The limits.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> SlewLimit<R> {
    SlewLimit {
        rising_per_s: EFFECT.number(numbers, "rising_per_s"),
        falling_per_s: EFFECT.number(numbers, "falling_per_s"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law == Law::Actuator {
        return vec![of_stem(scene)];
    }
    if !scene.follows_spool() {
        return Vec::new();
    }
    // From a limit alike in both directions a fit does not find one that is tighter in one of them.
    let even = [500.0, 100.0, 30.0].map(|limit| (limit, limit));
    let uneven = [(200.0, 60.0), (60.0, 200.0), (60.0, 20.0), (20.0, 60.0)];
    let (rising, falling): (Vec<f64>, Vec<f64>) = even.into_iter().chain(uneven).unzip();
    let stroke = scene.spool_stroke_v();
    let least = stroke.and_then(|stroke| scene.mark(Mark::UpTo(stroke / FASTEST_STROKE_S)));
    vec![
        Candidate::new(EFFECT.name, &["valve-command"])
            .free("rising_per_s", (1.0, 1e4), &rising)
            .matters(least)
            .free("falling_per_s", (1.0, 1e4), &falling)
            .matters(least),
    ]
}

fn of_stem(scene: &Scene<'_>) -> Candidate {
    let speed = scene.fastest_per_s;
    let bounds = (1e-3 * speed, 1e2 * speed);
    let rates = [1.0, 0.3, 0.1].map(|share| share * speed);
    Candidate::new(EFFECT.name, &["valve-command"])
        .form("one for each direction")
        .free("rising_per_s", bounds, &rates)
        .free("falling_per_s", bounds, &rates)
}
