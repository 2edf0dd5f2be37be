//! A plant for measuring the firmware: the paper's axis behind converters, at the
//! other end of the link. Without noise and without delay; how well the axis
//! tracks is not measured here.

use crate::qemu::Machine;
use crate::shell::Outcome;
use firmware::codes::{AdcCodes, COMMAND_V, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S};
use firmware::cost::Report;
use firmware::frame::{self, Decoder, Received};
use firmware::link::{self, CommandRecord};
use firmware::tick::Sample;
use model_core::axis::{Axis, AxisInputs, AxisState};
use model_core::paper;
use model_core::reference::Reference;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// How long QEMU may take to listen, and the firmware to answer.
const PATIENCE: Duration = Duration::from_secs(20);

/// The plant's end of the link.
#[derive(Debug)]
pub struct Link {
    stream: TcpStream,
    decoder: Decoder,
}

impl Link {
    /// Connects, and takes the controller's greeting.
    pub fn connect(machine: &Machine) -> Outcome<Self> {
        let stream = machine.connect(PATIENCE)?;
        let mut link = Self {
            stream,
            decoder: Decoder::new(),
        };
        let greeting = link.receive()?;
        link::hello_tick_period_ns(&greeting).ok_or("the controller's greeting is none")?;
        Ok(link)
    }

    /// Sends bytes as they are.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> Outcome {
        let sent = self.stream.write_all(bytes);
        sent.map_err(|error| format!("the link broke: {error}").into())
    }

    /// Sends a payload.
    pub fn send(&mut self, payload: &[u8]) -> Outcome {
        let frame = frame::encode(payload).ok_or("a payload is too long for a frame")?;
        self.send_bytes(&frame)
    }

    /// The next payload.
    pub fn receive(&mut self) -> Outcome<Vec<u8>> {
        let mut byte = [0];
        loop {
            let read = self.stream.read_exact(&mut byte);
            read.map_err(|error| format!("the controller does not answer: {error}"))?;
            if let Received::Payload(payload) = self.decoder.feed(byte[0]) {
                return Ok(payload.to_vec());
            }
        }
    }

    /// Sends a sample and returns its answer, byte for byte.
    pub fn exchange(&mut self, sample: &Sample) -> Outcome<Vec<u8>> {
        self.send(&link::sample(sample))?;
        self.receive()
    }

    /// Ends the run and returns what the firmware tells of itself.
    pub fn end(mut self) -> Outcome<Report> {
        self.send(&link::end())?;
        let payload = self.receive()?;
        let report = Report::read(&payload);
        report.ok_or_else(|| "the controller's report is none".into())
    }
}

/// The axis and its converters.
#[derive(Debug)]
pub struct Plant {
    axis: Axis<f64>,
    state: AxisState<f64>,
    tick: u32,
}

impl Default for Plant {
    /// At rest at mid-stroke, both chambers at the same pressure.
    fn default() -> Self {
        let axis = paper::axis::<f64>();
        let rest_pa = 0.6 * paper::SUPPLY_PRESSURE_PA;
        let rest = (axis.supply_temperature_k, axis.valve.null_v);
        Self {
            axis,
            state: AxisState::at_rest(0.0, rest_pa, rest_pa, rest.0, rest.1),
            tick: 0,
        }
    }
}

impl Plant {
    /// The same, from a later place in the motion on.
    pub fn beginning_at(tick: u32) -> Self {
        Self {
            tick,
            ..Self::default()
        }
    }

    /// The sample of this tick.
    pub fn sample(&self) -> Sample {
        let (carriage, gas) = (&self.state.carriage, &self.state.pneumatics);
        let position = code(&POSITION_M, carriage.position_m.value);
        let pressures = [
            gas.a.pressure_pa.value,
            gas.b.pressure_pa.value,
            paper::SUPPLY_PRESSURE_PA,
        ];
        // Of a 12-bit converter: the low 4 bits are nought.
        let [a, b, supply] = pressures.map(|pressure_pa| code(&PRESSURE_PA, pressure_pa) & !0xF);
        let velocity = code(&VELOCITY_M_PER_S, carriage.velocity_m_per_s);
        Sample {
            tick: self.tick,
            codes: AdcCodes::from_array([position, a, b, supply, velocity]),
            reference: reference(f64::from(self.tick) * self.axis.dt_s),
        }
    }

    /// Goes on to the next tick under this command.
    pub fn apply(&mut self, command: &CommandRecord) {
        let inputs = AxisInputs {
            command_v: f64::from(COMMAND_V.value(command.valve.0)),
            supply_pressure_pa: paper::SUPPLY_PRESSURE_PA,
        };
        self.axis.step(&mut self.state, &inputs);
        self.tick = self.tick.wrapping_add(1);
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the place is within 0..=65535"
)]
fn code(scale: &Scale, value: f64) -> u16 {
    scale.place(value as f32).round() as u16
}

/// The motion in which the cost is counted: rest, 60 mm at 0.5 Hz, rest, 60 mm at
/// 1 Hz, rest; over again.
#[expect(clippy::cast_possible_truncation, reason = "the link carries f32")]
fn reference(time_s: f64) -> Reference<f32> {
    let (begin_s, frequency_hz) = match time_s % 8.0 {
        time_s if time_s < 0.5 => (time_s, 0.0),
        time_s if time_s < 4.5 => (time_s - 0.5, 0.5),
        time_s if time_s < 5.0 => (time_s - 4.5, 0.0),
        time_s if time_s < 7.0 => (time_s - 5.0, 1.0),
        time_s => (time_s, 0.0),
    };
    let amplitude_m = 0.03;
    let rate = std::f64::consts::TAU * frequency_hz;
    let (sine, cosine) = (rate * begin_s).sin_cos();
    Reference {
        position_m: (amplitude_m * (1.0 - cosine)) as f32,
        velocity_m_per_s: (amplitude_m * rate * sine) as f32,
        acceleration_m_per_s2: (amplitude_m * rate * rate * cosine) as f32,
    }
}
