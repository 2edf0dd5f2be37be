//! What comes in at a tick and what goes out.

use crate::codes::{AdcCodes, DacCode};
use model_core::controller::Estimate;
use model_core::reference::Reference;

/// What comes in at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Number of the tick.
    pub tick: u32,
    /// The converters' codes, of whatever sensors there are.
    pub codes: AdcCodes,
    /// Where the load should be; NaN asks for nothing.
    pub reference: Reference<f32>,
}

/// Why a controller was not swapped: the axis is not at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotAtRest;

/// State of the controller as the outside sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// The observer settles; the valve is at its null.
    Init = 0,
    /// Nothing is asked for; the valve is at its null.
    Idle = 1,
    /// The load follows the reference.
    Track = 2,
    /// Something is wrong; the valve is at its null.
    Fault = 3,
    /// An experiment commands the valve or the force.
    Open = 4,
}

impl State {
    /// The state of a code.
    pub fn from_code(code: u8) -> Option<Self> {
        [Self::Init, Self::Idle, Self::Track, Self::Fault, Self::Open]
            .into_iter()
            .find(|state| *state as u8 == code)
    }
}

/// What goes out at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Tick of the sample.
    pub tick: u32,
    /// The sample's codes on the scales of the link.
    pub codes: AdcCodes,
    /// For the valve.
    pub valve: DacCode,
    /// State of the controller.
    pub state: State,
    /// 0, or the code of the fault, see [`crate::fault::Fault`].
    pub fault: u8,
    /// Where the load should be, m; NaN where nothing is asked of the loop. An experiment's own
    /// reference stands in the place of the sample's.
    pub reference_position_m: f32,
    /// What the observer believes.
    pub estimate: Estimate<f32>,
}
