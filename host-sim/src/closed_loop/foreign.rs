//! A plant that another tool has written: a functional mock-up unit in the axis' place.
//!
//! What it gives as position, pressures and velocity is what the converters see; a velocity that
//! it does not give is worked out from the position, a supply pressure that it does not give is
//! the rig's. Events of a motion file, noise of the sensors and end stops are its own matter.

use super::drive::DriveError;
use super::run::Driven;
use crate::model::AxisFault;
use crate::plant::{EndStop, Sample, coded, valve_v};
use crate::rig::Rig;
use crate::text::{closest, expected_one_of};
use crate::units::Unit as Measured;
use firmware::codes::{AdcCodes, DacCode};
use firmware::sensing::Sensing;
use firmware::settings::Sensors;
use foreign_unit::{Causality, Unit, UnitError, Variable};
use std::collections::BTreeMap;
use std::path::Path;

/// A signal of the loop: its key, and the variable that it is unless told, as `pneuma fmu` names
/// them.
struct Signal {
    key: &'static str,
    usual: &'static str,
    unit: &'static str,
    is_needed: bool,
}

const fn signal(key: &'static str, usual: &'static str, unit: &'static str) -> Signal {
    let is_needed = true;
    Signal {
        key,
        usual,
        unit,
        is_needed,
    }
}

const COMMAND: Signal = signal("u", "command_v", "V");
/// In the order of the link.
const SHOWN: [Signal; 5] = [
    signal("x", "position_m", "m"),
    signal("p_a", "pressure_a_pa", "Pa(abs)"),
    signal("p_b", "pressure_b_pa", "Pa(abs)"),
    Signal {
        is_needed: false,
        ..signal("p_s", "supply_pressure_pa", "Pa(abs)")
    },
    Signal {
        is_needed: false,
        ..signal("v", "velocity_m_per_s", "m/s")
    },
];

/// The signals that a variable can stand for.
pub const FOREIGN_SIGNALS: [&str; 6] = {
    let [x, a, b, supply, v] = &SHOWN;
    [COMMAND.key, x.key, a.key, b.key, supply.key, v.key]
};

/// A variable, and the unit in which it is.
struct Port {
    variable: Variable,
    measured: Measured,
    /// From where it counts, SI.
    zero: f64,
}

impl Port {
    fn to_si(&self, value: f64) -> f64 {
        self.zero + self.measured.to_si(value)
    }

    fn of_si(&self, value: f64) -> f64 {
        (value - self.measured.to_si(0.0)) / self.measured.factor()
    }
}

/// What is told of a unit.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// Variables by the signal that they are.
    pub variables: BTreeMap<String, String>,
    /// Parameters by name, in the unit of the description.
    pub parameters: BTreeMap<String, f64>,
}

/// A plant of another tool, stepped tick by tick.
pub struct ForeignPlant {
    unit: Unit,
    command: Port,
    shown: [Option<Port>; 5],
    sensing: Sensing,
    supply_pressure_pa: f64,
    tick_s: f64,
    tick: u64,
    command_v: f64,
    /// In the order of the link, SI.
    now: [f64; 5],
}

impl ForeignPlant {
    /// A unit at time 0, the valve at the rig's null.
    ///
    /// # Errors
    /// If the file is no unit that runs here, or lacks a variable.
    pub fn open(path: &Path, rig: &Rig, told: &Told, tick_s: f64) -> Result<Self, AxisFault> {
        let refused = |error: UnitError| refused(&error);
        let mut unit = Unit::open(path).map_err(refused)?;
        let command = port(&unit, rig, (&COMMAND, Causality::Input), told)?;
        let command = command.ok_or_else(|| AxisFault::missing(COMMAND.key))?;
        let mut shown = [None, None, None, None, None];
        for (place, signal) in shown.iter_mut().zip(&SHOWN) {
            *place = port(&unit, rig, (signal, Causality::Output), told)?;
        }
        for (name, value) in &told.parameters {
            let parameter = parameter(&unit, name)?;
            unit.set(&parameter, *value).map_err(refused)?;
        }
        let null_v = rig.value("valve.null_V");
        let command_v = null_v.ok_or_else(|| AxisFault::missing("valve.null_V"))?;
        unit.set(&command.variable, command.of_si(command_v))
            .map_err(refused)?;
        unit.initialise().map_err(refused)?;
        let sensors = Sensors {
            velocity_m_per_s: Sensors::STANDARD
                .velocity_m_per_s
                .filter(|_| shown[4].is_some()),
            ..Sensors::STANDARD
        };
        let supply_pressure_pa = match &shown[3] {
            Some(_) => 0.0,
            None => rig
                .value("supply.pressure_Pa")
                .ok_or_else(|| AxisFault::missing("supply.pressure_Pa"))?,
        };
        let mut plant = Self {
            unit,
            command,
            shown,
            sensing: Sensing::new(&sensors, tick_s as f32),
            supply_pressure_pa,
            tick_s,
            tick: 0,
            command_v,
            now: [0.0; 5],
        };
        plant.look().map_err(refused)?;
        Ok(plant)
    }

