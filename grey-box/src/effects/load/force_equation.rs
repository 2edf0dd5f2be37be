//! A force of no effect with a name, as a short equation.

use crate::effects::declaration::{Effect, Half, Kind, Numbers, PLAIN, parameter, signed};
use model_core::left_out::ForceEquation;
use model_core::real::Real;

/// The law divides by these ways.
const SHORTEST_M: f64 = 1e-4;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "force-equation",
    what: "A force of no named effect, as a short equation found from recordings: any of a spring about its rest, drag with the square of the speed, a force that repeats along the way, and one that trails behind the motion.",
    parameters: &[
        signed("spring_N_m", "N/m", "stiffness", "10 to 2000").said("stiffness", "N/mm"),
        signed("stiffening_N_m3", "N/m3", "stiffness that grows with the square of the way", "1e3 to 1e6").said("stiffening", "N/m³"),
        signed("rest_m", "m", "position at which the spring pushes nothing", "-0.2 to 0.2").said("rest", "mm"),
        parameter("drag_Ns2_m2", "N s2/m2", 0.0, 0.0, "drag per square of the speed", "5 to 100").said("drag", "N s²/m²"),
        signed("sine_N", "N", "sine part of the force that repeats", "2 to 20").said("sine part", "N"),
        signed("cosine_N", "N", "cosine part", "2 to 20").said("cosine part", "N"),
        parameter("pitch_m", "m", 0.05, SHORTEST_M, "way after which it repeats", "0.005 to 0.1").said("pitch", "mm"),
        signed("trailing_N", "N", "force that trails behind the motion, when full", "2 to 20").said("trailing force", "N"),
        parameter("path_m", "m", 0.02, SHORTEST_M, "way in which it turns over", "0.005 to 0.05").said("path", "mm"),
    ],
    meaning: "an unlisted force, as an equation",
    shown_by: "strokes in both directions over the full travel at several constant speeds",
    acts_on: Half::Forces,
    kind: Kind::Unnamed,
    ..PLAIN
};

/// The equation.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> ForceEquation<R> {
    let number = |key| EFFECT.number(numbers, key);
    ForceEquation {
        spring_n_per_m: number("spring_N_m"),
        stiffening_n_per_m3: number("stiffening_N_m3"),
        rest_m: number("rest_m"),
        drag_n_s2_per_m2: number("drag_Ns2_m2"),
        sine_n: number("sine_N"),
        cosine_n: number("cosine_N"),
        pitch_m: number("pitch_m"),
        trailing_n: number("trailing_N"),
        path_m: number("path_m"),
    }
}
