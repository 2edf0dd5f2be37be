//! The host side of pneuma: the simulated axis, the closed loop, the board's other side, trials,
//! reports and the commands.

pub mod board;
pub mod charts;
pub mod check;
pub mod cli;
pub mod closed_loop;
pub mod commission;
pub mod converted;
pub mod experiment;
pub mod fault_campaign;
pub mod fleet;
pub mod fmu;
pub mod hash;
pub mod init;
pub mod knowledge;
pub mod motion;
pub mod output;
pub mod paper;
pub mod plant;
pub mod rehearsal;
pub mod report;
pub mod scenario;
pub mod scope;
pub mod settings;
pub mod side_by_side;
pub mod simulate;
pub mod trial;
pub mod wire;

pub use grey_box::{effects, fit, laws, model, recording, recording_set, rig, units};
use grey_box::{gauge, lag, random, signals, text};
