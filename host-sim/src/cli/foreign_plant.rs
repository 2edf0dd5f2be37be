//! The plant of `pneuma loop` as a functional mock-up unit of another tool.

use super::inputs::bad_input;
use super::{CommandError, inputs};
use crate::closed_loop::{FOREIGN_SIGNALS, ForeignPlant, Told};
use crate::rig::Rig;
use crate::text::expected_one_of;
use clap::Args;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

/// A plant of another tool in place of the rig's.
#[derive(Args, Clone, Debug, Default)]
pub struct ForeignArguments {
    /// The plant as a unit of another tool (FMI 2.0 or 3.0, co-simulation) in place of the simulated one; it is a program and runs as one.
    #[arg(long, value_name = "FMU")]
    pub plant: Option<PathBuf>,
    /// Which variable of the unit a signal is: u, x, p_a, p_b, p_s or v; those of `pneuma fmu --kind plant` unless told.
    #[arg(long, value_name = "SIGNAL=NAME", requires = "plant")]
    pub plant_variable: Vec<String>,
    /// A real parameter of the unit, in the unit of its description.
    #[arg(long, value_name = "NAME=NUMBER", requires = "plant")]
    pub plant_parameter: Vec<String>,
}

impl ForeignArguments {
    /// The plant that is asked for, with a line for what is made up; `None` for the simulated one.
    ///
    /// # Errors
    /// If it cannot be used.
    pub fn open(
        &self,
        rig: &Rig,
        tick_s: f64,
        out: &mut dyn Write,
    ) -> Result<Option<ForeignPlant>, CommandError> {
        let Some(path) = &self.plant else {
            return Ok(None);
        };
        let plant = ForeignPlant::open(path, rig, &self.told()?, tick_s);
        let plant = plant.map_err(|fault| inputs::rig_fault(path, fault))?;
        for line in plant.assumed() {
            writeln!(out, "{}: {line}", path.display())?;
        }
        Ok(Some(plant))
    }

    /// Whose position errors are about.
    pub fn whose_position(&self) -> &'static str {
        match self.plant {
            Some(_) => "the unit's position",
            None => "true position",
        }
    }

    fn told(&self) -> Result<Told, CommandError> {
        let mut variables = BTreeMap::new();
        for (signal, name) in pairs("--plant-variable", "SIGNAL=NAME", &self.plant_variable)? {
            if !FOREIGN_SIGNALS.contains(&signal.as_str()) {
                return Err(bad_input(format!(
                    "--plant-variable {signal}: no signal of the loop, expected {}",
                    expected_one_of(&signal, &FOREIGN_SIGNALS)
                )));
            }
            variables.insert(signal, name);
        }
        let mut parameters = BTreeMap::new();
        for (name, value) in pairs("--plant-parameter", "NAME=NUMBER", &self.plant_parameter)? {
            let number: f64 = value.parse().map_err(|_| {
                bad_input(format!(
                    "--plant-parameter {name}: is {value}, expected a number"
                ))
            })?;
            parameters.insert(name, number);
        }
        Ok(Told {
            variables,
            parameters,
        })
    }
}

fn pairs(
    option: &str,
    form: &str,
    words: &[String],
) -> Result<Vec<(String, String)>, CommandError> {
    let split = |word: &String| {
        let (name, value) = word
            .split_once('=')
            .ok_or_else(|| bad_input(format!("{option}: is {word}, expected {form}")))?;
        Ok((name.trim().to_owned(), value.trim().to_owned()))
    };
    words.iter().map(split).collect()
}
