//! The 5/3 proportional valve: four orifices whose areas follow one command.
//!
//! Ports a and b mirror the same two tables: the command on one side of the
//! null opens supply to one port and the exhaust of the other. Areas are linear
//! between the points of a table over the opening `abs(u - null)`; the first
//! point is the leakage of the closed path, which stays when the path is shut.
//!
//! Neglected here: the spool's own motion, hysteresis and the dependence of the
//! critical ratio on the opening (see [`crate::left_out`]).

mod area_table;
mod curve;
mod orifice;

pub use area_table::{AreaTable, TABLE_CAPACITY, TableFault};
pub use orifice::{FlowLaw, OrificeFlow};

use crate::real::Real;

/// Pressure and temperature of the gas on one side of an orifice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GasState<R> {
    /// Absolute pressure in Pa.
    pub pressure_pa: R,
    /// Temperature in K.
    pub temperature_k: R,
}

/// The valve's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Valve<R> {
    /// Command at which the spool is centred, V.
    pub null_v: R,
    /// Whether port a is fed by commands above the null (else below).
    pub feeds_a_above_null: bool,
    /// Flow law common to the four orifices.
    pub law: FlowLaw<R>,
    /// Areas from the supply to a port over the opening.
    pub supply: AreaTable<R>,
    /// Areas from a port to the exhaust over the opening.
    pub exhaust: AreaTable<R>,
}

/// The four orifice areas at one spool position, m2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAreas<R> {
    /// Supply to port a.
    pub supply_a_m2: R,
    /// Port a to exhaust.
    pub exhaust_a_m2: R,
    /// Supply to port b.
    pub supply_b_m2: R,
    /// Port b to exhaust.
    pub exhaust_b_m2: R,
}

/// Which of the two working ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// The port of chamber a.
    A,
    /// The port of chamber b.
    B,
}

impl<R: Real> Valve<R> {
    /// Opening towards feeding port a, V: positive feeds a and empties b.
    #[inline]
    pub fn opening_towards_a_v(&self, command_v: R) -> R {
        if self.feeds_a_above_null {
            command_v - self.null_v
        } else {
            self.null_v - command_v
        }
    }

    /// The command of an opening towards feeding port a, V.
    #[inline]
    pub fn command_for_opening_v(&self, towards_a_v: R) -> R {
        if self.feeds_a_above_null {
            self.null_v + towards_a_v
        } else {
            self.null_v - towards_a_v
        }
    }

    /// Areas of the four paths at a command (a spool position in volts).
    #[inline]
    pub fn areas(&self, command_v: R) -> PathAreas<R> {
        let opening = self.opening_towards_a_v(command_v);
        let towards_a = opening.max(R::ZERO);
        let towards_b = (-opening).max(R::ZERO);
        PathAreas {
            supply_a_m2: self.supply.area_m2(towards_a),
            exhaust_a_m2: self.exhaust.area_m2(towards_b),
            supply_b_m2: self.supply.area_m2(towards_b),
            exhaust_b_m2: self.exhaust.area_m2(towards_a),
        }
    }

    /// The opening at which `per_supply` times the area of a supply path plus
    /// `per_exhaust` times that of an exhaust path reaches `wanted`; both weights
    /// are taken as nought where they are below. The second value is false where
    /// the fully open valve does not reach it.
    ///
    /// Both tables must have their points at the same openings, as those of a rig
    /// have.
    pub fn opening_for_sum(&self, per_supply: R, per_exhaust: R, wanted: R) -> (R, bool) {
        let per_supply = per_supply.max(R::ZERO) * self.supply.area_scale;
        let per_exhaust = per_exhaust.max(R::ZERO) * self.exhaust.area_scale;
        let sum = |point| {
            per_supply * self.supply.point_area(point)
                + per_exhaust * self.exhaust.point_area(point)
        };
        let (mut above, mut last) = (0, self.supply.last_point());
        if sum(last) < wanted {
            return (self.supply.point_v(last), false);
        }
        while above < last {
            let middle = usize::midpoint(above, last);
            if sum(middle) < wanted {
                above = middle + 1;
            } else {
                last = middle;
            }
        }
        let below = above.saturating_sub(1);
        let (low, high) = (sum(below), sum(above));
        let low_v = self.supply.point_v(below);
        if above == 0 || high <= low {
            return (low_v, true);
        }
        let share = (wanted - low) / (high - low);
        (low_v + share * (self.supply.point_v(above) - low_v), true)
    }
}

#[cfg(test)]
mod tests {
    use crate::paper;

    #[test]
    fn prop_ports_mirror_each_other() {
        let valve = paper::axis::<f64>().valve;
        let above = valve.areas(valve.null_v + 1.5);
        let below = valve.areas(valve.null_v - 1.5);
        assert_eq!(above.supply_a_m2.to_bits(), below.supply_b_m2.to_bits());
        assert_eq!(above.exhaust_b_m2.to_bits(), below.exhaust_a_m2.to_bits());
    }
}
