//! What the converters make of the axis: lag, offset, skew, noise, steps.

use std::collections::VecDeque;

use crate::random::{Purpose, Random, Signal};

/// The sensors' laws.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Lag of the chamber pressures, of the first order.
    pub pressure_lag_s: f64,
    /// A second lag behind the first.
    pub second_pressure_lag_s: f64,
    /// Offsets of the chamber pressures.
    pub pressure_offset_pa: [f64; 2],
    /// Gains of the chamber pressures.
    pub pressure_gain: [f64; 2],
    /// Gain of the position.
    pub position_gain: f64,
    /// How much position and speed come late.
    pub position_late_s: f64,
    /// A periodic error of the position: amplitude and period.
    pub position_wave_m: [f64; 2],
    /// Deviation of the pressures' noise.
    pub pressure_noise_pa: f64,
    /// Deviation of the position's noise.
    pub position_noise_m: f64,
    /// Deviation of the speed's noise.
    pub speed_noise_m_per_s: f64,
}

/// Steps of the converters, as the rig files declare them.
pub const PRESSURE_STEP_PA: f64 = 244.0;
/// Step of the position's converter.
pub const POSITION_STEP_M: f64 = 7.6e-6;
/// Full scale and codes of the command's converter.
pub const COMMAND_FULL_V: f64 = 10.0;
const COMMAND_CODES: f64 = 4095.0;

/// The command that the converter puts out: the nearest of 4096.
pub fn quantised_command_v(command_v: f64) -> f64 {
    let code = libm::round(command_v / COMMAND_FULL_V * COMMAND_CODES);
    code.clamp(0.0, COMMAND_CODES) * COMMAND_FULL_V / COMMAND_CODES
}

fn quantised(value: f64, step: f64) -> f64 {
    libm::round(value / step) * step
}

/// The axis as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reality {
    /// Pressures of chambers a and b.
    pub pressure_pa: [f64; 2],
    /// Pressure in front of the valve.
    pub supply_pa: f64,
    /// Position of the carriage.
    pub position_m: f64,
    /// Its speed.
    pub speed_m_per_s: f64,
}

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start.
    pub time_s: f64,
    /// Measured pressures of chambers a and b.
    pub pressure_pa: [f64; 2],
    /// Measured pressure in front of the valve.
    pub supply_pa: f64,
    /// Measured position.
    pub position_m: f64,
    /// Measured speed.
    pub speed_m_per_s: f64,
}

/// What the sensors remember.
#[derive(Clone, Debug)]
pub(crate) struct SensorState {
    lagged_pa: [f64; 2],
    twice_lagged_pa: [f64; 2],
    /// Position and speed of the past steps, the newest first.
    past: VecDeque<(f64, f64)>,
    noise: Noise,
}

#[derive(Clone, Debug)]
struct Noise {
    pressure: [Random; 2],
    supply: Random,
    position: Random,
    speed: Random,
}

impl SensorState {
    /// `late_steps` is the longest skew in steps of the plant.
    pub(crate) fn at_rest(
        reality: &Reality,
        late_steps: usize,
        seed: u64,
        recording: usize,
    ) -> Self {
        let stream = |signal: Signal| Random::new(seed, Purpose::Noise(recording, signal));
        Self {
            lagged_pa: reality.pressure_pa,
            twice_lagged_pa: reality.pressure_pa,
            past: vec![(reality.position_m, reality.speed_m_per_s); late_steps + 1].into(),
            noise: Noise {
                pressure: [stream(Signal::PressureA), stream(Signal::PressureB)],
                supply: stream(Signal::SupplyPressure),
                position: stream(Signal::Position),
                speed: stream(Signal::Velocity),
            },
        }
    }

    pub(crate) fn advance(&mut self, sensors: &Sensors, reality: &Reality, dt_s: f64) {
        for port in 0..2 {
            let keep = |lag_s: f64| {
                if lag_s > 0.0 {
                    libm::exp(-dt_s / lag_s)
                } else {
                    0.0
                }
            };
            let toward = |target: f64, now: f64, keep: f64| target + (now - target) * keep;
            self.lagged_pa[port] = toward(
                reality.pressure_pa[port],
                self.lagged_pa[port],
                keep(sensors.pressure_lag_s),
            );
            self.twice_lagged_pa[port] = toward(
                self.lagged_pa[port],
                self.twice_lagged_pa[port],
                keep(sensors.second_pressure_lag_s),
            );
        }
        self.past.pop_back();
        self.past
            .push_front((reality.position_m, reality.speed_m_per_s));
    }

    pub(crate) fn sample(
        &mut self,
        sensors: &Sensors,
        supply_pa: f64,
        time_s: f64,
        dt_s: f64,
    ) -> Sample {
        let late = libm::round(sensors.position_late_s / dt_s) as usize;
        let (position_m, speed_m_per_s) = self.past[late.min(self.past.len() - 1)];
        let [wave_m, period_m] = sensors.position_wave_m;
        let wrong_m = wave_m * libm::sin(2.0 * core::f64::consts::PI * position_m / period_m);
        let noise = &mut self.noise;
        let [gain_a, gain_b] = sensors.pressure_gain;
        let pressure = |true_pa: f64, offset_pa: f64, random: &mut Random| {
            let noisy_pa = true_pa + offset_pa + sensors.pressure_noise_pa * random.normal();
            quantised(noisy_pa, PRESSURE_STEP_PA)
        };
        let [random_a, random_b] = &mut noise.pressure;
        Sample {
            time_s,
            pressure_pa: [
                pressure(
                    gain_a * self.twice_lagged_pa[0],
                    sensors.pressure_offset_pa[0],
                    random_a,
                ),
                pressure(
                    gain_b * self.twice_lagged_pa[1],
                    sensors.pressure_offset_pa[1],
                    random_b,
                ),
            ],
            supply_pa: pressure(supply_pa, 0.0, &mut noise.supply),
            position_m: quantised(
                sensors.position_gain * position_m
                    + wrong_m
                    + sensors.position_noise_m * noise.position.normal(),
                POSITION_STEP_M,
            ),
            speed_m_per_s: speed_m_per_s + sensors.speed_noise_m_per_s * noise.speed.normal(),
        }
    }
}
