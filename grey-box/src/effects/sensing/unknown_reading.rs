//! A gauge that errs by no known law.

use super::OF_A_SENSOR;
use crate::effects::declaration::{
    Effect, EffectParameter, Kind, Numbers, PLAIN, parameter, signed,
};
use crate::side::Side;
use model_core::left_out::KNOTS;
use model_core::real::Real;

const fn error(key: &'static str, what: &'static str, words: &'static str) -> EffectParameter {
    signed(key, "Pa", what, "-10000 to 10000").said(words, "kPa")
}

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "unknown-reading",
    what: "A pressure gauge that errs by no known law: a table of nine points over the pressure, found from recordings. It stays off the board.",
    parameters: &[
        parameter("from", "Pa", 0.0, 0.0, "first point of the table", "1e5").said("from", "kPa"),
        parameter("to", "Pa", 1e6, 0.0, "last point of the table", "7e5").said("to", "kPa"),
        error("error_a_0_Pa", "reading less pressure of chamber A at point 0", "gauge A at knot 0"),
        error("error_a_1_Pa", "reading less pressure of chamber A at point 1", "gauge A at knot 1"),
        error("error_a_2_Pa", "reading less pressure of chamber A at point 2", "gauge A at knot 2"),
        error("error_a_3_Pa", "reading less pressure of chamber A at point 3", "gauge A at knot 3"),
        error("error_a_4_Pa", "reading less pressure of chamber A at point 4", "gauge A at knot 4"),
        error("error_a_5_Pa", "reading less pressure of chamber A at point 5", "gauge A at knot 5"),
        error("error_a_6_Pa", "reading less pressure of chamber A at point 6", "gauge A at knot 6"),
        error("error_a_7_Pa", "reading less pressure of chamber A at point 7", "gauge A at knot 7"),
        error("error_a_8_Pa", "reading less pressure of chamber A at point 8", "gauge A at knot 8"),
        error("error_b_0_Pa", "reading less pressure of chamber B at point 0", "gauge B at knot 0"),
        error("error_b_1_Pa", "reading less pressure of chamber B at point 1", "gauge B at knot 1"),
        error("error_b_2_Pa", "reading less pressure of chamber B at point 2", "gauge B at knot 2"),
        error("error_b_3_Pa", "reading less pressure of chamber B at point 3", "gauge B at knot 3"),
        error("error_b_4_Pa", "reading less pressure of chamber B at point 4", "gauge B at knot 4"),
        error("error_b_5_Pa", "reading less pressure of chamber B at point 5", "gauge B at knot 5"),
        error("error_b_6_Pa", "reading less pressure of chamber B at point 6", "gauge B at knot 6"),
        error("error_b_7_Pa", "reading less pressure of chamber B at point 7", "gauge B at knot 7"),
        error("error_b_8_Pa", "reading less pressure of chamber B at point 8", "gauge B at knot 8"),
    ],
    meaning: "unmodelled gauge error, as a table",
    shown_by: "both chambers at rest and connected, from ambient to supply pressure, with a reference gauge",
    kind: Kind::Unnamed,
    off_board: OF_A_SENSOR,
    ..PLAIN
};

/// Key of the error at a knot of a gauge's table.
pub fn error_key(side: Side, knot: usize) -> String {
    format!("error_{}_{knot}_Pa", side.letter())
}

/// First and last knot, Pa, and the error of a chamber's gauge at each, Pa; `None` where
/// neither rig nor fit has the table.
pub fn law<R: Real>(numbers: &impl Numbers<R>, side: Side) -> Option<(R, R, [R; KNOTS])> {
    if !numbers.holds(EFFECT.name) {
        return None;
    }
    let number = |key: &str| EFFECT.number(numbers, key);
    let errors_pa = std::array::from_fn(|knot| number(&error_key(side, knot)));
    Some((number("from"), number("to"), errors_pa))
}
