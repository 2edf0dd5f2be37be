//! The practice axes: recordings of a plant that another program simulated, each with its truth
//! beside it, and what a verdict on one is worth.

use crate::generated::{self, Part};
use crate::shell::{self, Failure, Outcome};
use crate::verdicts::{diagnosed, strings};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// This table's part of the page.
const PART: Part = Part {
    name: "practice axes",
    task: "cargo xtask evidence",
};

/// A size is right within this part of the true one ...
const SIZE_SHARE: f64 = 0.15;
/// ... or within so many of its own standard deviations.
const SIZE_DEVIATIONS: f64 = 2.0;

/// True sizes that a verdict states in the plant's own terms: effect and parameter, the plant's
/// name of it, and how many of the plant's make the verdict's (the plant counts half of a play).
const PLAIN_SIZES: [(&str, &str, f64); 13] = [
    ("tube-line.length_m", "tubeL", 1.0),
    ("tube-line.diameter_m", "tubeD", 1.0),
    ("piston-leakage.orifice_m2", "leakX", 1.0),
    ("spool-dynamics.natural_frequency_Hz", "spoolHz", 1.0),
    ("spool-dynamics.damping_ratio", "spoolZ", 1.0),
    ("supply-droop.tank_volume_m3", "tankV", 1.0),
    ("supply-droop.feed_area_m2", "feedA", 1.0),
    ("load-backlash.load_mass_kg", "mL", 1.0),
    ("load-backlash.stiffness_N_m", "kL", 1.0),
    ("load-backlash.damping_Ns_m", "cL", 1.0),
    ("load-backlash.gap_m", "gap", 2.0),
    ("dwell-stiction.rise_N", "dwF", 1.0),
    ("dwell-stiction.time_constant_s", "dwT", 1.0),
];

/// What is known of an axis.
pub struct Truth {
    /// The missing effects with their places, both sorted.
    pub effects: BTreeMap<String, Vec<String>>,
    /// True sizes by effect and parameter, as in a verdict.
    pub sizes: BTreeMap<String, f64>,
}

/// A size that was found beside the true one.
#[derive(Debug)]
pub struct Size {
    /// Effect and parameter.
    pub key: String,
    /// Found.
    pub found: f64,
    /// Its standard deviation, if stated.
    pub deviation: Option<f64>,
    /// True.
    pub truth: f64,
}

impl Size {
    /// Whether it is within 15 % or twice its stated deviation.
    pub fn is_right(&self) -> bool {
        let error = (self.found - self.truth).abs();
        error <= SIZE_SHARE * self.truth.abs() || self.is_within_own_deviations() == Some(true)
    }

    /// Whether it is within twice its stated deviation; `None` where none is stated.
    pub fn is_within_own_deviations(&self) -> Option<bool> {
        let known_to = self.deviation?;
        Some((self.found - self.truth).abs() <= SIZE_DEVIATIONS * known_to)
    }
}

impl Truth {
    /// Reads `truth.json` of an axis.
    ///
    /// # Errors
    /// If it cannot be read or lacks what it should hold.
    pub fn read(folder: &Path) -> Result<Self, Failure> {
        let truth = shell::read_json(&folder.join("truth.json"))?;
        let names = |key: &str| strings(&truth[key]);
        let places = names("places").into_iter().map(|places| {
            let mut all: Vec<String> = places.split('+').map(str::to_owned).collect();
            all.sort();
            all
        });
        Ok(Self {
            effects: names("effects").into_iter().zip(places).collect(),
            sizes: sizes(&truth["plant"]),
        })
    }

    /// What is wrong with a verdict: nothing, or what it should have said.
    pub fn objections(&self, verdict: &Value) -> Vec<String> {
        let mut all = self.objections_to_names(verdict);
        let wrong = self
            .found(verdict)
            .into_iter()
            .filter(|one| !one.is_right());
        all.extend(wrong.map(|one| format!("{one:?}")));
        all
    }

    /// The same of what is named and where, whatever its size.
    pub fn objections_to_names(&self, verdict: &Value) -> Vec<String> {
        let mut all = Vec::new();
        let kind = if self.effects.is_empty() {
            "nothing-missing"
        } else {
            "named"
        };
        if verdict["verdict"] != kind {
            all.push(format!("the verdict is {}, not {kind}", verdict["verdict"]));
        }
        let named = named(verdict);
        if named != self.effects {
            all.push(format!("named {named:?}, not {:?}", self.effects));
        }
        all
    }

