//! What no effect of the list explains: the input or the force that would explain it, as a table
//! over a variable, and as an equation where one does as well.

pub mod equation;
pub(crate) mod missing_force;
mod missing_input;
pub(crate) mod unknown_input;
pub mod unknown_term;
