//! What recordings say of a model of an axis: are they sound ([`inspect`]), how far is the model
//! off ([`compare`]), which numbers fit best ([`identify`]), what the
//! valve's areas are ([`valve_flow`]), and what physics is missing
//! ([`mod@diagnose`]).
//!
//! A room stands on those above it only:
//!
//! | room | what it answers |
//! |---|---|
//! | [`inspect`], [`valve_flow`] | what the recordings say by themselves; the valve's areas without a table |
//! | [`imprecise`] | how well numbers are known that no rig file states a deviation for |
//! | [`estimate`] | a law's model fitted to recordings, its noise, what counts as missed |
//! | [`locate`] | where and when a model parts from the recordings |
//! | [`search`] | which effects explain that, how sure, from which size on, what to record next |
//! | [`unlisted`] | what no effect explains, as an input, a table, an equation |
//! | [`finding`] | what was found of a law, frozen, and what held-out recordings say of it |
//! | [`verdict`] | all laws' findings as one verdict; its numbers, sentences, notes |
//! | [`mod@diagnose`] | the stages in their order |
//! | [`compare`], [`identify`] | the same estimate without a search |
//! | [`response`] | amplitude and phase over frequency, recorded and predicted |
//! | [`welch`] | spectra of windows of a signal |
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
pub mod response;
pub mod search;
pub mod thresholds;
pub mod unlisted;
pub mod valve_flow;
pub mod verdict;
pub mod welch;
pub mod words;

use grey_box::{
    effects, fit, gauge, laws, model, random, recording, recording_set, rig, signals, text,
};
