//! Valve, lines, supply, exhaust and leaks.

pub mod chamber_leakage;
pub mod exhaust_back_pressure;
mod leak;
pub mod piston_leakage;
pub mod port_throttle;
pub mod slew_limit;
pub mod spool_dynamics;
pub mod supply_droop;
pub mod tube_line;
pub mod unknown_opening;
pub mod valve_delay;
pub mod valve_hysteresis;
