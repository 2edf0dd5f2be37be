//! Words for a person: effects, sizes and what sets them apart.

mod experiments;

pub use experiments::{bearing_out, ruling_out, separating};

use crate::effects;
use crate::estimate::candidates::Candidate;
use crate::search::next_experiment::NextExperiment;
use crate::signals;
use std::collections::BTreeMap;

/// An experiment that separates the rivals in fewer of its simulated repetitions than this is no advice.
const WORTH_RECORDING: f64 = 0.5;

/// What to record to tell two effects apart, and how well it does so in simulation.
pub fn what_to_record(simulated: Option<&NextExperiment>, [one, other]: [&str; 2]) -> String {
    let Some(simulated) = simulated else {
        return separating(one, other);
    };
    let NextExperiment {
        told,
        repetitions,
        text,
        times,
    } = simulated;
    if simulated.power() < WORTH_RECORDING {
        return format!(
            "{} (Not simulated. The best of the simulated experiments separates the two in {told} of {repetitions} repetitions.)",
            separating(one, other)
        );
    }
    let [if_one, if_other] = times.map(digits);
    format!(
        "{text}. In simulation with both models it separates them in {told} of {repetitions} repetitions. If {one} is true, {other} has {if_one} times the misfit; if {other} is true, {one} has {if_other} times the misfit."
    )
}

/// A size as people say it: value, standard deviation, unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Size {
    /// The effect's name.
    pub effect: String,
    /// Parameter's name in the rig file.
    pub parameter: String,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; `None` where the data leave it open.
    pub std: Option<f64>,
}

/// Three significant digits, without trailing noise.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor();
    if !(-3.0..5.0).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let decimals = (2.0 - magnitude).max(0.0) as usize;
    format!("{value:.decimals$}")
}

impl Size {
    /// "wall conductance of chamber A 33.7 ± 0.9 W/K"
    pub fn spoken(&self) -> String {
        let (words, number, unit) = self.parts();
        format!("{words} {number} {unit}").trim().to_owned()
    }

    /// What it is, the number, its unit.
    pub fn parts(&self) -> (String, String, &'static str) {
        let known = effects::effect(&self.effect);
        let known = known.and_then(|effect| effect.parameter(&self.parameter));
        let (words, unit, factor) = match known {
            Some(known) => (
                known.words.to_owned(),
                known.trade_unit,
                known.trade_factor(),
            ),
            None => (self.parameter.clone(), "", 1.0),
        };
        let number = match self.std.map(|std| std * factor) {
            Some(std) if std > 0.0 => with_deviation(self.value * factor, std),
            _ => digits(self.value * factor),
        };
        (words, number, unit)
    }
}

/// "rise 17.6 N and forgotten over 0.2 mm": sizes of an effect by parameter, SI.
pub fn sizes(effect: &str, sizes: &BTreeMap<String, f64>) -> String {
    let one = |(parameter, &value): (&String, &f64)| {
        let size = Size {
            effect: effect.to_owned(),
            parameter: parameter.clone(),
            value,
            std: None,
        };
        size.spoken()
    };
    let sizes: Vec<String> = sizes.iter().map(one).collect();
    list(&sizes)
}

/// A value to the digits that its deviation leaves meaningful: the deviation
/// with one digit, two if the first is a 1.
pub fn with_deviation(value: f64, std: f64) -> String {
    let magnitude = std.abs().log10().floor();
    let leading = std / 10f64.powf(magnitude);
    let decimals = -magnitude + if leading < 1.95 { 1.0 } else { 0.0 };
    if (0.0..7.0).contains(&decimals.max(0.0)) && value.abs() < 1e6 {
        let decimals = decimals.max(0.0) as usize;
        return format!("{value:.decimals$} ± {std:.decimals$}");
    }
    let digits = (value.abs().log10().floor() + decimals).max(1.0) as usize;
    format!("{value:.digits$e} ± {std:.0e}")
}

/// What an effect is, to somebody who has not met its name.
pub fn meaning(effect: &str, form: Option<&str>) -> &'static str {
    let Some(effect) = effects::effect(effect) else {
        return "an effect of the list";
    };
    let mut forms = effect.meaning_of_form.iter();
    let of_form = forms.find(|(name, _)| form == Some(*name));
    of_form.map_or(effect.meaning, |(_, meaning)| meaning)
}

/// "gas temperature dynamics in both chambers".
pub fn effect_at_places(effect: &str, form: Option<&str>, places: &[&str]) -> String {
    let form = form.map(|form| format!(" ({form})")).unwrap_or_default();
    let places = if places == ["chamber-a", "chamber-b"] {
        "in both chambers".into()
    } else {
        let places: Vec<String> = places.iter().map(|place| place_in_words(place)).collect();
        list(&places)
    };
    format!("{}{form} {places}", effect.replace('-', " "))
}

