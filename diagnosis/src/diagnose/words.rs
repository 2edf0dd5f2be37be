//! Words for a person: effects, sizes and what sets them apart.

mod experiments;

pub use experiments::{bearing_out, ruling_out, separating};

use super::candidates::Candidate;
use super::next_experiment::NextExperiment;
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
    /// Parameter's name in the rig file.
    pub parameter: String,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; `None` where the data leave it open.
    pub std: Option<f64>,
}

/// How a parameter is said.
struct Spoken {
    /// Its key, with `?` for the side or the knot.
    key: &'static str,
    /// What it is.
    words: &'static str,
    /// The unit of the trade.
    unit: &'static str,
    /// How many of that unit make one of the catalogue's.
    factor: f64,
    /// Sizes from here on are said by a later entry of the same key.
    below: f64,
}

const fn say(key: &'static str, words: &'static str, unit: &'static str, factor: f64) -> Spoken {
    Spoken {
        key,
        words,
        unit,
        factor,
        below: f64::INFINITY,
    }
}

impl Spoken {
    const fn below(mut self, most: f64) -> Self {
        self.below = most;
        self
    }
}

/// Times and lengths that one key has for a sensor as for a seal, for a tube as
/// for a cushion, are said in the small unit below these.
const SHORT_S: f64 = 0.5;
const SHORT_M: f64 = 0.1;

/// Every parameter of the catalogue of effects.
const SPOKEN: &[Spoken] = &[
    say("memory_?", "memory ?", "", 1.0),
    say(
        "conductance_?_W_K",
        "wall conductance of chamber ?",
        "W/K",
        1.0,
    ),
    say("density_exponent", "density exponent", "", 1.0),
    say("flow_W_m2K", "increase at a flow of 1 g/s", "W/(m² K)", 1.0),
    say("offset_K", "offset", "K", 1.0),
    say("heat_capacity_J_K", "heat capacity of the wall", "J/K", 1.0),
    say("outer_W_K", "conductance to the surroundings", "W/K", 1.0),
    say("volume_?_m3", "additional volume of chamber ?", "L", 1e3),
    say("volume_m3", "volume", "cm³", 1e6),
    say("tank_volume_m3", "tank volume", "L", 1e3),
    say("feed_area_m2", "feed area", "mm²", 1e6),
    say("gauge_before_feed", "gauge before the feed", "", 1.0),
    say("silencer_area_m2", "silencer area", "mm²", 1e6),
    say("needle_area_m2", "needle area", "mm²", 1e6),
    say(
        "laminar_?_kg_s_Pa2",
        "laminar conductance of chamber ?",
        "kg/(s Pa²)",
        1.0,
    ),
    say("laminar_kg_s_Pa2", "laminar conductance", "kg/(s Pa²)", 1.0),
    say("orifice_?_m2", "leakage area of chamber ?", "mm²", 1e6),
    say("orifice_m2", "leakage area", "mm²", 1e6),
    say("onset_s", "from", "s", 1.0),
    say("delay_s", "delay", "ms", 1e3),
    say("time_constant_s", "time constant", "ms", 1e3).below(SHORT_S),
    say("time_constant_s", "time constant", "s", 1.0),
    say("natural_frequency_Hz", "natural frequency", "Hz", 1.0),
    say("damping_ratio", "damping ratio", "", 1.0),
    say("rising_per_s", "rising rate", "command units per s", 1.0),
    say("falling_per_s", "falling rate", "command units per s", 1.0),
    say("width", "width", "command units", 1.0),
    say("length_m", "length", "mm", 1e3).below(SHORT_M),
    say("length_m", "length", "m", 1.0),
    say("diameter_m", "inner diameter", "mm", 1e3),
    say("offset_?_Pa", "offset of gauge ?", "kPa", 1e-3),
    say("gain_error_?", "gain error of gauge ?", "%", 100.0),
    say("coulomb_N", "level", "N", 1.0),
    say(
        "bristle_stiffness_N_m",
        "presliding stiffness",
        "N/mm",
        1e-3,
    ),
    say("static_excess_N", "excess", "N", 1.0),
    say("viscous_Ns_m", "coefficient", "N s/m", 1.0),
    say("per_mean_pressure_N_Pa", "per mean pressure", "N/bar", 1e5),
    say(
        "per_pressure_difference_N_Pa",
        "per pressure difference",
        "N/bar",
        1e5,
    ),
    say(
        "static_rise_per_mean_pressure_N_Pa",
        "additional break-away force per mean pressure",
        "N/bar",
        1e5,
    ),
    say("cosine", "cosine part", "%", 100.0),
    say("sine", "sine part", "%", 100.0),
    say("wavelength_m", "wavelength", "mm", 1e3),
    say("slope_per_m", "slope", "% per m", 100.0),
    say("curvature_per_m2", "curvature", "% per m²", 100.0),
    say("asymmetry", "excess towards +x", "%", 100.0),
    say("viscous_asymmetry", "viscous excess towards +x", "%", 100.0),
    say("rise_N", "rise", "N", 1.0),
    say("forgetting_way_m", "decay distance", "mm", 1e3),
    say("load_mass_kg", "load mass", "kg", 1.0),
    say("stiffness_N_m", "stiffness", "N/mm", 1e-3),
    say("damping_Ns_m", "damping", "N s/m", 1.0),
    say("gap_m", "total play", "mm", 1e3),
    say("force_N", "force", "N", 1.0),
    say("of_velocity", "over velocity", "", 1.0),
    say("from", "from", "m or m/s", 1.0),
    say("to", "to", "m or m/s", 1.0),
    say("force_?_N", "at knot ?", "N", 1.0),
    say("shift_?_V", "at knot ?", "V", 1.0),
    say("error_a_?_Pa", "gauge A at knot ?", "kPa", 1e-3),
    say("error_b_?_Pa", "gauge B at knot ?", "kPa", 1e-3),
    say("buffer_length_m", "buffer length", "mm", 1e3),
    say("buffer_stiffness_N_m", "buffer stiffness", "N/mm", 1e-3),
    say("buffer_damping_Ns_m", "buffer damping", "N s/m", 1.0),
];

