//! The C interface of FMI 2.0 and 3.0 (co-simulation) for the units that `pneuma fmu` writes.
//!
//! | file | what |
//! |---|---|
//! | `instance` | a unit that a tool holds: what is in its archive, what it is told, what it says |
//! | `pointers` | what a tool's pointers point to, as slices and texts |
//! | `fmi2` | the functions of FMI 2.0.5 |
//! | `fmi3` | the functions of FMI 3.0.2 |
//!
//! The functions only translate: what a unit does is `host_sim::fmu`. No panic leaves the library:
//! it becomes the status *fatal*. Functions for what `modelDescription.xml` does not offer (model
//! exchange, clocks, derivatives, serialised states) answer *error*.
//!
//! Why not a library for it: `fmi-export` 0.3 makes one unit of one Rust type, with the names and
//! starts of its variables in the source; here they come from a rig file, and one library serves
//! three kinds of unit and both standards.

mod fmi2;
mod fmi3;
mod instance;
mod pointers;
