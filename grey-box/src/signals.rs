//! What people call a signal, and the unit in which they read it.
//!
//! A reader knows her recording: its numbers are shown in its units. Bare SI units whose
//! numbers would be long (Pa, m, m/s) get the prefix of the trade: kPa, mm, mm/s.
//!
//! Glossary: *reading*, unit and zero of the scale on which a quantity is shown. A gauge
//! pressure counts from the ambient pressure; a difference, an error or a deviation has the
//! same unit and no zero.
//!
//! Limits: quantities that are no signal (a rate of pressure, a position error) take the unit
//! of the first recorded signal of their kind; without one they stay SI, prefixed as above.

use crate::rig::{Rig, signal_dimension};
use crate::units::{Dimension, Unit};

/// The scale on which a quantity is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The unit of a difference; an absolute pressure has the same.
    pub unit: String,
    /// How many of that unit make one of SI.
    pub per_si: f64,
    /// The SI value that is shown as zero.
    zero_si: f64,
    /// Whether it counts from the ambient pressure.
    is_gauge: bool,
}

/// The name of a signal in a sentence.
pub fn spoken(signal: &str) -> &str {
    match signal {
        "t" => "time",
        "u" => "valve command",
        "x" => "position",
        "x_ref" => "reference position",
        "v" => "velocity",
        "a" => "acceleration",
        "p_a" => "chamber A pressure",
        "p_b" => "chamber B pressure",
        "p_s" => "supply pressure",
        "p_e" => "exhaust pressure",
        "spool" => "spool displacement",
        "flow_a" => "chamber A mass flow",
        "flow_b" => "chamber B mass flow",
        "flow_s" => "supply mass flow",
        "temperature_a" => "chamber A temperature",
        "temperature_b" => "chamber B temperature",
        "temperature_s" => "supply temperature",
        other => other,
    }
}

/// The name of a signal at the begin of a sentence or a heading.
pub fn titled(signal: &str) -> String {
    let name = spoken(signal);
    if name == signal {
        // A column's or an unnamed signal's own spelling stays.
        return name.to_owned();
    }
    let mut letters = name.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

impl Reading {
    /// Of a quantity in this SI unit, whatever was recorded.
    fn of_si(unit: &str) -> Self {
        let (unit, per_si) = match unit {
            "Pa" => ("kPa", 1e-3),
            "Pa/s" => ("kPa/s", 1e-3),
            "m" => ("mm", 1e3),
            "m/s" => ("mm/s", 1e3),
            "m/s2" => ("m/s²", 1.0),
            "1" => ("", 1.0),
            other => (other, 1.0),
        };
        Self {
            unit: unit.to_owned(),
            per_si,
            zero_si: 0.0,
            is_gauge: false,
        }
    }

    /// Of a column in this unit.
    fn of_unit(unit: &Unit, gauge_zero_pa: f64) -> Self {
        let is_bare = (unit.factor() - 1.0).abs() < f64::EPSILON && !unit.is_gauge();
        let zero_si = unit.to_si(0.0) + if unit.is_gauge() { gauge_zero_pa } else { 0.0 };
        if is_bare && zero_si == 0.0 {
            return Self::of_si(unit.dimension().si_unit());
        }
        Self {
            unit: without_reference(unit.as_str()),
            per_si: 1.0 / unit.factor(),
            zero_si,
            is_gauge: unit.is_gauge(),
        }
    }

    /// Of a signal of this rig; one that it does not record is shown as others of its kind.
    pub fn of_signal(rig: &Rig, signal: &str) -> Self {
        let recorded = rig.signals.get(signal).map(|one| &one.unit);
        let dimension = signal_dimension(signal, recorded.map(Unit::dimension));
        match recorded {
            // A raw voltage that the rig scales to something else says nothing to a reader.
            Some(unit) if dimension == Some(unit.dimension()) => {
                Self::of_unit(unit, rig.signals.gauge_zero_pa)
            }
            _ => Self::of_quantity(rig, dimension.map_or("", Dimension::si_unit)),
        }
    }

    /// Of a quantity with this SI unit that is no signal, or an error of one: differences.
    pub fn of_quantity(rig: &Rig, si_unit: &str) -> Self {
        let like = |signals: &[&str]| {
            let mut recorded = signals.iter().filter_map(|name| rig.signals.get(name));
            recorded
                .find(|signal| signal.unit.dimension().si_unit() == si_unit)
                .map(|signal| Self::of_unit(&signal.unit, 0.0).for_difference())
        };
        let per_second = |base: &str| {
            let base = Self::of_quantity(rig, base);
            Self {
                unit: format!("{}/s", base.unit),
                ..base
            }
        };
        let found = match si_unit {
            "Pa" => like(&["p_a", "p_b", "p_s"]),
            "m" | "1" => like(&["x"]),
            "m/s" => like(&["v"]).or_else(|| rig.signals.get("x").map(|_| per_second("m"))),
            "Pa/s" => Some(per_second("Pa")),
            "1/s" => return per_second("1"),
            "N" => like(&["force"]),
            "V" => like(&["u"]),
            _ => None,
        };
        found.unwrap_or_else(|| Self::of_si(si_unit))
    }

    /// The same scale for differences.
    fn for_difference(self) -> Self {
        Self {
            zero_si: 0.0,
            is_gauge: false,
            ..self
        }
    }

    /// A value of the signal, as shown.
    pub fn value(&self, si: f64) -> f64 {
        (si - self.zero_si) * self.per_si
    }

    /// A difference of two values, an error, a deviation, as shown.
    pub fn difference(&self, si: f64) -> f64 {
        si * self.per_si
    }

    /// The words that an axis adds to the quantity: pressures say what they count from.
    pub fn reference(&self, signal: &str) -> &'static str {
        match (signal.starts_with("p_"), self.is_gauge) {
            (true, true) => ", gauge",
            (true, false) => ", absolute",
            _ => "",
        }
    }
}

