//! Friction of seals and guides.

pub mod coulomb;
pub mod direction_dependent;
pub mod dwell_stiction;
pub mod position_dependent;
pub mod pressure_dependent;
pub mod stribeck;
pub mod viscous;

/// Where all of it acts.
const PLACE: &[&str] = &["force-balance"];
