//! The extension module behind the Python package `pneuma`: rigs, recordings and the work on them.
//! Results go over as JSON, the very text that the program writes; what is shown of them stands in
//! the package's Python.

mod errors;
mod recording;
mod rig;
mod steps;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _pneuma {
    #[pymodule_export]
    use super::errors::PneumaError;
    #[pymodule_export]
    use super::recording::{Recording, tables};
    #[pymodule_export]
    use super::rig::Rig;
    #[pymodule_export]
    use super::steps::{Controller, Plant};
    #[pymodule_export]
    use super::work::{Diagnosis, compare, diagnose, fit, identify, inspect, simulate, valve_flow};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
