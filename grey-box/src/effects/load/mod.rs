//! What pushes the carriage, and what hangs on it.

pub mod constant_force;
mod coupling;
pub mod end_cushion;
pub mod force_equation;
pub mod load_backlash;
pub mod load_compliance;
pub mod unknown_force;

/// Where forces act.
const PLACE: &[&str] = &["force-balance"];
