//! `[board.SIGNAL]`: the sensors at a board's terminals, where they are not those that the
//! scales of its link were made for.
//!
//! A sensor puts out a voltage, or a current through the terminal's resistor; its range says
//! what that means. Both make the scale of the board's converter, from its lowest code to its
//! highest.

use firmware::codes::{
    BIPOLAR_INPUT_V, POSITION_M, PRESSURE_INPUT_V, PRESSURE_PA, SHUNT_OHM, Scale, VELOCITY_M_PER_S,
};

use super::Rig;
use super::facts::{Facts, Limits, facts, limits};

/// What a sensor puts out at the two ends of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// `output_V`.
    Volts([f64; 2]),
    /// `output_mA`, through the terminal's resistor.
    Milliamperes([f64; 2]),
}

impl Output {
    /// The voltages at the terminal.
    pub fn volts(self) -> [f64; 2] {
        match self {
            Self::Volts(ends) => ends,
            Self::Milliamperes(ends) => ends.map(|current| current * 1e-3 * f64::from(SHUNT_OHM)),
        }
    }
}

/// A sensor at a terminal, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoardSensor {
    /// `sensor = "none"`.
    Absent,
    /// One whose reading is a straight line.
    Linear(LinearSensor),
}

/// A sensor whose reading is a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSensor {
    /// What it puts out at the ends of its range.
    pub output: Output,
    /// Its range in the unit of the signal.
    pub range: [f64; 2],
    /// `sensor = "gauge"`: it counts from the ambient pressure.
    pub is_gauge: bool,
}

/// An analogue input of a board.
pub struct BoardChannel {
    /// The signal, as in `[signals]`.
    pub signal: &'static str,
    /// The key of the range.
    pub range_key: &'static str,
    /// What ends of the range may be.
    pub limits: Limits,
    /// What the converter shows of the sensor that its link was made for.
    standard: Scale,
    /// Volts at the terminal at the ends of the converter.
    pub input_v: Scale,
    /// A board does without.
    pub may_be_absent: bool,
    /// There is room for a resistor across the terminal.
    pub takes_current: bool,
}

const BOARD_PRESSURE: Limits = limits(-1e5, 1e8, "Pa from -100 kPa to 100 MPa");

const fn pressure(signal: &'static str, may_be_absent: bool) -> BoardChannel {
    BoardChannel {
        signal,
        range_key: "range_Pa",
        limits: BOARD_PRESSURE,
        standard: PRESSURE_PA,
        input_v: PRESSURE_INPUT_V,
        may_be_absent,
        takes_current: true,
    }
}

/// The inputs there are.
pub const BOARD_CHANNELS: [BoardChannel; 5] = [
    BoardChannel {
        signal: "x",
        range_key: "range_m",
        limits: limits(-5.0, 5.0, "m from -5 to 5, 0 at mid-stroke"),
        standard: POSITION_M,
        input_v: BIPOLAR_INPUT_V,
        may_be_absent: false,
        takes_current: true,
    },
    pressure("p_a", false),
    pressure("p_b", false),
    pressure("p_s", true),
    BoardChannel {
        signal: "v",
        range_key: "range_m_s",
        limits: limits(-50.0, 50.0, "m/s from -50 to 50"),
        standard: VELOCITY_M_PER_S,
        input_v: BIPOLAR_INPUT_V,
        may_be_absent: true,
        takes_current: false,
    },
];

/// The keys of a sensor, for the reference; that of the range has a name for each signal.
#[rustfmt::skip]
pub(super) const BOARD_KEYS: [(&str, Facts); 4] = [
    ("output_V", facts("V", "[0, 10]", "what the sensor puts out at the ends of its range: 0 to 10 V for a pressure, -10 to 10 V for `x` and `v` at the most", "data sheet of the sensor")),
    ("output_mA", facts("mA", "[4, 20]", "in place of `output_V`, not for `v`: the same of a sensor that puts out a current, through 500 Ohm across the terminal", "data sheet of the sensor")),
    ("range_Pa, range_m, range_m_s", facts("Pa, m, m/s", "[0, 1e6]", "what it measures at these ends, in the unit of its signal; `x` is 0 at mid-stroke", "data sheet of the sensor")),
    ("sensor", facts("", "\"gauge\"", "\"absolute\" unless stated; \"gauge\" for a pressure that counts from the ambient pressure (`environment.pressure_Pa`); \"none\" without any other key: `v` is worked out from `x`, `p_s` is taken to be `supply.pressure_Pa`", "data sheet of the sensor")),
];

/// Currents of a sensor.
pub(super) const CURRENT_MA: Limits = limits(0.0, 20.0, "mA from 0 to 20");

impl BoardChannel {
    /// The input of a signal.
    pub fn of(signal: &str) -> Option<&'static Self> {
        BOARD_CHANNELS.iter().find(|one| one.signal == signal)
    }

    /// Whether its signal is a pressure.
    pub fn is_pressure(&self) -> bool {
        self.range_key == "range_Pa"
    }

    /// The voltages that it takes.
    pub(super) fn input_limits(&self) -> Limits {
        if self.input_v.lowest < 0.0 {
            limits(
                -10.0,
                10.0,
                "V from -10 to 10, which the board's input takes",
            )
        } else {
            limits(0.0, 10.0, "V from 0 to 10, which the board's input takes")
        }
    }
}

impl Rig {
    /// What the board's converter of a signal shows at its lowest code and its highest; `None` where
    /// there is no sensor.
    pub fn board_scale(&self, channel: &BoardChannel) -> Option<Scale> {
        let sensor = match self.board.get(channel.signal) {
            None => return Some(channel.standard),
            Some(BoardSensor::Absent) => return None,
            Some(BoardSensor::Linear(sensor)) => sensor,
        };
        let zero = if sensor.is_gauge {
            self.ambient_pressure_pa()
        } else {
            0.0
        };
        let (output_v, range) = (sensor.output.volts(), sensor.range);
        let slope = (range[1] - range[0]) / (output_v[1] - output_v[0]);
        let at = |input_v| (zero + range[0] + (f64::from(input_v) - output_v[0]) * slope) as f32;
        let input = &channel.input_v;
        Some(Scale::new(at(input.lowest), at(input.highest)))
    }
}

/// What a sensor's table holds, in writing order.
pub(super) fn stated(channel: &BoardChannel, sensor: &BoardSensor) -> Vec<(&'static str, Stated)> {
    let BoardSensor::Linear(sensor) = sensor else {
        return vec![("sensor", Stated::Word("none"))];
    };
    let output = match sensor.output {
        Output::Volts(ends) => ("output_V", Stated::Ends(ends)),
        Output::Milliamperes(ends) => ("output_mA", Stated::Ends(ends)),
    };
    let range = (channel.range_key, Stated::Ends(sensor.range));
    let kind = sensor.is_gauge.then_some(("sensor", Stated::Word("gauge")));
    [output, range].into_iter().chain(kind).collect()
}

/// A value of a sensor's table.
pub(super) enum Stated {
    Ends([f64; 2]),
    Word(&'static str),
}
