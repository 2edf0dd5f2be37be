//! `fleet.toml`: the axes of a fleet.

use crate::text::one_line;
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};

/// A fleet.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// What concerns all of it.
    #[serde(default)]
    pub fleet: Fleet,
    /// Its axes.
    #[serde(rename = "axis")]
    pub axes: Vec<Axis>,
}

/// What concerns all axes.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct Fleet {
    /// Where plan and results go, from the manifest's folder.
    pub results: PathBuf,
    /// Changes said of an axis that has none, a year.
    pub false_alarms_per_axis_year: f64,
}

impl Default for Fleet {
    fn default() -> Self {
        Self {
            results: "fleet".into(),
            false_alarms_per_axis_year: 0.05,
        }
    }
}

/// An axis.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Its name, which no other has.
    pub name: String,
    /// What shares its air and its weather: what changes in all axes of a group is none of theirs.
    #[serde(default)]
    pub group: String,
    /// The rig file.
    pub rig: PathBuf,
    /// Its recordings, one a night, as a pattern (`press-3/*.csv`).
    pub recordings: String,
    /// How many of the first nights show it as it should be.
    #[serde(default = "usual_reference")]
    pub reference: usize,
}

/// A week.
const fn usual_reference() -> usize {
    7
}

/// Fewer nights tell no scatter from night to night.
pub const LEAST_REFERENCE: usize = 3;

impl Manifest {
    /// Reads a manifest; paths in it are from its folder. The error is one line.
    pub fn read(path: &Path) -> Result<Self, String> {
        let shown = one_line(&path.display().to_string());
        let text = fs::read_to_string(path).map_err(|error| format!("{shown}: {error}"))?;
        let mut manifest: Self = toml::from_str(&text).map_err(|error| {
            let line = error
                .span()
                .map(|span| text[..span.start].lines().count().max(1));
            let line = line.map_or(String::new(), |line| format!(":{line}"));
            format!("{shown}{line}: {}", one_line(error.message()))
        })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        manifest.fleet.results = folder.join(&manifest.fleet.results);
        for axis in &mut manifest.axes {
            axis.rig = folder.join(&axis.rig);
            axis.recordings = folder.join(&axis.recordings).to_string_lossy().into_owned();
        }
        manifest
            .check()
            .map_err(|problem| format!("{shown}: {problem}"))?;
        Ok(manifest)
    }

    fn check(&self) -> Result<(), String> {
        let rate = self.fleet.false_alarms_per_axis_year;
        if !(rate > 0.0 && rate <= 10.0) {
            return Err(format!(
                "fleet.false_alarms_per_axis_year: {rate} is out of range, expected above 0, at most 10"
            ));
        }
        for (place, axis) in self.axes.iter().enumerate() {
            let name = one_line(&axis.name);
            if axis.name.is_empty() || self.axes[..place].iter().any(|one| one.name == axis.name) {
                return Err(format!(
                    "axis \"{name}\": expected a name that no other axis has"
                ));
            }
            if axis.reference < LEAST_REFERENCE {
                return Err(format!(
                    "axis \"{name}\": reference = {}, expected at least {LEAST_REFERENCE} nights",
                    axis.reference
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Manifest, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fleet.toml");
        fs::write(&path, text).unwrap();
        Manifest::read(&path)
    }

    const AXIS: &str = "[[axis]]\nname = \"one\"\nrig = \"rig.toml\"\nrecordings = \"one/*.csv\"\n";

    #[test]
    fn val_what_is_not_said_is_usual() {
        let manifest = read(AXIS).unwrap();
        assert_eq!(manifest.axes[0].reference, 7);
        assert!(manifest.fleet.results.ends_with("fleet"));
    }

    #[test]
    fn prop_a_fault_is_one_line_with_its_place() {
        for (text, expected) in [
            (AXIS.replace("rig =", "rigg ="), "fleet.toml:"),
            (
                format!("{AXIS}reference = 2\n"),
                "expected at least 3 nights",
            ),
            (format!("{AXIS}{AXIS}"), "a name that no other axis has"),
            (
                format!("[fleet]\nfalse_alarms_per_axis_year = 0.0\n{AXIS}"),
                "expected above 0",
            ),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        }
    }
}
