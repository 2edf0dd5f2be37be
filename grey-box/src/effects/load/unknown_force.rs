//! A force of no known law.

use crate::effects::declaration::{
    Effect, EffectParameter, Half, Kind, Numbers, PLAIN, parameter, signed,
};
use model_core::left_out::{ForceVariable, UnknownForce};
use model_core::real::Real;

const fn force(key: &'static str, what: &'static str, words: &'static str) -> EffectParameter {
    signed(key, "N", what, "-30 to 30").said(words, "N")
}

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "unknown-force",
    what: "A force of no known law: a table of nine points over position or velocity, found from recordings.",
    parameters: &[
        parameter("of_velocity", "1", 0.0, 0.0, "0: over the position, 1: over the velocity", "0 or 1").said("over velocity", ""),
        parameter("from", "m, m/s", -1.0, f64::MIN, "first point of the table", "-0.25").said("from", "m or m/s"),
        parameter("to", "m, m/s", 1.0, f64::MIN, "last point of the table", "0.25").said("to", "m or m/s"),
        force("force_0_N", "force against +x at point 0", "at knot 0"),
        force("force_1_N", "force against +x at point 1", "at knot 1"),
        force("force_2_N", "force against +x at point 2", "at knot 2"),
        force("force_3_N", "force against +x at point 3", "at knot 3"),
        force("force_4_N", "force against +x at point 4", "at knot 4"),
        force("force_5_N", "force against +x at point 5", "at knot 5"),
        force("force_6_N", "force against +x at point 6", "at knot 6"),
        force("force_7_N", "force against +x at point 7", "at knot 7"),
        force("force_8_N", "force against +x at point 8", "at knot 8"),
    ],
    meaning: "unmodelled force, as a table",
    shown_by: "strokes in both directions over the full travel at several constant speeds",
    acts_on: Half::Forces,
    kind: Kind::Unnamed,
    ..PLAIN
};

/// Key of the force at a knot.
pub fn force_key(knot: usize) -> String {
    format!("force_{knot}_N")
}

/// The table.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> UnknownForce<R> {
    let number = |key: &str| EFFECT.number(numbers, key);
    let is_of_velocity = number("of_velocity").value() > 0.5;
    UnknownForce {
        over: if is_of_velocity {
            ForceVariable::Velocity
        } else {
            ForceVariable::Position
        },
        from: number("from"),
        to: number("to"),
        at_knot_n: std::array::from_fn(|knot| number(&force_key(knot))),
    }
}
