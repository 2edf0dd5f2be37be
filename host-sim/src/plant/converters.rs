//! From truth to converter codes: the sensors' effects, their noise, and the
//! steps of the converters.

use super::Sample;
use crate::effects::sensing::{position_time_skew, pressure_sensor_lag};
use crate::gauge::Gauge;
use crate::lag::followed;
use crate::model::{AxisFault, Side, Values};
use crate::random::Noise;
use crate::rig::{BoardChannel, Rig};
use firmware::codes::{
    AdcCode, AdcCodes, COMMAND_V, DacCode, FAILED_CONVERSION, POSITION_M, PRESSURE_PA, Scale,
    VELOCITY_M_PER_S,
};

/// Noise of a position sensor where the rig does not state it, m.
const POSITION_NOISE_M: f64 = 4e-6;
/// Noise of a pressure sensor where the rig does not state it, Pa.
const PRESSURE_NOISE_PA: f64 = 250.0;
/// Noise of a velocity sensor where the rig does not state it, m/s.
const VELOCITY_NOISE_M_PER_S: f64 = 1.5e-3;

/// Codes between the steps of a 16-bit and of a 12-bit converter.
const STEP_16_BIT: f64 = 1.0;
const STEP_12_BIT: f64 = 16.0;

/// Noise of a sensor at a board, where nobody states it, and the step of its converter, SI; none for
/// what no converter measures.
pub fn usual_noise_and_step(signal: &str) -> Option<[f64; 2]> {
    let step = |scale: &Scale, codes: f64| {
        codes * (f64::from(scale.highest) - f64::from(scale.lowest)) / f64::from(u16::MAX)
    };
    match signal {
        "p_a" | "p_b" | "p_s" => Some([PRESSURE_NOISE_PA, step(&PRESSURE_PA, STEP_12_BIT)]),
        "x" => Some([POSITION_NOISE_M, step(&POSITION_M, STEP_16_BIT)]),
        "v" => Some([VELOCITY_NOISE_M_PER_S, step(&VELOCITY_M_PER_S, STEP_16_BIT)]),
        _ => None,
    }
}

/// What the codes say, SI, in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Position, m.
    pub position_m: f64,
    /// Pressure of chamber a, Pa absolute.
    pub pressure_a_pa: f64,
    /// Pressure of chamber b, Pa absolute.
    pub pressure_b_pa: f64,
    /// Supply pressure, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Velocity, m/s.
    pub velocity_m_s: f64,
}

/// What codes say.
pub fn seen(codes: &AdcCodes) -> Seen {
    Seen {
        position_m: value(&POSITION_M, codes.position.0),
        pressure_a_pa: value(&PRESSURE_PA, codes.pressure_a.0),
        pressure_b_pa: value(&PRESSURE_PA, codes.pressure_b.0),
        supply_pressure_pa: value(&PRESSURE_PA, codes.supply_pressure.0),
        velocity_m_s: value(&VELOCITY_M_PER_S, codes.velocity.0),
    }
}

/// What the valve's 12-bit converter puts out for a code, V.
pub fn valve_v(code: DacCode) -> f64 {
    const LOW_BITS: u16 = 0xF;
    value(&COMMAND_V, code.0 & !LOW_BITS)
}

/// The nearest codes for what converters are told to see, in the order of the link: the inverse of
/// [`seen`]. What is no number is a failed conversion.
pub fn coded(values: [f64; 5]) -> AdcCodes {
    let scales = [
        POSITION_M,
        PRESSURE_PA,
        PRESSURE_PA,
        PRESSURE_PA,
        VELOCITY_M_PER_S,
    ];
    let mut codes = [FAILED_CONVERSION.0; 5];
    for ((code, scale), value) in codes.iter_mut().zip(&scales).zip(values) {
        if !value.is_nan() {
            let last = f64::from(FAILED_CONVERSION.0) - STEP_16_BIT;
            *code = nearest(scale, value).min(last) as u16;
        }
    }
    AdcCodes::from_array(codes)
}

/// The nearest code for a voltage at the valve.
pub fn command_code(command_v: f64) -> DacCode {
    DacCode(nearest(&COMMAND_V, command_v) as u16)
}

/// The whole code nearest to a value, on the scale.
fn nearest(scale: &Scale, value: f64) -> f64 {
    let (lowest, highest) = (f64::from(scale.lowest), f64::from(scale.highest));
    let full = f64::from(u16::MAX);
    ((value - lowest) / (highest - lowest) * full)
        .round()
        .clamp(0.0, full)
}

fn value(scale: &Scale, code: u16) -> f64 {
    let (lowest, highest) = (f64::from(scale.lowest), f64::from(scale.highest));
    lowest + (highest - lowest) * f64::from(code) / f64::from(u16::MAX)
}

/// One sensor and its converter.
#[derive(Clone, Debug)]
struct Converter {
    /// What it shows; `None` where there is no sensor, and nothing at the terminal.
    scale: Option<Scale>,
    codes_per_step: f64,
    noise: Noise,
    deviation: f64,
}

impl Converter {
    fn new(rig: &Rig, seed: u64, channel: &Channel) -> Self {
        let declared = rig.signals.get(channel.signal);
        let input = BoardChannel::of(channel.signal);
        Self {
            scale: input.and_then(|input| rig.board_scale(input)),
            codes_per_step: channel.codes_per_step,
            noise: Noise::new(seed, channel.stream),
            deviation: declared
                .and_then(|signal| signal.noise)
                .unwrap_or(channel.noise),
        }
    }

