//! Numbers of a rig file from bench experiments, each with its deviation.
//!
//! The paper gets its model from experiments on parts of the axis: the valve on a flow meter, the
//! spool on a displacement sensor, the gas by the stop method, the carriage on a friction rig. Here
//! each of these is a function from a rig and its recordings to an [`Outcome`]: numbers under the
//! keys of the rig file, the stretches of the recordings that they came from, and pictures.
//!
//! | experiment | recorded | numbers |
//! |---|---|---|
//! | [`friction`] | constant speeds; force, or both pressures | Stribeck curve, its growth with pressure |
//! | [`presliding`] | small displacements and reversals; force | stiffness and damping of the bristles |
//! | [`heat_transfer`] | charging or discharging, stopped at once | heat transfer, gas temperature |
//! | [`dead_volume`] | plugged ports, piston at several places | dead volumes |
//! | [`valve_flow`] | a flow meter's points, or a vessel that fills | areas, null, critical pressure ratio; ISO 6358 |
//! | [`spool`] | command and spool | null, gain, play, natural frequency, damping, rate limit, delay |
//!
//! Deviations are of two parts, in quadrature: what the points of the recordings leave open
//! (scaled by what they leave, [`least_squares`]), and what the stated uncertainties of the rig do
//! to the result ([`stated`]).

pub mod dead_volume;
pub mod fixed_volume;
pub mod flow_point;
pub mod friction;
pub mod heat_transfer;
pub mod iso6358;
pub mod least_squares;
pub mod outcome;
pub mod presliding;
pub mod settling;
pub mod sines;
pub mod spool;
pub mod stated;
pub mod steady;
mod text;
pub mod valve_flow;

pub use outcome::{Curve, Kind, Number, Outcome, Picture, Scale, Stretch};

use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;

/// An experiment of this bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// Flow of the valve's paths.
    ValveFlow,
    /// The spool behind its command.
    Spool,
    /// Heat transfer by the stop method.
    HeatTransfer,
    /// Friction at constant speeds.
    Friction,
    /// Friction before break-away.
    Presliding,
    /// Dead volumes of plugged chambers.
    DeadVolume,
}

impl Experiment {
    /// All experiments, by the names of `pneuma identify`.
    pub const ALL: [(&'static str, Self); 6] = [
        ("valve-flow", Self::ValveFlow),
        ("spool", Self::Spool),
        ("heat-transfer", Self::HeatTransfer),
        ("friction", Self::Friction),
        ("presliding", Self::Presliding),
        ("dead-volume", Self::DeadVolume),
    ];

    /// The experiment of a name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|(known, _)| *known == name)
            .map(|(_, experiment)| experiment)
    }

    /// Whether recordings of a valve's flow are of a bench, with a flow meter or a vessel: of an axis
    /// in motion the chambers are the flow meter, which is another evaluation.
    pub fn is_of_bench(rig: &Rig, recordings: &[Recording]) -> bool {
        rig.vessel.is_some() || recordings.iter().all(|one| one.signal("flow_a").is_some())
    }

    /// Evaluates recordings of it.
    ///
    /// # Errors
    /// One line on what rig or recordings lack.
    pub fn evaluate(self, rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
        let (measure, depends_on): (stated::Measure, &[&str]) = match self {
            Self::ValveFlow => (valve_flow::measure, valve_flow::DEPENDS_ON),
            Self::Spool => (spool::measure, &[]),
            Self::HeatTransfer => (heat_transfer::measure, heat_transfer::DEPENDS_ON),
            Self::Friction => (friction::measure, friction::DEPENDS_ON),
            Self::Presliding => (presliding::measure, presliding::DEPENDS_ON),
            Self::DeadVolume => (dead_volume::measure, dead_volume::DEPENDS_ON),
        };
        stated::with_what_is_stated(rig, tracks, measure, depends_on)
    }
}
