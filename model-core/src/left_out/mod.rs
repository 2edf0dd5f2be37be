//! Physics that the paper's model leaves out, one file per effect.
//!
//! Each effect is a parameter group whose neutral value switches it off
//! exactly, so that models are nested: a fair refit with and without it
//! compares like with like, and an improved model goes onto the chip as
//! parameters, not as code.

mod carriage_effects;
mod chamber_leakage;
mod direction_dependent_friction;
mod dwell_stiction;
mod end_cushion;
mod friction_terms;
mod load_coupling;
mod position_dependent_friction;
mod slew_limit;
mod spool_dynamics;
mod tube_line;
mod valve_delay;
mod valve_hysteresis;

pub use carriage_effects::CarriageEffects;
pub use chamber_leakage::ChamberLeakage;
pub use direction_dependent_friction::DirectionDependentFriction;
pub use dwell_stiction::{DwellStiction, FORGETTING_WAY_M};
pub use end_cushion::EndCushion;
pub use friction_terms::FrictionTerms;
pub use load_coupling::{LoadCoupling, LoadState, Reaction};
pub use position_dependent_friction::PositionDependentFriction;
pub use slew_limit::SlewLimit;
pub use spool_dynamics::{SpoolDynamics, SpoolState, SpoolTransition};
pub use tube_line::{TubeLine, TubeState};
pub use valve_delay::{DELAY_CAPACITY, DelayLine, ValveDelay};
pub use valve_hysteresis::ValveHysteresis;
