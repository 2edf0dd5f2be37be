//! Who answers a sample with a command.

use crate::model::AxisFault;
use crate::plant::PlantSettings;
use crate::rig::Rig;
use firmware::codes::ValveConverter;
use firmware::control_task::ControlTask;
use firmware::link::{self, CommandRecord};
use firmware::settings::{Connection, Wiring};
use firmware::tick::Sample;
use model_core::controller::Controller;

/// Why no command came.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The other side broke off or does not speak the link's language.
    #[error("{0}")]
    Link(String),
}

/// A controller as the plant sees it.
pub trait Drive {
    /// The answer to a sample.
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError>;
}

/// The control code of the firmware, compiled for the host.
pub struct HostController {
    task: ControlTask,
}

impl HostController {
    /// A control task before its first tick.
    pub fn new(task: ControlTask) -> Self {
        Self { task }
    }

    /// The control task, for orders beside the samples.
    pub fn task_mut(&mut self) -> &mut ControlTask {
        &mut self.task
    }
}

impl Drive for HostController {
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let payload = link::command(&self.task.tick(sample));
        let own = || DriveError::Link("the control task's own command cannot be read".into());
        link::read_command(&payload).ok_or_else(own)
    }
}

/// The controller for a rig as the firmware has it, in single precision, by way
/// of the board's settings.
pub fn controller(rig: &Rig) -> Result<Controller<f32>, AxisFault> {
    Ok(crate::settings::controller(rig, PlantSettings::TICK_S)?)
}

/// The control task for a rig whose wiring was checked.
pub fn control_task(rig: &Rig) -> Result<ControlTask, AxisFault> {
    wired_task(rig, Wiring::Checked)
}

/// The control task for a rig whose wiring was checked or not.
pub fn wired_task(rig: &Rig, wiring: Wiring) -> Result<ControlTask, AxisFault> {
    // A plant gives codes on the scales of the link, whatever its sensors are.
    let connection = Connection::standard(wiring);
    let converter = ValveConverter::TwelveBits;
    Ok(ControlTask::of(controller(rig)?, &connection, converter))
}
