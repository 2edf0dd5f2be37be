//! The fault campaign: everything of the fault list happens to a running axis,
//! at several moments, and hard motion without a fault must not trip.
//!
//! | file | what |
//! |---|---|
//! | `case` | what is done to samples, supply or board |
//! | `run` | one fault at one moment of a motion, and what came of it |
//! | `both` | two controllers that must answer alike: the host's and the firmware in QEMU |
//! | `normal` | hard motion with everything that is no fault |
//! | `wiring` | an axis that is wired the wrong way round, from its first start on |
//! | `table` | reaction times, in words |

mod both;
mod case;
mod normal;
mod run;
mod table;
mod wiring;

pub use both::Both;
pub use case::{CASES, Case, Disturbance};
pub use normal::{NORMAL_RUN_S, NormalRun, normal_run};
pub use run::{Moment, Outcome, Supervised, run_case};
pub use table::{fault_list, reaction_table, wiring_row};
pub use wiring::{FirstStart, Wiring, first_start};
