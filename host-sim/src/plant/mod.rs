//! The simulated world that a controller is connected to.
//!
//! Responsibilities: the rig's axis in double precision with what lies between
//! it and a controller: converters and their noise, the valve's 12-bit
//! converter, one tick from a sample to its command, the spool, end stops, and
//! what happens to an axis in service ([`Event`]).
//!
//! | file | what |
//! |---|---|
//! | `world` | the axis in its surroundings, shared with the open-loop simulation |
//! | `converters` | from truth to codes, from a code to the valve |
//! | `event` | payload, supply and force that change at a time |
//!
//! * Turn order as on the link: [`Plant::sample`], then [`Plant::advance`] with
//!   the command that answers it; the command acts one tick after its sample.
//! * A rig without `effects.spool-dynamics` has a spool of 100 Hz and damping
//!   0.7, the data sheet's.
//! * The same rig, settings and commands give the same bytes.
//!
//! Limits: an end stop takes all speed away; there are no cushions. The time
//! skew of a position sensor is that of its rig where the position is late; a
//! position that is early has no cause in a plant and is refused.

mod converters;
mod event;
mod world;

pub use converters::{Seen, coded, command_code, seen, usual_noise_and_step, valve_v};
pub use event::{Change, Event};
pub use world::{Sample, World};
pub(crate) use world::{axis, equilibrium_pa, supply_pressure_pa};

use crate::model::{AxisFault, Side};
use crate::rig::Rig;
use crate::scenario::stroke_range_m;
use crate::settings::sensors;
use converters::Converters;
use firmware::codes::{AdcCodes, DacCode, POSITION_M, Scale};
use firmware::sensing::Sensing;
use model_core::axis::AxisState;
use model_core::carriage::CarriageState;
use std::collections::BTreeMap;

/// Natural frequency of the spool where a rig does not state one: the data
/// sheet's -3 dB, Hz.
const SPOOL_FREQUENCY_HZ: f64 = 100.0;
/// Its damping: the middle of 0.6..0.9, in which such spools lie.
const SPOOL_DAMPING: f64 = 0.7;

/// How a plant is run.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantSettings {
    /// From sample to sample, s.
    pub tick_s: f64,
    /// Integration steps in a tick.
    pub steps_per_tick: u32,
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// Where the carriage rests at the beginning, m.
    pub start_m: f64,
    /// What happens, and when.
    pub events: Vec<Event>,
}

impl PlantSettings {
    /// The tick of the controllers here.
    pub const TICK_S: f64 = 1e-3;

    /// At rest at a place, undisturbed.
    ///
    /// Five steps of 0.2 ms: against 40 steps the tracking errors of a controller
    /// differ by less than 0.3 %.
    pub fn at(start_m: f64, seed: u64) -> Self {
        Self {
            tick_s: Self::TICK_S,
            steps_per_tick: 5,
            seed,
            start_m,
            events: Vec::new(),
        }
    }
}

/// A plant.
#[derive(Clone, Debug)]
pub struct Plant {
    world: World,
    converters: Converters,
    sensing: Sensing,
    settings: PlantSettings,
    stroke_m: [f64; 2],
    tick: u64,
    command_v: f64,
    end_stop: Option<EndStop>,
}

/// The first time that the carriage ran against the end of its stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndStop {
    /// When, s.
    pub time_s: f64,
    /// Where, m.
    pub position_m: f64,
}

impl Plant {
    /// The rig's plant at rest, the valve at its null.
    pub fn new(rig: &Rig, settings: PlantSettings) -> Result<Self, AxisFault> {
        let rig = &with_spool(rig);
        let step_s = settings.tick_s / f64::from(settings.steps_per_tick);
        let axis = axis(rig, step_s)?;
        let supply_pressure_pa = supply_pressure_pa(rig)?;
        let stroke_m =
            stroke_range_m(rig).ok_or_else(|| AxisFault::missing("cylinder.position_zero"))?;
        check_scale(stroke_m, settings.start_m)?;
        let rests_pa = |side| {
            // Where nothing flows every pressure stays; an axis that has run
            // stands somewhere between its two ends.
            let between_pa = 0.5 * (supply_pressure_pa + axis.pneumatics.ambient.pressure_pa);
            equilibrium_pa(rig, &axis, supply_pressure_pa, side).unwrap_or(between_pa)
        };
        let state = AxisState::at_rest(
            settings.start_m,
            rests_pa(Side::A),
            rests_pa(Side::B),
            axis.supply_temperature_k,
            axis.valve.null_v,
        );
        Ok(Self {
            command_v: axis.valve.null_v,
            converters: Converters::new(rig, settings.seed, settings.tick_s)?,
            sensing: Sensing::new(&sensors(rig)?, settings.tick_s as f32),
            world: World::new(rig, axis, state, supply_pressure_pa),
            settings,
            stroke_m,
            tick: 0,
            end_stop: None,
        })
    }

