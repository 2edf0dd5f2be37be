//! Units of recorded columns and their conversion to SI.
//!
//! Pressures must say whether they are absolute or gauge: that mix-up is
//! silent and moves every flow, so plain `bar` is refused. Gauge pressures get
//! the ambient pressure added by whoever knows it ([`Unit::is_gauge`]).
//!
//! A plain number of a converter or an encoder is a `count`, whose size the rig gives by `scale`.
//!
//! Volume flows are taken as air at the ANR reference of ISO 8778 (20 degC,
//! 100 kPa, 65 % relative humidity, 1.185 kg/m3).

use std::fmt;

use thiserror::Error;

use crate::text::{expected_one_of, one_line};

/// Density of air at the ANR reference, ISO 8778.
pub const ANR_DENSITY_KG_M3: f64 = 1.185;
/// Temperature of the ANR reference, ISO 8778.
pub const ANR_TEMPERATURE_K: f64 = 293.15;
/// Standard gravity, exact by definition (CGPM 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// International inch, exact by definition.
const INCH_M: f64 = 0.0254;
/// Avoirdupois pound, exact by definition.
const POUND_KG: f64 = 0.453_592_37;
/// Pound-force per square inch, from the three definitions above.
const PSI_PA: f64 = POUND_KG * STANDARD_GRAVITY_M_S2 / (INCH_M * INCH_M);

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Seconds in SI.
    Time,
    /// Pascal in SI.
    Pressure,
    /// Metres in SI.
    Length,
    /// Metres per second in SI.
    Speed,
    /// Metres per second squared in SI.
    Acceleration,
    /// Newtons in SI.
    Force,
    /// Volts in SI.
    Voltage,
    /// A plain fraction: 1 is the whole.
    Fraction,
    /// Kelvin in SI.
    Temperature,
    /// Kilograms per second in SI.
    MassFlow,
    /// A plain number: how much one count is the rig says by its scale.
    Count,
}

impl Dimension {
    /// The name used in error lines, with an example unit.
    pub fn expectation(self) -> &'static str {
        match self {
            Self::Time => "a time (s, ms, us, ns, min, h, d)",
            Self::Pressure => "a pressure (such as Pa(abs), bar(g), psi(abs))",
            Self::Length => "a length (m, cm, mm, um, in)",
            Self::Speed => "a speed (m/s, mm/s, um/s, in/s)",
            Self::Acceleration => "an acceleration (m/s2, g)",
            Self::Force => "a force (N, kN, lbf, kgf)",
            Self::Voltage => "a voltage (V, mV)",
            Self::Fraction => "a fraction (1, %)",
            Self::Temperature => "a temperature (K, degC, degF)",
            Self::MassFlow => "a flow (kg/s, g/s, kg/h, l/min(ANR))",
            Self::Count => "a plain number (count)",
        }
    }

    /// The unit in which a converted signal is shown.
    pub fn si_unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Pressure => "Pa",
            Self::Length => "m",
            Self::Speed => "m/s",
            Self::Acceleration => "m/s2",
            Self::Force => "N",
            Self::Voltage => "V",
            Self::Fraction => "1",
            Self::Temperature => "K",
            Self::MassFlow => "kg/s",
            Self::Count => "count",
        }
    }
}

/// A unit as the rig file spells it, with its way to SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    text: String,
    dimension: Dimension,
    factor: f64,
    shift: f64,
    gauge: bool,
}

/// A unit that cannot be used: the problem and what was expected.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{problem}, expected {expected}")]
pub struct UnitError {
    /// What is wrong.
    pub problem: String,
    /// What should be written instead.
    pub expected: String,
}

