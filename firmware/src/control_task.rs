//! The control task: one pure call a tick.

use crate::codes::{CommandShaper, ValveConverter};
use crate::experiment::frames::{Report, Request};
use crate::experiment::{Asked, Experiment, Readiness, Reason};
use crate::fault::{Fault, Finding};
use crate::link::Order;
use crate::sensing::Sensing;
use crate::settings::{Connection, NULL_V, Wiring};
use crate::start::ResetCause;
use crate::status::{Counters, Program, Status, TickCost};
use crate::supervisor::{Shown, Supervisor};
use crate::tick::{Command, NotAtRest, Sample, State};
use model_core::controller::{Action, Controller, ControllerState, Estimate, Measurements, Wish};
use model_core::reference::Reference;

/// By how much more slowly the observer follows the pressures after the first swings: 40 per second
/// hold the axis about lags of 5 ms to 0.02 mm (docs/settings.md).
const CALMER: f32 = 0.2;
/// By how much slower the loop becomes after the next ones, each time.
const SLOWER: f32 = 0.5;

/// A load at rest is no faster, m/s: what offset and noise of a velocity sensor show.
const AT_REST_M_PER_S: f32 = 0.02;

/// The middle of the valve's scale, where a null that is no number is taken to
/// be: no setting, checked or not, may ever open the valve in a fault.
const MIDDLE_V: f32 = 5.0;

/// Controller, its memory, its supervision and the converter's shaping.
#[derive(Clone, Debug)]
pub struct ControlTask {
    controller: Controller<f32>,
    memory: Option<ControllerState<f32>>,
    shaper: CommandShaper,
    supervisor: Supervisor,
    experiment: Experiment,
    estimate: Estimate<f32>,
    /// Velocity of the last sample, m/s.
    velocity_m_per_s: f32,
    wiring: Wiring,
    /// A fault took back that the wiring was checked, and nobody stored it yet.
    is_void_to_store: bool,
    sensing: Sensing,
}

impl ControlTask {
    /// A task before its first tick, for a valve behind 12 bits, at an axis with standard sensors
    /// whose wiring was checked.
    pub fn new(controller: Controller<f32>) -> Self {
        let connection = Connection::standard(Wiring::Checked);
        Self::of(controller, &connection, ValveConverter::TwelveBits)
    }

    /// The same, for an axis that is so connected, and a valve behind this converter.
    pub fn of(
        controller: Controller<f32>,
        connection: &Connection,
        converter: ValveConverter,
    ) -> Self {
        Self {
            wiring: connection.wiring,
            is_void_to_store: false,
            sensing: Sensing::new(&connection.sensors, controller.axis().dt_s),
            supervisor: Supervisor::new(controller.axis(), connection.wiring),
            controller,
            memory: None,
            shaper: CommandShaper::new(converter),
            experiment: Experiment::default(),
            estimate: Estimate {
                position_m: 0.0,
                velocity_m_per_s: 0.0,
                friction_n: 0.0,
                disturbance_n: 0.0,
            },
            velocity_m_per_s: 0.0,
        }
    }

    /// Swaps the controller; its memory begins anew at the next tick. Only where
    /// the valve is at its null anyway: in the state idle while the load stands, and in the state
    /// fault, in which a board may have no sensors yet that could say so.
    pub fn replace_controller(
        &mut self,
        controller: Controller<f32>,
        connection: &Connection,
    ) -> Result<(), NotAtRest> {
        let is_free = self.stands() && !self.experiment.is_running();
        match self.supervisor.state() {
            State::Idle if !is_free => Err(NotAtRest),
            State::Idle | State::Fault => {
                let axis = controller.axis();
                self.supervisor.replace_axis(axis, connection.wiring);
                self.sensing = Sensing::new(&connection.sensors, axis.dt_s);
                self.controller = controller;
                self.wiring = connection.wiring;
                self.memory = None;
                Ok(())
            }
            State::Init | State::Track | State::Open => Err(NotAtRest),
        }
    }

    fn stands(&self) -> bool {
        self.velocity_m_per_s.abs() < AT_REST_M_PER_S
    }

