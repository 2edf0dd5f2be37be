//! The two chambers, and what each is called in keys, signals and verdicts.

/// Which chamber.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// Chamber a, which +x enlarges.
    A,
    /// Chamber b.
    B,
}

impl Side {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// "a" or "b", as in keys and signals.
    pub fn letter(self) -> char {
        match self {
            Self::A => 'a',
            Self::B => 'b',
        }
    }

    /// The pressure signal's name.
    pub fn pressure_signal(self) -> &'static str {
        match self {
            Self::A => "p_a",
            Self::B => "p_b",
        }
    }

    /// The place of its gauge in a verdict.
    pub fn gauge_place(self) -> &'static str {
        match self {
            Self::A => "sensor.p_a",
            Self::B => "sensor.p_b",
        }
    }

    /// The place in a verdict.
    pub fn place(self) -> &'static str {
        match self {
            Self::A => "chamber-a",
            Self::B => "chamber-b",
        }
    }

    /// Key of the gain of its gauge.
    pub const fn gauge_gain_key(self) -> &'static str {
        match self {
            Self::A => "chambers.gauge_gain_a",
            Self::B => "chambers.gauge_gain_b",
        }
    }
}
