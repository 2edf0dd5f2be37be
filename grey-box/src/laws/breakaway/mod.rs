//! Break-aways: what stiction is, read off the moments in which a carriage leaves its place.
//!
//! The model's own bristle is put where the carriage stood and pushed by the recorded gas
//! force. By how much less force it leaves when the carriage did is the residual of an event:
//!
//! ```text
//! residual = f:  instant of the model under F - f = recorded instant,   F = gas force + K way
//! ```
//!
//! (Forces at the two instants would not do: a carriage that has hardly the force to leave takes
//! long about it, and half a newton of noise made that eight.) A carriage that moves expands the
//! gas behind it, so the recorded force falls. K is the air spring: F is the force as it would
//! have been had the carriage not moved, and the model is pushed by F - f - K (its own way).
//! Both instants are read in the same way, off the first millimetre: a bristle gives way little
//! by little, and a seal that has aged forgets on the way, so that neither leaves at its static
//! level.

mod events;
mod push;
mod stand;

pub(super) use events::{Breakaway, PositionReading, breakaways};
pub(super) use push::Recorded;
pub use push::{BREAKAWAY_NOISE_N, KNOWN_TO_N};
pub(super) use stand::Stand;
