//! Why a board started, and what it remembers from before.

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

/// The cause that a panic leaves; the causes of the supervisor are 8-bit codes.
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
    fn prop_only_a_kept_cause_is_read() {
        assert_eq!(Kept::new(PANIC).read(), Some(PANIC));
        let mut kept = Kept::new(7);
        kept.cause ^= 1;
        assert_eq!(kept.read(), None);
        assert_eq!(Kept { cause: 0, check: 0 }.read(), None);
    }
}
