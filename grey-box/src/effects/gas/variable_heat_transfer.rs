//! Heat transfer that varies with the gas.

use super::exchanges_heat;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::VariableHeatTransfer;
use model_core::real::Real;

/// A third of what still gas exchanges ...
const FLOW_W_M2K: f64 = 3.0;
/// ... and a tenth more over a density three times as high.
const DENSITY_EXPONENT: f64 = 0.1;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "variable-heat-transfer",
    what: "Heat transfer that grows with gas density and mass flow.",
    parameters: &[
        parameter("density_exponent", "1", 0.0, 0.0, "exponent of the density ratio", "0.5 to 0.8").said("density exponent", ""),
        parameter("flow_W_m2K", "W/(m2 K)", 0.0, 0.0, "additional coefficient at full flow", "10 to 100").said("increase at a flow of 1 g/s", "W/(m² K)"),
    ],
    meaning: "the heat transfer to the wall depends on the density and flow of the gas",
    shown_by: "fill bursts of several strengths at fixed piston, each followed by a dwell of 10 s",
    candidates,
    ..PLAIN
};

/// The variation.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> VariableHeatTransfer<R> {
    VariableHeatTransfer {
        density_exponent: EFFECT.number(numbers, "density_exponent"),
        flow_w_per_m2_k: EFFECT.number(numbers, "flow_W_m2K"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !exchanges_heat(scene) {
        return Vec::new();
    }
    let varying = Candidate::new(EFFECT.name, &scene.chambers())
        .free("density_exponent", (0.0, 3.0), &[0.3])
        .matters(scene.mark(Mark::From(DENSITY_EXPONENT)))
        .free("flow_W_m2K", (0.0, 1e3), &[10.0, 60.0])
        .matters(scene.mark(Mark::From(FLOW_W_M2K)));
    vec![varying]
}