    /// What is not in the unit and is made up: a line each.
    pub fn assumed(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.shown[3].is_none() {
            let pressure_pa = self.supply_pressure_pa;
            lines.push(format!(
                "p_s: {pressure_pa} Pa as the rig says, the unit gives none"
            ));
        }
        if self.shown[4].is_none() {
            lines.push("v: worked out from x, the unit gives none".into());
        }
        lines
    }

    fn look(&mut self) -> Result<(), UnitError> {
        for (now, port) in self.now.iter_mut().zip(&self.shown) {
            if let Some(port) = port {
                *now = port.to_si(self.unit.get(&port.variable)?);
            }
        }
        if self.shown[3].is_none() {
            self.now[3] = self.supply_pressure_pa;
        }
        Ok(())
    }

    fn step(&mut self, command: DacCode) -> Result<(), UnitError> {
        self.unit.step(self.time_s(), self.tick_s)?;
        self.tick += 1;
        self.look()?;
        self.command_v = valve_v(command);
        let value = self.command.of_si(self.command_v);
        self.unit.set(&self.command.variable, value)
    }
}

impl Driven for ForeignPlant {
    fn time_s(&self) -> f64 {
        self.tick as f64 * self.tick_s
    }

    fn truth(&self) -> Sample {
        let [
            position_m,
            pressure_a_pa,
            pressure_b_pa,
            supply_pressure_pa,
            velocity_m_s,
        ] = self.now;
        Sample {
            time_s: self.time_s(),
            command_v: self.command_v,
            pressure_a_pa,
            pressure_b_pa,
            supply_pressure_pa,
            position_m,
            velocity_m_s,
            ..Sample::default()
        }
    }

    fn sample(&mut self) -> AdcCodes {
        self.sensing.shown(&coded(self.now))
    }

    fn advance(&mut self, command: DacCode) -> Result<(), DriveError> {
        let tick = self.tick;
        self.step(command)
            .map_err(|error| DriveError::Link(format!("the plant's unit at tick {tick}: {error}")))
    }

    fn end_stop(&self) -> Option<EndStop> {
        None
    }
}

fn refused(error: &UnitError) -> AxisFault {
    AxisFault {
        key: "unit".into(),
        problem: error.to_string(),
        expected: "a unit for co-simulation of FMI 2.0 or 3.0 that runs on this system".into(),
    }
}

/// The variable of a signal; `None` where the unit may do without and nobody named one.
fn port(
    unit: &Unit,
    rig: &Rig,
    (signal, causality): (&Signal, Causality),
    told: &Told,
) -> Result<Option<Port>, AxisFault> {
    let named = told.variables.get(signal.key);
    let name = named.map_or(signal.usual, String::as_str);
    let variable = match unit.variable(name) {
        Some(variable) => variable.clone(),
        None if named.is_none() && !signal.is_needed => return Ok(None),
        None => {
            let of_it = unit.variables().iter();
            let of_it = of_it.filter(|one| one.causality == causality);
            let names: Vec<&str> = of_it.map(|one| one.name.as_str()).collect();
            return Err(AxisFault {
                key: signal.key.into(),
                problem: format!("the unit has no real variable {name}"),
                expected: format!(
                    "--plant-variable {}=NAME, {}",
                    signal.key,
                    expected_one_of(name, &names)
                ),
            });
        }
    };
    let measured = measured(&variable, signal).map_err(|problem| AxisFault {
        key: signal.key.into(),
        problem: format!("the unit's variable {name}: {problem}"),
        expected: format!("a unit of {}", signal.unit),
    })?;
    let zero = if measured.is_gauge() {
        rig.ambient_pressure_pa()
    } else {
        0.0
    };
    Ok(Some(Port {
        variable,
        measured,
        zero,
    }))
}

/// In which unit a variable is: SI where its description says nothing, pressures absolute where
/// it does not say from where they count.
fn measured(variable: &Variable, signal: &Signal) -> Result<Measured, String> {
    let wanted = Measured::parse(signal.unit).map_err(|error| error.problem)?;
    let Some(stated) = &variable.unit else {
        return Ok(wanted);
    };
    let absolute = format!("{stated}(abs)");
    let read = Measured::parse(stated).or_else(|_| Measured::parse(&absolute));
    let read = read.map_err(|_| format!("its unit \"{stated}\" is unknown"))?;
    if read.dimension() == wanted.dimension() {
        Ok(read)
    } else {
        Err(format!("its unit \"{stated}\" does not fit"))
    }
}

fn parameter(unit: &Unit, name: &str) -> Result<Variable, AxisFault> {
    unit.variable(name).cloned().ok_or_else(|| {
        let names = unit.variables().iter().map(|one| one.name.as_str());
        let near = closest(name, names).unwrap_or_default();
        AxisFault {
            key: name.into(),
            problem: "the unit has no such real variable".into(),
            expected: format!("the name of one, such as \"{near}\""),
        }
    })
}
