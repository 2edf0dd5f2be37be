//! `unknown-force`: a force that no law of this library explains, as a table.
//!
//! ```text
//! F = Fx(x) + Fv(v)   against +x, each piecewise linear between nine knots
//! ```
//!
//! Source: none; it is what recordings asked for. A diagnosis fits it where
//! something is missing at the force balance and no effect with a name explains
//! it, so that the improved model holds at least its shape: a spring, a cable, a
//! guide that pinches (over the position), drag that grows with the square of the
//! speed (over the velocity). Beyond its ends a table holds its last value: nothing
//! was recorded there. It is no friction: at rest it pushes. Confused with every
//! friction law; a law with a name is to be preferred.

use crate::real::Real;

/// Knots of a table: eight pieces, four on either side of a middle.
pub const KNOTS: usize = 9;

/// A table whose ends meet is a step; in the variable's unit.
const LEAST_REACH: f64 = 1e-9;

/// A force over one variable, piecewise linear between evenly spaced knots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceTable<R> {
    /// Variable at the first knot.
    pub from: R,
    /// Variable at the last knot; over `from`.
    pub to: R,
    /// Force at each knot, N; all 0 is neutral.
    pub force_n: [R; KNOTS],
}

impl<R: Real> ForceTable<R> {
    /// No force.
    pub fn neutral() -> Self {
        Self {
            from: -R::ONE,
            to: R::ONE,
            force_n: [R::ZERO; KNOTS],
        }
    }

    /// Whether there is no force.
    pub fn is_neutral(&self) -> bool {
        self.force_n.iter().all(|force_n| *force_n == R::ZERO)
    }

    /// The force at a value of the variable, N.
    pub fn at(&self, variable: R) -> R {
        let pieces = R::from_f64((KNOTS - 1) as f64);
        let reach = (self.to - self.from).max(R::from_f64(LEAST_REACH));
        let place = (variable - self.from) / reach * pieces;
        let mut force = self.force_n[0];
        for (knot, pair) in self.force_n.windows(2).enumerate() {
            let share = (place - R::from_f64(knot as f64)).clamp(R::ZERO, R::ONE);
            force += share * (pair[1] - pair[0]);
        }
        force
    }
}

/// The force over position and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnknownForce<R> {
    /// Fx over the position, m.
    pub by_position: ForceTable<R>,
    /// Fv over the velocity, m/s.
    pub by_velocity: ForceTable<R>,
}

impl<R: Real> UnknownForce<R> {
    /// No force.
    pub fn neutral() -> Self {
        Self {
            by_position: ForceTable::neutral(),
            by_velocity: ForceTable::neutral(),
        }
    }

    /// Whether there is no force.
    pub fn is_neutral(&self) -> bool {
        self.by_position.is_neutral() && self.by_velocity.is_neutral()
    }

    /// The force against +x, N.
    pub fn force_n(&self, position_m: R, velocity_m_per_s: R) -> R {
        let mut force = R::ZERO;
        if !self.by_position.is_neutral() {
            force += self.by_position.at(position_m);
        }
        if !self.by_velocity.is_neutral() {
            force += self.by_velocity.at(velocity_m_per_s);
        }
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_table_goes_through_its_knots_and_holds_its_ends() {
        let table = ForceTable {
            from: -0.2_f64,
            to: 0.2,
            force_n: [8.0, 4.0, 2.0, 1.0, 0.0, -1.0, -2.0, -4.0, -9.0],
        };
        for (knot, force_n) in table.force_n.iter().enumerate() {
            let x = -0.2 + 0.05 * knot as f64;
            assert!((table.at(x) - force_n).abs() < 1e-12, "at {x}");
        }
        assert!((table.at(-0.175) - 6.0).abs() < 1e-12);
        assert!((table.at(0.19) + 8.0).abs() < 1e-12);
        assert!((table.at(-7.0) - 8.0).abs() < 1e-12);
        assert!((table.at(7.0) + 9.0).abs() < 1e-12);
    }

    #[test]
    fn prop_both_tables_add_up_and_ends_that_meet_are_a_step() {
        let force = UnknownForce {
            by_position: ForceTable {
                from: 0.1_f64,
                to: 0.1,
                force_n: [3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0],
            },
            by_velocity: ForceTable {
                force_n: [-1.0; KNOTS],
                ..ForceTable::neutral()
            },
        };
        assert!((force.force_n(0.09, 0.3) - 2.0).abs() < 1e-12);
        assert!((force.force_n(0.11, 0.3) - 4.0).abs() < 1e-12);
        assert!(UnknownForce::<f32>::neutral().is_neutral());
    }
}
