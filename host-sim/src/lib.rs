//! The host side of pneuma: rigs, recordings, fits, diagnosis and reports.

pub mod board;
pub mod charts;
pub mod check;
pub mod cli;
pub mod closed_loop;
pub mod compare;
pub mod diagnose;
pub mod fault_campaign;
pub mod identify;
pub mod imprecise;
pub mod init;
pub mod inspect;
pub mod motion;
pub mod output;
pub mod plant;
pub mod report;
pub mod scenario;
pub mod settings;
pub mod simulate;
pub mod trial;
pub mod wire;

pub use grey_box::{effects, fit, laws, model, recording, recording_set, rig, units};
use grey_box::{gauge, lag, random, signals, text};
