//! A fit as terminal text.

use std::fmt;

use super::{BeforeAfter, FittedParameter, LawFit, OwnUnit, SignalError};
use crate::text::{Columns, plain};

/// Significant digits of parameters.
const PARAMETER_DIGITS: usize = 5;
/// Significant digits of errors and deviations.
const ERROR_DIGITS: usize = 3;

impl fmt::Display for LawFit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", self.law.title())?;
        write!(out, "{}", parameter_columns(&self.parameters))?;
        if !self.correlations.is_empty() {
            writeln!(out, "  correlated parameters:")?;
        }
        for pair in &self.correlations {
            writeln!(
                out,
                "    {:>6.3}  {} and {}",
                pair.correlation, pair.first, pair.second
            )?;
        }
        for sentence in &self.undetermined {
            writeln!(out, "  {sentence}")?;
        }
        writeln!(out, "  rms error, {}:", self.prediction)?;
        write!(out, "{}", error_columns(&self.errors))?;
        writeln!(
            out,
            "  {} iterations over {} rows; stopped: {}",
            self.iterations, self.rows, self.stopped
        )?;
        writeln!(
            out,
            "  residuals are correlated: for the standard deviations about {:.0} successive rows count as one",
            self.correlated_rows
        )
    }
}

fn parameter_columns(parameters: &[FittedParameter]) -> Columns {
    let mut columns = Columns::new(2, &["parameter", "given", "fitted", "sd", "prior sd", ""]);
    for parameter in parameters {
        let optional = |value: Option<f64>, digits| {
            value.map_or_else(|| "-".into(), |value| plain(value, digits))
        };
        columns.row([
            parameter.name.clone(),
            optional(parameter.given, PARAMETER_DIGITS),
            plain(parameter.fitted, PARAMETER_DIGITS),
            optional(parameter.standard_deviation, ERROR_DIGITS),
            optional(parameter.prior_standard_deviation, ERROR_DIGITS),
            parameter.note.clone(),
        ]);
    }
    columns
}

fn error_columns(errors: &[SignalError]) -> Columns {
    let held = errors.iter().any(|error| error.held_out.is_some());
    let mut headings = vec!["signal", "unit", "noise", "train: given", "fitted"];
    if held {
        headings.extend(["held-out: given", "fitted"]);
    }
    let mut columns = Columns::new(4, &headings);
    for error in errors {
        columns.row(error_row(error, error.unit, 1.0));
        // A second line only where its figures differ.
        let other = |own: &&OwnUnit| (own.si_per_unit - 1.0).abs() > f64::EPSILON;
        if let Some(own) = error.own.as_ref().filter(other) {
            columns.row(error_row(error, &own.unit, own.si_per_unit));
        }
    }
    columns
}

fn error_row(error: &SignalError, unit: &str, si_per_unit: f64) -> Vec<String> {
    let figure = |value: Option<f64>| {
        value.map_or_else(
            || "-".into(),
            |value| plain(value / si_per_unit, ERROR_DIGITS),
        )
    };
    let pair = |errors: BeforeAfter| [figure(errors.before), figure(errors.after)];
    let mut row = vec![
        crate::signals::spoken(error.signal).to_owned(),
        unit.to_owned(),
        figure(Some(error.noise)),
    ];
    row.extend(pair(error.train));
    row.extend(error.held_out.into_iter().flat_map(pair));
    row
}
