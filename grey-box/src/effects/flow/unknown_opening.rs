//! A valve opening that is off by no known law.

use crate::effects::declaration::{
    Effect, EffectParameter, Kind, Numbers, PLAIN, parameter, signed,
};
use model_core::left_out::{KNOTS, knots};
use model_core::real::Real;

const fn shift(key: &'static str, what: &'static str, words: &'static str) -> EffectParameter {
    signed(key, "V", what, "-0.2 to 0.2").said(words, "V")
}

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "unknown-opening",
    what: "A valve opening that differs from the stated one by no known law: a table of nine points over the opening, evenly spaced over its square root, found from recordings.",
    parameters: &[
        parameter("from", "V", 0.0, 0.0, "first point of the table", "0").said("from", "V"),
        parameter("to", "V", 1.0, 0.0, "last point of the table", "5").said("to", "V"),
        shift("shift_0_V", "shift of the opening at point 0", "at knot 0"),
        shift("shift_1_V", "shift of the opening at point 1", "at knot 1"),
        shift("shift_2_V", "shift of the opening at point 2", "at knot 2"),
        shift("shift_3_V", "shift of the opening at point 3", "at knot 3"),
        shift("shift_4_V", "shift of the opening at point 4", "at knot 4"),
        shift("shift_5_V", "shift of the opening at point 5", "at knot 5"),
        shift("shift_6_V", "shift of the opening at point 6", "at knot 6"),
        shift("shift_7_V", "shift of the opening at point 7", "at knot 7"),
        shift("shift_8_V", "shift of the opening at point 8", "at knot 8"),
    ],
    meaning: "unmodelled error of the valve opening, as a table",
    shown_by: "strokes in both directions at several constant commands from the dead zone to fully open",
    kind: Kind::Unnamed,
    ..PLAIN
};

/// Key of the shift at a knot.
pub fn shift_key(knot: usize) -> String {
    format!("shift_{knot}_V")
}

/// Where the knots lie, V: evenly over the opening's root, as most commands open a little and few
/// altogether.
pub fn opening_knots<R: Real>(from: R, to: R) -> [R; KNOTS] {
    knots(from.sqrt(), to.sqrt()).map(|root| root * root)
}

/// First and last knot, V, and the shift at each, V; `None` where all are nought.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> Option<(R, R, [R; KNOTS])> {
    if !numbers.holds(EFFECT.name) {
        return None;
    }
    let number = |key: &str| EFFECT.number(numbers, key);
    let shifts_v: [R; KNOTS] = std::array::from_fn(|knot| number(&shift_key(knot)));
    let is_off = shifts_v.iter().any(|shift_v| *shift_v != R::ZERO);
    is_off.then(|| (number("from"), number("to"), shifts_v))
}
