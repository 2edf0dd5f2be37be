//! From a board with a rig file to an axis that is diagnosed, improved and scored.
//!
//! | file | what it holds |
//! |---|---|
//! | `programs` | the experiments of the way |
//! | [`score`] | what a score run comes to |
//! | `sheet` | the acceptance sheet |
//! | [`steps`] | the steps in their order, and what is done of them |
//! | [`wiring`] | which way round the axis answers |

pub mod programs;
pub mod score;
pub mod sheet;
pub mod steps;
pub mod wiring;