/// `(spelling, dimension, factor, shift)`: SI = value * factor + shift.
const PLAIN: &[(&str, Dimension, f64, f64)] = &[
    ("s", Dimension::Time, 1.0, 0.0),
    ("ms", Dimension::Time, 1e-3, 0.0),
    ("us", Dimension::Time, 1e-6, 0.0),
    ("ns", Dimension::Time, 1e-9, 0.0),
    ("min", Dimension::Time, 60.0, 0.0),
    ("h", Dimension::Time, 3600.0, 0.0),
    ("d", Dimension::Time, 86_400.0, 0.0),
    ("m", Dimension::Length, 1.0, 0.0),
    ("cm", Dimension::Length, 1e-2, 0.0),
    ("mm", Dimension::Length, 1e-3, 0.0),
    ("um", Dimension::Length, 1e-6, 0.0),
    ("in", Dimension::Length, INCH_M, 0.0),
    ("m/s", Dimension::Speed, 1.0, 0.0),
    ("mm/s", Dimension::Speed, 1e-3, 0.0),
    ("um/s", Dimension::Speed, 1e-6, 0.0),
    ("in/s", Dimension::Speed, INCH_M, 0.0),
    ("m/s2", Dimension::Acceleration, 1.0, 0.0),
    ("g", Dimension::Acceleration, STANDARD_GRAVITY_M_S2, 0.0),
    ("N", Dimension::Force, 1.0, 0.0),
    ("kN", Dimension::Force, 1e3, 0.0),
    (
        "lbf",
        Dimension::Force,
        POUND_KG * STANDARD_GRAVITY_M_S2,
        0.0,
    ),
    ("kgf", Dimension::Force, STANDARD_GRAVITY_M_S2, 0.0),
    ("V", Dimension::Voltage, 1.0, 0.0),
    ("mV", Dimension::Voltage, 1e-3, 0.0),
    ("1", Dimension::Fraction, 1.0, 0.0),
    ("%", Dimension::Fraction, 1e-2, 0.0),
    ("K", Dimension::Temperature, 1.0, 0.0),
    ("degC", Dimension::Temperature, 1.0, 273.15),
    (
        "degF",
        Dimension::Temperature,
        5.0 / 9.0,
        459.67 * 5.0 / 9.0,
    ),
    ("kg/s", Dimension::MassFlow, 1.0, 0.0),
    ("g/s", Dimension::MassFlow, 1e-3, 0.0),
    ("kg/h", Dimension::MassFlow, 1.0 / 3600.0, 0.0),
    (
        "l/min(ANR)",
        Dimension::MassFlow,
        ANR_DENSITY_KG_M3 / 60_000.0,
        0.0,
    ),
    ("count", Dimension::Count, 1.0, 0.0),
];

/// How loggers call plain numbers, in lower case.
const COUNT_WORDS: &[&str] = &[
    "bit",
    "bits",
    "code",
    "codes",
    "digit",
    "digits",
    "inc",
    "increments",
    "lsb",
    "pulses",
    "raw",
    "step",
    "steps",
    "tick",
    "ticks",
];

/// `(spelling without (abs) or (g), Pa per unit)`.
const PRESSURES: &[(&str, f64)] = &[
    ("Pa", 1.0),
    ("hPa", 1e2),
    ("kPa", 1e3),
    ("MPa", 1e6),
    ("mbar", 1e2),
    ("bar", 1e5),
    ("psi", PSI_PA),
];

impl Unit {
    /// Reads a unit such as `mm`, `bar(g)` or `l/min(ANR)`.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        let spelling = canonical(text);
        if let Some(unit) = plain(&spelling) {
            return Ok(unit);
        }
        pressure(&spelling)
    }

    /// What the unit measures.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// True for a pressure that counts from the ambient pressure.
    pub fn is_gauge(&self) -> bool {
        self.gauge
    }

    /// Converts to SI; a gauge pressure stays gauge.
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.factor + self.shift
    }

    /// The size of one unit in SI: converts differences, noise and steps.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// The spelling of the rig file.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}

/// All spellings of units but the pressures', for a reader.
pub fn spellings() -> String {
    let quoted: Vec<String> = PLAIN.iter().map(|row| format!("`{}`", row.0)).collect();
    quoted.join(", ")
}

