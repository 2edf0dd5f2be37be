//! Dead time between command and valve.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::law::Law;
use model_core::left_out::ValveDelay;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "valve-delay",
    what: "Dead time of the command.",
    parameters: &[parameter("delay_s", "s", 0.0, 0.0, "dead time", "0.001 to 0.005").said("delay", "ms")],
    meaning: "dead time between command and valve",
    shown_by: "short bursts of the command at fixed piston, sampled as fast as the logger can",
    kind: Kind::ShiftInTime,
    candidates,
    ..PLAIN
};

/// The dead time.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> ValveDelay<R> {
    ValveDelay {
        delay_s: EFFECT.number(numbers, "delay_s"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let row_s = scene.row_s;
    let delay = Candidate::new(EFFECT.name, &["valve-command"]);
    let rows = |most: f64, starts: &[f64]| {
        let starts: Vec<f64> = starts.iter().map(|rows| rows * row_s).collect();
        vec![delay.free("delay_s", (0.0, most * row_s), &starts)]
    };
    if scene.law == Law::Actuator {
        rows(20.0, &[0.25, 0.75, 1.5, 4.0])
    } else if scene.follows_spool() {
        rows(50.0, &[1.5, 5.5])
    } else {
        Vec::new()
    }
}
