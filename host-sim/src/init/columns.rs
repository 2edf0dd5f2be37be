//! Which column of a recording is which signal, in which unit: guessed from header names and from
//! the values. Every guess says why; a person confirms it.
//!
//! Limits: tables with a header. Other files are named column by column.

use std::path::Path;

use crate::recording::{TableLook, tables};
use crate::rig::signal_dimension;
use crate::units::{Dimension, Unit};

/// The columns of a file's table: names, units that the file states beside them, and first values.
#[derive(Debug)]
pub(super) struct Preview {
    pub names: Vec<String>,
    units: Vec<Option<String>>,
    pub values: Vec<Vec<f64>>,
    /// The file's own clock, in words.
    clock: Option<String>,
}

/// One guess.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guess {
    /// The signal.
    pub signal: String,
    /// The header name.
    pub column: String,
    /// The unit.
    pub unit: String,
    /// Why.
    pub why: String,
}

/// What of the axis tells units apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub stroke_m: f64,
    pub supply_pa: f64,
    pub ambient_pa: f64,
}

impl Preview {
    /// The table of a file in which most signals are found.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let tables = tables(path)
            .map_err(|cause| format!("{cause}, or --column SIGNAL=HEADER:UNIT for each signal"))?;
        let previews = tables.into_iter().map(Self::of);
        let best = previews.max_by_key(|one| (one.found().len(), one.values.first().map(Vec::len)));
        best.ok_or_else(|| format!("{}: holds no table", path.display()))
    }

    fn of(table: TableLook) -> Self {
        let mut preview = Self {
            names: Vec::new(),
            units: Vec::new(),
            values: Vec::new(),
            clock: table.clock,
        };
        for column in table.columns {
            preview.names.push(column.name);
            preview.units.push(column.unit);
            preview.values.push(column.values);
        }
        preview
    }

    /// Signals, the columns that their names fit, and the units that those state; no column is
    /// taken twice.
    fn found(&self) -> Vec<(&'static str, usize, Option<String>)> {
        let mut found: Vec<(&str, usize, Option<String>)> = Vec::new();
        for known in SIGNALS {
            let free =
                (0..self.names.len()).filter(|place| found.iter().all(|one| one.1 != *place));
            let mut fitting =
                free.filter_map(|place| Some((place, known.unit_of(&self.names[place])?)));
            if let Some((place, named)) = fitting.next() {
                let stated = || known.spelled(self.units[place].as_deref()?);
                found.push((known.name, place, named.or_else(stated)));
            }
        }
        found
    }

    /// A guess for each signal that a column's name fits; no column is taken twice.
    pub(super) fn guesses(&self, scale: Scale) -> Vec<Guess> {
        let found = self.found();
        let pressures = found.iter().filter(|one| one.0.starts_with("p_"));
        let highest = pressures.map(|one| extremes(&self.values[one.1]).1);
        let highest = highest.fold(f64::NEG_INFINITY, f64::max);
        let guess = |(signal, place, written): &(&str, usize, Option<String>)| {
            let (unit, why) = unit(
                signal,
                written.as_deref(),
                &self.values[*place],
                highest,
                scale,
            );
            Guess {
                signal: (*signal).to_owned(),
                column: self.names[*place].clone(),
                unit,
                why,
            }
        };
        let mut guesses: Vec<Guess> = found.iter().map(guess).collect();
        let has_time = guesses.iter().any(|guess| guess.signal == "t");
        guesses.extend(self.clock.iter().filter(|_| !has_time).map(|clock| Guess {
            signal: "t".into(),
            column: "t".into(),
            unit: "s".into(),
            why: clock.clone(),
        }));
        guesses
    }

    fn column(&self, guesses: &[Guess], signal: &str) -> Option<(&[f64], Unit)> {
        let guess = guesses.iter().find(|guess| guess.signal == signal)?;
        let place = self.names.iter().position(|name| *name == guess.column)?;
        Some((&self.values[place], Unit::parse(&guess.unit).ok()?))
    }

    /// Whether a command above the null moves the axis to +x: the sign of the sum of
    /// `(u - null) dx`.
    pub(super) fn moves_up_above(&self, guesses: &[Guess], null_v: f64) -> Option<bool> {
        let ((command, unit), (position, _)) =
            (self.column(guesses, "u")?, self.column(guesses, "x")?);
        let sum: f64 = command
            .windows(2)
            .zip(position.windows(2))
            .map(|(u, x)| (unit.to_si(u[0]) - null_v) * (x[1] - x[0]))
            .sum();
        (sum != 0.0).then_some(sum > 0.0)
    }

    /// Least and greatest position.
    pub(super) fn travel_m(&self, guesses: &[Guess]) -> Option<[f64; 2]> {
        let (position, unit) = self.column(guesses, "x")?;
        let (least, most) = extremes(position);
        Some([unit.to_si(least), unit.to_si(most)])
    }
}

/// How loggers call the column of a signal: one of some words, or a pressure and one of some words.
struct Named {
    name: &'static str,
    words: &'static [&'static str],
    of_pressures: &'static [&'static str],
    /// Words that speak against it.
    unless: &'static [&'static str],
}

