//! Axis, controller and observer as a functional mock-up unit: what other simulation tools step.
//!
//! | file | what |
//! |---|---|
//! | `kind` | plant, controller, observer |
//! | `variables` | the variables of a unit, as its rig makes them |
//! | `component` | one unit at work: values in, a tick, values out |
//! | `part` | what is inside: the plant, the control task, the observer |
//! | `description` | `modelDescription.xml` by FMI 2.0 and 3.0 |
//! | `archive` | the file `.fmu` |
//!
//! The interface of FMI itself, in C, is the crate `fmu`; it calls [`Component`] and nothing else.
//!
//! * All quantities are SI, pressures absolute. What a converter shows carries the converter's
//!   steps, so a plant and a controller that are coupled tick by tick give the same bytes as
//!   `pneuma loop`: in a tick the plant runs under the command that the controller had at its
//!   beginning, and the controller answers the sensors of its beginning.
//! * Nothing passes through a unit at once: what is set at a communication point shows in the
//!   outputs of the next.

mod archive;
mod component;
mod description;
mod kind;
mod part;
mod variables;

pub use archive::{ArchiveError, pack};
pub use component::{Component, Refusal};
pub use description::{Standard, model_description, token};
pub use kind::Kind;
pub use variables::{Causality, Type, Variable, variables};

/// The name of the library in the archive, and what tools call the model's code.
pub const LIBRARY: &str = "pneuma_fmu";
/// The rig in the archive, in its folder `resources`.
pub const RIG_FILE: &str = "rig.toml";
/// What the unit is, there too.
pub const KIND_FILE: &str = "kind.txt";
/// Time of a tick: the only communication step, s.
pub const TICK_S: f64 = crate::plant::PlantSettings::TICK_S;