/// An effect with its sizes: "dead volume in chamber B (additional volume of chamber B 5.5 ± 0.2 L)".
pub fn named(candidate: &Candidate, sizes: &[Size]) -> String {
    let spoken: Vec<String> = sizes.iter().map(Size::spoken).collect();
    let sizes = if spoken.is_empty() {
        String::new()
    } else {
        format!(" ({})", spoken.join(", "))
    };
    let what = effect_at_places(candidate.effect, candidate.form, &candidate.places);
    format!("{what}{sizes}")
}

/// "in chamber A", "in the force balance", "at the position sensor".
fn place_in_words(place: &str) -> String {
    let preposition = match place {
        "valve-command" => return "between command and valve".into(),
        sensor if sensor.starts_with("sensor.") => "at the",
        "chamber-a" | "chamber-b" => "in",
        _ => "in the",
    };
    format!("{preposition} {}", self::place(place))
}

/// "chamber A", "force balance", "position sensor".
pub fn place(place: &str) -> String {
    match place {
        "chamber-a" => "chamber A".into(),
        "chamber-b" => "chamber B".into(),
        other => match other.strip_prefix("sensor.") {
            Some(signal) => format!("{} sensor", signals::spoken(signal)),
            None => other.replace('-', " "),
        },
    }
}

/// A probability or a share: "95 %", "more than 99 %", "less than 1 %".
pub fn percent(part: f64) -> String {
    if part > 0.99 && part < 1.0 {
        "more than 99 %".into()
    } else if part > 0.0 && part < 0.01 {
        "less than 1 %".into()
    } else {
        format!("{:.0} %", 100.0 * part)
    }
}

/// "a", "a and b", "a, b and c".
pub fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::EFFECTS;

    #[test]
    fn regress_sizes_are_said_in_the_units_of_the_trade() {
        let size = |effect: &str, parameter: &str, value, std| Size {
            effect: effect.into(),
            parameter: parameter.into(),
            value,
            std,
        };
        let volume = size("dead-volume", "volume_b_m3", 5.492e-3, Some(1.9e-4));
        assert_eq!(
            volume.spoken(),
            "additional volume of chamber B 5.49 ± 0.19 L"
        );
        let growth = size(
            "pressure-dependent-friction",
            "per_mean_pressure_N_Pa",
            1.43e-5,
            None,
        );
        assert_eq!(growth.spoken(), "per mean pressure 1.43 N/bar");
        let skew = size("position-time-skew", "delay_s", -0.32, None);
        assert_eq!(skew.spoken(), "delay -320 ms");
        assert_eq!(
            size("chamber-leakage", "laminar_a_kg_s_Pa2", 1.1e-16, None).spoken(),
            "laminar conductance of chamber A 1.10e-16 kg/(s Pa²)"
        );
    }

    #[test]
    fn regress_a_sensor_lags_by_milliseconds_and_a_seal_ages_over_seconds() {
        let spoken = |effect: &str, value| {
            let size = Size {
                effect: effect.into(),
                parameter: "time_constant_s".into(),
                value,
                std: None,
            };
            size.spoken()
        };
        assert_eq!(
            spoken("pressure-sensor-lag", 0.002),
            "time constant 2.00 ms"
        );
        assert_eq!(spoken("dwell-stiction", 0.4), "time constant 0.400 s");
    }

    #[test]
    fn prop_every_place_of_a_verdict_has_words() {
        let places = [
            "valve-command",
            "valve-flow",
            "supply",
            "exhaust",
            "chamber-a",
            "chamber-b",
            "force-balance",
            "sensor.p_a",
        ];
        for place in places {
            let words = place_in_words(place);
            assert!(!words.contains(['-', '.', '_']), "{words}");
        }
    }

    #[test]
    fn regress_the_documents_list_every_effect_with_keys_units_and_neutral_values() {
        let document = include_str!("../../../docs/model.md");
        for effect in EFFECTS {
            let name = format!("| `{}` |", effect.name);
            let row = document.lines().find(|line| line.starts_with(&name));
            let row = row.unwrap_or_else(|| panic!("{} has no row", effect.name));
            for parameter in effect.parameters {
                let neutral = parameter
                    .neutral
                    .map_or_else(|| "as declared".into(), |value| value.to_string());
                let entry = format!("`{}` ({}, {neutral})", parameter.key, parameter.unit);
                assert!(row.contains(&entry), "{}: {entry}", effect.name);
            }
        }
    }
}
