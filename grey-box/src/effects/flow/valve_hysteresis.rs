//! Play between command and spool or stem.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use crate::law::Law;
use model_core::left_out::ValveHysteresis;
use model_core::real::Real;

/// Half of the play of a new spool, as a part of its stroke.
const PLAY_SHARE: f64 = 5e-4;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "valve-hysteresis",
    what: "Play between command and spool or stem.",
    parameters: &[parameter("width", "signal", 0.0, 0.0, "full width of the play", "0.4 % of the command range").said("width", "command units")],
    meaning: "play (backlash) between command and stem or spool",
    shown_by: "a triangle of the command of 60 s through the valve's null at fixed piston",
    told_from: &[
        (&["valve-delay", "spool-dynamics", "slew-limit"], "A slow triangle of the command through the valve's null at fixed piston, and the same ten times as fast: the hysteresis loop of a play keeps its width, that of a lag widens with the speed."),
    ],
    candidates,
    ..PLAIN
};

/// The play.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> ValveHysteresis<R> {
    ValveHysteresis {
        width: EFFECT.number(numbers, "width"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let play = Candidate::new(EFFECT.name, &["valve-command"]);
    if scene.law == Law::Actuator {
        let play = play.form("backlash");
        return vec![play.free("width", (0.0, 0.3), &[0.005, 0.03])];
    }
    if !scene.follows_spool() {
        return Vec::new();
    }
    let least = scene.spool_stroke_v();
    let least = least.and_then(|stroke| scene.mark(Mark::From(PLAY_SHARE * stroke)));
    vec![play.free("width", (0.0, 1.0), &[0.03, 0.1]).matters(least)]
}
