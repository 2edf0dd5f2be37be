//! One unit at work.

use super::TICK_S;
use super::kind::Kind;
use super::part::{Part, Values};
use super::variables::{Causality, Variable, variables};
use crate::model::AxisFault;
use crate::rig::{Rig, RigError};

/// Why a unit does not do what a tool asks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The tool asks out of turn.
    #[error("{0}")]
    OutOfTurn(&'static str),
    /// There is no such variable.
    #[error(
        "value reference {0}: there is no such variable, expected those of modelDescription.xml"
    )]
    NoVariable(u32),
    /// A value that a variable cannot have.
    #[error("{name} = {value}: expected {expected}")]
    Value {
        /// The variable.
        name: String,
        /// What it was to be.
        value: f64,
        /// What it may be.
        expected: String,
    },
    /// A time that is no tick.
    #[error("a communication step of {0} s: expected {TICK_S} s, the tick of the board")]
    Step(f64),
    /// The rig, with the parameters that the tool set, is none.
    #[error("{0}")]
    Rig(RigError),
}

impl Refusal {
    fn of_axis(fault: AxisFault) -> Self {
        Self::Rig(RigError {
            file: "rig".into(),
            line: None,
            key: Some(fault.key),
            problem: fault.problem,
            expected: fault.expected,
        })
    }
}

/// A unit from its instantiation on.
#[derive(Clone, Debug)]
pub struct Component {
    kind: Kind,
    rig: Rig,
    table: Table,
    is_initialising: bool,
    part: Option<Part>,
}

/// Variables and their values.
#[derive(Clone, Debug)]
struct Table {
    variables: Vec<Variable>,
    values: Vec<f64>,
}

impl Table {
    /// The value of a name; where an input and an output share one, `causality` decides.
    fn place(&self, name: &str, is_output: bool) -> Option<usize> {
        // From the end: inputs and outputs, which every tick asks for, stand behind the parameters.
        self.variables.iter().rposition(|variable| {
            variable.name == name && (variable.causality == Causality::Output) == is_output
        })
    }
}

impl Values for Table {
    fn get(&self, name: &str) -> f64 {
        self.place(name, false)
            .map_or(0.0, |place| self.values[place])
    }

    fn put(&mut self, name: &str, value: f64) {
        if let Some(place) = self.place(name, true) {
            self.values[place] = value;
        }
    }
}

impl Component {
    /// A unit of this kind for a rig.
    ///
    /// # Errors
    /// Where the rig lacks a number that the unit needs.
    pub fn new(kind: Kind, rig: &Rig) -> Result<Self, Refusal> {
        let variables = variables(kind, rig).map_err(Refusal::of_axis)?;
        let values = variables.iter().map(|variable| variable.start).collect();
        Ok(Self {
            kind,
            rig: rig.clone(),
            table: Table { variables, values },
            is_initialising: false,
            part: None,
        })
    }

    /// The variables; a value reference is a place counted from 1.
    pub fn variables(&self) -> &[Variable] {
        &self.table.variables
    }

    fn place(&self, reference: u32) -> Result<usize, Refusal> {
        let place = (reference as usize).checked_sub(1);
        place
            .filter(|place| *place < self.table.values.len())
            .ok_or(Refusal::NoVariable(reference))
    }

    /// A value.
    ///
    /// # Errors
    /// Where there is no such variable.
    pub fn get(&self, reference: u32) -> Result<f64, Refusal> {
        let place = self.place(reference)?;
        Ok(self.table.values[place])
    }

    /// Sets a parameter before the initialisation ends, an input at any time.
    ///
    /// # Errors
    /// For outputs, for parameters later on, and for values that the variable cannot have.
    pub fn set(&mut self, reference: u32, value: f64) -> Result<(), Refusal> {
        let place = self.place(reference)?;
        let variable = &self.table.variables[place];
        match variable.causality {
            Causality::Output => return Err(Refusal::OutOfTurn("an output cannot be set")),
            Causality::Parameter if self.part.is_some() => {
                let late = "a parameter cannot be set after the initialisation";
                return Err(Refusal::OutOfTurn(late));
            }
            Causality::Parameter | Causality::Input => {}
        }
        if !variable.admits(value) {
            return Err(Refusal::Value {
                name: variable.name.clone(),
                value,
                expected: variable.expected(),
            });
        }
        self.table.values[place] = value;
        Ok(())
    }

    /// The initialisation begins.
    ///
    /// # Errors
    /// Where it has been.
    pub fn begin_initialisation(&mut self) -> Result<(), Refusal> {
        if self.is_initialising || self.part.is_some() {
            return Err(Refusal::OutOfTurn("the unit is initialised already"));
        }
        self.is_initialising = true;
        Ok(())
    }

    /// The initialisation ends: the axis is built from the rig and the parameters.
    ///
    /// # Errors
    /// Where it has not begun, and where the numbers make no axis.
    pub fn end_initialisation(&mut self) -> Result<(), Refusal> {
        if !self.is_initialising {
            return Err(Refusal::OutOfTurn("the initialisation has not begun"));
        }
        let rig = self.rig_as_set()?;
        self.follow(&rig)?;
        let part = Part::new(self.kind, &rig, &mut self.table).map_err(Refusal::of_axis)?;
        self.part = Some(part);
        self.is_initialising = false;
        Ok(())
    }

    /// An input that nobody set begins as the rig with its parameters has it: else it would take a
    /// parameter back at the first tick.
    fn follow(&mut self, rig: &Rig) -> Result<(), Refusal> {
        let begun = variables(self.kind, rig).map_err(Refusal::of_axis)?;
        let known = self.table.variables.iter().zip(&mut self.table.values);
        for ((variable, value), begun) in known.zip(begun) {
            let is_unset = variable.start.to_bits() == value.to_bits();
            if variable.causality == Causality::Input && is_unset {
                *value = begun.start;
            }
        }
        Ok(())
    }

    /// The rig with the parameters that were set; it is read back, so that its limits hold.
    fn rig_as_set(&self) -> Result<Rig, Refusal> {
        let mut rig = self.rig.clone();
        let mut is_changed = false;
        for (variable, value) in self.table.variables.iter().zip(&self.table.values) {
            let is_set = variable.start.to_bits() != value.to_bits();
            if variable.is_of_rig() && is_set {
                rig.set_value(&variable.name, *value)
                    .map_err(|_| Refusal::OutOfTurn("a parameter has no place in the rig"))?;
                is_changed = true;
            }
        }
        if !is_changed {
            return Ok(rig);
        }
        Rig::parse(&rig.to_toml(), "the rig with the parameters set").map_err(Refusal::Rig)
    }

    /// One tick.
    ///
    /// # Errors
    /// Before the initialisation, and for a step that is no tick.
    pub fn step(&mut self, step_s: f64) -> Result<(), Refusal> {
        // Tools add up their times: the last bits of a difference are theirs.
        let is_tick = (step_s - TICK_S).abs() <= 1e-6 * TICK_S;
        let part = self.part.as_mut();
        let part = part.ok_or(Refusal::OutOfTurn("the unit is not initialised"))?;
        if !is_tick {
            return Err(Refusal::Step(step_s));
        }
        part.tick(&mut self.table);
        Ok(())
    }

    /// As instantiated.
    ///
    /// # Errors
    /// None that the instantiation had not.
    pub fn reset(&mut self) -> Result<(), Refusal> {
        *self = Self::new(self.kind, &self.rig)?;
        Ok(())
    }
}