    /// Does what a host asks of an experiment; what it is told then.
    pub fn serve_experiment(&mut self, request: &Request<'_>) -> Report {
        let ready = Readiness {
            is_idle: self.supervisor.state() == State::Idle,
            stands: self.stands(),
            position_m: self.estimate.position_m,
            wiring: self.wiring,
        };
        self.experiment.serve(request, ready)
    }

    /// Somebody wishes the axis to be let go: an experiment ends.
    pub fn let_go(&mut self) {
        self.experiment.halt(Reason::Stopped);
    }

    /// The board saw a fault: the next tick reacts.
    pub fn note_fault(&mut self, finding: Finding) {
        if finding.fault == Fault::TaskOverrun {
            let overruns = &mut self.supervisor.counters_mut().overruns;
            *overruns = overruns.saturating_add(1);
        }
        self.supervisor.note(finding);
    }

    /// Does as it is told; whether there was anything to do.
    pub fn obey(&mut self, order: Order) -> bool {
        match order {
            Order::Acknowledge => self.acknowledge(),
            Order::Inject(finding) => {
                self.note_fault(finding);
                true
            }
        }
    }

    /// What the board counts.
    pub fn counters_mut(&mut self) -> &mut Counters {
        self.supervisor.counters_mut()
    }

    /// Somebody has seen the fault: back to idle, with an observer that begins
    /// anew; the axis tracks again once that has settled and a sample that is
    /// newer brings a reference. False where there is no fault or its cause
    /// still stands.
    pub fn acknowledge(&mut self) -> bool {
        let is_left = self.supervisor.acknowledge();
        if is_left {
            self.memory = None;
        }
        is_left
    }

    /// The fault that nobody acknowledged: what to keep over a reset.
    pub fn latched(&self) -> Option<Finding> {
        self.supervisor.latched()
    }

    /// A fault before the first tick: what the start found, or what was kept
    /// over the reset.
    pub fn recall(&mut self, finding: Finding) {
        self.supervisor.trip(finding, 0);
    }

    /// The status report, without what only a board's application knows: its program and the cost
    /// of a tick.
    pub fn status(&self, reset_cause: ResetCause, has_built_in_settings: bool) -> Status {
        Status {
            state: self.supervisor.state(),
            finding: self.supervisor.latched(),
            fault_tick: self.supervisor.fault_tick(),
            reset_cause,
            has_built_in_settings,
            wiring: self.wiring,
            calmed: self.supervisor.calmed(),
            program: Program::default(),
            tick_cost: TickCost::default(),
            counters: *self.supervisor.counters(),
        }
    }

    /// One tick.
    pub fn tick(&mut self, sample: &Sample) -> Command {
        let codes = self.sensing.shown(&sample.codes);
        let measured = codes.measurements();
        self.velocity_m_per_s = measured.velocity_m_per_s;
        let tried = self.experiment(sample.tick, &measured);
        let reference = &tried.map_or(sample.reference, Asked::reference);
        let may_follow = tried.is_some() | (self.wiring == Wiring::Checked);
        let axis = self.controller.axis();
        let shown = Shown {
            tick: sample.tick,
            codes: &codes,
            measured: &measured,
        };
        let asked = match self.supervisor.step(axis, &shown, (reference, may_follow)) {
            State::Fault => {
                self.experiment.halt(Reason::Fault);
                self.doubt_wiring();
                self.supervisor.remember_spool(self.null_v());
                None
            }
            State::Init | State::Idle | State::Open => {
                let command_v = self.observe(&measured, None, sample.tick);
                let wish = tried.and_then(|tried| tried.wish(self.null_v()));
                match wish {
                    Some(wish) if command_v.is_some() => self.try_out(&wish, sample.tick),
                    _ => command_v,
                }
            }
            State::Track => self.observe(&measured, Some(reference), sample.tick),
        };
        let null_v = self.null_v();
        if let (State::Track, Some(command_v)) = (self.supervisor.state(), asked) {
            let dt_s = self.controller.axis().dt_s;
            let time = (dt_s, sample.tick);
            let is_swinging = self
                .supervisor
                .watch_command(reference, command_v - null_v, time);
            if is_swinging {
                self.calm();
            }
        }
        let state = match self.supervisor.state() {
            State::Idle if tried.is_some() => State::Open,
            state => state,
        };
        let is_commanded = matches!(state, State::Track | State::Open);
        let command_v = if is_commanded {
            asked.unwrap_or(null_v)
        } else {
            let axis = self.controller.axis();
            let brake_v = self.supervisor.brake_v(axis, &measured, sample.tick);
            null_v + brake_v.unwrap_or(0.0)
        };
        if !is_commanded {
            self.shaper.forget();
        }
        Command {
            tick: sample.tick,
            codes,
            valve: self.shaper.code(command_v, null_v),
            state,
            fault: self
                .supervisor
                .latched()
                .map_or(0, |finding| finding.fault.code()),
            reference_position_m: reference.position_m,
            estimate: self.estimate,
        }
    }

