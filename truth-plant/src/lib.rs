//! A servo-pneumatic axis whose truth is known, and a generator of recordings
//! of it: what a diagnosis of left-out physics is judged by.
//!
//! It shares no code, no formulation and no integrator with `model-core`: gas
//! is mass and energy, tubes are finite volumes, the carriage is stepped by the
//! implicit midpoint rule, all at 25 us. Same seed, same bytes, on every machine.
//!
//! - [`plant`]: the axis, steppable at 1 kHz by a controller;
//! - [`effects`]: what an axis may hold beyond the laws of its rig file;
//! - [`case`]: rig file, recordings and truth, drawn from a seed;
//! - [`fleet`]: axes that record every night while one thing in them goes wrong;
//! - [`mod@bench`]: the test benches on which single laws of the axis are measured.

pub mod bench;
pub mod case;
pub mod effects;
pub mod fleet;
pub mod plant;
mod random;

pub use case::{Case, Kind, Nature, Onset, Request, TrueEffect, Truth, draw};
pub use effects::{Form, Strength};
pub use plant::sensors::Sample;
pub use plant::{Plant, Window};
