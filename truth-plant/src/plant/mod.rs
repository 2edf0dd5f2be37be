//! The plant: gas, valve, carriage and sensors joined and stepped.
//!
//! A step is symmetric (Strang): half a step of the spool, half a step of the
//! gas with the piston at its old speed, a whole step of the carriage under the
//! pressures that the gas then has, half a step of the gas with the piston at
//! its new speed, half a step of the spool. So every part keeps its own
//! method, the volumes follow the position exactly, and the whole is of the
//! second order.

pub mod friction;
pub mod gas;
pub mod heat;
pub mod line;
pub mod mechanics;
pub mod network;
pub mod sensors;
pub mod valve;

use gas::Node;
use mechanics::{Mechanics, MotionState, Push};
use network::{Gas, Motion, Network};
use sensors::{Reality, Sample, SensorState, Sensors, quantised_command_v};
use valve::{Areas, CommandPath, CommandState};

/// Time between two commands.
pub const TICK_S: f64 = 1e-3;
/// Steps between two commands: 25 us.
pub const STEPS_PER_TICK: usize = 40;

/// Everything about an axis that does not change with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Physics {
    /// From command to spool.
    pub command: CommandPath,
    /// The valve's areas.
    pub areas: Areas,
    /// The gas.
    pub network: Network,
    /// The carriage.
    pub mechanics: Mechanics,
    /// The converters.
    pub sensors: Sensors,
}

/// When the second physics of a plant holds, in seconds from the start.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Window {
    /// First moment.
    pub from_s: f64,
    /// Last moment.
    pub to_s: f64,
}

/// How a plant starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Position of the carriage.
    pub position_m: f64,
    /// Pressures of chambers a and b.
    pub pressure_pa: [f64; 2],
    /// Seed of the noise.
    pub seed: u64,
    /// Which of the seed's noises.
    pub recording: usize,
}

/// An axis that can be stepped at 1 kHz by whatever wants to control it.
#[derive(Clone, Debug)]
pub struct Plant {
    usual: Physics,
    changed: Option<(Physics, Window)>,
    steps_per_tick: usize,
    ticks: u64,
    command: CommandState,
    gas: Gas,
    motion: MotionState,
    sensors: SensorState,
}

impl Plant {
    /// A plant at rest.
    pub fn new(physics: Physics, start: Start) -> Self {
        Self::with_steps(physics, None, start, STEPS_PER_TICK)
    }

    /// A plant whose physics is another in a window of time, with a number of
    /// steps between two commands.
    pub fn with_steps(
        usual: Physics,
        changed: Option<(Physics, Window)>,
        start: Start,
        steps_per_tick: usize,
    ) -> Self {
        let at_rest =
            |physics: &Physics| physics.network.at_rest(start.position_m, start.pressure_pa);
        let mut gas = at_rest(&usual);
        if let Some((physics, _)) = &changed {
            // Volumes that only the other physics has wait for it, filled.
            let other = at_rest(physics);
            (gas.tank, gas.silencer) = (other.tank, other.silencer);
        }
        let motion = usual.mechanics.at_rest(start.position_m);
        let reality = reality(&usual, &gas, &motion, 0.0);
        let late_s = changed
            .iter()
            .map(|(physics, _)| physics.sensors.position_late_s)
            .fold(usual.sensors.position_late_s, f64::max);
        let late_steps = libm::ceil(late_s / TICK_S * steps_per_tick as f64) as usize;
        Self {
            command: CommandState::at_rest(usual.areas.null_v),
            sensors: SensorState::at_rest(&reality, late_steps, start.seed, start.recording),
            usual,
            changed,
            steps_per_tick,
            ticks: 0,
            gas,
            motion,
        }
    }

    /// Time since the start.
    pub fn time_s(&self) -> f64 {
        self.ticks as f64 * TICK_S
    }

    /// What the converters read now; each call draws new noise.
    pub fn sample(&mut self) -> Sample {
        let time_s = self.time_s();
        let supply_pa = self.reality().supply_pa;
        let dt_s = TICK_S / self.steps_per_tick as f64;
        let physics = physics_at(&self.usual, &self.changed, time_s);
        self.sensors
            .sample(&physics.sensors, supply_pa, time_s, dt_s)
    }

