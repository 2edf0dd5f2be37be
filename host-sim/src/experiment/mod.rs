//! The experiment file: what a board is to try by itself, and the envelope that it keeps.
//!
//! ```toml
//! format = "experiment/1"
//!
//! [envelope]                        # as the board measures; leaving it shuts the valve
//! position_m = [-0.15, 0.15]
//! speed_m_s = 1.0
//! pressure_Pa = [5e4, 7.5e5]        # absolute, both chambers
//! force_N = 300.0                   # of the gas
//!
//! [[step]]
//! kind = "move"
//! to_m = 0.0
//! seconds = 2.0
//!
//! [[step]]
//! kind = "chirp"
//! amplitude_V = 0.6                 # from the valve's null
//! from_Hz = 0.5
//! to_Hz = 10.0
//! seconds = 10.0
//! ```

mod read;
mod steps;
mod write;

pub use read::{ExperimentError, parse, read};
pub use write::{FASTEST_M_PER_S, envelope_text, step_text};

use firmware::experiment::{Envelope, Step, frames};

/// What a board runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// The text of its file.
    pub text: String,
    /// What the board keeps.
    pub envelope: Envelope,
    /// What it does, in its own steps.
    pub steps: Vec<Step>,
    /// For each of these the step of the file, from 1, and its kind.
    pub origins: Vec<(usize, &'static str)>,
}

impl Program {
    /// Its length, s.
    pub fn seconds(&self) -> f64 {
        self.steps
            .iter()
            .map(|step| f64::from(step.seconds()))
            .sum()
    }

    /// By which a board knows it.
    pub fn crc(&self) -> u32 {
        let bytes: Vec<u8> = self.steps.iter().flat_map(Step::bytes).collect();
        frames::crc(&self.envelope, &bytes)
    }

    /// A step of the board in words: `step 2 (chirp)`.
    pub fn name_of(&self, place: usize) -> String {
        let origin = self.origins.get(place);
        origin.map_or_else(
            || format!("step {}", place + 1),
            |(number, kind)| format!("step {number} ({kind})"),
        )
    }
}