/// Spellings that mean the same to everybody, brought to the one of the tables.
fn canonical(text: &str) -> String {
    let text = text.trim().replace(['µ', 'μ'], "u");
    match text.as_str() {
        "psia" => "psi(abs)".into(),
        "psig" => "psi(g)".into(),
        "bara" => "bar(abs)".into(),
        "barg" => "bar(g)".into(),
        "°C" => "degC".into(),
        "m/s^2" | "m/s²" => "m/s2".into(),
        "sec" => "s".into(),
        "msec" => "ms".into(),
        "usec" => "us".into(),
        "counts" | "cts" => "count".into(),
        _ => text,
    }
}

fn plain(spelling: &str) -> Option<Unit> {
    let (name, dimension, factor, shift) = PLAIN.iter().find(|row| row.0 == spelling)?;
    Some(Unit {
        text: (*name).into(),
        dimension: *dimension,
        factor: *factor,
        shift: *shift,
        gauge: false,
    })
}

fn pressure(spelling: &str) -> Result<Unit, UnitError> {
    let (base, reference) = match spelling.split_once('(') {
        Some((base, reference)) => (base.trim(), Some(reference)),
        None => (spelling, None),
    };
    let Some((name, factor)) = PRESSURES.iter().find(|row| row.0 == base) else {
        return Err(unknown(spelling));
    };
    let gauge = match reference {
        Some("abs)") => false,
        Some("g)") => true,
        _ => return Err(reference_missing(spelling, name)),
    };
    Ok(Unit {
        text: format!("{name}({})", if gauge { "g" } else { "abs" }),
        dimension: Dimension::Pressure,
        factor: *factor,
        shift: 0.0,
        gauge,
    })
}

fn reference_missing(spelling: &str, name: &str) -> UnitError {
    UnitError {
        problem: format!(
            "unit \"{}\" does not say absolute or gauge",
            one_line(spelling)
        ),
        expected: format!("\"{name}(abs)\" or \"{name}(g)\""),
    }
}

/// A unit as a logger writes it above a column: brackets around it are fine, and a pressure need
/// not say absolute or gauge.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    unit: Unit,
    /// False for a pressure that does not say absolute or gauge.
    has_reference: bool,
}

impl Written {
    /// `None` for a text that is no unit.
    pub fn read(text: &str) -> Option<Self> {
        let bare = text
            .trim()
            .trim_matches(['[', ']', '(', ')', '<', '>', '{', '}']);
        if let Ok(unit) = Unit::parse(text).or_else(|_| Unit::parse(bare)) {
            return Some(Self {
                unit,
                has_reference: true,
            });
        }
        let unit = Unit::parse(&format!("{bare}(abs)")).ok()?;
        Some(Self {
            unit,
            has_reference: false,
        })
    }

    /// Whether both measure the same kind of quantity.
    pub fn measures_as(&self, rig: &Unit) -> bool {
        self.unit.dimension == rig.dimension
    }

    /// Whether it cannot be the rig's unit. A rig that scales may start from another unit (volts
    /// of a sensor), or have the factor between two units as its scale.
    pub fn contradicts(&self, rig: &Unit, scale: Option<f64>) -> bool {
        let same = |factor: f64| (self.unit.factor / factor - 1.0).abs() < 1e-9;
        if self.unit.dimension != rig.dimension {
            return scale.is_none();
        }
        let factor = same(rig.factor) || scale.is_some_and(|scale| same(rig.factor * scale));
        let shift = same(rig.factor) && (self.unit.shift - rig.shift).abs() > 1e-9;
        let reference = self.has_reference && self.unit.gauge != rig.gauge;
        !factor || shift || reference
    }
}

