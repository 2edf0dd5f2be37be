//! A gauge with a wrong gain.
//!
//! ```text
//! shown = (1 + gain_error) p,   p absolute
//! ```
//!
//! Source: data sheets give 0.25 to 1 %. 1 % of 5 bar are 5 kPa, 2.5 N on a piston of 25 mm. The rig's `[chambers]` have gains known to
//! 0.25 % as part of every fit; the effect is what lies beyond. Confused with an offset, and with an area of the piston.

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
    name: "gauge-gain",
    what: "Recorded over true absolute chamber pressure, less one.",
    parameters: &[
        signed("gain_error_a", "1", "relative error of the gain of chamber A's gauge", "-0.01 to 0.01").said("gain error of gauge A", "%"),
        signed("gain_error_b", "1", "relative error of the gain of chamber B's gauge", "-0.01 to 0.01").said("gain error of gauge B", "%"),
    ],
    meaning: "the gain of a pressure sensor is wrong",
    shown_by: "both chambers at rest and connected, from ambient to supply pressure, with a reference gauge",
    off_board: OF_A_SENSOR,
    candidates,
    ..PLAIN
};

fn gain_error_key(side: Side) -> String {
    format!("gain_error_{}", side.letter())
}

/// The gain's error of a chamber's gauge.
pub fn gain_error<R: Real>(numbers: &impl Numbers<R>, side: Side) -> R {
    EFFECT.number(numbers, &gain_error_key(side))
}

/// One for each gauge, in the place of the gain that is refitted.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law != Law::Chambers {
        return Vec::new();
    }
    let of_side = |&side: &Side| {
        // The prediction is linear in it: the other sign ends at the same place.
        Candidate::new(EFFECT.name, &[side.gauge_place()])
            .free(&gain_error_key(side), (-0.2, 0.2), &[0.01])
            .matters(least(scene))
            .beside(scene.rig, &[side.gauge_gain_key()])
            .voiding(&[side.gauge_gain_key()])
    };
    scene.sides.iter().map(of_side).collect()
}

/// A gain that at the supply pressure pushes no more than a force that does not matter.
fn least(scene: &Scene<'_>) -> Option<Mark> {
    let area_m2 = scene.rig.value("cylinder.area_a_m2")?;
    let supply_pa = scene.rig.value("supply.pressure_Pa")?;
    scene.mark(Mark::From(scene.least_force_n()? / (area_m2 * supply_pa)))
}
