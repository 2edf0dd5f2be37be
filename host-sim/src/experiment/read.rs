//! Reading an experiment file.

use super::Program;
use super::steps::FileStep;
use crate::rig::{RigError, line_at, read_text};
use firmware::experiment::{Envelope, MOST_STEPS};
use serde::Deserialize;
use std::path::Path;

/// The only format there is.
const FORMAT: &str = "experiment/1";

/// An experiment file that cannot be used: file, line, key, problem, expectation.
pub type ExperimentError = RigError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    envelope: FileEnvelope,
    step: Vec<toml::Spanned<FileStep>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileEnvelope {
    position_m: [f64; 2],
    speed_m_s: f64,
    #[serde(rename = "pressure_Pa")]
    pressure_pa: [f64; 2],
    #[serde(rename = "force_N")]
    force_n: f64,
}

/// Reads an experiment file.
///
/// # Errors
/// If it is none, or asks for what no board can do.
pub fn read(path: &Path) -> Result<Program, ExperimentError> {
    let name = path.display().to_string();
    parse(&read_text(path, &name, "experiment")?, &name)
}

/// Reads the text of an experiment file, which is named in errors.
///
/// # Errors
/// If it is none, or asks for what no board can do.
pub fn parse(text: &str, name: &str) -> Result<Program, ExperimentError> {
    let complaint = |line: Option<usize>, key: Option<String>, problem: String, expected: &str| {
        ExperimentError {
            file: name.into(),
            line,
            key,
            problem,
            expected: expected.into(),
        }
    };
    let file: File = toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| line_at(text, span.start));
        complaint(line, None, error.message().to_owned(), "an experiment file")
    })?;
    if file.format != FORMAT {
        let problem = format!("is \"{}\"", file.format);
        let expected = "\"experiment/1\"";
        return Err(complaint(None, Some("format".into()), problem, expected));
    }
    let envelope = file
        .envelope
        .checked()
        .map_err(|(key, problem, expected)| {
            complaint(None, Some(format!("envelope.{key}")), problem, expected)
        })?;
    let mut program = Program {
        text: text.to_owned(),
        envelope,
        steps: Vec::new(),
        origins: Vec::new(),
    };
    for (place, step) in file.step.iter().enumerate() {
        let (span, step) = (step.span(), step.get_ref());
        for one in step.steps() {
            if let Some(defect) = one.defect() {
                let (key, expected) = step.key_of(defect);
                let key = format!("step {} ({}) {key}", place + 1, step.kind());
                let line = Some(line_at(text, span.start));
                return Err(complaint(line, Some(key), "is impossible".into(), expected));
            }
            program.steps.push(one);
            program.origins.push((place + 1, step.kind()));
        }
    }
    if program.steps.is_empty() || program.steps.len() > MOST_STEPS {
        let problem = format!("the steps are {} for a board", program.steps.len());
        let expected = format!("1 to {MOST_STEPS} (a dwell is two a rest)");
        return Err(complaint(None, Some("step".into()), problem, &expected));
    }
    Ok(program)
}

impl FileEnvelope {
    /// The board's, or the key, what is wrong and what was expected.
    fn checked(&self) -> Result<Envelope, (&'static str, String, &'static str)> {
        let [low_m, high_m] = self.position_m;
        let [low_pa, high_pa] = self.pressure_pa;
        let is_range = |low: f64, high: f64| low.is_finite() && high.is_finite() && low < high;
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        if !(is_range(low_m, high_m) && low_m.abs() <= 0.25 && high_m.abs() <= 0.25) {
            let problem = format!("is [{low_m}, {high_m}]");
            return Err((
                "position_m",
                problem,
                "lowest and highest, metres within 0.25",
            ));
        }
        if !is_positive(self.speed_m_s) {
            let problem = format!("is {}", self.speed_m_s);
            return Err(("speed_m_s", problem, "metres a second above 0"));
        }
        if !(is_range(low_pa, high_pa) && low_pa >= 0.0 && high_pa >= 1e5) {
            let problem = format!("is [{low_pa}, {high_pa}]");
            let expected =
                "lowest and highest, Pa absolute, the highest above that of the surroundings";
            return Err(("pressure_Pa", problem, expected));
        }
        if !is_positive(self.force_n) {
            return Err(("force_N", format!("is {}", self.force_n), "newtons above 0"));
        }
        Ok(Envelope {
            position_m: self.position_m.map(|one| one as f32),
            speed_m_per_s: self.speed_m_s as f32,
            pressure_pa: self.pressure_pa.map(|one| one as f32),
            force_n: self.force_n as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENVELOPE: &str = "format = \"experiment/1\"\n[envelope]\nposition_m = [-0.1, 0.1]\nspeed_m_s = 1.0\n\
                            pressure_Pa = [5e4, 8e5]\nforce_N = 300.0\n";

    fn parsed(steps: &str) -> Result<Program, ExperimentError> {
        parse(&format!("{ENVELOPE}{steps}"), "e.toml")
    }

    #[test]
    fn prop_a_dwell_is_several_steps_of_the_board() {
        let program = parsed(
            "[[step]]\nkind = \"triangle\"\namplitude_V = 0.5\nseconds = 8.0\nperiods = 2\n\
             [[step]]\nkind = \"dwell\"\nfrom_m = 0.0\nto_m = 0.02\nmove_s = 0.5\nrests_s = [0.1, 1.0]\n",
        );
        let program = program.expect("a program");
        assert_eq!(program.steps.len(), 1 + 4);
        assert!((program.seconds() - (8.0 + 2.0 * 0.6 + 2.0 * 1.5)).abs() < 1e-5);
        assert_eq!(program.name_of(0), "step 1 (triangle)");
        assert_eq!(program.name_of(4), "step 2 (dwell)");
    }

    #[test]
    fn prop_what_is_impossible_is_said_with_line_and_key() {
        for (steps, said) in [
            (
                "[[step]]\nkind = \"opening\"\nopening_V = 9.0\nseconds = 1.0\n",
                "step 1 (opening) opening_V",
            ),
            (
                "[[step]]\nkind = \"chirp\"\namplitude_V = 1.0\nfrom_Hz = 0.0\nto_Hz = 5.0\nseconds = 1.0\n",
                "from_Hz, to_Hz",
            ),
            (
                "[[step]]\nkind = \"hold\"\nseconds = -1.0\n",
                "step 1 (hold) seconds",
            ),
            (
                "[[step]]\nkind = \"leap\"\nseconds = 1.0\n",
                "unknown variant `leap`",
            ),
            (
                "[[step]]\nkind = \"dwell\"\nfrom_m = 0.0\nto_m = 0.1\nmove_s = 1.0\nrests_s = [1,1,1,1,1,1,1,1,1,1,1,1,1]\n",
                "the steps are 26",
            ),
        ] {
            let error = parsed(steps).expect_err("impossible").to_string();
            assert!(error.contains(said), "{steps}: {error}");
        }
        let error = parsed(
            "[[step]]\nkind = \"sine\"\namplitude_m = 0.4\nfrequency_Hz = 1.0\nperiods = 3\n",
        );
        let error = error.expect_err("too far").to_string();
        assert!(
            error.starts_with("e.toml:7: step 1 (sine) amplitude_m"),
            "{error}"
        );
        let narrow = ENVELOPE.replace("[-0.1, 0.1]", "[0.1, -0.1]");
        let error = parse(
            &format!("{narrow}[[step]]\nkind = \"hold\"\nseconds = 1.0\n"),
            "e.toml",
        );
        assert!(
            error
                .expect_err("no room")
                .to_string()
                .contains("envelope.position_m")
        );
    }
}
