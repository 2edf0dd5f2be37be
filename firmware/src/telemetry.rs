//! What happens at every tick, streamed over the serial wire.
//!
//! The control task offers each tick to a [`Tap`], which takes every N-th into
//! its queue in constant time; a task below it turns what is queued into frames.
//! A tick that found the queue full is counted, and the count goes out with the
//! frames that follow: together with the sequence number no loss is unnoticed,
//! and a loss on the board is told from one on the wire.
//!
//! | frame | direction | payload, little-endian |
//! |---|---|---|
//! | `Tick` 0x30 | board to host | u8 kind, u16 sequence, u16 overflows so far, u32 tick, u16 x5 ADC codes (position, p_a, p_b, p_s, velocity), u16 DAC code in force from this tick to the next, u8 state, u8 fault, f32 reference position in m, f32 x4 estimates as in the link's `Command` |
//! | `Stream` 0x31 | host to board | u8 kind, u16 decimation: every N-th tick, 0 stops |
//! | `Streaming` 0x32 | board to host | the answer: u8 kind, u16 decimation, u32 tick period in ns |
//!
//! Sequence and overflows go round at 65536. The command that a tick computes
//! is in force from the next tick on, so a frame carries the code of the tick
//! before: rows made of frames stand as a logger beside the rig would have
//! written them.
//!
//! Bandwidth: a `Tick` is 43 bytes, 47 on the wire with CRC, COBS and end mark.
//! Every tick at 1 kHz is 47 kB/s, 470 kbit/s with start and stop bits: 51 % of
//! 921600 baud. At 8 kHz every 5th tick is 82 %. [`least_decimation`] does this
//! sum.

use crate::codes::{AdcCodes, DacCode};
use crate::link::{Fields, Payload, put};
use crate::tick::{Command, Sample};
use heapless::Deque;

/// Places in the queue: a wait of 16 ms at 1 kHz, 2 ms at 8 kHz; the longest
/// frame takes the wire 2.8 ms, in which a decimation of 5 brings 5 ticks.
pub const QUEUE_PLACES: usize = 16;
/// Bytes on the wire of a `Tick` frame.
pub const TICK_FRAME_BYTES: u32 = 47;
const BITS_PER_BYTE: u32 = 10;
/// The part of the wire that telemetry may take, in percent: answers and status
/// reports need the rest.
const MOST_LOAD_PERCENT: u64 = 85;

/// First byte of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Board to host: one tick.
    Tick = 0x30,
    /// Host to board: begin or stop.
    Stream = 0x31,
    /// Board to host: the answer to it.
    Streaming = 0x32,
}

/// One tick as it is streamed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Number of the record, lost ones counted.
    pub sequence: u16,
    /// Records that found the queue full, so far.
    pub overflows: u16,
    /// Number of the tick.
    pub tick: u32,
    /// The converters' codes.
    pub codes: AdcCodes,
    /// The valve's code in force from this tick to the next.
    pub valve_in_force: DacCode,
    /// The controller's state, see [`crate::tick::State`].
    pub state: u8,
    /// 0, or the code of the fault.
    pub fault: u8,
    /// Where the load should be, m; NaN asks for nothing.
    pub reference_position_m: f32,
    /// Position in m, velocity in m/s, friction and disturbance force in N.
    pub estimate: [f32; 4],
}

/// The queue between control and telemetry, and what goes into it.
#[derive(Debug)]
pub struct Tap {
    queue: Deque<Record, QUEUE_PLACES>,
    /// 0: nothing is streamed.
    decimation: u16,
    until_next: u16,
    sequence: u16,
    overflows: u16,
    /// What the last tick commanded: in force at the next.
    commanded: DacCode,
}

impl Tap {
    /// A tap that streams nothing yet; `resting` is the valve's code at the start.
    pub const fn new(resting: DacCode) -> Self {
        Self {
            queue: Deque::new(),
            decimation: 0,
            until_next: 0,
            sequence: 0,
            overflows: 0,
            commanded: resting,
        }
    }

    /// Streams every `decimation`-th tick from the next one on; 0 stops.
    pub fn set_decimation(&mut self, decimation: u16) {
        self.decimation = decimation;
        self.until_next = 0;
    }

    /// The oldest tick that waits.
    pub fn take(&mut self) -> Option<Record> {
        self.queue.pop_front()
    }