/// What `?` may stand for: a side, or a knot of a table.
const WHICH: [&str; 11] = ["a", "b", "0", "1", "2", "3", "4", "5", "6", "7", "8"];

/// How a parameter of this size is said, and for which side; `None` for a key
/// that is not in the catalogue.
fn spoken_as(parameter: &str, value: f64) -> Option<(String, &'static Spoken)> {
    for spoken in SPOKEN.iter().filter(|spoken| value.abs() < spoken.below) {
        for side in WHICH {
            if spoken.key.replace('?', side) == parameter {
                return Some((spoken.words.replace('?', &side.to_uppercase()), spoken));
            }
        }
    }
    None
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
        let (words, unit, factor) = match spoken_as(&self.parameter, self.value) {
            Some((words, spoken)) => (words, spoken.unit, spoken.factor),
            None => (self.parameter.clone(), "", 1.0),
        };
        let number = match self.std.map(|std| std * factor) {
            Some(std) if std > 0.0 => with_deviation(self.value * factor, std),
            _ => digits(self.value * factor),
        };
        (words, number, unit)
    }
}

/// "rise 17.6 N and forgotten over 0.2 mm": sizes by parameter, SI.
pub fn sizes(sizes: &BTreeMap<String, f64>) -> String {
    let one = |(parameter, &value): (&String, &f64)| {
        let parameter = parameter.clone();
        let size = Size {
            parameter,
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
fn with_deviation(value: f64, std: f64) -> String {
    let magnitude = std.abs().log10().floor();
    let leading = std / 10f64.powf(magnitude);
    let decimals = -magnitude + if leading < 1.95 { 1.0 } else { 0.0 };
    if (0.0..7.0).contains(&decimals.max(0.0)) && value.abs() < 1e6 {
        let decimals = decimals.max(0.0) as usize;
        return format!("{value:.decimals$} ± {std:.decimals$}");
    }
    format!("{value:.2e} ± {std:.0e}")
}

/// What an effect is, to somebody who has not met its name.
pub fn meaning(effect: &str, form: Option<&str>) -> &'static str {
    known_meaning(effect, form).unwrap_or("an effect of the list")
}

fn known_meaning(effect: &str, form: Option<&str>) -> Option<&'static str> {
    Some(match (effect, form) {
        ("tube-line", _) => {
            "the tubes between valve and chambers store, delay and throttle the gas"
        }
        ("spool-dynamics", _) => "the spool follows the command as a second-order lag",
        ("valve-hysteresis", _) => "play (backlash) between command and stem or spool",
        ("valve-delay", _) => "dead time between command and valve",
        ("slew-limit", _) => {
            "the speed of the stem or spool is limited, with one limit per direction"
        }
        ("piston-leakage", Some("orifice")) => "leakage across the piston, orifice flow",
        ("piston-leakage", _) => "leakage across the piston seal, laminar flow",
        ("chamber-leakage", Some("orifice")) => "leakage to ambient, orifice flow",
        ("chamber-leakage", _) => "leakage to ambient, laminar flow",
        ("supply-droop", Some("gauge before the feed")) => {
            "the supply pressure drops at the valve, downstream of its gauge: the feed line is too narrow"
        }
        ("supply-droop", _) => {
            "the supply pressure drops: the regulator refills its tank more slowly than the valve empties it"
        }
        ("exhaust-back-pressure", _) => {
            "the silencer keeps the exhaust above ambient pressure at high flow"
        }
        ("gas-temperature-dynamics", _) => {
            "the gas temperature follows an energy balance with heat exchange to the wall"
        }
        ("variable-heat-transfer", _) => {
            "the heat transfer to the wall depends on the density and flow of the gas"
        }
        ("wall-temperature", _) => "the cylinder wall is not at ambient temperature",
        ("dead-volume", _) => "the dead volume of the chamber differs from the rig file",
        ("coulomb-friction", _) => "dry (Coulomb) friction",
        ("viscous-friction", _) => "viscous friction",
        ("stribeck-friction", _) => "break-away force above the sliding friction (Stribeck)",
        ("pressure-dependent-friction", _) => "dry friction that increases with pressure",
        ("position-dependent-friction", Some("slope")) => {
            "friction that changes linearly along the stroke"
        }
        ("position-dependent-friction", _) => "friction that varies periodically along the stroke",
        ("direction-dependent-friction", _) => "friction that differs between the two directions",
        ("dwell-stiction", _) => "break-away force that increases with the time at rest",
        ("constant-force", _) => "a constant force",
        ("unknown-force", _) => "unmodelled force, as a table",
        ("unknown-reading", _) => "unmodelled gauge error, as a table",
        ("unknown-opening", _) => "unmodelled error of the valve opening, as a table",
        ("load-compliance", _) => "part of the moving mass is coupled by a spring",
        ("load-backlash", _) => "part of the moving mass is coupled with play",
        ("end-cushion", Some("elastic")) => "elastic buffers at the ends of the stroke",
        ("end-cushion", _) => {
            "pneumatic cushions: near the end of stroke the chamber exhausts through a needle valve"
        }
        ("pressure-sensor-lag", _) => "the pressure sensors lag",
        ("gauge-gain", _) => "the gain of a pressure sensor is wrong",
        ("pressure-sensor-offset", _) => "a pressure sensor has an offset",
        ("position-time-skew", _) => "time skew between the position and the other channels",
        _ => return None,
    })
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
        let size = |parameter: &str, value, std| Size {
            parameter: parameter.into(),
            value,
            std,
        };
        let volume = size("volume_b_m3", 5.492e-3, Some(1.9e-4));
        assert_eq!(
            volume.spoken(),
            "additional volume of chamber B 5.49 ± 0.19 L"
        );
        let growth = size("per_mean_pressure_N_Pa", 1.43e-5, None);
        assert_eq!(growth.spoken(), "per mean pressure 1.43 N/bar");
        assert_eq!(size("delay_s", -0.32, None).spoken(), "delay -320 ms");
        assert_eq!(
            size("laminar_a_kg_s_Pa2", 1.1e-16, None).spoken(),
            "laminar conductance of chamber A 1.10e-16 kg/(s Pa²)"
        );
    }

    #[test]
    fn prop_every_effect_of_the_catalogue_has_words() {
        for effect in EFFECTS {
            assert!(
                known_meaning(effect.name, None).is_some(),
                "{}",
                effect.name
            );
        }
        assert!(known_meaning("phlogiston", None).is_none());
    }

    /// What one of the trade's units is in the catalogue's, by definition.
    fn of_catalogue(trade: &str) -> f64 {
        match trade {
            "L" | "mm" | "ms" => 1e-3,
            "cm³" | "mm²" => 1e-6,
            "kPa" | "N/mm" => 1e3,
            "N/bar" => 1e-5,
            "%" | "% per m" | "% per m²" => 0.01,
            _ => 1.0,
        }
    }

    #[test]
    fn prop_every_parameter_of_the_catalogue_is_said_in_words_and_in_its_unit() {
        let parameters = EFFECTS.iter().flat_map(|effect| effect.parameters);
        for parameter in parameters {
            for size in [0.01, 3.0] {
                let (words, spoken) = spoken_as(parameter.key, size)
                    .unwrap_or_else(|| panic!("{} has no words", parameter.key));
                assert!(!words.is_empty() && !words.contains('?'), "{words}");
                let one = spoken.factor * of_catalogue(spoken.unit);
                assert!((one - 1.0).abs() < 1e-12, "{}", parameter.key);
                let bare = matches!(parameter.unit, "1");
                assert_eq!(
                    bare && spoken.factor < 2.0,
                    spoken.unit.is_empty(),
                    "{words}"
                );
            }
        }
    }

    #[test]
    fn regress_no_key_of_the_words_is_strange_to_the_catalogue() {
        for spoken in SPOKEN {
            let keys = WHICH.map(|which| spoken.key.replace('?', which));
            let known = EFFECTS
                .iter()
                .any(|effect| keys.iter().any(|key| effect.parameter(key).is_some()));
            assert!(known, "{}", spoken.key);
        }
    }

    #[test]
    fn regress_a_sensor_lags_by_milliseconds_and_a_seal_ages_over_seconds() {
        let spoken = |value| {
            let size = Size {
                parameter: "time_constant_s".into(),
                value,
                std: None,
            };
            size.spoken()
        };
        assert_eq!(spoken(0.002), "time constant 2.00 ms");
        assert_eq!(spoken(1.5), "time constant 1.50 s");
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
