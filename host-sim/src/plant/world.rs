//! An axis in its surroundings, stepped through time: what the open-loop
//! simulation and the closed loop share.

use crate::effects::flow::{chamber_leakage, supply_droop, valve_delay};
use crate::model::{AxisFault, Side, Values};
use crate::rig::Rig;
use model_core::axis::{Axis, AxisInputs, AxisState};
use model_core::left_out::{ChamberLeakage, DELAY_CAPACITY};
use model_core::valve::{GasState, Port};

/// Halvings of the pressure interval: to the last bit of a double.
const EQUILIBRIUM_HALVINGS: u32 = 60;

/// What happened at one row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// The command from this row to the next, V.
    pub command_v: f64,
    /// Pressure of chamber a, Pa absolute.
    pub pressure_a_pa: f64,
    /// Pressure of chamber b, Pa absolute.
    pub pressure_b_pa: f64,
    /// Supply pressure where its gauge sits, Pa absolute: at the valve, unless the rig says.
    pub supply_pressure_pa: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_m_s: f64,
    /// Temperature of the gas in chamber a, K.
    pub temperature_a_k: f64,
    /// Temperature of the gas in chamber b, K.
    pub temperature_b_k: f64,
    /// Friction against +x, mean over the last step, N.
    pub friction_n: f64,
}

/// An axis, its state, and what its surroundings do to it.
#[derive(Clone, Debug)]
pub struct World {
    /// The axis.
    pub axis: Axis<f64>,
    /// Its state.
    pub state: AxisState<f64>,
    /// Supply pressure at the regulator, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Whether its gauge sits there too, and not at the valve.
    gauges_regulator: bool,
    leak_onset_s: f64,
    /// The leaks of both chambers once open.
    leaks: (ChamberLeakage<f64>, ChamberLeakage<f64>),
}

impl World {
    /// The rig's axis in a state.
    pub fn new(rig: &Rig, axis: Axis<f64>, state: AxisState<f64>, supply_pressure_pa: f64) -> Self {
        Self {
            gauges_regulator: supply_droop::gauge_before_feed(&Values::of(rig)),
            leak_onset_s: leak_onset_s(rig),
            leaks: (axis.pneumatics.leak_a, axis.pneumatics.leak_b),
            axis,
            state,
            supply_pressure_pa,
        }
    }

    /// One integration step under a command, ending at `end_s`.
    pub fn step(&mut self, command_v: f64, end_s: f64) {
        self.open_leaks(end_s);
        let inputs = AxisInputs {
            command_v,
            supply_pressure_pa: self.supply_pressure_pa,
        };
        self.axis.step(&mut self.state, &inputs);
    }

    /// What happens now, for a row at `time_s` whose command holds to the next.
    pub fn sample(&self, time_s: f64, command_v: f64) -> Sample {
        let AxisState {
            pneumatics,
            carriage,
            ..
        } = &self.state;
        let chambers = &self.axis.pneumatics;
        let a = chambers.chamber_a.seen(pneumatics.a.gas_state(), 0.0);
        let b = chambers.chamber_b.seen(pneumatics.b.gas_state(), 0.0);
        Sample {
            time_s,
            command_v,
            pressure_a_pa: a.pressure_pa,
            pressure_b_pa: b.pressure_pa,
            supply_pressure_pa: if self.gauges_regulator {
                self.supply_pressure_pa
            } else {
                pneumatics.tank.pressure_pa(self.supply_pressure_pa)
            },
            position_m: carriage.position_m.value,
            velocity_m_s: carriage.velocity_m_per_s,
            temperature_a_k: a.temperature_k,
            temperature_b_k: b.temperature_k,
            friction_n: carriage.friction_n,
        }
    }

    /// The leaks by the part of the step to `end_s` for which they are open.
    fn open_leaks(&mut self, end_s: f64) {
        let open = ((end_s - self.leak_onset_s) / self.axis.dt_s).clamp(0.0, 1.0);
        self.axis.pneumatics.leak_a = self.leaks.0.scaled(open);
        self.axis.pneumatics.leak_b = self.leaks.1.scaled(open);
    }
}

