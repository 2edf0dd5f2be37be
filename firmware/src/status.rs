//! What the supervisor tells: counters and the status report.

use crate::fault::{Fault, Finding};
use crate::link::{Fields, Payload, put};
use crate::settings::Wiring;
use crate::start::ResetCause;
use crate::tick::State;

/// First byte of a status payload.
pub const KIND: u8 = 0x40;
/// Version of the status payload.
pub const VERSION: u8 = 4;
/// The one before, without a word of the wiring, ...
const VERSION_3: u8 = 3;
/// ... the one without program and cost ...
const VERSION_2: u8 = 2;
/// ... and the one before that, without how often the loop was calmed.
const VERSION_1: u8 = 1;
/// Bits of the byte about settings.
const BUILT_IN: u8 = 1;
const UNCHECKED: u8 = 2;

/// Which program a board runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// Version of the firmware: major, minor, patch; noughts where it is not known.
    pub version: [u8; 3],
    /// First digits of the commit that the image was built from; 0 where that is not known.
    pub commit: u32,
}

impl Program {
    /// By the parts of the version and the commit in hexadecimal digits, as a build has them.
    pub const fn of(version: [&str; 3], commit: Option<&str>) -> Self {
        let [major, minor, patch] = version;
        Self {
            version: [low_byte(major), low_byte(minor), low_byte(patch)],
            commit: match commit {
                Some(digits) => number(digits, 16),
                None => 0,
            },
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "versions are small")]
const fn low_byte(digits: &str) -> u8 {
    number(digits, 10) as u8
}

/// The number of the digits up to the first that is none.
const fn number(digits: &str, radix: u32) -> u32 {
    let mut rest = digits.as_bytes();
    let mut number: u32 = 0;
    while let [first, others @ ..] = rest {
        let Some(digit) = (*first as char).to_digit(radix) else {
            return number;
        };
        number = number.wrapping_mul(radix).wrapping_add(digit);
        rest = others;
    }
    number
}

/// What a tick costs on the board, in tenths of a microsecond; noughts where nothing counts it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickCost {
    /// In the mean since the start.
    pub mean_100ns: u16,
    /// The longest.
    pub worst_100ns: u16,
}

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
    /// What is known of the wiring: a board of before takes it for checked.
    pub wiring: Wiring,
    /// Counters.
    pub counters: Counters,
    /// How many times the loop swung and was calmed, since it has its settings.
    pub calmed: u8,
    /// Which program this is.
    pub program: Program,
    /// What a tick costs.
    pub tick_cost: TickCost,
}

impl Status {
    /// Kind, version, state, fault (0: none), detail, u32 tick of the fault,
    /// reset cause, u8 with bit 0 for built-in settings and bit 1 for unchecked wiring, u32 x5 counters, times calmed, u8 x3 version of the
    /// firmware, u32 commit, u16 x2 cost of a tick; little-endian.
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
            &[self.reset_cause as u8, self.about_settings()],
        );
        for count in self.counters.to_array() {
            put(&mut payload, &count.to_le_bytes());
        }
        put(&mut payload, &[self.calmed]);
        put(&mut payload, &self.program.version);
        put(&mut payload, &self.program.commit.to_le_bytes());
        put(&mut payload, &self.tick_cost.mean_100ns.to_le_bytes());
        put(&mut payload, &self.tick_cost.worst_100ns.to_le_bytes());
        payload
    }

    fn about_settings(&self) -> u8 {
        let built_in = if self.has_built_in_settings {
            BUILT_IN
        } else {
            0
        };
        match self.wiring {
            Wiring::Checked => built_in,
            Wiring::Unchecked => built_in | UNCHECKED,
        }
    }

    /// Reads a status report; `None` where it is none or one of another version.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let mut fields = Fields(payload);
        if fields.u8()? != KIND {
            return None;
        }
        let version = fields.u8()?;
        if !(VERSION_1..=VERSION).contains(&version) {
            return None;
        }
        let (state, finding) = (
            State::from_code(fields.u8()?)?,
            finding(fields.u8()?, fields.u8()?)?,
        );
        let fault_tick = fields.u32()?;
        let reset_cause = ResetCause::from_code(fields.u8()?)?;
        let about_settings = fields.u8()?;
        let mut status = Self {
            state,
            finding,
            fault_tick,
            reset_cause,
            has_built_in_settings: about_settings & BUILT_IN != 0,
            wiring: if about_settings & UNCHECKED == 0 {
                Wiring::Checked
            } else {
                Wiring::Unchecked
            },
            counters: Counters::from_array([
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
                fields.u32()?,
            ]),
            calmed: 0,
            program: Program::default(),
            tick_cost: TickCost::default(),
        };
        if version >= VERSION_2 {
            status.calmed = fields.u8()?;
        }
        if version >= VERSION_3 {
            status.program = Program {
                version: [fields.u8()?, fields.u8()?, fields.u8()?],
                commit: fields.u32()?,
            };
            status.tick_cost = TickCost {
                mean_100ns: fields.u16()?,
                worst_100ns: fields.u16()?,
            };
        }
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
        wiring: Wiring::Unchecked,
        counters: Counters {
            dropped_frames: 1,
            missed_ticks: 2,
            repeated_ticks: 3,
            overruns: 4,
            faults: 5,
        },
        calmed: 1,
        program: Program {
            version: [0, 1, 2],
            commit: 0x8a95_2d0f,
        },
        tick_cost: TickCost {
            mean_100ns: 776,
            worst_100ns: 856,
        },
    };

    #[test]
    fn val_a_program_is_known_by_its_version_and_commit() {
        let program = Program::of(["1", "20", "3"], Some("8a952d0f"));
        assert_eq!(program.version, [1, 20, 3]);
        assert_eq!(program.commit, 0x8a95_2d0f);
        assert_eq!(Program::of(["0", "0", "0"], None), Program::default());
    }

    #[test]
    fn prop_a_status_comes_back() {
        let payload = STATUS.payload();
        assert_eq!(payload.len(), 43);
        assert_eq!(Status::read(&payload), Some(STATUS));
        assert_eq!(Status::read(&payload[..42]), None);
        let checked = Status {
            wiring: Wiring::Checked,
            ..STATUS
        };
        assert_eq!(Status::read(&checked.payload()), Some(checked));
        let without_cost = Status {
            program: Program::default(),
            tick_cost: TickCost::default(),
            ..checked
        };
        let uncalmed = Status {
            calmed: 0,
            ..without_cost
        };
        for (version, length, expected) in [
            (VERSION_3, 43, checked),
            (VERSION_2, 32, without_cost),
            (VERSION_1, 31, uncalmed),
        ] {
            let mut of_before = checked.payload();
            of_before.truncate(length);
            of_before[1] = version;
            assert_eq!(Status::read(&of_before), Some(expected));
        }
        let sound = Status {
            state: State::Track,
            finding: None,
            ..STATUS
        };
        assert_eq!(Status::read(&sound.payload()), Some(sound));
    }
}
