//! Recordings written: columns that the same rig's `[signals]` reads back.
//!
//! A signal stands in the rig's column and unit; one that the rig does not name
//! stands in SI under the name given with it.

use super::Recording;
use crate::number::Rounding;
use crate::rig::{Column, Rig, RigError, Signal, Signals};
use std::io::{self, Write};

/// Digits of the numbers in the table: 1e-12 of a value is far below any
/// sensor, and rounding keeps 0.1 + 0.2 from filling a line.
const DIGITS: i32 = 12;

/// Digits of a number that was recorded: decimals of fewer digits come back as they were.
const RECORDED_DIGITS: i32 = 15;

/// The signals of a recording in the columns and units of the rig, time first.
pub fn as_recorded(recording: &Recording, signals: &Signals) -> Vec<data_files::Column> {
    let rounding = Rounding::Significant(RECORDED_DIGITS);
    let time = signals.iter().filter(|(name, _)| *name == "t");
    let others = signals.iter().filter(|(name, _)| *name != "t");
    let column = |(name, signal): (&str, &Signal)| {
        let recorded = |value: &f64| rounding.apply(signal.from_si(*value, signals.gauge_zero_pa));
        let values = recording.signal(name)?.iter().map(recorded).collect();
        let header = match &signal.column {
            Column::Name(header) => header.as_str(),
            _ => name,
        };
        let column = data_files::Column::new(header, data_files::Cells::Reals(values));
        Some(column.with_facts(Some(signal.unit.to_string()), Some(name.into())))
    };
    time.chain(others).filter_map(column).collect()
}

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
        let offered: Vec<(&str, &str)> = outputs
            .iter()
            .map(|output| (output.signal, output.name))
            .collect();
        let (names, columns) = arrange(rig, rig_name, &offered)?
            .into_iter()
            .map(|(name, place)| (name, column(rig, &outputs[place])))
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

/// The columns in their order: name in the header, place among the `offered`
/// ones, which are pairs of signal and the name where the rig does not say.
/// Numbered ones stand where the rig says, the others in the places left.
pub fn arrange(
    rig: &Rig,
    rig_name: &str,
    offered: &[(&str, &str)],
) -> Result<Vec<(String, usize)>, RigError> {
    let numbered = |place: usize| match rig.signals.get(offered[place].0)?.column {
        Column::Number(number) => Some(number),
        _ => None,
    };
    let mut slots: Vec<Option<usize>> = vec![None; offered.len()];
    for place in 0..offered.len() {
        let Some(number) = numbered(place) else {
            continue;
        };
        let Some(slot) = slots.get_mut(number) else {
            return Err(RigError {
                file: rig_name.into(),
                line: None,
                key: Some(format!("signals.{}.column", offered[place].0)),
                problem: format!("there is no column {number} to write"),
                expected: format!("a name, or a number below {}", offered.len()),
            });
        };
        *slot = Some(place);
    }
    let mut others = (0..offered.len()).filter(|place| numbered(*place).is_none());
    Ok(slots
        .into_iter()
        .filter_map(|slot| slot.or_else(|| others.next()))
        .map(|place| (header_name(rig, offered[place]), place))
        .collect())
}

fn header_name(rig: &Rig, (signal, name): (&str, &str)) -> String {
    match rig.signals.get(signal).map(|signal| &signal.column) {
        Some(Column::Name(name)) if name.contains([',', '"']) => {
            format!("\"{}\"", name.replace('"', "\"\""))
        }
        Some(Column::Name(name)) => name.clone(),
        _ => name.into(),
    }
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