const fn named(name: &'static str, words: &'static [&'static str]) -> Named {
    Named {
        name,
        words,
        of_pressures: &[],
        unless: &[
            "ref",
            "reference",
            "setpoint",
            "soll",
            "target",
            "des",
            "desired",
        ],
    }
}

/// In the order in which columns are taken.
#[rustfmt::skip]
const SIGNALS: &[Named] = &[
    named("t", &["t", "time", "zeit", "timestamp"]),
    Named { of_pressures: &["a", "1"], ..named("p_a", &["pa", "p1"]) },
    Named { of_pressures: &["b", "2"], ..named("p_b", &["pb", "p2"]) },
    Named { of_pressures: &["s", "supply", "tank", "0", "versorgung"], ..named("p_s", &["ps", "p0", "psupply"]) },
    named("u", &["u", "cmd", "command", "valve", "ventil", "voltage", "stell"]),
    named("x", &["x", "pos", "position", "weg", "displacement"]),
    named("v", &["v", "vel", "velocity", "speed", "geschwindigkeit"]),
];
const PRESSURE_WORDS: &[&str] = &["p", "pressure", "press", "druck"];

impl Named {
    /// Whether a header names this signal, and the unit that it states.
    fn unit_of(&self, header: &str) -> Option<Option<String>> {
        let dimension = signal_dimension(self.name, None)?;
        let (words, unit) = words_and_unit(header, dimension);
        let says = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
        let pressure = says(PRESSURE_WORDS) && says(self.of_pressures);
        let is_it = (says(self.words) || pressure) && !says(self.unless);
        is_it.then_some(unit)
    }

    /// A unit that the file states, as the rig file spells it, if it can be this signal's.
    fn spelled(&self, stated: &str) -> Option<String> {
        let stated = stated.trim().trim_matches(['[', ']', '(', ')']);
        spelled(stated, signal_dimension(self.name, None)?)
    }
}

/// The words of a header in lower case without the unit at its end, if that is one of this
/// dimension: "v_m_s", "p_a (bar)", "x [mm]", "pB_bar_g".
fn words_and_unit(header: &str, dimension: Dimension) -> (Vec<String>, Option<String>) {
    let cut = |text: &str| -> Vec<String> {
        let words = text.split(|one: char| !one.is_alphanumeric());
        words
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect()
    };
    let lower = |words: &[String]| words.iter().map(|word| word.to_lowercase()).collect();
    let bracketed = header.find(['[', '(']).map(|place| header.split_at(place));
    if let Some((name, bracket)) = bracketed {
        let inner = bracket.trim_start_matches(['[', '(']).trim_end_matches(']');
        let bare = inner.strip_suffix(')').unwrap_or(inner);
        let unit = spelled(inner, dimension).or_else(|| spelled(bare, dimension));
        if unit.is_some() {
            return (lower(&cut(name)), unit);
        }
    }
    let words = cut(header);
    for length in [2, 1] {
        let Some(rest) = words.len().checked_sub(length).filter(|rest| *rest > 0) else {
            continue;
        };
        let unit = match &words[rest..] {
            [above, below] => spelled(&format!("{above}/{below}"), dimension)
                .or_else(|| spelled(&format!("{above}({below})"), dimension)),
            [unit] => spelled(unit, dimension),
            _ => None,
        };
        if unit.is_some() {
            return (lower(&words[..rest]), unit);
        }
    }
    (lower(&words), None)
}

/// A unit of this dimension as the rig file spells it; a pressure may lack its reference.
fn spelled(text: &str, dimension: Dimension) -> Option<String> {
    let text = match text.trim() {
        "sec" | "seconds" => "s",
        "pa" => "Pa",
        "kpa" => "kPa",
        "v" | "Volt" | "volt" | "volts" => "V",
        other => other,
    };
    let of_dimension =
        |spelling: &str| Unit::parse(spelling).is_ok_and(|unit| unit.dimension() == dimension);
    let whole = of_dimension(text) || of_dimension(&format!("{text}(abs)"));
    whole.then(|| text.to_owned())
}

/// The unit of a column, and how it was found.
fn unit(
    signal: &str,
    written: Option<&str>,
    values: &[f64],
    highest_pressure: f64,
    scale: Scale,
) -> (String, String) {
    let (least, most) = extremes(values);
    match (signal, written) {
        (_, Some(unit)) if Unit::parse(unit).is_ok() => {
            (unit.to_owned(), "unit from the header".into())
        }
        (pressure, written) if pressure.starts_with("p_") => {
            pressure_unit(written, highest_pressure, scale)
        }
        ("t", _) => time_unit(values),
        ("x", _) => length_unit(most - least, scale.stroke_m),
        ("v", _) => (
            "m/s".into(),
            format!("guessed, values from {least} to {most}"),
        ),
        _ => (
            "V".into(),
            format!("guessed, values from {least} to {most}"),
        ),
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), value| (least.min(*value), most.max(*value)),
    )
}

