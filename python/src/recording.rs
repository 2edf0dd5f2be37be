//! Recordings: from files of every format, and from arrays.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::{of_recording, unusable};
use crate::rig::Rig;

/// A recording in SI units, pressures absolute.
#[pyclass(frozen, module = "pneuma")]
#[derive(Clone)]
pub struct Recording {
    pub inner: grey_box::recording::Recording,
}

#[pymethods]
impl Recording {
    /// Reads the columns that a rig names.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, rig: &Rig) -> PyResult<Self> {
        let signals = &rig.inner.signals;
        let read = py.detach(|| grey_box::recording::Recording::read(&path, signals));
        let mut inner = read.map_err(of_recording)?;
        if let Some(name) = path.file_name() {
            inner.name = name.to_string_lossy().into_owned();
        }
        Ok(Self { inner })
    }

    /// A recording of arrays in SI units, pressures absolute, of one length.
    #[staticmethod]
    fn from_arrays(
        name: String,
        time_s: PyReadonlyArray1<'_, f64>,
        signals: BTreeMap<String, PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
        let time_s = time_s.as_array().to_vec();
        let rises = time_s.windows(2).all(|pair| pair[0] < pair[1]);
        if !rises || time_s.iter().any(|time| !time.is_finite()) {
            return Err(unusable(format!(
                "{name}: t: expected finite instants that rise from row to row"
            )));
        }
        let mut columns = BTreeMap::new();
        for (signal, values) in signals {
            let values = values.as_array().to_vec();
            if grey_box::rig::signal_dimension(&signal, None).is_none() {
                return Err(unusable(format!(
                    "{name}: {signal}: expected the name of a signal, such as u, p_a, p_b, p_s, x, v, force"
                )));
            }
            if values.len() != time_s.len() {
                let (has, rows) = (values.len(), time_s.len());
                return Err(unusable(format!(
                    "{name}: {signal}: has {has} values, expected {rows}, as t has"
                )));
            }
            if let Some(row) = values.iter().position(|value| !value.is_finite()) {
                return Err(unusable(format!(
                    "{name}: {signal}: row {row} is no finite number, expected rows with a value of every signal"
                )));
            }
            columns.insert(signal, values);
        }
        let inner = grey_box::recording::Recording::from_signals(name, time_s, columns);
        Ok(Self { inner })
    }

    /// The file or name.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Time of the rows, s.
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.time_s.clone().into_pyarray(py)
    }

    /// The names of the signals.
    #[getter]
    fn signals(&self) -> Vec<&str> {
        self.inner.signals.keys().map(String::as_str).collect()
    }

    /// What was decided or left out on reading.
    #[getter]
    fn remarks(&self) -> &[String] {
        &self.inner.remarks
    }

    /// The rows `from` to `to`.
    fn part(&self, from: usize, to: usize) -> Self {
        Self {
            inner: self.inner.part(from..to.max(from)),
        }
    }

    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        signal: &str,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values = self.inner.signal(signal).ok_or_else(|| {
            let names: Vec<&str> = self.inner.signals.keys().map(String::as_str).collect();
            pyo3::exceptions::PyKeyError::new_err(format!(
                "{signal}: expected one of t, {}",
                names.join(", ")
            ))
        })?;
        Ok(values.to_vec().into_pyarray(py))
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    fn __repr__(&self) -> String {
        let (rows, seconds) = (self.inner.len(), self.inner.duration_s());
        let names: Vec<&str> = self.inner.signals.keys().map(String::as_str).collect();
        format!(
            "Recording({:?}: {rows} rows, {seconds} s, signals: {})",
            self.inner.name,
            names.join(", ")
        )
    }
}

/// Table, column, unit, description and number of rows of everything that a file holds.
type Listed = (
    String,
    String,
    Option<String>,
    Option<String>,
    Option<usize>,
);

/// What a file holds, without a rig.
#[pyfunction]
pub fn tables(py: Python<'_>, path: PathBuf) -> PyResult<Vec<Listed>> {
    let tables = py.detach(|| grey_box::recording::tables(&path));
    let rows = tables.map_err(of_recording)?.into_iter().flat_map(|table| {
        let (name, rows) = (table.name, table.rows);
        let column = move |column: grey_box::recording::ColumnLook| {
            (
                name.clone(),
                column.name,
                column.unit,
                column.description,
                rows,
            )
        };
        table
            .columns
            .into_iter()
            .map(column)
            .collect::<Vec<Listed>>()
    });
    Ok(rows.collect())
}
