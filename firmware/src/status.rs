//! What the supervisor tells: counters, the status report, and the record of a
//! fault that outlives a reset.

use crate::control_task::State;
use crate::fault::{Fault, Finding};
use crate::frame::crc;
use crate::link::{Fields, Payload, put};
use crate::start::ResetCause;

/// First byte of a status payload.
pub const KIND: u8 = 0x40;
/// Version of the status payload and of the fault record.
pub const VERSION: u8 = 1;

/// What is counted since the start; every counter stays at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that were dropped.
    pub dropped_frames: u32,
    /// Samples that are missing.
    pub missed_ticks: u32,
    /// Samples whose tick did not advance.
    pub repeated_ticks: u32,
    /// Overruns of the control task.
    pub overruns: u32,
    /// Faults.
    pub faults: u32,
}

impl Counters {
    fn to_array(self) -> [u32; 5] {
        [
            self.dropped_frames,
            self.missed_ticks,
            self.repeated_ticks,
            self.overruns,
            self.faults,
        ]
    }

    fn from_array(counts: [u32; 5]) -> Self {
        let [
            dropped_frames,
            missed_ticks,
            repeated_ticks,
            overruns,
            faults,
        ] = counts;
        Self {
            dropped_frames,
            missed_ticks,
            repeated_ticks,
            overruns,
            faults,
        }
    }
}

/// The status report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// State of the controller.
    pub state: State,
    /// Why it is in fault.
    pub finding: Option<Finding>,
    /// Tick whose sample showed the fault.
    pub fault_tick: u32,
    /// Why the board started.
    pub reset_cause: ResetCause,
    /// Counters.
    pub counters: Counters,
}

impl Status {
    /// Kind, version, state, fault (0: none), detail, u32 tick of the fault,
    /// reset cause, u32 x5 counters; little-endian.
    pub fn payload(&self) -> Payload {
        let mut payload = Payload::new();
        let (fault, detail) = self.finding.map_or((0, 0), parts);
        put(
            &mut payload,
            &[KIND, VERSION, self.state as u8, fault, detail],
        );
        put(&mut payload, &self.fault_tick.to_le_bytes());
        put(&mut payload, &[self.reset_cause as u8]);
        for count in self.counters.to_array() {
            put(&mut payload, &count.to_le_bytes());
        }
        payload
    }

    /// Reads a status report; `None` where it is none or one of another version.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let mut fields = Fields(payload);
        if fields.u8()? != KIND || fields.u8()? != VERSION {
            return None;
        }
        let status = Self {
            state: State::from_code(fields.u8()?)?,
            finding: finding(fields.u8()?, fields.u8()?)?,
            fault_tick: fields.u32()?,
            reset_cause: ResetCause::from_code(fields.u8()?)?,
            counters: Counters::from_array([
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
            ]),
        };
        fields.end(status)
    }
}

fn parts(finding: Finding) -> (u8, u8) {
    (finding.fault.code(), finding.detail)
}

/// The finding of a code and its detail: `Some(None)` for code 0.
fn finding(code: u8, detail: u8) -> Option<Option<Finding>> {
    if code == 0 {
        return Some(None);
    }
    Fault::from_code(code).map(|fault| Some(fault.at(detail)))
}

/// An unacknowledged fault as it lies in memory that a reset does not clear.
/// What power-on leaves there fails the CRC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultMemory {
    /// The fault; `None` once it is acknowledged.
    pub finding: Option<Finding>,
    /// Its tick.
    pub tick: u32,
}

impl FaultMemory {
    /// Bytes of the record.
    pub const LENGTH: usize = 9;

    /// Version, fault, detail, u32 tick, CRC; little-endian.
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let (fault, detail) = self.finding.map_or((0, 0), parts);
        let [t0, t1, t2, t3] = self.tick.to_le_bytes();
        let [c0, c1] = crc(&[VERSION, fault, detail, t0, t1, t2, t3]).to_le_bytes();
        [VERSION, fault, detail, t0, t1, t2, t3, c0, c1]
    }

    /// Reads a record; `None` where the bytes are none.
    pub fn from_bytes(bytes: &[u8; Self::LENGTH]) -> Option<Self> {
        let (record, kept_crc) = bytes.split_last_chunk::<2>()?;
        let mut fields = Fields(record);
        let is_record = u16::from_le_bytes(*kept_crc) == crc(record) && fields.u8()? == VERSION;
        let memory = Self {
            finding: finding(fields.u8()?, fields.u8()?)?,
            tick: fields.u32()?,
        };
        is_record.then_some(memory)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: Status = Status {
        state: State::Fault,
        finding: Some(Finding {
            fault: Fault::SupplyLost,
            detail: 21,
        }),
        fault_tick: 77_000,
        reset_cause: ResetCause::Watchdog,
        counters: Counters {
            dropped_frames: 1,
            missed_ticks: 2,
            repeated_ticks: 3,
            overruns: 4,
            faults: 5,
        },
    };

    #[test]
    fn prop_a_status_comes_back() {
        let payload = STATUS.payload();
        assert_eq!(payload.len(), 30);
        assert_eq!(Status::read(&payload), Some(STATUS));
        assert_eq!(Status::read(&payload[..29]), None);
        let sound = Status {
            state: State::Track,
            finding: None,
            ..STATUS
        };
        assert_eq!(Status::read(&sound.payload()), Some(sound));
    }

    #[test]
    fn prop_a_fault_is_remembered_and_every_flipped_bit_is_noticed() {
        let memory = FaultMemory {
            finding: STATUS.finding,
            tick: 77_000,
        };
        let bytes = memory.to_bytes();
        assert_eq!(FaultMemory::from_bytes(&bytes), Some(memory));
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(FaultMemory::from_bytes(&damaged), None, "bit {bit}");
        }
        assert_eq!(FaultMemory::from_bytes(&[0; 9]), None);
        assert_eq!(FaultMemory::from_bytes(&[0xFF; 9]), None);
    }
}