/// `psi(abs)` is `psi`; `l/min(ANR)` keeps its reference, as it is no zero.
fn without_reference(unit: &str) -> String {
    let bare = unit.trim_end_matches("(abs)").trim_end_matches("(g)");
    match bare {
        "1" => String::new(),
        "um" => "µm".into(),
        "us" => "µs".into(),
        "um/s" => "µm/s".into(),
        "degC" => "°C".into(),
        "degF" => "°F".into(),
        other => other.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(signals: &str) -> Rig {
        Rig::parse(
            &format!(
                "format = \"rig/1\"\n[signals]\nt = {{ column = 9, unit = \"s\" }}\n{signals}"
            ),
            "rig.toml",
        )
        .unwrap()
    }

    #[test]
    fn prop_a_recorded_signal_is_shown_in_its_own_unit() {
        let units = [
            "psi(abs)", "psi(g)", "bar(abs)", "bar(g)", "MPa(abs)", "kPa(g)", "hPa(abs)",
        ];
        for unit in units {
            let rig = rig(&format!("p_a = {{ column = 0, unit = \"{unit}\" }}"));
            let signal = rig.signals.get("p_a").unwrap();
            let reading = Reading::of_signal(&rig, "p_a");
            let si = signal.to_si(3.7, rig.signals.gauge_zero_pa);
            assert!((reading.value(si) - 3.7).abs() < 1e-9, "{unit}");
            assert_eq!(reading.unit, unit.split('(').next().unwrap());
            let apart = signal.to_si(4.7, 0.0) - signal.to_si(3.7, 0.0);
            assert!((reading.difference(apart) - 1.0).abs() < 1e-9, "{unit}");
            let of_error = Reading::of_quantity(&rig, "Pa");
            assert!((of_error.value(apart) - 1.0).abs() < 1e-9, "{unit}");
        }
    }

    #[test]
    fn regress_inches_stay_inches_and_bare_si_gets_a_prefix() {
        let inches = rig("x = { column = 0, unit = \"in\" }");
        assert_eq!(Reading::of_quantity(&inches, "m").unit, "in");
        assert_eq!(Reading::of_quantity(&inches, "m/s").unit, "in/s");
        let bare =
            rig("x = { column = 0, unit = \"m\" }\np_a = { column = 1, unit = \"Pa(abs)\" }");
        assert_eq!(Reading::of_signal(&bare, "x").unit, "mm");
        assert_eq!(Reading::of_quantity(&bare, "Pa/s").unit, "kPa/s");
        assert_eq!(Reading::of_signal(&bare, "p_b").unit, "kPa");
        let percent = rig("x = { column = 0, unit = \"%\" }");
        assert!((Reading::of_signal(&percent, "x").value(0.25) - 25.0).abs() < 1e-12);
    }

    #[test]
    fn val_a_temperature_in_celsius_is_shown_so() {
        let rig = rig("temperature_a = { column = 0, unit = \"degC\" }");
        let reading = Reading::of_signal(&rig, "temperature_a");
        assert!((reading.value(293.15) - 20.0).abs() < 1e-9);
        assert!((reading.difference(2.0) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn regress_a_sentence_begins_with_a_capital_and_a_column_keeps_its_spelling() {
        assert_eq!(titled("p_a"), "Chamber A pressure");
        assert_eq!(titled("flow"), "flow");
    }
}
