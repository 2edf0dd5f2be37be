//! Steps a functional mock-up unit that another tool has written: FMI 2.0 and 3.0, co-simulation.
//!
//! | file | what |
//! |---|---|
//! | `description` | `modelDescription.xml`: which variables there are |
//! | `library` | the shared library of this system, out of the archive |
//! | `component` | an instance of either standard: its pointer, its log, its end |
//! | `fmi2`, `fmi3` | its functions, by the standard's headers |
//!
//! A unit is somebody else's program: it runs with the rights of whoever starts it, and what it
//! breaks is broken. Numbers are real ones, in the unit that the description states.

mod component;
mod description;
mod fmi2;
mod fmi3;
mod library;

pub use description::{Causality, Variable};

use description::{Description, Standard};
use library::Extracted;
use std::path::Path;

/// Why a unit is of no use.
#[derive(Debug, thiserror::Error)]
pub enum UnitError {
    /// The file is none.
    #[error("is no functional mock-up unit: {0}")]
    Archive(String),
    /// The description says something that this program cannot do.
    #[error("modelDescription.xml: {0}")]
    Description(String),
    /// The library cannot be used here.
    #[error("{0}")]
    Library(String),
    /// One of its functions did not succeed.
    #[error("{function} gave {status}{}", said(.log))]
    Refused {
        /// The function's name.
        function: &'static str,
        /// The status, in words.
        status: &'static str,
        /// What the unit said.
        log: String,
    },
}

fn said(log: &str) -> String {
    if log.is_empty() {
        String::new()
    } else {
        format!(": {log}")
    }
}

/// What a unit does, whatever its standard.
trait Stepped {
    fn initialise(&mut self) -> Result<(), UnitError>;
    fn set(&mut self, reference: u32, value: f64) -> Result<(), UnitError>;
    fn get(&mut self, reference: u32) -> Result<f64, UnitError>;
    fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError>;
}

/// A unit of another tool.
pub struct Unit {
    // Before the files that its library lies in: dropped first.
    stepped: Box<dyn Stepped>,
    variables: Vec<Variable>,
    name: String,
    _files: Extracted,
}

impl std::fmt::Debug for Unit {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = &self.name;
        out.debug_struct("Unit").field("name", name).finish()
    }
}

impl Unit {
    /// Opens a file `.fmu` and makes one instance of what is in it.
    ///
    /// # Errors
    /// If it is no unit for co-simulation, or has no library for this system.
    pub fn open(path: &Path) -> Result<Self, UnitError> {
        let files = Extracted::of(path)?;
        let Description {
            standard,
            model,
            token,
            name,
            variables,
        } = Description::read(&files.description()?)?;
        let library = files.library(standard, &model)?;
        let resources = files.resources();
        let stepped: Box<dyn Stepped> = match standard {
            Standard::Two => Box::new(fmi2::Instance::new(library, &token, &resources)?),
            Standard::Three => Box::new(fmi3::Instance::new(library, &token, &resources)?),
        };
        Ok(Self {
            stepped,
            variables,
            name,
            _files: files,
        })
    }

    /// What its author calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its real variables.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// The real variable of that name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|one| one.name == name)
    }

    /// Ends the time in which parameters and starts are set; time 0 begins.
    ///
    /// # Errors
    /// If the unit refuses.
    pub fn initialise(&mut self) -> Result<(), UnitError> {
        self.stepped.initialise()
    }

    /// Sets a variable.
    ///
    /// # Errors
    /// If the unit refuses.
    pub fn set(&mut self, variable: &Variable, value: f64) -> Result<(), UnitError> {
        self.stepped.set(variable.reference, value)
    }

    /// Reads a variable.
    ///
    /// # Errors
    /// If the unit refuses.
    pub fn get(&mut self, variable: &Variable) -> Result<f64, UnitError> {
        self.stepped.get(variable.reference)
    }

    /// A step of so many seconds from a time on.
    ///
    /// # Errors
    /// If the unit refuses, or ends before.
    pub fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError> {
        self.stepped.step(time_s, step_s)
    }
}
