//! Sizes under which an effect does not matter on a servo-pneumatic axis, however plain
//! the recordings show it.
//!
//! They are about a fifth of the least that the literature calls typical (each effect's own file
//! in `model_core::left_out`), or what the loop holds anyway. An effect under them stays in the
//! improved model and is not named.

/// From which size on an effect matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// It matters from this size on.
    From(f64),
    /// It matters up to this size: smaller is stronger.
    UpTo(f64),
}

impl Mark {
    /// Whether a size is on the side that does not matter.
    pub fn leaves_out(self, size: f64) -> bool {
        match self {
            Self::From(least) => size.abs() < least,
            Self::UpTo(most) => size > most,
        }
    }

    /// A size that is so many times weaker.
    pub fn weaker(self, size: f64, times: f64) -> f64 {
        match self {
            Self::From(_) => size / times,
            Self::UpTo(_) => size * times,
        }
    }

    /// The size at which it begins to matter.
    pub fn size(self) -> f64 {
        match self {
            Self::From(size) | Self::UpTo(size) => size,
        }
    }
}
