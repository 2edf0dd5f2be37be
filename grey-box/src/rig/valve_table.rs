//! The three tables of the valve, as keys.

use super::Valve;
use super::facts::{Facts, Limits, facts, limits};

/// One of the three tables of the valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValveTable {
    /// `valve.opening_V`; its scale stretches the opening.
    Opening,
    /// `valve.supply_area_m2`.
    SupplyArea,
    /// `valve.exhaust_area_m2`.
    ExhaustArea,
}

impl ValveTable {
    /// All three, in the order of the file.
    pub const ALL: [Self; 3] = [Self::Opening, Self::SupplyArea, Self::ExhaustArea];

    /// The spelling `section.key`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Opening => "valve.opening_V",
            Self::SupplyArea => "valve.supply_area_m2",
            Self::ExhaustArea => "valve.exhaust_area_m2",
        }
    }

    /// The table of that key.
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|table| table.key() == key)
    }

    /// The points of the table.
    pub fn points(self, valve: &Valve) -> &Vec<f64> {
        match self {
            Self::Opening => &valve.opening_v,
            Self::SupplyArea => &valve.supply_area_m2,
            Self::ExhaustArea => &valve.exhaust_area_m2,
        }
    }

    pub(super) fn points_mut(self, valve: &mut Valve) -> &mut Vec<f64> {
        match self {
            Self::Opening => &mut valve.opening_v,
            Self::SupplyArea => &mut valve.supply_area_m2,
            Self::ExhaustArea => &mut valve.exhaust_area_m2,
        }
    }

    /// What a person needs to know of it.
    pub(super) fn facts(self) -> Facts {
        match self {
            Self::Opening => facts(
                "V",
                "[0, 0.3, ..., 5]",
                "opening abs(u - null) of the points of both area tables: begins at 0, rises",
                "flow test; a dead zone of 0.2 to 0.5 V is typical",
            ),
            Self::SupplyArea => facts(
                "m2",
                "[1e-7, 1e-7, ..., 1.7e-5]",
                "orifice area from the supply at those openings; the first is the leakage of the closed path",
                "flow test: area = mass flow sqrt(T) / (Cd C1 p psi)",
            ),
            Self::ExhaustArea => facts(
                "m2",
                "[1e-7, 1e-7, ..., 1.7e-5]",
                "orifice area to the exhaust at those openings",
                "as supply_area_m2; often 0.8 to 1.3 times as large",
            ),
        }
    }

    /// What one entry may be.
    pub(super) fn limits(self) -> Limits {
        match self {
            Self::Opening => limits(0.0, 1000.0, "volts from 0 to 1000"),
            Self::SupplyArea | Self::ExhaustArea => {
                limits(0.0, 0.01, "m2 from 0 to 0.01 (is this mm2?)")
            }
        }
    }
}
