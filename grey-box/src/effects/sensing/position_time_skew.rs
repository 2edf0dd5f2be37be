//! A position that is recorded late against the other channels.
//!
//! ```text
//! shown(t) = x(t - delay)
//! ```
//!
//! Source: encoders on a bus, and loggers that read their channels in turns; some milliseconds. At 0.5 m/s one of them is 0.5 mm. It has
//! nothing to do with the axis: control on a board is as good as before. Confused with gauges that lag (both are a shift
//! between position and pressure) and with a late valve.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, signed};
use crate::effects::scene::Scene;
use crate::fit::free_parameter::Scope;
use crate::fit::levenberg_marquardt::Prior;
use crate::law::Law;
use model_core::real::Real;

/// A logger that is out by more rows than this is rare; the prior is weak against any recording
/// with motion in it, and decides where there is none.
const USUAL_ROWS: f64 = 10.0;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "position-time-skew",
    what: "The position is recorded late against the other channels.",
    parameters: &[signed("delay_s", "s", "delay", "0 to 0.01").said("delay", "ms")],
    meaning: "time skew between the position and the other channels",
    shown_by: "fast reversals with the valve at its null",
    told_from: &[
        (&["valve-delay", "spool-dynamics", "slew-limit", "tube-line"], "Bursts of the command at fixed piston: valve and tube act, a time skew of the position has no effect."),
    ],
    kind: Kind::ShiftInTime,
    off_board: Some((&[], "is the logger's, and a board reads its sensors at one time")),
    candidates,
    ..PLAIN
};

/// The delay, s.
pub fn delay_s<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "delay_s")
}

/// A property of a recording's logging, hence one per recording; the channels of a whole axis come
/// from one logger, and either sign leads to its few rows.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let has_position = match scene.law {
        Law::Chambers => scene.rig.vessel.is_none(),
        law => law == Law::Force,
    };
    if !has_position {
        return Vec::new();
    }
    let row_s = scene.row_s;
    let starts_s = [2.0, -2.0, 12.0, -12.0].map(|rows| rows * row_s);
    let (scope, starts_s) = match scene.rig.valve {
        Some(_) => (Scope::Shared, &starts_s[..2]),
        None => (Scope::PerRecording, &starts_s[..]),
    };
    let prior = Prior {
        mean: 0.0,
        standard_deviation: USUAL_ROWS * row_s,
    };
    let bounds = (-50.0 * row_s, 50.0 * row_s);
    let skew = Candidate::new(EFFECT.name, &["sensor.x"]);
    vec![skew.free_as("delay_s", scope, bounds, Some(prior), starts_s)]
}
