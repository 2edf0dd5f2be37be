//! Why a board started, and what it remembers from before.

use crate::fault::{Fault, Finding};

/// Why the board started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ResetCause {
    /// The board cannot tell.
    Unknown = 0,
    /// Power came.
    PowerOn = 1,
    /// Power fell too low.
    BrownOut = 2,
    /// Somebody pressed reset.
    Pin = 3,
    /// The application asked for it.
    Software = 4,
    /// The watchdog was not fed.
    Watchdog = 5,
}

impl ResetCause {
    /// What a start for this cause says of the board.
    pub fn finding(self) -> Option<Finding> {
        match self {
            Self::Watchdog => Some(Fault::WatchdogReset.at(0)),
            Self::BrownOut => Some(Fault::BrownOut.at(0)),
            Self::Unknown | Self::PowerOn | Self::Pin | Self::Software => None,
        }
    }

    /// The cause of a code.
    pub fn from_code(code: u8) -> Option<Self> {
        [
            Self::Unknown,
            Self::PowerOn,
            Self::BrownOut,
            Self::Pin,
            Self::Software,
            Self::Watchdog,
        ]
        .into_iter()
        .find(|cause| *cause as u8 == code)
    }
}

/// A cause as it lies in memory that a reset does not clear: the word and its
/// complement, so that what power-on left there is not taken for a cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The word.
    pub cause: u32,
    /// Its complement.
    pub check: u32,
}

/// The cause that a fault leaves: code and detail, 0 where there is none.
pub fn cause_of(finding: Option<Finding>) -> u32 {
    let (fault, detail) = finding.map_or((0, 0), |it| (it.fault.code(), it.detail));
    u32::from_le_bytes([fault, 0, detail, 0])
}

/// The fault that a kept cause is to the start after it: one that nobody
/// acknowledged, or why the board reset itself. What stays until the board starts
/// anew has ended, or this start finds it again.
pub fn finding_of(cause: u32) -> Option<Finding> {
    match cause {
        PANIC => Some(Fault::WatchdogReset.at(1)),
        EXCEPTION => Some(Fault::WatchdogReset.at(2)),
        CRYSTAL_STOPPED => Some(Fault::WatchdogReset.at(3)),
        _ => {
            let [fault, 0, detail, 0] = cause.to_le_bytes() else {
                return None;
            };
            let fault = Fault::from_code(fault).filter(|fault| !fault.is_standing())?;
            Some(fault.at(detail))
        }
    }
}

/// The cause that a panic leaves; those of faults have a second byte of zero.
pub const PANIC: u32 = 0x100;
/// The cause that an exception of the processor leaves.
pub const EXCEPTION: u32 = 0x101;
/// The cause that a crystal leaves which stops while the board runs.
pub const CRYSTAL_STOPPED: u32 = 0x102;

impl Kept {
    /// A cause to keep.
    pub fn new(cause: u32) -> Self {
        Self {
            cause,
            check: !cause,
        }
    }

    /// The cause; `None` where the memory holds none.
    pub fn read(self) -> Option<u32> {
        (self.check == !self.cause).then_some(self.cause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_fault_comes_back_from_its_cause() {
        let finding = Some(Fault::SupplyLost.at(21));
        assert_eq!(finding_of(cause_of(finding)), finding);
        assert_eq!(finding_of(cause_of(None)), None);
        let clock = Fault::ClockFailed.at(1);
        assert_eq!(finding_of(cause_of(Some(clock))), None, "it is looked for");
        for (cause, detail) in [(PANIC, 1), (EXCEPTION, 2), (CRYSTAL_STOPPED, 3)] {
            assert_eq!(finding_of(cause), Some(Fault::WatchdogReset.at(detail)));
        }
    }

    #[test]
    fn prop_only_a_kept_cause_is_read() {
        assert_eq!(Kept::new(PANIC).read(), Some(PANIC));
        let mut kept = Kept::new(7);
        kept.cause ^= 1;
        assert_eq!(kept.read(), None);
        assert_eq!(Kept { cause: 0, check: 0 }.read(), None);
    }
}
