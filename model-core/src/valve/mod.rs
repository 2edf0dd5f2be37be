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

/// The command that the inverse found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseFlow<R> {
    /// Valve command, V.
    pub command_v: R,
    /// False where the wanted flow lies beyond what the open valve passes; the
    /// command is then that of the nearest flow.
    pub reached: bool,
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

    /// The command that gives a wanted net mass flow into a port (kg/s), through
    /// the dead zone and against the leakage of both closed paths.
    ///
    /// The net flow grows with the opening towards the port: supply area times
    /// its flow per area, less exhaust area times its own. Where only the
    /// leakage flows, the whole dead zone gives the same flow; the null is
    /// returned there. A pressure outside of exhaust..supply, where one path
    /// runs backwards, is served by the path that still can.
    pub fn command_for_flow(
        &self,
        port: Port,
        wanted_kg_per_s: R,
        chamber: GasState<R>,
        supply: GasState<R>,
        exhaust: GasState<R>,
    ) -> InverseFlow<R> {
        let per_area = |from, to| self.law.flow(R::ONE, from, to).mass_flow_kg_per_s;
        let inflow_per_m2 = per_area(supply, chamber);
        let outflow_per_m2 = per_area(chamber, exhaust);
        let shut_supply_m2 = self.supply.area_m2(R::ZERO);
        let shut_exhaust_m2 = self.exhaust.area_m2(R::ZERO);
        let at_null = inflow_per_m2 * shut_supply_m2 - outflow_per_m2 * shut_exhaust_m2;
        let (opening, reached) = if wanted_kg_per_s > at_null {
            let through_supply = wanted_kg_per_s + outflow_per_m2 * shut_exhaust_m2;
            self.supply.opening_v(through_supply, inflow_per_m2)
        } else if wanted_kg_per_s < at_null {
            let through_exhaust = inflow_per_m2 * shut_supply_m2 - wanted_kg_per_s;
            let (opening, reached) = self.exhaust.opening_v(through_exhaust, outflow_per_m2);
            (-opening, reached)
        } else {
            (R::ZERO, true)
        };
        let towards_a = match port {
            Port::A => opening,
            Port::B => -opening,
        };
        InverseFlow {
            command_v: self.command_for_opening_v(towards_a),
            reached,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const SUPPLY: GasState<f64> = GasState {
        pressure_pa: 7e5,
        temperature_k: 293.15,
    };
    const EXHAUST: GasState<f64> = GasState {
        pressure_pa: 101_325.0,
        temperature_k: 293.15,
    };

    fn net_flow(valve: &Valve<f64>, port: Port, command_v: f64, chamber: GasState<f64>) -> f64 {
        let areas = valve.areas(command_v);
        let (supply, exhaust) = match port {
            Port::A => (areas.supply_a_m2, areas.exhaust_a_m2),
            Port::B => (areas.supply_b_m2, areas.exhaust_b_m2),
        };
        valve.law.flow(supply, SUPPLY, chamber).mass_flow_kg_per_s
            - valve.law.flow(exhaust, chamber, EXHAUST).mass_flow_kg_per_s
    }

    #[test]
    fn prop_inverse_returns_the_command_that_gives_the_flow() {
        let mut valve = paper::axis::<f64>().valve;
        for feeds_a_above_null in [true, false] {
            valve.feeds_a_above_null = feeds_a_above_null;
            for port in [Port::A, Port::B] {
                for pressure_pa in [1.2e5, 3e5, 5.25e5, 6.9e5] {
                    for wanted in [-6e-3, -2e-4, -1e-5, 0.0, 1e-5, 3e-4, 1.2e-3] {
                        let chamber = GasState {
                            pressure_pa,
                            temperature_k: 285.0,
                        };
                        let inverse =
                            valve.command_for_flow(port, wanted, chamber, SUPPLY, EXHAUST);
                        let flow = net_flow(&valve, port, inverse.command_v, chamber);
                        if inverse.reached {
                            assert!((flow - wanted).abs() < 1e-12, "{wanted} at {pressure_pa}");
                        } else {
                            assert!(flow.abs() < wanted.abs(), "{wanted} at {pressure_pa}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn prop_flow_at_full_opening_is_reached_and_more_is_not() {
        let valve = paper::axis::<f64>().valve;
        let chamber = GasState {
            pressure_pa: 4e5,
            temperature_k: 293.15,
        };
        let most = net_flow(&valve, Port::A, 10.0, chamber);
        let inverse = |wanted| valve.command_for_flow(Port::A, wanted, chamber, SUPPLY, EXHAUST);
        assert!(inverse(0.999 * most).reached);
        assert!(!inverse(1.001 * most).reached);
    }

    #[test]
    fn regress_a_path_that_runs_backwards_is_kept_shut() {
        // Compressed above the supply a chamber cannot be filled, nor one below
        // the exhaust be emptied: opening would only do the opposite.
        let valve = paper::axis::<f64>().valve;
        for (pressure_pa, wanted) in [(7.5e5, 1e-3), (0.8e5, -1e-3)] {
            let chamber = GasState {
                pressure_pa,
                temperature_k: 293.15,
            };
            let inverse = valve.command_for_flow(Port::A, wanted, chamber, SUPPLY, EXHAUST);
            assert!(!inverse.reached);
            let found = net_flow(&valve, Port::A, inverse.command_v, chamber);
            for command_v in [0.0, 2.0, 8.0, 10.0] {
                let other = net_flow(&valve, Port::A, command_v, chamber);
                assert!((found - wanted).abs() <= (other - wanted).abs());
            }
        }
    }

    #[test]
    fn prop_ports_mirror_each_other() {
        let valve = paper::axis::<f64>().valve;
        let above = valve.areas(valve.null_v + 1.5);
        let below = valve.areas(valve.null_v - 1.5);
        assert_eq!(above.supply_a_m2.to_bits(), below.supply_b_m2.to_bits());
        assert_eq!(above.exhaust_b_m2.to_bits(), below.exhaust_a_m2.to_bits());
    }
}
