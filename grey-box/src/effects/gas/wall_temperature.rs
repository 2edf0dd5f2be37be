//! A wall at another temperature than the surroundings.

use super::exchanges_heat;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::WallTemperature;
use model_core::real::Real;

/// No wall of a pneumatic axis is so much colder than its surroundings.
const COLDEST_OFFSET_K: f64 = -100.0;
/// 0.3 % of the pressure that a chamber settles at.
const LEAST_OFFSET_K: f64 = 1.0;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "wall-temperature",
    what: "A wall at another temperature than the surroundings; with a heat capacity the gas warms it.",
    parameters: &[
        parameter("offset_K", "K", 0.0, COLDEST_OFFSET_K, "wall less ambient temperature", "-10 to 10").said("offset", "K"),
        parameter("heat_capacity_J_K", "J/K", 0.0, 0.0, "heat capacity; 0 is a wall of constant temperature", "1000 to 2500").said("heat capacity of the wall", "J/K"),
        parameter("outer_W_K", "W/K", 0.0, 0.0, "conductance of the wall to the surroundings", "0.2 to 1").said("conductance to the surroundings", "W/K"),
    ],
    meaning: "the cylinder wall is not at ambient temperature",
    shown_by: "a start from cold and ten minutes of full strokes",
    told_from: &[
        (&["variable-heat-transfer", "gas-temperature-dynamics"], "Fill bursts of several strengths at fixed piston, each followed by a dwell of 10 s, from a cold start and again after ten minutes of full strokes: the heat transfer determines how fast the pressure settles, the wall temperature its final value."),
    ],
    candidates,
    ..PLAIN
};

/// The wall of either chamber.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> WallTemperature<R> {
    WallTemperature {
        offset_k: EFFECT.number(numbers, "offset_K"),
        heat_capacity_j_per_k: EFFECT.number(numbers, "heat_capacity_J_K"),
        outer_w_per_k: EFFECT.number(numbers, "outer_W_K"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !exchanges_heat(scene) {
        return Vec::new();
    }
    let warm = Candidate::new(EFFECT.name, &scene.chambers())
        .free("offset_K", (-80.0, 80.0), &[5.0, -5.0])
        .matters(scene.mark(Mark::From(LEAST_OFFSET_K)));
    vec![warm]
}
