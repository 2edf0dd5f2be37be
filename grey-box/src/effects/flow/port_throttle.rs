//! One-way flow controls at the ports.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use crate::side::Side;
use model_core::left_out::PortThrottle;
use model_core::real::Real;

/// A throttle of three times the area of a valve of this size takes a twentieth off its flow.
const WIDEST_M2: f64 = 3e-5;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "port-throttle",
    what: "One-way flow controls (speed controllers) at the ports: gas leaves a chamber through a throttle and enters it freely.",
    parameters: &[
        parameter("outlet_a_m2", "m2", 0.0, 0.0, "throttle through which chamber A empties; 0 is none", "1e-6 to 1e-5").said("throttle of chamber A", "mm²"),
        parameter("outlet_b_m2", "m2", 0.0, 0.0, "throttle through which chamber B empties; 0 is none", "1e-6 to 1e-5").said("throttle of chamber B", "mm²"),
    ],
    meaning: "one-way flow control (speed controller) at the port throttles the gas that leaves the chamber",
    shown_by: "bursts from small to full opening in both directions",
    told_from: &[
        (&["exhaust-back-pressure", "tube-line"], "Bursts from small to full opening in both directions, with the flow controls screwed fully open and as found: a silencer holds back whatever chamber empties, a tube delays filling too, a throttle limits the emptying of its own chamber alone."),
        (&["end-cushion"], "Strokes at two speeds through the whole way: a cushion throttles near the end of stroke, a flow control everywhere."),
    ],
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

/// The throttle of one chamber.
pub fn law<R: Real>(numbers: &impl Numbers<R>, side: Side) -> PortThrottle<R> {
    PortThrottle {
        outlet_area_m2: EFFECT.number(numbers, &outlet_key(side)),
    }
}

fn outlet_key(side: Side) -> String {
    format!("outlet_{}_m2", side.letter())
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_behind_valve() {
        return Vec::new();
    }
    let of_side = |&side: &Side| throttled(scene, side);
    scene.sides.iter().map(of_side).collect()
}

fn throttled(scene: &Scene<'_>, side: Side) -> Candidate {
    let open_m2 = scene.open_valve_m2();
    Candidate::new(EFFECT.name, &[side.place()])
        .free(
            &outlet_key(side),
            (0.02 * open_m2, 50.0 * open_m2),
            &[open_m2, 0.3 * open_m2, 3.0 * open_m2],
        )
        .matters(scene.mark(Mark::UpTo(WIDEST_M2)))
}
