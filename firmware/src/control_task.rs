//! The control task: one pure call a tick.

use crate::codes::{AdcCodes, CommandShaper, DacCode};
use model_core::controller::{Controller, ControllerState, Estimate};
use model_core::reference::Reference;

/// What comes in at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Number of the tick.
    pub tick: u32,
    /// The converters' codes.
    pub codes: AdcCodes,
    /// Where the load should be; NaN asks for nothing.
    pub reference: Reference<f32>,
}

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
}

/// What goes out at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Tick of the sample.
    pub tick: u32,
    /// For the valve.
    pub valve: DacCode,
    /// State of the controller.
    pub state: State,
    /// 0, or the code of the fault.
    pub fault: u8,
    /// What the observer believes.
    pub estimate: Estimate<f32>,
}

/// Why a controller was not swapped: the axis is not at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotAtRest;

/// Controller, its memory and the converter's shaping.
#[derive(Clone, Debug)]
pub struct ControlTask {
    controller: Controller<f32>,
    memory: Option<ControllerState<f32>>,
    shaper: CommandShaper,
    state: State,
}

impl ControlTask {
    /// A task before its first tick.
    pub fn new(controller: Controller<f32>) -> Self {
        Self {
            controller,
            memory: None,
            shaper: CommandShaper::default(),
            state: State::Init,
        }
    }

    /// Swaps the controller; its memory begins anew at the next tick. Only where
    /// the valve is at its null anyway: in the states idle and fault.
    pub fn replace_controller(&mut self, controller: Controller<f32>) -> Result<(), NotAtRest> {
        match self.state {
            State::Idle | State::Fault => {
                self.controller = controller;
                self.memory = None;
                Ok(())
            }
            State::Init | State::Track => Err(NotAtRest),
        }
    }

    /// One tick.
    pub fn tick(&mut self, sample: &Sample) -> Command {
        let measured = sample.codes.measurements();
        let memory = self
            .memory
            .get_or_insert_with(|| self.controller.begin(&measured));
        let action = self.controller.track(memory, &measured, &sample.reference);
        let null_v = self.controller.null_v();
        self.state = State::Track;
        Command {
            tick: sample.tick,
            valve: self.shaper.code(action.command_v, null_v),
            state: self.state,
            fault: 0,
            estimate: action.estimate,
        }
    }
}