    /// Offers a tick: constant time, never waits.
    #[inline]
    pub fn offer(&mut self, sample: &Sample, command: &Command) {
        let valve_in_force = self.commanded;
        self.commanded = command.valve;
        if self.decimation == 0 {
            return;
        }
        if self.until_next > 0 {
            self.until_next -= 1;
            return;
        }
        self.until_next = self.decimation - 1;
        let record = Record {
            sequence: self.sequence,
            overflows: self.overflows,
            tick: sample.tick,
            codes: command.codes,
            valve_in_force,
            state: command.state as u8,
            fault: command.fault,
            reference_position_m: command.reference_position_m,
            estimate: command.estimate.to_array(),
        };
        self.sequence = self.sequence.wrapping_add(1);
        if self.queue.push_back(record).is_err() {
            self.overflows = self.overflows.wrapping_add(1);
        }
    }
}

/// The least decimation that the wire carries.
pub fn least_decimation(tick_period_ns: u32, baud: u32) -> u16 {
    let frame_ns = u64::from(TICK_FRAME_BYTES * BITS_PER_BYTE) * 1_000_000_000 * 100;
    let share = u64::from(baud.max(1)) * MOST_LOAD_PERCENT * u64::from(tick_period_ns.max(1));
    u16::try_from(frame_ns.div_ceil(share)).unwrap_or(u16::MAX)
}

/// The decimation that a wish gets: what the wire carries at least, 0 to stop. The answer says it.
pub fn granted_decimation(wish: u16, tick_period_ns: u32, baud: u32) -> u16 {
    if wish == 0 {
        0
    } else {
        wish.max(least_decimation(tick_period_ns, baud))
    }
}

/// A record as a payload.
pub fn tick(record: &Record) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Tick as u8]);
    put(&mut payload, &record.sequence.to_le_bytes());
    put(&mut payload, &record.overflows.to_le_bytes());
    put(&mut payload, &record.tick.to_le_bytes());
    for code in record.codes.to_array() {
        put(&mut payload, &code.to_le_bytes());
    }
    put(&mut payload, &record.valve_in_force.0.to_le_bytes());
    put(&mut payload, &[record.state, record.fault]);
    put(&mut payload, &record.reference_position_m.to_le_bytes());
    for value in record.estimate {
        put(&mut payload, &value.to_le_bytes());
    }
    payload
}

/// Reads a record; `None` where it is none.
pub fn read_tick(payload: &[u8]) -> Option<Record> {
    let mut fields = Fields(payload);
    if fields.u8()? != Kind::Tick as u8 {
        return None;
    }
    let (sequence, overflows, tick) = (fields.u16()?, fields.u16()?, fields.u32()?);
    let mut codes = [0; 5];
    for code in &mut codes {
        *code = fields.u16()?;
    }
    let record = Record {
        sequence,
        overflows,
        tick,
        codes: AdcCodes::from_array(codes),
        valve_in_force: DacCode(fields.u16()?),
        state: fields.u8()?,
        fault: fields.u8()?,
        reference_position_m: fields.f32()?,
        estimate: [fields.f32()?, fields.f32()?, fields.f32()?, fields.f32()?],
    };
    fields.end(record)
}

/// The wish for every `decimation`-th tick; 0 to stop.
pub fn stream(decimation: u16) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Stream as u8]);
    put(&mut payload, &decimation.to_le_bytes());
    payload
}

/// The decimation wished for; `None` where it is no such wish.
pub fn read_stream(payload: &[u8]) -> Option<u16> {
    let mut fields = Fields(payload);
    let is_ours = fields.u8()? == Kind::Stream as u8;
    let decimation = fields.u16()?;
    fields.end(decimation).filter(|_| is_ours)
}

/// What a board streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Streaming {
    /// Every so many ticks; 0: nothing.
    pub decimation: u16,
    /// Time from tick to tick, ns.
    pub tick_period_ns: u32,
}

impl Streaming {
    /// Time from tick to tick, s.
    pub fn tick_s(&self) -> f64 {
        f64::from(self.tick_period_ns) / 1e9
    }
}

/// The board's answer to a wish.
pub fn streaming(what: Streaming) -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[Kind::Streaming as u8]);
    put(&mut payload, &what.decimation.to_le_bytes());
    put(&mut payload, &what.tick_period_ns.to_le_bytes());
    payload
}

