//! What a person needs to know of a key, and what its number may be.

/// What a person needs to know of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// The unit; 1 for a ratio.
    pub unit: &'static str,
    /// A typical value, or the range of typical values.
    pub typical: &'static str,
    /// What it is, in one sentence.
    pub what: &'static str,
    /// Where one finds it.
    pub source: &'static str,
}

/// What a key's line in the reference says.
pub const fn facts(
    unit: &'static str,
    typical: &'static str,
    what: &'static str,
    source: &'static str,
) -> Facts {
    Facts {
        unit,
        typical,
        what,
        source,
    }
}

/// What a number may be, and how a line says so.
pub struct Limits {
    /// The least number.
    pub low: f64,
    /// The largest number.
    pub high: f64,
    /// Whether `low` itself is admitted.
    pub low_included: bool,
    /// Whether `high` itself is admitted.
    pub high_included: bool,
    /// How a message says what was expected.
    pub expected: &'static str,
}

impl Limits {
    /// Whether a number lies within.
    pub fn admit(&self, value: f64) -> bool {
        let above = value > self.low || (self.low_included && value >= self.low);
        let below = value < self.high || (self.high_included && value <= self.high);
        above && below
    }
}

/// Limits that are themselves admitted.
pub const fn limits(low: f64, high: f64, expected: &'static str) -> Limits {
    Limits {
        low,
        high,
        low_included: true,
        high_included: true,
        expected,
    }
}

/// Above nought, up to `high`.
pub const fn positive(high: f64, expected: &'static str) -> Limits {
    Limits {
        low: 0.0,
        high,
        low_included: false,
        high_included: true,
        expected,
    }
}

pub(super) const RATIO: Limits = Limits {
    low: 0.0,
    high: 1.0,
    low_included: false,
    high_included: false,
    expected: "a ratio above 0 and below 1",
};
