//! What the supervisor tells: counters and the status report.

use crate::fault::{Fault, Finding};
use crate::link::{Fields, Payload, put};
use crate::start::ResetCause;
use crate::tick::State;

/// First byte of a status payload.
pub const KIND: u8 = 0x40;
/// Version of the status payload.
pub const VERSION: u8 = 2;
/// The one before, without how often the loop was calmed.
const VERSION_1: u8 = 1;

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
    /// No settings of this rig are in use, but the built-in ones.
    pub has_built_in_settings: bool,
    /// Counters.
    pub counters: Counters,
    /// How many times the loop swung and was calmed, since it has its settings.
    pub calmed: u8,
}

impl Status {
    /// Kind, version, state, fault (0: none), detail, u32 tick of the fault,
    /// reset cause, 1 for built-in settings, u32 x5 counters, times calmed; little-endian.
    pub fn payload(&self) -> Payload {
        let mut payload = Payload::new();
        let (fault, detail) = self.finding.map_or((0, 0), parts);
        put(
            &mut payload,
            &[KIND, VERSION, self.state as u8, fault, detail],
        );
        put(&mut payload, &self.fault_tick.to_le_bytes());
        put(
            &mut payload,
            &[self.reset_cause as u8, u8::from(self.has_built_in_settings)],
        );
        for count in self.counters.to_array() {
            put(&mut payload, &count.to_le_bytes());
        }
        put(&mut payload, &[self.calmed]);
        payload
    }

    /// Reads a status report; `None` where it is none or one of another version.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let mut fields = Fields(payload);
        if fields.u8()? != KIND {
            return None;
        }
        let version = fields.u8()?;
        if version != VERSION && version != VERSION_1 {
            return None;
        }
        let status = Self {
            state: State::from_code(fields.u8()?)?,
            finding: finding(fields.u8()?, fields.u8()?)?,
            fault_tick: fields.u32()?,
            reset_cause: ResetCause::from_code(fields.u8()?)?,
            has_built_in_settings: fields.u8()? == 1,
            counters: Counters::from_array([
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
            ]),
            calmed: if version == VERSION { fields.u8()? } else { 0 },
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
        has_built_in_settings: true,
        counters: Counters {
            dropped_frames: 1,
            missed_ticks: 2,
            repeated_ticks: 3,
            overruns: 4,
            faults: 5,
        },
        calmed: 1,
    };

    #[test]
    fn prop_a_status_comes_back() {
        let payload = STATUS.payload();
        assert_eq!(payload.len(), 32);
        assert_eq!(Status::read(&payload), Some(STATUS));
        assert_eq!(Status::read(&payload[..31]), None);
        let mut of_before = payload.clone();
        of_before.truncate(31);
        of_before[1] = VERSION_1;
        let read = Status::read(&of_before);
        assert_eq!(
            read,
            Some(Status {
                calmed: 0,
                ..STATUS
            })
        );
        let sound = Status {
            state: State::Track,
            finding: None,
            ..STATUS
        };
        assert_eq!(Status::read(&sound.payload()), Some(sound));
    }
}
