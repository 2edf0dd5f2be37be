//! Gauges that lag.
//!
//! ```text
//! shown' = (p - shown) / tau
//! ```
//!
//! Source: filters of transmitters, and thin tubes before them; 1 to 5 ms. It matters from half a millisecond on, as a pressure of 5 bar
//! may change by 1 kPa in that time, and in control from 1 ms on. Confused with everything else that is late: valve, spool, tubes, and a logger that
//! reads the position late.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::law::Law;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "pressure-sensor-lag",
    what: "Both chamber pressures are recorded late, as a first-order lag.",
    parameters: &[parameter("time_constant_s", "s", 0.0, 0.0, "time constant", "0.001 to 0.005").said("time constant", "ms").decisive()],
    meaning: "the pressure sensors lag",
    shown_by: "free swings of the carriage with the valve at its null",
    told_from: &[
        (&["position-time-skew"], "Short fill bursts at fixed piston: a sensor lag rounds the onset of the pressure, a time skew of the position has no effect."),
        (&["valve-delay", "spool-dynamics", "slew-limit", "valve-hysteresis"], "Let the carriage swing freely with the valve held at its null: a sensor lag appears between position and pressure, the valve has no effect."),
    ],
    kind: Kind::ShiftInTime,
    candidates,
    ..PLAIN
};

/// The time constant, s.
pub fn time_constant_s<R: Real>(numbers: &impl Numbers<R>) -> R {
    EFFECT.number(numbers, "time_constant_s")
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if scene.law != Law::Chambers {
        return Vec::new();
    }
    let row_s = scene.row_s;
    let places: Vec<&'static str> = scene.sides.iter().map(|side| side.gauge_place()).collect();
    let starts_s = [2.0 * row_s, 10.0 * row_s];
    let lag = Candidate::new(EFFECT.name, &places);
    vec![lag.free("time_constant_s", (0.0, 100.0 * row_s), &starts_s)]
}
