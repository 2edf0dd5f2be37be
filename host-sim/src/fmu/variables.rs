//! The variables of a unit.

use super::kind::Kind;
use crate::effects::EFFECTS;
use crate::model::AxisFault;
use crate::plant::supply_pressure_pa;
use crate::rig::{Rig, ValveTable, describe, key_bounds};

/// What a variable is to the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// A number that is settled before the first step.
    Parameter,
    /// Set before a step.
    Input,
    /// Read after a step.
    Output,
}

/// The type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// A double.
    Real,
    /// A 32-bit integer.
    Integer,
}

/// One variable; its value reference is its place in the list, counted from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name, ending in its unit unless it is a key of the rig.
    pub name: String,
    /// What it is to the tool.
    pub causality: Causality,
    /// Its type.
    pub of_type: Type,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// Its value before anybody sets it; outputs: before the first initialisation.
    pub start: f64,
    /// What it is, in a few words.
    pub what: String,
    /// What it may be.
    range: Range,
}

/// What a variable may be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Range {
    /// Anything: what is no number is a reading that failed, a reference that asks for nothing.
    Anything,
    /// A number.
    Finite,
    /// A number between two others.
    Between(f64, f64),
}

impl Variable {
    /// Whether it may have this value. What a rig file admits is asked when the rig is built.
    pub(super) fn admits(&self, value: f64) -> bool {
        match self.range {
            Range::Anything => true,
            Range::Finite => value.is_finite(),
            Range::Between(low, high) => (low..=high).contains(&value),
        }
    }

    /// What it may be, in words.
    pub(super) fn expected(&self) -> String {
        match self.range {
            Range::Anything => "anything".into(),
            Range::Finite => "a number".into(),
            Range::Between(low, high) => format!("a number from {low} to {high}"),
        }
    }

    /// Whether it is a number of the rig.
    pub(super) fn is_of_rig(&self) -> bool {
        self.causality == Causality::Parameter && !self.name.starts_with(OF_PLANT)
    }

    fn within(mut self, key: &str) -> Self {
        if let Some((low, high)) = key_bounds(key) {
            self.range = Range::Between(low, high);
        }
        self
    }

    fn or_none(mut self) -> Self {
        self.range = Range::Anything;
        self
    }

    fn new(causality: Causality, name: &str, unit: &'static str, start: f64, what: &str) -> Self {
        Self {
            name: name.to_owned(),
            causality,
            of_type: Type::Real,
            unit,
            start,
            what: what.to_owned(),
            range: Range::Finite,
        }
    }

    fn whole(mut self) -> Self {
        self.of_type = Type::Integer;
        self
    }
}

/// Names of parameters that are no keys of the rig begin so.
const OF_PLANT: &str = "plant.";

