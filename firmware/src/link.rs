//! Payloads of the lock-step link between controller and plant.
//!
//! The controller says hello; then the plant sends a [`Sample`] a tick and
//! waits for its [`Command`]. The arrival of a sample is the tick: a run is
//! repeatable to the byte and nobody's clock matters. All fields little-endian.

use crate::codes::{AdcCodes, DacCode};
use crate::fault::{Fault, Finding};
use crate::frame::LONGEST_PAYLOAD;
use crate::tick::{Command, Sample};
use heapless::Vec;
use model_core::reference::Reference;

/// The version spoken.
pub const PROTOCOL: u16 = 1;
const CHANNELS: u8 = 5;

/// First byte of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Controller to plant, once.
    Hello = 0x01,
    /// Plant to controller, each tick.
    Sample = 0x02,
    /// Controller to plant, the answer.
    Command = 0x03,
    /// Plant to controller: the run is over.
    End = 0x04,
    /// To the controller: leave the fault.
    Acknowledge = 0x10,
    /// Plant to controller: behave as if the board had seen a fault.
    Inject = 0x11,
    /// To a board with converters of its own: where the load should be.
    Reference = 0x12,
    /// To the controller: send a status report, see [`crate::status`].
    AskStatus = 0x13,
}

/// A payload.
pub type Payload = Vec<u8, LONGEST_PAYLOAD>;

/// What the plant sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromPlant {
    /// One tick's measurements and reference.
    Sample(Sample),
    /// The end of the run.
    End,
    /// Something to do before the next sample.
    Order(Order),
    /// Where the load should be, until the next reference.
    Reference(Reference<f32>),
    /// A status report is wished for.
    AskStatus,
}

/// What the controller is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Leave the fault.
    Acknowledge,
    /// Behave as if the board had seen this.
    Inject(Finding),
}

/// Reads the fields of a payload one after the other.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }
    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }
    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }
    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }
    /// All that is left.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.0
    }
    /// `value` if nothing is left over.
    pub(crate) fn end<T>(self, value: T) -> Option<T> {
        self.0.is_empty().then_some(value)
    }
}

/// Appends fields; every payload here is shorter than the longest.
pub(crate) fn put(payload: &mut Payload, bytes: &[u8]) {
    let fits = payload.extend_from_slice(bytes).is_ok();
    debug_assert!(fits, "a link payload is shorter than the longest");
}

/// What the plant sent; `None` where it is none of its payloads.
pub fn from_plant(payload: &[u8]) -> Option<FromPlant> {
    let mut fields = Fields(payload);
    match fields.u8()? {
        kind if kind == Kind::Sample as u8 => {
            let tick = fields.u32()?;
            let mut codes = [0; CHANNELS as usize];
            for code in &mut codes {
                *code = fields.u16()?;
            }
            let sample = Sample {
                tick,
                codes: AdcCodes::from_array(codes),
                reference: read_reference(&mut fields)?,
            };
            fields.end(FromPlant::Sample(sample))
        }
        kind if kind == Kind::Reference as u8 => {
            let reference = read_reference(&mut fields)?;
            fields.end(FromPlant::Reference(reference))
        }
        kind if kind == Kind::End as u8 => fields.end(FromPlant::End),
        kind if kind == Kind::AskStatus as u8 => fields.end(FromPlant::AskStatus),
        kind if kind == Kind::Acknowledge as u8 => fields.end(FromPlant::Order(Order::Acknowledge)),
        kind if kind == Kind::Inject as u8 => {
            let finding = Finding {
                fault: Fault::from_code(fields.u8()?)?,
                detail: fields.u8()?,
            };
            fields.end(FromPlant::Order(Order::Inject(finding)))
        }
        _ => None,
    }
}

fn read_reference(fields: &mut Fields<'_>) -> Option<Reference<f32>> {
    Some(Reference {
        position_m: fields.f32()?,
        velocity_m_per_s: fields.f32()?,
        acceleration_m_per_s2: fields.f32()?,
    })
}

fn put_reference(payload: &mut Payload, reference: &Reference<f32>) {
    for value in [
        reference.position_m,
        reference.velocity_m_per_s,
        reference.acceleration_m_per_s2,
    ] {
        put(payload, &value.to_le_bytes());
    }
}

/// The controller's greeting.
pub fn hello(tick_period_ns: u32) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Hello as u8]);
    put(&mut payload, &PROTOCOL.to_le_bytes());
    put(&mut payload, &tick_period_ns.to_le_bytes());
    put(&mut payload, &[CHANNELS]);
    payload
}