    /// What an experiment asks for at this tick, if one runs.
    #[inline]
    fn experiment(&mut self, tick: u32, measured: &Measurements<f32>) -> Option<Asked> {
        if !self.experiment.is_running() {
            return None;
        }
        let axis = self.controller.axis();
        let drive_n = axis
            .carriage
            .drive_n(measured.pressure_a_pa, measured.pressure_b_pa);
        self.experiment.step((tick, axis.dt_s), measured, drive_n)
    }

    /// The command for what an experiment wishes of valve or force. One that is no number is a
    /// fault.
    #[inline(never)]
    fn try_out(&mut self, wish: &Wish<f32>, tick: u32) -> Option<f32> {
        let command_v = self.controller.instead(self.memory.as_mut()?, wish);
        if !command_v.is_finite() {
            self.supervisor.trip(Fault::NotANumber.at(0), tick);
            return None;
        }
        Some(command_v)
    }

    /// One tick of the observer, and of the controller where there is a
    /// reference. A result that is no number is a fault.
    fn observe(
        &mut self,
        measured: &Measurements<f32>,
        reference: Option<&Reference<f32>>,
        tick: u32,
    ) -> Option<f32> {
        let controller = &self.controller;
        let memory = self
            .memory
            .get_or_insert_with(|| controller.begin(measured));
        let action = match reference {
            Some(reference) => controller.track(memory, measured, reference),
            None => controller.idle(memory, measured),
        };
        // The observer knows of delay, slew limit, spool and tubes what the rig does.
        self.supervisor
            .remember_spool(controller.felt_spool_v(memory));
        if is_finite(&action) {
            self.estimate = action.estimate;
            Some(action.command_v)
        } else {
            self.supervisor.trip(Fault::NotANumber.at(0), tick);
            None
        }
    }

    /// The loop swings: the observer follows the pressures more slowly, then the whole loop
    /// becomes slower.
    fn calm(&mut self) {
        if self.supervisor.calmed() == 1 {
            self.controller.follow_pressures_slower(CALMER);
        } else {
            self.controller.slow_down(SLOWER);
        }
    }

    /// A fault of the wiring takes back that it was checked.
    #[cold]
    fn doubt_wiring(&mut self) {
        let finding = self.supervisor.latched();
        if finding.is_some_and(|finding| finding.fault == Fault::WrongPolarity) {
            self.is_void_to_store |= self.wiring == Wiring::Checked;
            self.wiring = Wiring::Unchecked;
        }
    }

    /// Whether a fault took back that the wiring was checked: told once, for the storage.
    pub fn take_void(&mut self) -> bool {
        core::mem::take(&mut self.is_void_to_store)
    }

    /// The valve's null, V.
    fn null_v(&self) -> f32 {
        let null_v = self.controller.null_v();
        if null_v.is_finite() {
            null_v.clamp(NULL_V[0], NULL_V[1])
        } else {
            MIDDLE_V
        }
    }
}

/// One comparison for all numbers: nought times what is infinite or no number is no number.
fn is_finite(action: &Action<f32>) -> bool {
    let numbers = action.estimate.to_array().into_iter();
    let noughts = numbers.fold(0.0 * action.command_v, |sum, number| sum + 0.0 * number);
    noughts == 0.0
}