/// The rig's axis for steps of `step_s`.
pub(crate) fn axis(rig: &Rig, step_s: f64) -> Result<Axis<f64>, AxisFault> {
    let axis = Values::of(rig).axis(step_s)?;
    check_delay(rig, &axis)?;
    Ok(axis)
}

/// The supply pressure that the rig states, Pa absolute.
pub(crate) fn supply_pressure_pa(rig: &Rig) -> Result<f64, AxisFault> {
    let key = "supply.pressure_Pa";
    rig.value(key).ok_or_else(|| AxisFault::missing(key))
}

/// A delay longer than the model's memory would be cut in silence.
fn check_delay(rig: &Rig, axis: &Axis<f64>) -> Result<(), AxisFault> {
    let delay_s = valve_delay::law(&Values::of(rig)).delay_s;
    let longest_s = (DELAY_CAPACITY - 2) as f64 * axis.dt_s;
    if delay_s <= longest_s {
        return Ok(());
    }
    Err(AxisFault {
        key: "effects.valve-delay.delay_s".into(),
        problem: format!("{delay_s} s is more than {longest_s} s"),
        expected: format!(
            "at most {} steps of {} s: a longer step_s",
            DELAY_CAPACITY - 2,
            axis.dt_s
        ),
    })
}

/// Time at which the leaks of the chambers open, s.
fn leak_onset_s(rig: &Rig) -> f64 {
    chamber_leakage::onset_s(&Values::of(rig))
}

/// The pressure at which the valve at its null lets in as much as it and the
/// chamber's leak let out, with all gas at the temperature of the surroundings;
/// `None` where nothing flows and any pressure stays.
pub(crate) fn equilibrium_pa(
    rig: &Rig,
    axis: &Axis<f64>,
    supply_pressure_pa: f64,
    side: Side,
) -> Option<f64> {
    let leaks_now = leak_onset_s(rig) <= 0.0;
    let inflow =
        |pressure_pa| net_inflow_kg_per_s(axis, side, supply_pressure_pa, pressure_pa, leaks_now);
    let ambient_pa = axis.pneumatics.ambient.pressure_pa;
    if inflow(ambient_pa) <= 0.0 && inflow(supply_pressure_pa) >= 0.0 {
        return None;
    }
    let (mut low, mut high) = (ambient_pa, supply_pressure_pa);
    for _ in 0..EQUILIBRIUM_HALVINGS {
        let middle = 0.5 * (low + high);
        if inflow(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

fn net_inflow_kg_per_s(
    axis: &Axis<f64>,
    side: Side,
    supply_pressure_pa: f64,
    pressure_pa: f64,
    leaks_now: bool,
) -> f64 {
    let pneumatics = &axis.pneumatics;
    let ambient = pneumatics.ambient;
    let gas = |pressure_pa| GasState {
        pressure_pa,
        temperature_k: ambient.temperature_k,
    };
    let areas = axis.valve.areas(axis.valve.null_v);
    let (port, leak) = match side {
        Side::A => (Port::A, &pneumatics.leak_a),
        Side::B => (Port::B, &pneumatics.leak_b),
    };
    let (supply_m2, exhaust_m2) = match port {
        Port::A => (areas.supply_a_m2, areas.exhaust_a_m2),
        Port::B => (areas.supply_b_m2, areas.exhaust_b_m2),
    };
    let law = &axis.valve.law;
    let chamber = gas(pressure_pa);
    let leak_outflow = if leaks_now {
        leak.outflow(&pneumatics.law, chamber, ambient).0
    } else {
        0.0
    };
    law.flow(supply_m2, gas(supply_pressure_pa), chamber)
        .mass_flow_kg_per_s
        - law.flow(exhaust_m2, chamber, ambient).mass_flow_kg_per_s
        - leak_outflow
}