    /// Time of the present tick, s.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.settings.tick_s
    }

    /// What the sensors show now, on the scales of the link. Each call draws new noise.
    pub fn sample(&mut self) -> AdcCodes {
        let codes = self.codes_of_sensors();
        self.sensing.shown(&codes)
    }

    /// What a board's converters say now of the sensors that the rig has, `[board.SIGNAL]`.
    pub fn codes_of_sensors(&mut self) -> AdcCodes {
        self.converters.codes(&self.truth())
    }

    /// What no converter shows: the world now, with the command that holds from
    /// here to the next tick.
    pub fn truth(&self) -> Sample {
        self.world.sample(self.time_s(), self.command_v)
    }

    /// The first hit of an end stop, if there was one.
    pub fn end_stop(&self) -> Option<EndStop> {
        self.end_stop
    }

    /// One tick's time under the present command; then `command`, the answer to
    /// the present sample, takes over.
    pub fn advance(&mut self, command: DacCode) {
        self.advance_held();
        self.command_v = valve_v(command);
    }

    /// One tick's time under the present command, which stays.
    pub fn advance_held(&mut self) {
        let begin_s = self.time_s();
        for step in 1..=self.settings.steps_per_tick {
            let end_s = begin_s + f64::from(step) * self.world.axis.dt_s;
            for event in &self.settings.events {
                event.apply(&mut self.world, end_s);
            }
            self.world.step(self.command_v, end_s);
            self.stop_at_ends(end_s);
        }
        self.tick += 1;
    }

    /// Another command from now on; one that the valve has already leaves it as it is, though no
    /// code stands for it (the null before the first command).
    pub fn command(&mut self, command_v: f64) {
        if command_v.to_bits() != self.command_v.to_bits() {
            self.command_v = valve_v(command_code(command_v));
        }
    }

    /// Something changes now and stays.
    pub fn change(&mut self, change: Change) {
        change.apply(&mut self.world);
    }

    /// The ends of the stroke take the speed away.
    fn stop_at_ends(&mut self, time_s: f64) {
        let position_m = self.world.state.carriage.position_m.value;
        let [low, high] = self.stroke_m;
        if (low..=high).contains(&position_m) {
            return;
        }
        let stopped_m = if position_m < low { low } else { high };
        self.world.state.carriage = CarriageState::new(stopped_m, 0.0);
        self.end_stop.get_or_insert(EndStop {
            time_s,
            position_m: stopped_m,
        });
    }
}

/// The rig with the data sheet's spool, unless it states its own.
fn with_spool(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    rig.effects
        .entry("spool-dynamics".into())
        .or_insert_with(|| {
            BTreeMap::from([
                ("natural_frequency_Hz".into(), SPOOL_FREQUENCY_HZ),
                ("damping_ratio".into(), SPOOL_DAMPING),
            ])
        });
    rig
}

/// The link's position scale is fixed: a stroke beyond it would be cut off.
fn check_scale(stroke_m: [f64; 2], start_m: f64) -> Result<(), AxisFault> {
    let Scale { lowest, highest } = POSITION_M;
    let [low, high] = stroke_m;
    let fault = |key: &str, problem, expected| AxisFault {
        key: key.into(),
        problem,
        expected,
    };
    if low < f64::from(lowest) || high > f64::from(highest) {
        return Err(fault(
            "cylinder.stroke_m",
            format!("reaches from {low} m to {high} m"),
            format!(
                "a stroke within {lowest} m to {highest} m, the link's position scale: \
                 position_zero = \"mid-stroke\" for strokes up to {} m",
                highest - lowest
            ),
        ));
    }
    if !(low..=high).contains(&start_m) {
        return Err(fault(
            "start",
            format!("{start_m} m is beyond the stroke"),
            format!("a place from {low} m to {high} m"),
        ));
    }
    Ok(())
}
