//! The rig's parameters on the board: what they are, whether they are
//! possible, how they are kept and how they get there.
//!
//! | room | responsibility |
//! |---|---|
//! | `parameters` | [`Settings`], plain numbers, each said once |
//! | `gains` | [`Gains`], the controller's section: numbers, ranges, both ways |
//! | `effects` | [`PneumaticEffects`], [`MechanicalEffects`]: left-out physics, as `gains` |
//! | `check` | the judgement, by name and range: [`SettingsFault`] |
//! | `build` | [`Settings::try_build`]: to the controller, off the control path |
//! | [`record`] | bytes with version, length and CRC |
//! | [`slots`] | two places, one always whole |
//! | [`transfer`] | over the serial wire, in pieces, swapped in at rest |
//!
//! Values that no rig can have never reach the controller: every way in, from a
//! slot or from the wire, goes through [`Settings::try_build`].

mod build;
mod check;
mod effects;
mod field;
mod gains;
mod mechanics;
mod parameters;
pub mod record;
mod sensors;
pub mod slots;
pub mod transfer;

pub use check::NULL_V;
pub use effects::{MechanicalEffects, PneumaticEffects};
pub use field::{Field, SettingsFault};
pub use gains::Gains;
pub use mechanics::{Carriage, Friction, FrictionTerms};
pub use parameters::{
    Ambient, Chamber, Chambers, Column, CommandPath, Connection, Gas, Settings, Thermal, Tube,
    Valve, Wiring,
};
pub use sensors::Sensors;

#[cfg(test)]
mod tests;
