//! Recordings written: columns that the same rig's `[signals]` reads back.
//!
//! A signal stands in the rig's column and unit; one that the rig does not name
//! stands in SI under the name given with it.

use crate::report::number::Rounding;
use crate::rig::{Column, Rig, RigError};
use std::io::{self, Write};

/// Digits of the numbers in the table: 1e-12 of a value is far below any
/// sensor, and rounding keeps 0.1 + 0.2 from filling a line.
const DIGITS: i32 = 12;

/// One signal to write.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// The name when the rig does not say.
    pub name: &'static str,
    /// The signal of the rig; empty where it is none.
    pub signal: &'static str,
    /// The values, SI.
    pub values: Vec<f64>,
}

/// A recording as it is written: names and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The header.
    pub names: Vec<String>,
    /// One column per name.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// The outputs in the columns, order and units of the rig, whose file is
    /// named in errors.
    pub fn new(rig: &Rig, rig_name: &str, outputs: &[Output]) -> Result<Self, RigError> {
        let order = places(rig, rig_name, outputs)?;
        let ordered = order.into_iter().map(|place| &outputs[place]);
        let (names, columns) = ordered
            .map(|output| (header_name(rig, output), column(rig, output)))
            .unzip();
        Ok(Self { names, columns })
    }

    /// Writes it as CSV with a header line.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "{}", self.names.join(","))?;
        let rows = self.columns.first().map_or(0, Vec::len);
        for row in 0..rows {
            for (place, column) in self.columns.iter().enumerate() {
                let separator = if place == 0 { "" } else { "," };
                write!(out, "{separator}{}", column[row])?;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

fn header_name(rig: &Rig, output: &Output) -> String {
    match rig.signals.get(output.signal).map(|signal| &signal.column) {
        Some(Column::Name(name)) if name.contains([',', '"']) => {
            format!("\"{}\"", name.replace('"', "\"\""))
        }
        Some(Column::Name(name)) => name.clone(),
        _ => output.name.into(),
    }
}

/// Which output stands in which column: numbered ones where the rig says, the
/// others in the places left.
fn places(rig: &Rig, rig_name: &str, outputs: &[Output]) -> Result<Vec<usize>, RigError> {
    let numbered = |place: usize| match rig.signals.get(outputs[place].signal)?.column {
        Column::Number(number) => Some(number),
        Column::Name(_) => None,
    };
    let mut slots: Vec<Option<usize>> = vec![None; outputs.len()];
    for place in 0..outputs.len() {
        let Some(number) = numbered(place) else {
            continue;
        };
        let Some(slot) = slots.get_mut(number) else {
            return Err(RigError {
                file: rig_name.into(),
                line: None,
                key: Some(format!("signals.{}.column", outputs[place].signal)),
                problem: format!("a simulation has no column {number}"),
                expected: format!("a name, or a number below {}", outputs.len()),
            });
        };
        *slot = Some(place);
    }
    let mut others = (0..outputs.len()).filter(|place| numbered(*place).is_none());
    Ok(slots
        .into_iter()
        .filter_map(|slot| slot.or_else(|| others.next()))
        .collect())
}

fn column(rig: &Rig, output: &Output) -> Vec<f64> {
    let rounding = Rounding::Significant(DIGITS);
    let signal = rig.signals.get(output.signal);
    let recorded = |value: &f64| match signal {
        Some(signal) => signal.from_si(*value, rig.signals.gauge_zero_pa),
        None => *value,
    };
    output
        .values
        .iter()
        .map(|value| rounding.apply(recorded(value)))
        .collect()
}