    /// The sizes that a verdict states, beside the true ones.
    pub fn found(&self, verdict: &Value) -> Vec<Size> {
        let size = |(key, &truth): (&String, &f64)| {
            let (effect, parameter) = key.split_once('.')?;
            let mut effects = verdict["effects"].as_array()?.iter();
            let stated = &effects.find(|one| one["effect"] == effect)?["parameters"][parameter];
            Some(Size {
                key: key.clone(),
                found: stated["value"].as_f64()?,
                deviation: stated["std"].as_f64(),
                truth,
            })
        };
        self.sizes.iter().filter_map(size).collect()
    }
}

/// True sizes; of friction by pressure the plant holds shares of the level per bar, about 4 bar.
fn sizes(plant: &Value) -> BTreeMap<String, f64> {
    let number = |name: &str| plant[name].as_f64();
    let plain = PLAIN_SIZES
        .iter()
        .filter_map(|(key, name, times)| Some((*key, number(name)? * times)));
    let per_bar = |value: f64| value * 1e-5;
    let by_pressure = || {
        let (share, difference) = (number("kfp")?, number("kfd")?);
        let (coulomb, static_level) = (number("FC")?, number("FS")?);
        Some([
            ("per_mean_pressure_N_Pa", per_bar(share * coulomb)),
            ("per_pressure_difference_N_Pa", per_bar(difference)),
            (
                "static_rise_per_mean_pressure_N_Pa",
                per_bar(share * (static_level - coulomb)),
            ),
        ])
    };
    let by_pressure = by_pressure().into_iter().flatten();
    let by_pressure =
        by_pressure.map(|(key, size)| (format!("pressure-dependent-friction.{key}"), size));
    let plain = plain.map(|(key, size)| (key.to_owned(), size));
    plain.chain(by_pressure).collect()
}

/// The named effects with their places.
fn named(verdict: &Value) -> BTreeMap<String, Vec<String>> {
    let effect = |one: &Value| {
        let mut places = strings(&one["places"]);
        places.sort();
        Some((one["effect"].as_str()?.to_owned(), places))
    };
    let all = verdict["effects"].as_array().into_iter().flatten();
    all.filter_map(effect).collect()
}

/// The axes, each the folder of its rig file; none where there are no recordings.
pub fn axes() -> Vec<PathBuf> {
    let entries = fs::read_dir(shell::recordings().join("practice"));
    let entries = entries.into_iter().flatten().flatten();
    let mut all: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    all.retain(|folder| folder.join("rig.toml").is_file());
    all.sort();
    all
}

/// The recordings of an axis whose names begin so.
///
/// # Errors
/// If the folder cannot be read.
pub fn recordings(folder: &Path, begin: &str) -> Result<Vec<PathBuf>, Failure> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut all: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    all.retain(|path| {
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or("");
        name.starts_with(begin) && name.ends_with(".csv")
    });
    all.sort();
    Ok(all)
}

/// Diagnoses all axes and writes their table; fails afterwards where a verdict is not the true one.
pub fn run() -> Outcome {
    let (mut text, mut wrong) = (heading(), Vec::new());
    let mut sizes: Vec<Size> = Vec::new();
    for folder in axes() {
        let axis = folder.file_name().unwrap_or_default().to_string_lossy();
        println!("practice axis {axis}");
        let truth = Truth::read(&folder)?;
        let (train, held_out) = (recordings(&folder, "train")?, recordings(&folder, "held")?);
        let verdict = diagnosed(&folder.join("rig.toml"), &train, &held_out)?;
        row(&mut text, &axis, &truth, &verdict);
        sizes.extend(truth.found(&verdict));
        let objections = truth.objections(&verdict);
        wrong.extend(objections.iter().map(|one| format!("{axis}: {one}")));
    }
    text += &coverage(&sizes);
    PART.write(crate::verdicts::PAGE, &text)?;
    if wrong.is_empty() {
        return Ok(());
    }
    Err(wrong.join("\n").into())
}

/// How many sizes lie within two of their own deviations, whatever part of the size that is.
fn coverage(sizes: &[Size]) -> String {
    let stated: Vec<bool> = sizes
        .iter()
        .filter_map(Size::is_within_own_deviations)
        .collect();
    let within = stated.iter().filter(|is_within| **is_within).count();
    format!(
        "\nOf {} sizes with a stated standard deviation {within} lie within two of it.\n",
        stated.len()
    )
}

