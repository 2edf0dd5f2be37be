//! Cushions at the ends of the stroke.

use super::PLACE;
use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Half, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::side::Side;
use model_core::left_out::{ElasticBuffer, EndCushion};
use model_core::real::Real;

/// A needle narrower than this is shut: the law divides by its area.
const NARROWEST_NEEDLE_M2: f64 = 1e-9;
/// No cushion is longer than this, m.
const LONGEST_M: f64 = 0.1;
/// Half the way over which a cushion's seal closes, m.
const EDGE_M: f64 = 1e-4;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "end-cushion",
    what: "Cushions at the ends of the stroke: exhaust through needles, elastic buffers.",
    parameters: &[
        parameter("length_m", "m", 0.0, 0.0, "length of the pneumatic cushion; 0 is none", "0.01 to 0.03").said("length", "mm"),
        parameter("needle_area_m2", "m2", 1e-6, NARROWEST_NEEDLE_M2, "area of the needle", "5e-7 to 3e-6").said("needle area", "mm²"),
        parameter("buffer_length_m", "m", 0.0, 0.0, "length of the elastic buffer", "0.002 to 0.01").said("buffer length", "mm"),
        parameter("buffer_stiffness_N_m", "N/m", 0.0, 0.0, "stiffness of the buffer", "1e4 to 1e6").said("buffer stiffness", "N/mm"),
        parameter("buffer_damping_Ns_m", "N s/m", 0.0, 0.0, "damping of the buffer", "10 to 1000").said("buffer damping", "N s/m"),
    ],
    meaning: "pneumatic cushions: near the end of stroke the chamber exhausts through a needle valve",
    meaning_of_form: &[("elastic", "elastic buffers at the ends of the stroke")],
    shown_by: "strokes to both ends at two speeds",
    told_from: &[
        (&["position-dependent-friction", "dead-volume", "constant-force"], "Strokes to the end at two speeds and away from it again: friction changes its sign with the direction, a buffer pushes in both directions, a needle valve resists in proportion to the speed and only towards the end, a volume depends on neither."),
    ],
    acts_on: Half::Gas,
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

/// The needles.
pub fn needles<R: Real>(numbers: &impl Numbers<R>) -> EndCushion<R> {
    EndCushion {
        length_m: EFFECT.number(numbers, "length_m"),
        needle_area_m2: EFFECT.number(numbers, "needle_area_m2"),
    }
}

/// The buffers, at the ends of a stroke.
pub fn buffers<R: Real>(numbers: &impl Numbers<R>, ends_m: [R; 2]) -> ElasticBuffer<R> {
    let number = |key| EFFECT.number(numbers, key);
    let length_m = number("buffer_length_m");
    ElasticBuffer {
        low_m: ends_m[0] + length_m,
        high_m: ends_m[1] - length_m,
        stiffness_n_per_m: number("buffer_stiffness_N_m"),
        damping_n_s_per_m: number("buffer_damping_Ns_m"),
    }
}

/// Where the recordings come near enough to an end.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let near_m = scene.nearest_end_m.filter(|&near_m| near_m < LONGEST_M);
    let Some(near_m) = near_m else {
        return Vec::new();
    };
    if scene.is_behind_valve() {
        vec![needle(near_m)]
    } else if scene.is_of_forces() {
        vec![elastic(near_m, scene.misfit_n)]
    } else {
        Vec::new()
    }
}

/// A start that lies outside the cushion, or has a needle wider than what the valve opens, sees
/// nothing of it, and one that lies far inside sees too much.
fn needle(near_m: f64) -> Candidate {
    const INTO_M: [f64; 9] = [
        0.001, 0.002, 0.0035, 0.006, 0.009, 0.014, 0.021, 0.032, 0.05,
    ];
    const NEEDLES_M2: [f64; 4] = [1e-7, 2.5e-7, 6e-7, 1.5e-6];
    let pairs = INTO_M
        .iter()
        .flat_map(|into_m| NEEDLES_M2.map(|needle_m2| (near_m + into_m, needle_m2)));
    let (lengths_m, needles_m2): (Vec<f64>, Vec<f64>) = pairs.unzip();
    Candidate::new(EFFECT.name, &Side::BOTH.map(Side::place))
        .form("needle")
        .free("length_m", (near_m.max(1e-3), LONGEST_M), &lengths_m)
        .edge(EDGE_M)
        .free("needle_area_m2", (1e-8, 1e-4), &needles_m2)
}

fn elastic(near_m: f64, force_n: f64) -> Candidate {
    let stiffness_n_m = 10.0 * force_n.max(1.0) / 1e-3;
    let lengths_m = [near_m + 0.005, near_m + 0.02];
    Candidate::new(EFFECT.name, PLACE)
        .form("elastic")
        .free("buffer_length_m", (near_m.max(1e-3), LONGEST_M), &lengths_m)
        .free("buffer_stiffness_N_m", (0.0, 1e7), &[0.1 * stiffness_n_m])
        .free("buffer_damping_Ns_m", (0.0, 1e5), &[10.0])
}
