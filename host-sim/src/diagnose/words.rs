//! Words for a person: effects, sizes and what sets them apart.

use super::candidates::Candidate;

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

/// How a parameter is said: its name with `?` for the side, words, unit, factor.
const SPOKEN: [(&str, &str, &str, f64); 20] = [
    ("conductance_?_W_K", "wall conductance ?", "W/K", 1.0),
    ("volume_?_m3", "additional volume ?", "L", 1e3),
    ("laminar_?_kg_s_Pa2", "coefficient ?", "kg/(s Pa²)", 1.0),
    ("orifice_?_m2", "area ?", "mm²", 1e6),
    ("onset_s", "from", "s", 1.0),
    ("delay_s", "delay", "ms", 1e3),
    ("time_constant_s", "time constant", "ms", 1e3),
    ("coulomb_N", "level", "N", 1.0),
    (
        "bristle_stiffness_N_m",
        "presliding stiffness",
        "N/mm",
        1e-3,
    ),
    ("static_excess_N", "excess", "N", 1.0),
    ("viscous_Ns_m", "coefficient", "N s/m", 1.0),
    ("per_mean_pressure_N_Pa", "per mean pressure", "N/bar", 1e5),
    (
        "per_pressure_difference_N_Pa",
        "per pressure difference",
        "N/bar",
        1e5,
    ),
    ("force_N", "force", "N", 1.0),
    ("rising_per_s", "rising", "per s", 1.0),
    ("falling_per_s", "falling", "per s", 1.0),
    ("width", "width", "", 1.0),
    ("length_m", "length", "m", 1.0),
    ("natural_frequency_Hz", "natural frequency", "Hz", 1.0),
    ("damping_ratio", "damping ratio", "", 1.0),
];

/// Words, unit and factor of a parameter; its own name where none are known.
fn spoken_as(parameter: &str) -> (String, &'static str, f64) {
    for (pattern, words, unit, factor) in SPOKEN {
        for side in ["a", "b"] {
            if pattern.replace('?', side) == parameter {
                return (words.replace('?', side), unit, factor);
            }
        }
    }
    (parameter.to_owned(), "", 1.0)
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
    /// "wall conductance a 33.7 ± 0.9 W/K"
    pub fn spoken(&self) -> String {
        let (words, unit, factor) = spoken_as(&self.parameter);
        let number = match self.std.map(|std| std * factor) {
            Some(std) if std > 0.0 => with_deviation(self.value * factor, std),
            _ => digits(self.value * factor),
        };
        format!("{words} {number} {unit}").trim().to_owned()
    }
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
    match (effect, form) {
        ("gas-temperature-dynamics", _) => {
            "the gas temperature follows its own balance, with heat exchange to the wall"
        }
        ("dead-volume", _) => "the chamber's dead volume is not the one stated",
        ("chamber-leakage", Some("orifice")) => "gas leaks to the surroundings through an orifice",
        ("chamber-leakage", _) => "gas leaks to the surroundings through a laminar gap",
        ("position-time-skew", _) => {
            "the position is recorded at another time than the other channels"
        }
        ("pressure-sensor-lag", _) => "the pressure sensors lag",
        ("coulomb-friction", _) => "dry (Coulomb) friction",
        ("viscous-friction", _) => "viscous friction",
        ("stribeck-friction", _) => "a breakaway force above the sliding friction (Stribeck)",
        ("pressure-dependent-friction", _) => "dry friction that grows with the pressure",
        ("constant-force", _) => "a constant force",
        ("slew-limit", _) => {
            "the rate of the stem or spool is limited, one limit for each direction"
        }
        ("valve-delay", _) => "the valve acts on the command of a while ago",
        ("valve-hysteresis", _) => "play (backlash) between command and stem or spool",
        ("spool-dynamics", _) => "the spool follows the command as a second-order lag",
        ("tube-line", _) => "tubes between valve and chambers",
        _ => "an effect of the list",
    }
}

/// What to record to tell two effects apart (`docs/method.md`, experiments).
pub fn separating(one: &str, other: &str) -> String {
    const EXPERIMENTS: [(&str, &str, &str); 6] = [
        (
            "viscous-friction",
            "coulomb-friction",
            "Strokes at four or more constant speeds from 1 to 500 mm/s in both directions, at one pressure.",
        ),
        (
            "viscous-friction",
            "pressure-dependent-friction",
            "Strokes at four or more constant speeds in both directions, at each of three pressures.",
        ),
        (
            "chamber-leakage",
            "gas-temperature-dynamics",
            "Fill, shut the valve and dwell for a minute: a leak settles at ambient pressure, heat exchange above it.",
        ),
        (
            "dead-volume",
            "position-time-skew",
            "Slow and fast strokes over the same way: a volume does not depend on the speed, a skew does.",
        ),
        (
            "spool-dynamics",
            "valve-delay",
            "A chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes.",
        ),
        (
            "tube-line",
            "valve-delay",
            "Bursts of the command at two positions of the fixed piston: a delay does not depend on the volume.",
        ),
    ];
    EXPERIMENTS
        .iter()
        .find(|(a, b, _)| (*a == one && *b == other) || (*a == other && *b == one))
        .map_or_else(
            || format!("A recording in which {one} and {other} act at different times or speeds."),
            |(_, _, experiment)| (*experiment).to_owned(),
        )
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

/// The same with its sizes: "dead volume in chamber b (additional volume b 5.5 ± 0.2 L)".
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

/// "in chamber a", "in the force balance", "at the sensor of x".
fn place_in_words(place: &str) -> String {
    match place {
        "chamber-a" => "in chamber a".into(),
        "chamber-b" => "in chamber b".into(),
        "force-balance" => "in the force balance".into(),
        "valve-flow" => "in the valve's flow".into(),
        "valve-command" => "between command and valve".into(),
        other => match other.strip_prefix("sensor.") {
            Some(signal) => format!("at the sensor of {signal}"),
            None => format!("at {other}"),
        },
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

    #[test]
    fn regress_sizes_are_said_in_the_units_of_the_trade() {
        let size = |parameter: &str, value, std| Size {
            parameter: parameter.into(),
            value,
            std,
        };
        let volume = size("volume_b_m3", 5.492e-3, Some(1.9e-4));
        assert_eq!(volume.spoken(), "additional volume b 5.49 ± 0.19 L");
        let growth = size("per_mean_pressure_N_Pa", 1.43e-5, None);
        assert_eq!(growth.spoken(), "per mean pressure 1.43 N/bar");
        assert_eq!(size("delay_s", -0.32, None).spoken(), "delay -320 ms");
        assert_eq!(
            size("laminar_a_kg_s_Pa2", 1.1e-16, None).spoken(),
            "coefficient a 1.10e-16 kg/(s Pa²)"
        );
    }
}
