//! Tubes between valve and cylinder.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use model_core::left_out::TubeLine;
use model_core::real::Real;

/// A tube narrower than this is none: the law divides by its area.
const NARROWEST_M: f64 = 1e-4;
/// A shorter tube is a fitting, and belongs to the valve's areas.
const SHORTEST_M: f64 = 0.05;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "tube-line",
    what: "Tubes between valve and cylinder at both ports: the gas is stored, delayed and throttled.",
    parameters: &[
        parameter("length_m", "m", 0.0, 0.0, "length of each tube", "0.1 to 3").said("length", "m").decisive(),
        parameter("diameter_m", "m", 0.004, NARROWEST_M, "inner diameter", "0.004 to 0.008").said("inner diameter", "mm"),
    ],
    meaning: "the tubes between valve and chambers store, delay and throttle the gas",
    shown_by: "two fill bursts of different strength with the piston fixed at each end of the stroke",
    told_from: &[
        (&["dead-volume"], "Bursts at fixed piston at both ends of the stroke, and slow strokes with the valve at its null: a volume appears in both, the lag of a tube only in the bursts."),
        (&["valve-delay", "spool-dynamics", "pressure-sensor-lag"], "Bursts of the command at two amplitudes with the piston fixed at both ends of the stroke: the lag of a tube depends on the volume behind it and on the flow, the other lags do not."),
    ],
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

/// The tubes of both ports.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> TubeLine<R> {
    TubeLine {
        length_m: EFFECT.number(numbers, "length_m"),
        diameter_m: EFFECT.number(numbers, "diameter_m"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_behind_valve() {
        return Vec::new();
    }
    let tube = Candidate::new(EFFECT.name, &["valve-flow"])
        .free("length_m", (SHORTEST_M, 10.0), &[0.5, 2.0])
        .free("diameter_m", (0.0015, 0.015), &[0.004]);
    vec![tube]
}
