//! The host side of pneuma: rigs, recordings, fits, diagnosis and reports.

pub mod board;
pub mod charts;
pub mod cli;
pub mod closed_loop;
pub mod compare;
pub mod diagnose;
pub mod effects;
pub mod fault_campaign;
pub mod fit;
pub mod identify;
pub mod inspect;
mod lag;
pub mod laws;
pub mod model;
pub mod motion;
pub mod plant;
mod random;
pub mod recording;
pub mod report;
pub mod rig;
pub mod scenario;
pub mod settings;
pub mod simulate;
mod text;
pub mod trial;
pub mod units;
pub mod wire;