fn heading() -> String {
    format!(
        "Commit {}.\n\n\
         | axis | missing | said | sizes: found (true) | signal | refitted | improved | noise floor | work, s |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        generated::commit()
    )
}

/// One line of an axis: the signal is the one of which the refit misses most, over its noise.
fn row(text: &mut String, axis: &str, truth: &Truth, verdict: &Value) {
    let listed = |effects: &BTreeMap<String, Vec<String>>| {
        let names: Vec<&str> = effects.keys().map(String::as_str).collect();
        if names.is_empty() {
            "nothing".to_owned()
        } else {
            names.join(", ")
        }
    };
    let fit = |model: &str, signal: &str| {
        verdict["fit"][model]["held_out"][signal]
            .as_f64()
            .unwrap_or(f64::NAN)
    };
    let over_noise = |signal: &str| fit("refitted", signal) / fit("noise_floor", signal);
    let signals = verdict["fit"]["refitted"]["held_out"].as_object();
    let signals = signals
        .into_iter()
        .flatten()
        .map(|(signal, _)| signal.as_str());
    let signal = signals
        .max_by(|a, b| over_noise(a).total_cmp(&over_noise(b)))
        .unwrap_or("-");
    let said = named(verdict);
    let said = if said == truth.effects {
        "right".to_owned()
    } else {
        format!("{}: {}", verdict["verdict"], listed(&said))
    };
    let sizes: Vec<String> = truth.found(verdict).iter().map(spoken).collect();
    // Writing into a string cannot fail.
    let _ = writeln!(
        text,
        "| {axis} | {} | {said} | {} | {signal} | {:.4} | **{:.4}** | {:.4} | {:.0} |",
        listed(&truth.effects),
        sizes.join("; "),
        fit("refitted", signal),
        fit("improved", signal),
        fit("noise_floor", signal),
        verdict["seconds"].as_f64().unwrap_or(f64::NAN),
    );
}

/// A size in words; a wrong one is marked.
fn spoken(size: &Size) -> String {
    let parameter = size
        .key
        .split_once('.')
        .map_or("", |(_, parameter)| parameter);
    let known_to = size.deviation.map(|known_to| format!(" ± {known_to:.2e}"));
    let wrong = if size.is_right() { "" } else { " **off**" };
    let known_to = known_to.unwrap_or_default();
    format!(
        "{parameter} {:.3e}{known_to} ({:.3e}){wrong}",
        size.found, size.truth
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn size(found: f64, deviation: Option<f64>) -> Size {
        Size {
            key: "tube-line.length_m".into(),
            found,
            deviation,
            truth: 1.0,
        }
    }

    #[test]
    fn prop_a_size_is_right_within_a_share_or_its_own_deviations() {
        assert!(size(1.14, None).is_right());
        assert!(!size(1.16, None).is_right());
        assert!(size(1.4, Some(0.21)).is_right());
        assert!(!size(1.4, Some(0.19)).is_right());
        assert_eq!(
            size(1.1, Some(0.04)).is_within_own_deviations(),
            Some(false)
        );
        assert_eq!(size(1.1, None).is_within_own_deviations(), None);
        let text = coverage(&[
            size(1.1, Some(0.04)),
            size(1.1, Some(0.06)),
            size(1.0, None),
        ]);
        assert!(
            text.contains("Of 2 sizes with a stated standard deviation 1 lie"),
            "{text}"
        );
    }

    #[test]
    fn prop_a_verdict_is_objected_to_for_its_kind_its_effects_and_its_sizes() {
        let truth = Truth {
            effects: [("tube-line".to_owned(), vec!["valve-flow".to_owned()])].into(),
            sizes: [("tube-line.length_m".to_owned(), 1.0)].into(),
        };
        let verdict = |kind: &str, place: &str, length: f64| {
            json!({
                "verdict": kind,
                "effects": [{
                    "effect": "tube-line",
                    "places": [place],
                    "parameters": { "length_m": { "value": length, "std": 0.01 } },
                }],
            })
        };
        let objections =
            |kind, place, length| truth.objections(&verdict(kind, place, length)).len();
        assert_eq!(objections("named", "valve-flow", 1.1), 0);
        assert_eq!(objections("unknown", "valve-flow", 1.1), 1);
        assert_eq!(objections("named", "supply", 1.1), 1);
        assert_eq!(objections("named", "valve-flow", 1.3), 1);
    }
}
