//! What recordings say of a model of an axis: are they sound ([`inspect`]), how far is the model
//! off ([`compare`]), which numbers fit best ([`identify`]), what the
//! valve's areas are ([`valve_flow`]), and what physics is missing
//! ([`mod@diagnose`]).
//!
//! It knows rigs, recordings and laws (`grey_box`), and neither files of results nor a simulated
//! axis: what an experiment would record is asked of a bank
//! ([`search::next_experiment::Bank`]).

pub mod compare;
pub mod diagnose;
#[cfg(test)]
mod drawn;
pub mod estimate;
pub mod finding;
mod golden_section;
pub mod identify;
pub mod imprecise;
pub mod inspect;
pub mod locate;
pub mod search;
pub mod unlisted;
pub mod valve_flow;
pub mod verdict;
pub mod words;

use grey_box::{
    effects, fit, gauge, laws, model, random, recording, recording_set, rig, signals, text,
};