/// The tick period of a greeting, ns; `None` where it is no greeting or one of
/// another protocol.
pub fn hello_tick_period_ns(payload: &[u8]) -> Option<u32> {
    let mut fields = Fields(payload);
    let is_ours = fields.u8()? == Kind::Hello as u8 && fields.u16()? == PROTOCOL;
    let tick_period_ns = fields.u32()?;
    let channels = fields.u8()?;
    fields.end((is_ours && channels == CHANNELS).then_some(tick_period_ns))?
}

/// The answer to a sample.
pub fn command(command: &Command) -> Payload {
    CommandRecord {
        tick: command.tick,
        valve: command.valve,
        state: command.state as u8,
        fault: command.fault,
        estimate: command.estimate.to_array(),
    }
    .payload()
}

/// A command as the plant reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandRecord {
    /// Tick of the sample that it answers.
    pub tick: u32,
    /// For the valve.
    pub valve: DacCode,
    /// The controller's state, see [`crate::tick::State`].
    pub state: u8,
    /// 0, or why it is in fault.
    pub fault: u8,
    /// Position in m, velocity in m/s, friction and disturbance force in N.
    pub estimate: [f32; 4],
}

impl CommandRecord {
    /// The command as it was sent.
    pub fn payload(&self) -> Payload {
        let mut payload = Payload::new();
        put(&mut payload, &[Kind::Command as u8]);
        put(&mut payload, &self.tick.to_le_bytes());
        put(&mut payload, &self.valve.0.to_le_bytes());
        put(&mut payload, &[self.state, self.fault]);
        for value in self.estimate {
            put(&mut payload, &value.to_le_bytes());
        }
        payload
    }
}

/// Reads a command; `None` where it is none.
pub fn read_command(payload: &[u8]) -> Option<CommandRecord> {
    let mut fields = Fields(payload);
    if fields.u8()? != Kind::Command as u8 {
        return None;
    }
    let record = CommandRecord {
        tick: fields.u32()?,
        valve: DacCode(fields.u16()?),
        state: fields.u8()?,
        fault: fields.u8()?,
        estimate: [fields.f32()?, fields.f32()?, fields.f32()?, fields.f32()?],
    };
    fields.end(record)
}

/// A sample as the plant sends it.
pub fn sample(sample: &Sample) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Sample as u8]);
    put(&mut payload, &sample.tick.to_le_bytes());
    for code in sample.codes.to_array() {
        put(&mut payload, &code.to_le_bytes());
    }
    put_reference(&mut payload, &sample.reference);
    payload
}

/// A reference for a board with converters of its own.
pub fn reference(reference: &Reference<f32>) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Reference as u8]);
    put_reference(&mut payload, reference);
    payload
}

/// The plant's farewell.
pub fn end() -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::End as u8]);
    payload
}

/// The wish for a status report.
pub fn ask_status() -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::AskStatus as u8]);
    payload
}

/// An order.
pub fn order(order: Order) -> Payload {
    let mut payload = Payload::new();
    match order {
        Order::Acknowledge => put(&mut payload, &[Kind::Acknowledge as u8]),
        Order::Inject(Finding { fault, detail }) => {
            put(&mut payload, &[Kind::Inject as u8, fault.code(), detail]);
        }
    }
    payload
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_sample_comes_back() {
        let original = Sample {
            tick: 70_000,
            codes: AdcCodes::from_array([1, 2, 3, 0xFFFF, 5]),
            reference: Reference {
                position_m: 0.01,
                velocity_m_per_s: -0.2,
                acceleration_m_per_s2: 3.0,
            },
        };
        let payload = sample(&original);
        assert_eq!(payload.len(), 27);
        assert_eq!(from_plant(&payload), Some(FromPlant::Sample(original)));
        assert_eq!(from_plant(&payload[..26]), None);
        assert_eq!(from_plant(&end()), Some(FromPlant::End));
        let payload = reference(&original.reference);
        let read = Some(FromPlant::Reference(original.reference));
        assert_eq!(from_plant(&payload), read);
        assert_eq!(from_plant(&payload[..12]), None);
    }

    #[test]
    fn prop_orders_come_back() {
        for sent in [Order::Acknowledge, Order::Inject(Fault::ClockFailed.at(1))] {
            assert_eq!(from_plant(&order(sent)), Some(FromPlant::Order(sent)));
        }
        assert_eq!(from_plant(&ask_status()), Some(FromPlant::AskStatus));
        assert_eq!(from_plant(&[Kind::Inject as u8, 200, 0]), None);
    }

    #[test]
    fn prop_a_greeting_comes_back() {
        assert_eq!(hello_tick_period_ns(&hello(1_000_000)), Some(1_000_000));
        assert_eq!(hello_tick_period_ns(&end()), None);
    }
}