/// Reads that answer; `None` where it is none.
pub fn read_streaming(payload: &[u8]) -> Option<Streaming> {
    let mut fields = Fields(payload);
    let is_ours = fields.u8()? == Kind::Streaming as u8;
    let what = Streaming {
        decimation: fields.u16()?,
        tick_period_ns: fields.u32()?,
    };
    fields.end(what).filter(|_| is_ours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame;
    use crate::tick::State;
    use model_core::controller::Estimate;
    use model_core::reference::Reference;

    fn offer(tap: &mut Tap, tick: u32) {
        let sample = Sample {
            tick,
            codes: AdcCodes::from_array([1, 2, 3, 4, 5]),
            reference: Reference {
                position_m: 0.1,
                velocity_m_per_s: 0.0,
                acceleration_m_per_s2: 0.0,
            },
        };
        let command = Command {
            tick,
            codes: AdcCodes::from_array([1, 2, 3, 4, 5]),
            valve: DacCode(1000 + tick as u16),
            state: State::Track,
            fault: 0,
            reference_position_m: 0.01,
            estimate: Estimate {
                position_m: 0.1,
                velocity_m_per_s: 0.2,
                friction_n: 3.0,
                disturbance_n: -4.0,
            },
        };
        tap.offer(&sample, &command);
    }

    #[test]
    fn prop_a_record_comes_back_and_has_the_length_that_the_sum_uses() {
        let record = Record {
            sequence: 65_535,
            overflows: 3,
            tick: 70_000,
            codes: AdcCodes::from_array([1, 2, 3, 0xFFFF, 5]),
            valve_in_force: DacCode(9),
            state: 2,
            fault: 7,
            reference_position_m: 0.01,
            estimate: [1.0, 2.0, -3.0, 4.5],
        };
        let payload = tick(&record);
        assert_eq!(read_tick(&payload), Some(record));
        assert_eq!(read_tick(&payload[1..]), None);
        let frame = frame::encode(&payload).expect("it fits");
        assert_eq!(frame.len(), TICK_FRAME_BYTES as usize);
        let what = Streaming {
            decimation: 5,
            tick_period_ns: 125_000,
        };
        assert_eq!(read_streaming(&streaming(what)), Some(what));
        assert_eq!(read_stream(&stream(7)), Some(7));
        assert_eq!(read_stream(&streaming(what)), None);
    }

    #[test]
    fn prop_every_nth_tick_is_streamed_with_the_code_in_force() {
        let mut tap = Tap::new(DacCode(7));
        offer(&mut tap, 0);
        assert_eq!(tap.take(), None, "nobody asked");
        tap.set_decimation(3);
        for tick in 1..=9 {
            offer(&mut tap, tick);
        }
        for (place, tick) in [1, 4, 7].into_iter().enumerate() {
            let record = tap.take().expect("a third of the ticks");
            assert_eq!(record.tick, tick);
            assert_eq!(usize::from(record.sequence), place);
            assert_eq!(record.valve_in_force, DacCode(999 + tick as u16));
        }
        tap.set_decimation(0);
        offer(&mut tap, 10);
        assert_eq!(tap.take(), None);
    }

    #[test]
    fn prop_no_loss_of_a_full_queue_is_unnoticed() {
        let mut tap = Tap::new(DacCode(7));
        tap.set_decimation(1);
        let held = QUEUE_PLACES as u32;
        for tick in 0..held + 9 {
            offer(&mut tap, tick);
        }
        let mut last = None;
        while let Some(record) = tap.take() {
            last = Some(record);
        }
        assert_eq!(last.map(|record| record.tick), Some(held - 1));
        offer(&mut tap, held + 9);
        let next = tap.take().expect("there is room again");
        assert_eq!(next.overflows, 9);
        assert_eq!(u32::from(next.sequence), held + 9);
    }

    #[test]
    fn val_the_wire_carries_every_tick_at_1_khz_and_every_5th_at_8_khz() {
        assert_eq!(least_decimation(1_000_000, 921_600), 1);
        assert_eq!(least_decimation(125_000, 921_600), 5);
        assert_eq!(least_decimation(1_000_000, 115_200), 5);
        assert_eq!(granted_decimation(1, 125_000, 921_600), 5);
        assert_eq!(granted_decimation(7, 125_000, 921_600), 7);
        assert_eq!(granted_decimation(0, 125_000, 921_600), 0);
    }
}
