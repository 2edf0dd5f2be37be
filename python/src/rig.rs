//! Rigs.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::errors::of_rig;

/// What is known of a rig.
#[pyclass(frozen, module = "pneuma")]
#[derive(Clone)]
pub struct Rig {
    pub inner: grey_box::rig::Rig,
    /// Where it was read.
    pub name: String,
}

#[pymethods]
impl Rig {
    /// Reads a rig file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        Ok(Self {
            inner: grey_box::rig::Rig::read(&path).map_err(of_rig)?,
            name: path.display().to_string(),
        })
    }

    /// Reads the text of a rig file.
    #[staticmethod]
    #[pyo3(signature = (text, name = "rig.toml"))]
    fn parse(text: &str, name: &str) -> PyResult<Self> {
        Ok(Self {
            inner: grey_box::rig::Rig::parse(text, name).map_err(of_rig)?,
            name: name.into(),
        })
    }

    /// The rig as the text of a rig file.
    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    /// The number of a key such as `"valve.null_V"`, SI; `None` where the rig does not state it.
    fn value(&self, key: &str) -> Option<f64> {
        self.inner.value(key)
    }

    /// The signals that the rig records, by name: column and unit.
    fn signals(&self) -> Vec<(String, String, String)> {
        let signals = self.inner.signals.iter();
        let facts = signals.map(|(name, signal)| {
            let column = match &signal.column {
                grey_box::rig::Column::Name(column) => column.clone(),
                grey_box::rig::Column::Number(number) => number.to_string(),
                grey_box::rig::Column::Constant(value) => format!("constant {value}"),
                grey_box::rig::Column::Every(value) => format!("every {value}"),
            };
            (name.to_owned(), column, signal.unit.to_string())
        });
        facts.collect()
    }

    fn __repr__(&self) -> String {
        let names: Vec<&str> = self.inner.signals.iter().map(|(name, _)| name).collect();
        format!("Rig({:?}, signals: {})", self.name, names.join(", "))
    }
}
