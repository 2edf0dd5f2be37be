//! `unknown-force`: a force that no law of this library explains, as a table.
//!
//! ```text
//! F = F(x)  or  F = F(v)   against +x, piecewise linear between nine even knots
//! ```
//!
//! Source: none; it is what recordings asked for. A diagnosis fits it where
//! something is missing at the force balance and no effect with a name explains
//! it, so that the improved model holds at least its shape: a spring, a cable, a
//! guide that pinches (over the position), drag that grows with the square of the
//! speed (over the velocity). Beyond its ends the table goes on as its last piece does,
//! for half of its reach, and then stays: nothing was recorded there, but a spring does
//! not end where the recordings did. It is no friction: at rest it pushes. Confused with every
//! friction law; a law with a name is to be preferred.

use crate::real::Real;

/// Knots of the table: eight pieces, four on either side of a middle.
pub const KNOTS: usize = 9;

/// A table has some reach; in the variable's unit.
const LEAST_REACH: f64 = 1e-9;

/// Pieces for which the table goes on beyond its ends.
const GOES_ON: f64 = 4.0;

/// What the force is a table of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceVariable {
    /// The position, m.
    Position,
    /// The velocity, m/s.
    Velocity,
}

/// The force over one variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnknownForce<R> {
    /// The variable.
    pub over: ForceVariable,
    /// Variable at the first knot.
    pub from: R,
    /// Variable at the last knot; over `from`.
    pub to: R,
    /// Force at each knot, N; all 0 is neutral.
    pub at_knot_n: [R; KNOTS],
}

impl<R: Real> UnknownForce<R> {
    /// No force.
    pub fn neutral() -> Self {
        Self {
            over: ForceVariable::Position,
            from: -R::ONE,
            to: R::ONE,
            at_knot_n: [R::ZERO; KNOTS],
        }
    }

    /// Whether there is no force.
    pub fn is_neutral(&self) -> bool {
        self.at_knot_n.iter().all(|force_n| *force_n == R::ZERO)
    }

    /// The force against +x, N.
    pub fn force_n(&self, position_m: R, velocity_m_per_s: R) -> R {
        if self.is_neutral() {
            return R::ZERO;
        }
        let variable = match self.over {
            ForceVariable::Position => position_m,
            ForceVariable::Velocity => velocity_m_per_s,
        };
        over_knots(self.from, self.to, &self.at_knot_n, variable)
    }
}

/// Where the even knots from `from` to `to` lie.
pub fn knots<R: Real>(from: R, to: R) -> [R; KNOTS] {
    core::array::from_fn(|knot| from + R::from_f64(knot as f64 / (KNOTS - 1) as f64) * (to - from))
}

/// A table over [`knots`] from `from` to `to`, piecewise linear; beyond its ends it goes on as its
/// last piece does, for half of its reach, and then stays.
pub fn over_knots<R: Real>(from: R, to: R, at_knot: &[R; KNOTS], variable: R) -> R {
    let pieces = R::from_f64((KNOTS - 1) as f64);
    let reach = (to - from).max(R::from_f64(LEAST_REACH));
    let place = (variable - from) / reach * pieces;
    let mut value = at_knot[0];
    for (knot, pair) in at_knot.windows(2).enumerate() {
        let least = if knot == 0 { -GOES_ON } else { 0.0 };
        let most = if knot == KNOTS - 2 {
            1.0 + GOES_ON
        } else {
            1.0
        };
        let share = place - R::from_f64(knot as f64);
        let share = share.clamp(R::from_f64(least), R::from_f64(most));
        value += share * (pair[1] - pair[0]);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_table_goes_through_its_knots_and_on_for_half_its_reach() {
        let table = UnknownForce {
            over: ForceVariable::Velocity,
            from: -0.2_f64,
            to: 0.2,
            at_knot_n: [8.0, 4.0, 2.0, 1.0, 0.0, -1.0, -2.0, -4.0, -9.0],
        };
        let at = |velocity| table.force_n(3.0, velocity);
        for (velocity, force_n) in knots(table.from, table.to).into_iter().zip(table.at_knot_n) {
            assert!((at(velocity) - force_n).abs() < 1e-12, "at {velocity}");
        }
        assert!((knots(table.from, table.to)[1] + 0.15).abs() < 1e-12);
        assert!((at(-0.175) - 6.0).abs() < 1e-12);
        assert!((at(0.19) + 8.0).abs() < 1e-12);
        assert!((at(-0.25) - 12.0).abs() < 1e-12);
        assert!((at(0.25) + 14.0).abs() < 1e-12);
        assert!((at(-7.0) - 24.0).abs() < 1e-12);
        assert!((at(7.0) + 29.0).abs() < 1e-12);
    }

    #[test]
    fn prop_ends_that_meet_leave_the_force_finite() {
        let table = UnknownForce {
            from: 0.1_f64,
            to: 0.1,
            at_knot_n: [3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0],
            ..UnknownForce::neutral()
        };
        // 3 N at the first knot, and four pieces more of 3 N each.
        assert!((table.force_n(0.09, 7.0) - 15.0).abs() < 1e-12);
        assert!((table.force_n(0.11, 7.0) - 25.0).abs() < 1e-12);
        assert!(UnknownForce::<f32>::neutral().is_neutral());
    }
}
