//! Virtual test benches: one experiment for each law of the axis, with the
//! sensors of a laboratory, and the values that an evaluation should return.
//!
//! All benches of a seed carry the same axis: what one of them measures is true
//! on the others. The rig file of a bench is right except for what the bench is
//! there to measure; that is wrong within its `[uncertainty]`, or absent.

mod axis;
mod dead_volume;
mod friction;
mod heat_transfer;
mod machine;
mod motion;
mod presliding;
mod recording;
mod rig;
mod spool;
mod travel;
mod valve_flow;
mod vessel_flow;

use core::fmt;
use core::str::FromStr;
use std::collections::BTreeMap;

use axis::Axis;
pub use motion::{axis_behind_tubes, axis_in_motion};
use recording::Noises;

use crate::random::{Purpose, Random};

/// What a bench measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// Steady flow over command and pressure ratio, with a flow meter.
    ValveFlow,
    /// Areas of the valve from charging and discharging a known volume.
    VesselFlow,
    /// Spool displacement: gain, play, frequency response.
    Spool,
    /// Heat transfer in a chamber by the stop method.
    HeatTransfer,
    /// Sliding friction over speed and chamber pressure.
    Friction,
    /// Bristle stiffness and damping from small displacements.
    Presliding,
    /// Dead volumes of a closed cylinder whose piston is pushed.
    DeadVolume,
}

impl Experiment {
    /// All experiments.
    pub const ALL: [Self; 7] = [
        Self::ValveFlow,
        Self::VesselFlow,
        Self::Spool,
        Self::HeatTransfer,
        Self::Friction,
        Self::Presliding,
        Self::DeadVolume,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ValveFlow => "valve-flow",
            Self::VesselFlow => "vessel-flow",
            Self::Spool => "spool",
            Self::HeatTransfer => "heat-transfer",
            Self::Friction => "friction",
            Self::Presliding => "presliding",
            Self::DeadVolume => "dead-volume",
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// There is no experiment of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownExperiment(pub String);

impl fmt::Display for UnknownExperiment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "unknown bench `{}`: expected one of {}",
            self.0,
            Experiment::ALL.map(Experiment::name).join(", ")
        )
    }
}

impl std::error::Error for UnknownExperiment {}

impl FromStr for Experiment {
    type Err = UnknownExperiment;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|experiment| experiment.name() == name)
            .ok_or_else(|| UnknownExperiment(name.to_owned()))
    }
}

/// A rig file, the recordings of a bench and the truth about them.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchCase {
    /// What the engineer states before the experiment.
    pub rig_toml: String,
    /// Recordings: file name and text.
    pub recordings: Vec<(String, String)>,
    /// Key of the rig file and true value.
    pub truth: BTreeMap<String, f64>,
}

impl BenchCase {
    /// The truth as a flat JSON object.
    ///
    /// # Errors
    /// If a value is not finite.
    pub fn truth_json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(&self.truth)? + "\n")
    }
}

/// What every experiment is drawn from.
struct Setup {
    axis: Axis,
    /// For what this experiment alone draws: settings, errors of the rig file.
    random: Random,
    noises: Noises,
}

/// Draws a bench: equal seeds give equal bytes.
pub fn draw(experiment: Experiment, seed: u64) -> BenchCase {
    let mut setup = Setup::new(experiment, seed);
    match experiment {
        Experiment::ValveFlow => valve_flow::draw(&mut setup),
        Experiment::VesselFlow => vessel_flow::draw(&mut setup),
        Experiment::Spool => spool::draw(&mut setup),
        Experiment::HeatTransfer => heat_transfer::draw(&mut setup),
        Experiment::Friction => friction::draw(&mut setup),
        Experiment::Presliding => presliding::draw(&mut setup),
        Experiment::DeadVolume => dead_volume::draw(&mut setup),
    }
}

impl Setup {
    fn new(experiment: Experiment, seed: u64) -> Self {
        Self {
            axis: Axis::draw(seed),
            // Draws 0 are those of the axis.
            random: Random::new(seed, Purpose::Bench(1 + experiment as usize)),
            noises: Noises::new(seed, experiment as usize),
        }
    }
}

/// The truth of a bench.
fn truth<const COUNT: usize>(values: [(&str, f64); COUNT]) -> BTreeMap<String, f64> {
    values.map(|(key, value)| (key.to_owned(), value)).into()
}

/// A speed or position that changes from 0 to 1 as the share runs from 0 to 1,
/// without a step of its derivative.
fn smooth(share: f64) -> f64 {
    0.5 - 0.5 * libm::cos(core::f64::consts::PI * share.clamp(0.0, 1.0))
}
