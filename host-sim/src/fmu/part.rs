//! What is inside of a unit.

use super::kind::Kind;
use super::variables::{BELIEF, INSIDE, SENSORS, TRUTH};
use crate::closed_loop::{control_task, controller};
use crate::model::AxisFault;
use crate::motion::as_sent;
use crate::plant::{Change, Plant, PlantSettings, coded, command_code, seen, valve_v};
use crate::rig::Rig;
use firmware::codes::AdcCodes;
use firmware::control_task::ControlTask;
use firmware::tick::{Command, Sample};
use model_core::controller::{Controller, Measurements};
use model_core::observer::ObserverState;
use model_core::reference::Reference;

/// Values of variables by name.
pub(super) trait Values {
    /// The value of a variable that the kind has; 0 of others.
    fn get(&self, name: &str) -> f64;
    /// Sets an output.
    fn put(&mut self, name: &str, value: f64);
}

/// A unit between two ticks.
#[derive(Clone, Debug)]
pub(super) enum Part {
    Plant(Box<Axis>),
    Controller(Box<Loop>),
    Observer(Box<Watch>),
}

impl Part {
    /// At the beginning, for a rig; outputs are set.
    pub(super) fn new(kind: Kind, rig: &Rig, values: &mut impl Values) -> Result<Self, AxisFault> {
        Ok(match kind {
            Kind::Plant => Self::Plant(Box::new(Axis::new(rig, values)?)),
            Kind::Controller => Self::Controller(Box::new(Loop::new(rig, values)?)),
            Kind::Observer => Self::Observer(Box::new(Watch::new(rig)?)),
        })
    }

    /// One tick: inputs are read, outputs set.
    pub(super) fn tick(&mut self, values: &mut impl Values) {
        match self {
            Self::Plant(axis) => axis.tick(values),
            Self::Controller(control) => control.tick(values),
            Self::Observer(watch) => watch.tick(values),
        }
    }
}

/// The simulated axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    plant: Plant,
    push_n: f64,
}

impl Axis {
    fn new(rig: &Rig, values: &mut impl Values) -> Result<Self, AxisFault> {
        let seed = values.get("plant.seed") as i64 as u64;
        let settings = PlantSettings::at(values.get("plant.start_m"), seed);
        let mut axis = Self {
            plant: Plant::new(rig, settings)?,
            push_n: 0.0,
        };
        axis.show(values);
        Ok(axis)
    }

    fn tick(&mut self, values: &mut impl Values) {
        let push_n = values.get("push_n");
        let changes = [
            Change::Mass(values.get("moving_mass_kg")),
            Change::SupplyPressure(values.get("regulator_pressure_pa")),
            Change::Push(push_n - self.push_n),
        ];
        for change in changes {
            self.plant.change(change);
        }
        self.push_n = push_n;
        self.plant.command(values.get("command_v"));
        self.plant.advance_held();
        self.show(values);
    }

    fn show(&mut self, values: &mut impl Values) {
        let shown = seen(&self.plant.sample());
        let sensors = [
            shown.position_m,
            shown.pressure_a_pa,
            shown.pressure_b_pa,
            shown.supply_pressure_pa,
            shown.velocity_m_s,
        ];
        let now = self.plant.truth();
        let truth = [
            now.position_m,
            now.velocity_m_s,
            now.pressure_a_pa,
            now.pressure_b_pa,
            now.supply_pressure_pa,
            now.temperature_a_k,
            now.temperature_b_k,
            now.friction_n,
        ];
        for ((name, ..), value) in SENSORS.iter().zip(sensors).chain(TRUTH.iter().zip(truth)) {
            values.put(name, value);
        }
    }
}

/// The codes of the converters for what they are told to see.
fn codes(values: &impl Values) -> AdcCodes {
    coded(SENSORS.map(|(name, ..)| values.get(name)))
}

/// The control task.
#[derive(Clone, Debug)]
pub(super) struct Loop {
    task: ControlTask,
    tick: u32,
    acknowledged: bool,
}

impl Loop {
    fn new(rig: &Rig, values: &mut impl Values) -> Result<Self, AxisFault> {
        let null_v = rig.value("valve.null_V");
        values.put(
            "command_v",
            null_v.ok_or_else(|| AxisFault::missing("valve.null_V"))?,
        );
        Ok(Self {
            task: control_task(rig)?,
            tick: 0,
            acknowledged: false,
        })
    }

    fn tick(&mut self, values: &mut impl Values) {
        let acknowledged = values.get("acknowledge") > 0.0;
        if acknowledged && !self.acknowledged {
            self.task.acknowledge();
        }
        self.acknowledged = acknowledged;
        let command = self.task.tick(&Sample {
            tick: self.tick,
            codes: codes(values),
            reference: as_sent(&wish(values)),
        });
        self.tick = self.tick.wrapping_add(1);
        show_command(&command, values);
    }
}

/// What is asked of the load; NaN asks for nothing.
fn wish(values: &impl Values) -> Reference<f64> {
    let position_m = if values.get("enable") > 0.0 {
        values.get("reference_position_m")
    } else {
        f64::NAN
    };
    Reference {
        position_m,
        velocity_m_per_s: values.get("reference_velocity_m_per_s"),
        acceleration_m_per_s2: values.get("reference_acceleration_m_per_s2"),
    }
}

fn show_command(command: &Command, values: &mut impl Values) {
    values.put("command_v", valve_v(command.valve));
    values.put("state", f64::from(command.state as u8));
    values.put("fault", f64::from(command.fault));
    let belief = command.estimate.to_array();
    for ((name, ..), value) in BELIEF.iter().zip(belief) {
        values.put(name, f64::from(value));
    }
}

/// The observer of the control task alone.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    controller: Controller<f32>,
    state: Option<ObserverState<f32>>,
    /// What acted up to the present sample, V.
    command_v: f32,
}

impl Watch {
    fn new(rig: &Rig) -> Result<Self, AxisFault> {
        let controller = controller(rig)?;
        Ok(Self {
            command_v: controller.null_v(),
            controller,
            state: None,
        })
    }

    fn tick(&mut self, values: &mut impl Values) {
        let measured: Measurements<f32> = codes(values).measurements();
        let (axis, observer) = (self.controller.axis(), self.controller.observer());
        let state = match &mut self.state {
            Some(state) => {
                observer.step(axis, state, self.command_v, &measured);
                state
            }
            none => none.insert(observer.begin(axis, &measured)),
        };
        self.command_v = valve_v(command_code(values.get("command_v"))) as f32;
        let belief = [
            state.carriage.position_m.value,
            state.carriage.velocity_m_per_s,
            state.carriage.friction_n,
            state.disturbance_n,
        ];
        let [a, b] = [
            state.pneumatics.a.gas_state(),
            state.pneumatics.b.gas_state(),
        ];
        let inside = [
            a.pressure_pa,
            b.pressure_pa,
            a.temperature_k,
            b.temperature_k,
            state.felt_spool_v,
            state.edges.above_v,
            state.edges.below_v,
        ];
        for ((name, ..), value) in BELIEF.iter().zip(belief).chain(INSIDE.iter().zip(inside)) {
            values.put(name, f64::from(value));
        }
    }
}
