//! The scenario file: a rig, where it starts, and what it is commanded.
//!
//! ```toml
//! format = "scenario/1"
//! rig = "../rigs/paper.toml"   # relative to this file; or the rig itself as
//!                              # [rig], [rig.valve], ... with its own format
//! duration_s = 1.5
//! sample_s = 0.001             # from row to row, 0.001 unless said
//! step_s = 0.0005              # integration step, a whole part of sample_s;
//!                              # sample_s unless said
//!
//! [initial]                    # every key may be left out
//! position_m = 0.1             # else the middle of the stroke
//! velocity_m_s = 0.0           # else at rest
//! pressure_a_Pa = 5.2e5        # else where the leaks of the valve at its null
//! pressure_b_Pa = 5.2e5        # balance
//! temperature_K = 293.15       # of both chambers; else ambient
//! command_V = 5.0              # held before t = 0; else the valve's null
//!
//! [[command]]                  # segments, one after the other; each has its
//! kind = "constant"            # own time from 0, and all but the last say how
//! value_V = 5.0                # long they last. One segment may be [command].
//! duration_s = 0.2
//!
//! [[command]]
//! kind = "sine"
//! amplitude_V = 0.5
//! frequency_Hz = 2.0
//!
//! [noise]                      # quantise and disturb the recording as
//! seed = 1                     # [signals] of the rig says; else it is exact
//!
//! [record]
//! states = true                # also T_a_K, T_b_K, friction_N
//! ```
//!
//! | kind | keys |
//! |---|---|
//! | `constant` | `value_V` |
//! | `step` | `at_s`, `from_V`, `to_V` |
//! | `pulses` | `from_V`, `pulses = [{ at_s, duration_s, to_V }, ...]` |
//! | `ramp` | `from_V`, `to_V`, `over_s`, `at_s` (0) |
//! | `sine` | `amplitude_V`, `frequency_Hz`, `center_V` (the null), `phase_rad` (0) |
//! | `chirp` | `amplitude_V`, `from_Hz`, `to_Hz`, `over_s` (the segment's length), `center_V` |
//! | `multisine` | `amplitude_V` of each line, `frequencies_Hz = [...]`, `center_V` |
//! | `table` | `file`: a text table of time in s and command in V, held from row to row |
//!
//! A command changes at rows only: the recorded `u` holds from its row to the
//! next, as a controller's does.

mod command;
mod read;
mod time_grid;

pub(crate) use read::stroke_range_m;

pub use command::{Command, Pulse, Segment, Shape};

pub(crate) use time_grid::on_time_grid;

use crate::rig::{Rig, RigError};
use std::path::PathBuf;

/// The only format there is.
pub const FORMAT: &str = "scenario/1";

/// A scenario that cannot be used: file, line, key, problem, expectation.
pub type ScenarioError = RigError;

/// A scenario as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The file as the caller named it.
    pub name: String,
    /// Where the rig came from: its file, or the scenario's own.
    pub rig_name: String,
    /// The files that the scenario names: its rig's and those of its commands.
    pub files: Vec<PathBuf>,
    /// The rig.
    pub rig: Rig,
    /// How long it lasts, s.
    pub duration_s: f64,
    /// From row to row, s.
    pub sample_s: f64,
    /// Integration steps in a row.
    pub steps_per_sample: u32,
    /// Where it starts.
    pub initial: Initial,
    /// What is commanded.
    pub command: Command,
    /// Seed of the noise; none for an exact recording.
    pub noise_seed: Option<u64>,
    /// Whether the states that no sensor shows are recorded.
    pub records_states: bool,
}

/// `[initial]`; what is absent is at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Initial {
    /// Position, m.
    pub position_m: Option<f64>,
    /// Velocity, m/s.
    pub velocity_m_s: Option<f64>,
    /// Pressure of chamber a, Pa absolute.
    pub pressure_a_pa: Option<f64>,
    /// Pressure of chamber b, Pa absolute.
    pub pressure_b_pa: Option<f64>,
    /// Temperature of the gas in both, K.
    pub temperature_k: Option<f64>,
    /// The command before the first row, V.
    pub command_v: Option<f64>,
}

impl Scenario {
    /// The integration step, s.
    pub fn step_s(&self) -> f64 {
        self.sample_s / f64::from(self.steps_per_sample)
    }

    /// Rows of a simulation that reaches its end.
    pub fn rows(&self) -> usize {
        read::rows(self.duration_s, self.sample_s)
    }
}