/// Name, unit, what.
type Said = (&'static str, &'static str, &'static str);

/// What the converters show, in the order of the link.
pub(super) const SENSORS: [Said; 5] = [
    ("position_m", "m", "position, as its converter shows it"),
    (
        "pressure_a_pa",
        "Pa",
        "pressure of chamber a, as its converter shows it",
    ),
    (
        "pressure_b_pa",
        "Pa",
        "pressure of chamber b, as its converter shows it",
    ),
    (
        "supply_pressure_pa",
        "Pa",
        "supply pressure, as its converter shows it",
    ),
    (
        "velocity_m_per_s",
        "m/s",
        "velocity, as its converter shows it",
    ),
];

/// What no converter shows.
pub(super) const TRUTH: [Said; 8] = [
    ("true_position_m", "m", "position"),
    ("true_velocity_m_per_s", "m/s", "velocity"),
    ("true_pressure_a_pa", "Pa", "pressure of chamber a"),
    ("true_pressure_b_pa", "Pa", "pressure of chamber b"),
    (
        "true_supply_pressure_pa",
        "Pa",
        "supply pressure at its gauge",
    ),
    (
        "temperature_a_k",
        "K",
        "temperature of the gas in chamber a",
    ),
    (
        "temperature_b_k",
        "K",
        "temperature of the gas in chamber b",
    ),
    ("friction_n", "N", "friction against +x"),
];

/// What the controller believes.
pub(super) const BELIEF: [Said; 4] = [
    (
        "estimated_position_m",
        "m",
        "position, as the observer has it",
    ),
    (
        "estimated_velocity_m_per_s",
        "m/s",
        "velocity, as the observer has it",
    ),
    (
        "estimated_friction_n",
        "N",
        "friction against +x, as the observer has it",
    ),
    (
        "estimated_disturbance_n",
        "N",
        "force along +x that no law explains",
    ),
];

/// What the observer believes beside.
pub(super) const INSIDE: [Said; 7] = [
    (
        "estimated_pressure_a_pa",
        "Pa",
        "pressure of chamber a, as the observer has it",
    ),
    (
        "estimated_pressure_b_pa",
        "Pa",
        "pressure of chamber b, as the observer has it",
    ),
    (
        "estimated_temperature_a_k",
        "K",
        "temperature of the gas in chamber a",
    ),
    (
        "estimated_temperature_b_k",
        "K",
        "temperature of the gas in chamber b",
    ),
    (
        "estimated_spool_v",
        "V",
        "the command that the spool has reached",
    ),
    (
        "edge_above_v",
        "V",
        "how far the valve opens later than the rig says, above its null",
    ),
    ("edge_below_v", "V", "the same below its null"),
];

/// The variables of a unit of this kind for a rig: parameters, inputs, outputs.
///
/// # Errors
/// Where the rig has no valve's null or no supply pressure.
pub fn variables(kind: Kind, rig: &Rig) -> Result<Vec<Variable>, AxisFault> {
    let null_v = value(rig, "valve.null_V")?;
    let mut list = match kind {
        Kind::Plant => of_plant(),
        Kind::Controller | Kind::Observer => Vec::new(),
    };
    list.extend(of_rig(rig));
    list.extend(match kind {
        Kind::Plant => inputs_of_plant(rig, null_v)?,
        Kind::Controller => inputs_of_controller(rig)?,
        Kind::Observer => inputs_of_observer(rig, null_v)?,
    });
    match kind {
        Kind::Plant => {
            list.extend(outputs(&SENSORS, null_v));
            list.extend(outputs(&TRUTH, null_v));
        }
        Kind::Controller => {
            list.extend(outputs(&COMMAND, null_v));
            list.extend(outputs(&CONDITION, null_v).map(Variable::whole));
            list.extend(outputs(&BELIEF, null_v));
        }
        Kind::Observer => {
            list.extend(outputs(&BELIEF, null_v));
            list.extend(outputs(&INSIDE, null_v));
        }
    }
    Ok(list)
}

fn of_plant() -> Vec<Variable> {
    let start = parameter(
        "plant.start_m",
        "m",
        0.0,
        "where the carriage rests at the beginning",
    );
    let seed = parameter("plant.seed", "", 1.0, "seed of the sensors' noise");
    vec![start, seed.whole()]
}

fn inputs_of_plant(rig: &Rig, null_v: f64) -> Result<Vec<Variable>, AxisFault> {
    let (supply_key, mass_key) = ("supply.pressure_Pa", "carriage.mass_kg");
    let supply_pa = value(rig, supply_key)?;
    let mass_kg = value(rig, mass_key)?;
    let supply = input(
        "regulator_pressure_pa",
        "Pa",
        supply_pa,
        "supply pressure at the regulator",
    );
    let mass = input("moving_mass_kg", "kg", mass_kg, "the moving mass");
    Ok(vec![
        input(
            "command_v",
            "V",
            null_v,
            "the valve's input; the 12 bits of its converter are taken",
        ),
        input("push_n", "N", 0.0, "a force along +x besides the rig's"),
        supply.within(supply_key),
        mass.within(mass_key),
    ])
}

fn inputs_of_controller(rig: &Rig) -> Result<Vec<Variable>, AxisFault> {
    let mut list = sensors(rig)?;
    let where_to = "where the load should be; no number: nothing is asked";
    list.extend([
        input("reference_position_m", "m", 0.0, where_to).or_none(),
        input("reference_velocity_m_per_s", "m/s", 0.0, "its velocity"),
        input(
            "reference_acceleration_m_per_s2",
            "m/s2",
            0.0,
            "its acceleration",
        ),
        input("enable", "", 1.0, "0: nothing is asked of the axis").whole(),
        input(
            "acknowledge",
            "",
            0.0,
            "from 0 to 1: somebody has seen the fault",
        )
        .whole(),
    ]);
    Ok(list)
}

fn inputs_of_observer(rig: &Rig, null_v: f64) -> Result<Vec<Variable>, AxisFault> {
    let mut list = sensors(rig)?;
    list.push(input(
        "command_v",
        "V",
        null_v,
        "the valve's input that acts from now on",
    ));
    Ok(list)
}

/// What the controller commands.
const COMMAND: [Said; 1] = [("command_v", "V", "the valve's input, to act from now on")];

/// How the controller is.
const CONDITION: [Said; 2] = [
    ("state", "", "0 init, 1 idle, 2 track, 3 fault, 4 open"),
    ("fault", "", "the fault's number, 0: none"),
];

fn value(rig: &Rig, key: &str) -> Result<f64, AxisFault> {
    rig.value(key).ok_or_else(|| AxisFault::missing(key))
}

fn input(name: &str, unit: &'static str, start: f64, what: &str) -> Variable {
    Variable::new(Causality::Input, name, unit, start, what)
}

fn parameter(name: &str, unit: &'static str, start: f64, what: &str) -> Variable {
    Variable::new(Causality::Parameter, name, unit, start, what)
}

/// Sensors as inputs, as an axis at rest has them.
fn sensors(rig: &Rig) -> Result<Vec<Variable>, AxisFault> {
    let supply_pa = supply_pressure_pa(rig)?;
    let middle_pa = 0.5 * (supply_pa + rig.ambient_pressure_pa());
    let starts = [0.0, middle_pa, middle_pa, supply_pa, 0.0];
    let sensor =
        |((name, unit, what), start): (Said, f64)| input(name, unit, start, what).or_none();
    Ok(SENSORS.into_iter().zip(starts).map(sensor).collect())
}

/// Outputs; a voltage begins at the valve's null.
fn outputs(said: &[Said], null_v: f64) -> impl Iterator<Item = Variable> {
    said.iter().map(move |(name, unit, what)| {
        let start = if *unit == "V" { null_v } else { 0.0 };
        Variable::new(Causality::Output, name, unit, start, what)
    })
}

/// Every number of the rig and every parameter of every effect, those that it does not have at
/// their neutral values.
fn of_rig(rig: &Rig) -> Vec<Variable> {
    let keys = rig.value_keys().into_iter();
    let is_number =
        |key: &String| !key.starts_with("effects.") && ValveTable::from_key(key).is_none();
    let numbers = keys.filter(is_number);
    let effects = EFFECTS.iter().flat_map(|effect| {
        let name = effect.name;
        let known = effect.parameters.iter();
        known.map(move |known| (format!("effects.{name}.{}", known.key), known.neutral))
    });
    let all = numbers.map(|key| (key, None)).chain(effects);
    all.filter_map(|(key, neutral)| {
        // XML of tools has no infinite numbers; "from the first moment" is a finite one.
        let start = rig.value(&key).or(neutral)?.clamp(f64::MIN, f64::MAX);
        let facts = describe(&key)?;
        let unit = match facts.unit {
            "1" | "signal" => "",
            unit => unit,
        };
        Some(parameter(&key, unit, start, facts.what))
    })
    .collect()
}