/// By the step between rows: loggers sample at 10 Hz to 10 kHz.
fn time_unit(values: &[f64]) -> (String, String) {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let unit = match step {
        step if step < 0.2 => "s",
        step if step < 90.0 => "ms",
        _ => "us",
    };
    (unit.into(), format!("rows {step} apart"))
}

/// The largest unit in which the travel fits into the stroke.
fn length_unit(span: f64, stroke_m: f64) -> (String, String) {
    /// Position sensors read a little beyond the stroke.
    const SLACK: f64 = 1.05;
    let units = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)];
    let unit = units.iter().find(|unit| span * unit.1 <= SLACK * stroke_m);
    let unit = unit.map_or("um", |unit| unit.0);
    (
        unit.into(),
        format!("guessed, as the travel of {span} fits into the stroke"),
    )
}

/// The unit in which the highest pressure is nearest to the supply: absolute, or gauge.
fn pressure_unit(written: Option<&str>, highest: f64, scale: Scale) -> (String, String) {
    let names = match written {
        Some(unit) => vec![unit],
        None => vec!["Pa", "kPa", "bar", "MPa", "psi"],
    };
    let levels = [
        ("abs", scale.supply_pa),
        ("g", scale.supply_pa - scale.ambient_pa),
    ];
    let candidates = names.iter().flat_map(|name| {
        levels.map(|(reference, level_pa)| (format!("{name}({reference})"), level_pa))
    });
    let off = |(spelling, level_pa): &(String, f64)| {
        let factor = Unit::parse(spelling).map_or(f64::NAN, |unit| unit.factor());
        (highest * factor / level_pa).ln().abs()
    };
    let nearest = candidates.min_by(|one, other| off(one).total_cmp(&off(other)));
    let spelling = nearest.map_or_else(|| "Pa(abs)".to_owned(), |(spelling, _)| spelling);
    let supply_pa = scale.supply_pa;
    (
        spelling,
        format!(
            "guessed, as {highest}, the highest of all pressure columns, is nearest to the supply of {supply_pa:.0} Pa absolute"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const SCALE: Scale = Scale {
        stroke_m: 0.5,
        supply_pa: 6.6e5,
        ambient_pa: 1.01e5,
    };

    fn guessed(header: &str, rows: &str) -> Vec<(String, String, String)> {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        write!(file, "{header}\n{rows}").expect("room");
        let preview = Preview::read(file.path()).expect("a table");
        let guesses = preview.guesses(SCALE).into_iter();
        guesses
            .map(|guess| (guess.signal, guess.column, guess.unit))
            .collect()
    }

    fn check(header: &str, rows: &str, expected: &[(&str, &str, &str)]) {
        let mut found = guessed(header, rows);
        found.sort();
        let mut expected: Vec<_> = expected
            .iter()
            .map(|(signal, column, unit)| {
                (signal.to_string(), column.to_string(), unit.to_string())
            })
            .collect();
        expected.sort();
        assert_eq!(found, expected, "{header}");
    }

    #[test]
    fn val_names_with_units_are_taken_as_they_say() {
        check(
            "t_s,u_V,p_a_Pa,p_b_Pa,p_s_Pa,x_m,v_m_s",
            "0.000,8.7,444568,444812,658556,-0.01,0.0\n0.001,8.7,655548,436272,658068,-0.01,0.1\n",
            &[
                ("t", "t_s", "s"),
                ("u", "u_V", "V"),
                ("p_a", "p_a_Pa", "Pa(abs)"),
                ("p_b", "p_b_Pa", "Pa(abs)"),
                ("p_s", "p_s_Pa", "Pa(abs)"),
                ("x", "x_m", "m"),
                ("v", "v_m_s", "m/s"),
            ],
        );
    }

    #[test]
    fn val_words_of_loggers_are_understood_and_units_found_by_the_values() {
        check(
            "Time;Command;Pressure A;Pressure B;Supply pressure;Position;Reference position",
            "0;5.0;3.1;3.3;5.6;0.0;0\n1;5.1;5.4;3.3;5.6;220.0;0\n2;5.1;5.4;3.3;5.6;430.0;0\n",
            &[
                ("t", "Time", "ms"),
                ("u", "Command", "V"),
                ("p_a", "Pressure A", "bar(g)"),
                ("p_b", "Pressure B", "bar(g)"),
                ("p_s", "Supply pressure", "bar(g)"),
                ("x", "Position", "mm"),
            ],
        );
    }

    #[test]
    fn val_brackets_and_preambles_are_read() {
        check(
            "logger 7\n# Time [s]\tu [V]\tpA [bar(g)]\tpB [bar(g)]\tx [mm]",
            "0.0\t5\t3\t3\t0\n0.1\t5\t3\t3\t1\n",
            &[
                ("t", "Time [s]", "s"),
                ("u", "u [V]", "V"),
                ("p_a", "pA [bar(g)]", "bar(g)"),
                ("p_b", "pB [bar(g)]", "bar(g)"),
                ("x", "x [mm]", "mm"),
            ],
        );
    }
}
