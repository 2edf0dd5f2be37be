//! Diagnosis: from recordings to what is missing, how large, and the proof.

pub mod candidates;
pub mod fitted;
pub mod locate;
mod phrase;
pub mod search;
