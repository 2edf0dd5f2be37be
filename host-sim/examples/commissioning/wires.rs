//! An axis of `truth-plant` behind wires that somebody may have exchanged, and what it does meanwhile.

use firmware::codes::{AdcCode, AdcCodes, DacCode, POSITION_M};
use host_sim::board::twin::Axis;
use host_sim::fault_campaign::Wiring;
use host_sim::plant::command_code;
use host_sim::trial::drawn_axis::DrawnAxis;
use std::sync::{Arc, Mutex, PoisonError};

/// What a gauge at the surroundings shows.
const SURROUNDINGS: AdcCode = AdcCode(6560);

/// What is the wrong way round, and what a check must say of it.
#[derive(Clone, Copy, Debug)]
pub struct Wires {
    pub name: &'static str,
    /// Words of the finding.
    pub said: &'static str,
    /// One after the other.
    pub ways: &'static [Wiring],
    pub valve_without_power: bool,
    /// Shows the surroundings.
    pub dead_gauge: Option<char>,
    pub both_gauges_at_a: bool,
}

impl Wires {
    /// As they should be.
    pub const RIGHT: Self = Self {
        name: "right",
        said: "",
        ways: &[],
        valve_without_power: false,
        dead_gauge: None,
        both_gauges_at_a: false,
    };

    /// Twelve ways to be wrong.
    pub const WRONG: [Self; 12] = [
        Self {
            name: "valve reversed",
            said: "the valve is reversed",
            ways: &[Wiring::ReversedValve],
            ..Self::RIGHT
        },
        Self {
            name: "gauges exchanged",
            said: "the gauges of the two chambers are exchanged",
            ways: &[Wiring::ExchangedGauges],
            ..Self::RIGHT
        },
        Self {
            name: "tubes exchanged, gauges with them",
            said: "the load goes the wrong way",
            ways: &[Wiring::ExchangedPorts],
            ..Self::RIGHT
        },
        Self {
            name: "position and velocity reversed",
            said: "the load goes the wrong way",
            ways: &[Wiring::ReversedMotion],
            ..Self::RIGHT
        },
        Self {
            name: "position reversed",
            said: "the position is reversed",
            ways: &[Wiring::ReversedPosition],
            ..Self::RIGHT
        },
        Self {
            name: "velocity reversed",
            said: "the velocity is reversed",
            ways: &[Wiring::ReversedVelocity],
            ..Self::RIGHT
        },
        Self {
            name: "valve and position reversed",
            said: "and position are reversed",
            ways: &[Wiring::ReversedValve, Wiring::ReversedPosition],
            ..Self::RIGHT
        },
        Self {
            name: "valve and velocity reversed",
            said: "and velocity are reversed",
            ways: &[Wiring::ReversedValve, Wiring::ReversedVelocity],
            ..Self::RIGHT
        },
        Self {
            name: "gauge a dead",
            said: "chamber a does not answer",
            dead_gauge: Some('a'),
            ..Self::RIGHT
        },
        Self {
            name: "gauge b dead",
            said: "chamber b does not answer",
            dead_gauge: Some('b'),
            ..Self::RIGHT
        },
        Self {
            name: "both gauges at chamber a",
            said: "both chambers answer the valve alike",
            both_gauges_at_a: true,
            ..Self::RIGHT
        },
        Self {
            name: "valve without power",
            said: "neither chamber answers",
            valve_without_power: true,
            ..Self::RIGHT
        },
    ];

    /// What the converters see.
    fn seen(self, codes: AdcCodes) -> AdcCodes {
        let mut seen = self.ways.iter().fold(codes, |codes, way| way.seen(codes));
        if self.both_gauges_at_a {
            seen.pressure_b = seen.pressure_a;
        }
        match self.dead_gauge {
            Some('a') => seen.pressure_a = SURROUNDINGS,
            Some(_) => seen.pressure_b = SURROUNDINGS,
            None => {}
        }
        seen
    }

    /// What the valve gets of a command.
    fn driven(self, command: DacCode, null: DacCode) -> DacCode {
        if self.valve_without_power {
            return null;
        }
        let through = |command, way: &Wiring| way.driven(command, null);
        self.ways.iter().fold(command, through)
    }
}

/// What of an axis is changed and looked at while a board runs it.
#[derive(Clone, Copy, Debug)]
pub struct Looked {
    pub wires: Wires,
    /// Where the load first stood, and how far it went from there.
    pub first_m: Option<f64>,
    pub went_m: f64,
    pub ticks: u64,
}

/// Both sides have it.
pub type Shared = Arc<Mutex<Looked>>;

/// An axis as a board sees it.
pub struct Wired {
    axis: DrawnAxis,
    /// The valve's true null: exchanged tubes mirror a command about it.
    null: DacCode,
    looked: Shared,
}

impl Wired {
    pub fn new(axis: DrawnAxis, null_v: f64, wires: Wires) -> (Self, Shared) {
        let looked = Arc::new(Mutex::new(Looked {
            wires,
            first_m: None,
            went_m: 0.0,
            ticks: 0,
        }));
        let wired = Self {
            axis,
            null: command_code(null_v),
            looked: Arc::clone(&looked),
        };
        (wired, looked)
    }
}

impl Axis for Wired {
    fn codes(&mut self) -> AdcCodes {
        let codes = self.axis.codes();
        let mut looked = self.looked.lock().unwrap_or_else(PoisonError::into_inner);
        let position_m = f64::from(POSITION_M.value(codes.position.0));
        let first_m = *looked.first_m.get_or_insert(position_m);
        looked.went_m = looked.went_m.max((position_m - first_m).abs());
        looked.ticks += 1;
        looked.wires.seen(codes)
    }

    fn advance(&mut self, command: DacCode) {
        let looked = self.looked.lock().unwrap_or_else(PoisonError::into_inner);
        let wires = looked.wires;
        drop(looked);
        self.axis.advance(wires.driven(command, self.null));
    }
}
