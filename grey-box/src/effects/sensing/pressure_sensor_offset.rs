//! A gauge with a wrong zero.
//!
//! ```text
//! shown = p + offset
//! ```
//!
//! Source: data sheets give 0.25 to 1 % of the full scale, 2.5 to 10 kPa of 10 bar. It matters from 2 kPa on, which are
//! 1 N on a piston of 25 mm. Of a carriage alone it cannot be told from a constant force.

use super::OF_A_SENSOR;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, signed};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use crate::law::Law;
use crate::side::Side;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "pressure-sensor-offset",
    what: "Recorded less true chamber pressure.",
    parameters: &[
        signed("offset_a_Pa", "Pa", "offset of chamber A", "-10000 to 10000").said("offset of gauge A", "kPa"),
        signed("offset_b_Pa", "Pa", "offset of chamber B", "-10000 to 10000").said("offset of gauge B", "kPa"),
    ],
    meaning: "a pressure sensor has an offset",
    shown_by: "both chambers vented, then both at supply pressure",
    off_board: OF_A_SENSOR,
    candidates,
    ..PLAIN
};

fn offset_key(side: Side) -> String {
    format!("offset_{}_Pa", side.letter())
}

/// The offset of a chamber's gauge, Pa.
pub fn offset_pa<R: Real>(numbers: &impl Numbers<R>, side: Side) -> R {
    EFFECT.number(numbers, &offset_key(side))
}

/// One for each gauge.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law != Law::Chambers {
        return Vec::new();
    }
    let of_side = |&side: &Side| {
        // The prediction is linear in it: the other sign ends at the same place.
        Candidate::new(EFFECT.name, &[side.gauge_place()])
            .free(&offset_key(side), (-1e5, 1e5), &[2e3])
            .matters(least(scene))
    };
    scene.sides.iter().map(of_side).collect()
}

/// An offset that pushes no more than a force that does not matter.
fn least(scene: &Scene<'_>) -> Option<Mark> {
    let area_m2 = scene.rig.value("cylinder.area_a_m2")?;
    scene.mark(Mark::From(scene.least_force_n()? / area_m2))
}