    /// Holds a command for a tick (as the 12-bit converter puts it out) and
    /// returns what the converters then read.
    pub fn step(&mut self, command_v: f64) -> Sample {
        self.advance(command_v);
        self.sample()
    }

    /// Holds a command for a tick.
    pub fn advance(&mut self, command_v: f64) {
        let start_s = self.time_s();
        let dt_s = TICK_S / self.steps_per_tick as f64;
        let physics = physics_at(&self.usual, &self.changed, start_s);
        self.command.accept(quantised_command_v(command_v));
        for step in 0..self.steps_per_tick {
            let since_tick_s = step as f64 * dt_s;
            let time_s = start_s + since_tick_s;
            let half_s = 0.5 * dt_s;
            self.command
                .advance(&physics.command, since_tick_s, TICK_S, half_s);
            let drift_v = physics.command.drift_v_per_s * time_s;
            let paths = physics.areas.paths(self.command.spool_v() + drift_v);
            let network = &physics.network;
            let gas = network.advance(&self.gas, &paths, piston(&self.motion), time_s, half_s);
            let middle_m = self.motion.position_m + half_s * self.motion.speed_m_per_s;
            let push = push(physics, &gas, middle_m);
            self.motion = physics.mechanics.advance(&self.motion, &push, time_s, dt_s);
            let mut second = piston(&self.motion);
            second.position_m -= half_s * second.speed_m_per_s;
            self.gas = network.advance(&gas, &paths, second, time_s + half_s, half_s);
            self.command
                .advance(&physics.command, since_tick_s + half_s, TICK_S, half_s);
            let reality = reality(physics, &self.gas, &self.motion, time_s + dt_s);
            self.sensors.advance(&physics.sensors, &reality, dt_s);
        }
        self.ticks += 1;
    }

    /// The axis as it is.
    pub fn reality(&self) -> Reality {
        let time_s = self.time_s();
        let physics = physics_at(&self.usual, &self.changed, time_s);
        reality(physics, &self.gas, &self.motion, time_s)
    }

    /// Position of the valve's spool, in volts of command.
    pub fn spool_v(&self) -> f64 {
        self.command.spool_v()
    }

    /// The gas as it is.
    pub fn gas(&self) -> &Gas {
        &self.gas
    }

    /// The motion as it is.
    pub fn motion(&self) -> &MotionState {
        &self.motion
    }
}

fn physics_at<'a>(
    usual: &'a Physics,
    changed: &'a Option<(Physics, Window)>,
    time_s: f64,
) -> &'a Physics {
    match changed {
        Some((physics, window)) if time_s >= window.from_s && time_s < window.to_s => physics,
        _ => usual,
    }
}

fn piston(motion: &MotionState) -> Motion {
    Motion {
        position_m: motion.position_m,
        speed_m_per_s: motion.speed_m_per_s,
    }
}

fn push(physics: &Physics, gas: &Gas, position_m: f64) -> Push {
    let network = &physics.network;
    let [a, b] = [0, 1].map(|chamber| network.chamber(gas, chamber, position_m).pressure_pa);
    let ambient_pa = network.ambient.pressure_pa;
    let [area_a, area_b] = network.cylinder.area_m2;
    Push {
        // A rod, if the areas differ, has the surroundings on its other end.
        force_n: (a - ambient_pa) * area_a - (b - ambient_pa) * area_b,
        mean_gauge_pa: 0.5 * (a + b) - ambient_pa,
        difference_pa: a - b,
    }
}

fn reality(physics: &Physics, gas: &Gas, motion: &MotionState, time_s: f64) -> Reality {
    let network = &physics.network;
    let node = |chamber: usize| -> Node { network.chamber(gas, chamber, motion.position_m) };
    Reality {
        pressure_pa: [node(0).pressure_pa, node(1).pressure_pa],
        supply_pa: network.supply(gas, time_s).pressure_pa,
        position_m: motion.position_m,
        speed_m_per_s: motion.speed_m_per_s,
    }
}