/// Currents and converter codes are no unit of what is measured: how they are scaled.
fn raw(spelling: &str) -> Option<UnitError> {
    let expected = if ["mA", "ma", "A"].contains(&spelling) {
        "the measured quantity's unit, and scale and offset (SI) that turn the number into it; 4 to 20 mA of 0 to 10 bar: unit = \"bar(abs)\", scale = 0.625, offset = -250000.0"
    } else if COUNT_WORDS.contains(&spelling.to_lowercase().as_str()) {
        "unit = \"count\" for a plain number, with scale (SI unit per count) and, if need be, offset"
    } else {
        return None;
    };
    Some(UnitError {
        problem: format!("unknown unit \"{}\"", one_line(spelling)),
        expected: expected.into(),
    })
}

fn unknown(spelling: &str) -> UnitError {
    if let Some(error) = raw(spelling) {
        return error;
    }
    let pressures: Vec<String> = PRESSURES
        .iter()
        .flat_map(|row| [format!("{}(abs)", row.0), format!("{}(g)", row.0)])
        .collect();
    let names = PLAIN.iter().map(|row| row.0);
    let known: Vec<&str> = names.chain(pressures.iter().map(String::as_str)).collect();
    UnitError {
        problem: format!("unknown unit \"{}\"", one_line(spelling)),
        expected: expected_one_of(spelling, &known),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn si(text: &str, value: f64) -> f64 {
        Unit::parse(text).expect(text).to_si(value)
    }

    #[test]
    fn val_definitions_of_the_units() {
        let cases = [
            ("psi(abs)", 1.0, 6_894.757_293_168),
            ("bar(g)", 2.0, 2e5),
            ("in", 2.0, 0.0508),
            ("lbf", 1.0, 4.448_221_615_260_5),
            ("degC", 20.0, 293.15),
            ("degF", 212.0, 373.15),
            ("%", 50.0, 0.5),
            ("ms", 10.0, 0.01),
            ("µm", 3.0, 3e-6),
            ("l/min(ANR)", 60_000.0, 1.185),
        ];
        for (text, value, expected) in cases {
            let got = si(text, value);
            assert!(
                (got - expected).abs() <= 1e-12 * expected.abs(),
                "{text}: {got} is not {expected}"
            );
        }
    }

    #[test]
    fn val_a_pressure_must_say_absolute_or_gauge() {
        let error = Unit::parse("bar").expect_err("ambiguous").to_string();
        assert_eq!(
            error,
            "unit \"bar\" does not say absolute or gauge, expected \"bar(abs)\" or \"bar(g)\""
        );
        assert!(Unit::parse("bar(g)").expect("gauge").is_gauge());
    }

    #[test]
    fn val_a_raw_unit_is_told_how_to_scale() {
        for text in ["mA", "LSB", "raw"] {
            let error = Unit::parse(text).expect_err(text).to_string();
            assert!(
                error.starts_with(&format!("unknown unit \"{text}\"")),
                "{error}"
            );
            assert!(error.contains("scale"), "{error}");
        }
    }

    #[test]
    fn prop_a_unit_above_a_column_contradicts_only_another_one() {
        let rig = |text| Unit::parse(text).expect(text);
        for (written, unit, scale, contradicts) in [
            ("s", "s", None, false),
            ("[ms]", "s", None, true),
            ("bar", "bar(g)", None, false),
            ("bara", "bar(g)", None, true),
            ("kPa", "Pa(abs)", None, true),
            ("V", "bar(g)", Some(0.5), false),
            ("V", "bar(g)", None, true),
            ("ns", "us", Some(1e-3), false),
            ("°C", "K", None, true),
        ] {
            let read = Written::read(written).expect(written);
            assert_eq!(
                read.contradicts(&rig(unit), scale),
                contradicts,
                "{written} {unit}"
            );
        }
        assert_eq!(Written::read("Pressure A"), None);
    }

    #[test]
    fn val_an_unknown_unit_gets_a_suggestion() {
        let error = Unit::parse("mmm").expect_err("unknown").to_string();
        assert!(error.starts_with("unknown unit \"mmm\", expected one of: s, ms"));
        assert!(error.ends_with(" (did you mean \"mm\"?)"));
    }
}