    /// The code of a value with new noise; the ends of the scale beyond it, and
    /// never the code of a failed conversion.
    fn code(&mut self, value: f64) -> AdcCode {
        let Some(scale) = &self.scale else {
            return AdcCode(0);
        };
        let noisy = value + self.deviation * self.noise.normal();
        let (lowest, highest) = (f64::from(scale.lowest), f64::from(scale.highest));
        let place = (noisy - lowest) / (highest - lowest) * f64::from(u16::MAX);
        let code = (place / self.codes_per_step).round() * self.codes_per_step;
        let last = f64::from(FAILED_CONVERSION.0) - self.codes_per_step;
        AdcCode(code.clamp(0.0, last.max(0.0)) as u16)
    }
}

/// What a converter is made from.
struct Channel {
    signal: &'static str,
    codes_per_step: f64,
    noise: f64,
    stream: u64,
}

const fn pressure(signal: &'static str, stream: u64) -> Channel {
    Channel {
        signal,
        codes_per_step: STEP_12_BIT,
        noise: PRESSURE_NOISE_PA,
        stream,
    }
}

const POSITION: Channel = Channel {
    signal: "x",
    codes_per_step: STEP_16_BIT,
    noise: POSITION_NOISE_M,
    stream: 0,
};
const PRESSURE_A: Channel = pressure("p_a", 1);
const PRESSURE_B: Channel = pressure("p_b", 2);
const SUPPLY_PRESSURE: Channel = pressure("p_s", 3);
const VELOCITY: Channel = Channel {
    signal: "v",
    codes_per_step: STEP_16_BIT,
    noise: VELOCITY_NOISE_M_PER_S,
    stream: 4,
};

/// All five, with what lies between the axis and them.
#[derive(Clone, Debug)]
pub(super) struct Converters {
    position: Converter,
    pressure_a: Converter,
    pressure_b: Converter,
    supply_pressure: Converter,
    velocity: Converter,
    lag: PressureLag,
    gauges: [Gauge<f64>; 2],
    skew: PositionSkew,
}

impl Converters {
    pub(super) fn new(rig: &Rig, seed: u64, tick_s: f64) -> Result<Self, AxisFault> {
        let converter = |channel| Converter::new(rig, seed, channel);
        Ok(Self {
            position: converter(&POSITION),
            pressure_a: converter(&PRESSURE_A),
            pressure_b: converter(&PRESSURE_B),
            supply_pressure: converter(&SUPPLY_PRESSURE),
            velocity: converter(&VELOCITY),
            lag: PressureLag::new(rig, tick_s),
            gauges: Side::BOTH.map(|side| Gauge::of(&Values::of(rig), side)),
            skew: PositionSkew::new(rig)?,
        })
    }

    /// What the converters say of this instant.
    pub(super) fn codes(&mut self, truth: &Sample) -> AdcCodes {
        let [lagged_a_pa, lagged_b_pa] = self.lag.shown([truth.pressure_a_pa, truth.pressure_b_pa]);
        let [gauge_a, gauge_b] = &self.gauges;
        AdcCodes {
            position: self.position.code(self.skew.shown_m(truth)),
            pressure_a: self.pressure_a.code(gauge_a.shows_pa(lagged_a_pa)),
            pressure_b: self.pressure_b.code(gauge_b.shows_pa(lagged_b_pa)),
            supply_pressure: self.supply_pressure.code(truth.supply_pressure_pa),
            velocity: self.velocity.code(truth.velocity_m_s),
        }
    }
}

/// `effects.pressure-sensor-lag`: first order, tick by tick.
#[derive(Clone, Copy, Debug)]
struct PressureLag {
    lag_s: f64,
    tick_s: f64,
    /// The exact pressures and the shown ones of the tick before.
    before_pa: Option<[[f64; 2]; 2]>,
}

impl PressureLag {
    fn new(rig: &Rig, tick_s: f64) -> Self {
        Self {
            lag_s: pressure_sensor_lag::time_constant_s(&Values::of(rig)),
            tick_s,
            before_pa: None,
        }
    }

    fn shown(&mut self, exact_pa: [f64; 2]) -> [f64; 2] {
        let [from, shown] = self.before_pa.unwrap_or([exact_pa; 2]);
        let step = |place: usize| {
            let way = (from[place], exact_pa[place]);
            followed(shown[place], way, self.lag_s, self.tick_s)
        };
        let shown_pa = [step(0), step(1)];
        self.before_pa = Some([exact_pa, shown_pa]);
        shown_pa
    }
}

/// `effects.position-time-skew`: the position of a moment ago, by the speed.
#[derive(Clone, Copy, Debug)]
struct PositionSkew {
    delay_s: f64,
}

impl PositionSkew {
    fn new(rig: &Rig) -> Result<Self, AxisFault> {
        let delay_s = position_time_skew::delay_s(&Values::of(rig));
        if delay_s >= 0.0 {
            return Ok(Self { delay_s });
        }
        Err(AxisFault {
            key: "effects.position-time-skew.delay_s".into(),
            problem: format!("{delay_s} s: a position that is early"),
            expected: "0 or more: no sensor shows what is to come".into(),
        })
    }

    fn shown_m(&self, truth: &Sample) -> f64 {
        truth.position_m - self.delay_s * truth.velocity_m_s
    }
}
