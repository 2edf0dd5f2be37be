//! Physics that the paper's model leaves out, one file per effect.
//!
//! Each effect is a parameter group whose neutral value switches it off
//! exactly, so that models are nested: a fair refit with and without it
//! compares like with like, and an improved model goes onto the chip as
//! parameters, not as code.

mod chamber_leakage;
mod direction_dependent_friction;
mod dwell_stiction;
mod elastic_buffer;
mod end_cushion;
mod exhaust_back_pressure;
mod force_equation;
mod friction_terms;
mod load_coupling;
mod piston_leakage;
mod port_throttle;
mod position_dependent_friction;
mod slew_limit;
mod spool_dynamics;
mod supply_droop;
mod tube_line;
mod unknown_force;
mod valve_delay;
mod valve_hysteresis;
mod variable_heat_transfer;
mod volume_node;
mod wall_temperature;

pub use chamber_leakage::ChamberLeakage;
pub use direction_dependent_friction::DirectionDependentFriction;
pub use dwell_stiction::{DwellStiction, FORGETTING_WAY_M};
pub use elastic_buffer::ElasticBuffer;
pub use end_cushion::EndCushion;
pub use exhaust_back_pressure::{ExhaustBackPressure, SilencerState};
pub use force_equation::ForceEquation;
pub use friction_terms::FrictionTerms;
pub use load_coupling::{LoadCoupling, LoadState, Reaction};
pub use piston_leakage::{Crossing, PistonLeakage};
pub use port_throttle::PortThrottle;
pub use position_dependent_friction::{FrictionZone, PositionDependentFriction};
pub use slew_limit::SlewLimit;
pub use spool_dynamics::{SpoolDynamics, SpoolState, SpoolTransition};
pub use supply_droop::{SupplyDroop, TankState};
pub use tube_line::{Passed, PortFlow, TubeEnd, TubeLine, TubeState};
pub use unknown_force::{ForceVariable, KNOTS, UnknownForce, knots, over_knots};
pub use valve_delay::{DELAY_CAPACITY, DelayLine, ValveDelay};
pub use valve_hysteresis::ValveHysteresis;
pub use variable_heat_transfer::{REFERENCE_DENSITY_KG_PER_M3, VariableHeatTransfer};
pub use wall_temperature::WallTemperature;
