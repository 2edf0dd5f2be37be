//! What the commands read: rigs, recordings and parts of them, and with which
//! files a page was made.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};

use super::CommandError;
use crate::hash;
use crate::laws::{Law, needs};
use crate::model::AxisFault;
use crate::recording::Recording;
use crate::recording_set::{reworked_stretch, shared_stretch};
use crate::report::Provenance;
use crate::rig::{Rig, RigError};
use crate::text::file_name;

pub(super) fn bad_input(error: impl ToString) -> CommandError {
    CommandError::BadInput(error.to_string())
}

/// A number of a rig file that makes no axis.
pub(super) fn rig_fault(path: &Path, fault: AxisFault) -> CommandError {
    bad_input(RigError {
        file: path.display().to_string(),
        line: None,
        key: Some(fault.key),
        problem: fault.problem,
        expected: fault.expected,
    })
}

pub(super) fn read_rig(path: &Path) -> Result<Rig, CommandError> {
    Rig::read(path).map_err(bad_input)
}

/// The name of a file without its folders, on one line.
pub(super) fn bare_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    file_name(&name.to_string_lossy())
}

/// Reads recordings. Error lines name the file as typed; afterwards a recording
/// goes by its file name, unless two share it.
pub(super) fn read_recordings(
    paths: &[PathBuf],
    rig: &Rig,
) -> Result<Vec<Recording>, CommandError> {
    let mut all: Vec<Recording> = Vec::new();
    for path in paths {
        all.push(read_recording(path, rig)?);
    }
    let names: Vec<String> = paths.iter().map(|path| bare_name(path)).collect();
    let distinct: BTreeSet<&String> = names.iter().collect();
    if distinct.len() == names.len() {
        for (recording, name) in all.iter_mut().zip(names) {
            recording.name = name;
        }
    }
    Ok(all)
}

/// Fewer rows than this say nothing of any law.
const LEAST_ROWS: usize = 30;

/// Reads a recording, or a part of one: `run.csv@0..50` is its first half, in percent of its rows,
/// `run.csv@1.5s..3s` what lies between two times. A file of that very name goes first.
pub(super) fn read_recording(path: &Path, rig: &Rig) -> Result<Recording, CommandError> {
    let text = path.to_string_lossy();
    let recording = match text.rsplit_once('@').filter(|_| !path.exists()) {
        None => Recording::read(path, &rig.signals).map_err(bad_input)?,
        Some((file, part)) => {
            let Some(part) = Part::of(part) else {
                return Err(bad_input(format!(
                    "{}: expected a part such as @0..50, rising percentages of the rows from 0 to 100, or @1.5s..3s, rising times",
                    file_name(&text)
                )));
            };
            let whole = Recording::read(file, &rig.signals).map_err(bad_input)?;
            whole.part(part.rows(&whole.time_s))
        }
    };
    if recording.len() < LEAST_ROWS {
        return Err(bad_input(format!(
            "{}: holds {} rows, expected at least {LEAST_ROWS}",
            file_name(&text),
            recording.len()
        )));
    }
    Ok(recording)
}

/// A part of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// Between two percentages of its rows.
    Percent(f64, f64),
    /// Between two of its times, s.
    Seconds(f64, f64),
}

impl Part {
    /// Of `0..50` or `1.5s..3s`.
    fn of(text: &str) -> Option<Self> {
        let (from, to) = text.split_once("..")?;
        if let (Some(from), Some(to)) = (from.strip_suffix('s'), to.strip_suffix('s')) {
            let (from, to): (f64, f64) = (from.parse().ok()?, to.parse().ok()?);
            return (from < to).then_some(Self::Seconds(from, to));
        }
        let (from, to): (f64, f64) = (from.parse().ok()?, to.parse().ok()?);
        (0.0 <= from && from < to && to <= 100.0).then_some(Self::Percent(from, to))
    }

    fn rows(self, time_s: &[f64]) -> std::ops::Range<usize> {
        let share = |percent: f64| (time_s.len() as f64 * percent / 100.0).round() as usize;
        let at = |second: f64| time_s.partition_point(|time| *time < second);
        match self {
            Self::Percent(from, to) => share(from)..share(to),
            Self::Seconds(from, to) => at(from)..at(to),
        }
    }
}

/// Refuses a row of a recording that is given twice: fitted to twice it counts for two, and
/// held out as well it proves nothing. Rows are compared, not names: a copy is found whatever
/// it is called.
pub(super) fn check_apart(train: &[Recording], held_out: &[Recording]) -> Result<(), CommandError> {
    let all: Vec<&Recording> = train.iter().chain(held_out).collect();
    for (place, later) in all.iter().enumerate() {
        for (other, earlier) in all[..place].iter().enumerate() {
            let (line, rows) = match shared_stretch(earlier, later) {
                Some(line) => (line, "rows from here on are"),
                None => match reworked_stretch(earlier, later) {
                    Some(line) => (line, "rows from here on have the noise of rows that are"),
                    None => continue,
                },
            };
            let (later, earlier) = (&later.name, &earlier.name);
            return Err(bad_input(if other < train.len() && place >= train.len() {
                format!(
                    "{later}:{line}: {rows} trained on too ({earlier}), expected different recordings"
                )
            } else {
                format!(
                    "{later}:{line}: {rows} given twice ({earlier}), expected each recording once"
                )
            }));
        }
    }
    Ok(())
}

/// The file of an argument that may name a part of it.
pub(super) fn without_part(path: &Path) -> PathBuf {
    let text = path.to_string_lossy();
    let part = text.rsplit_once('@').filter(|_| !path.exists());
    let file = part.filter(|(_, part)| Part::of(part).is_some());
    file.map_or_else(|| path.into(), |(file, _)| file.into())
}

/// The laws that the rig describes and its signals drive; one line where there
/// is none, with what is missing.
pub(super) fn laws(rig: &Rig) -> Result<Vec<Law>, CommandError> {
    let has = |signal: &str| rig.signals.contains(signal);
    let laws = Law::of(rig, &has);
    if laws.is_empty() {
        let lacks = needs::lacks(rig, &has);
        let first = lacks.first().map(ToString::to_string);
        return Err(bad_input(first.unwrap_or_else(|| no_law(rig))));
    }
    Ok(laws)
}

/// Lines on what a rig lacks, so that a law is not run, and on what laws assume.
pub(super) fn remarks_on_rig(rig: &Rig) -> Vec<String> {
    let has = |signal: &str| rig.signals.contains(signal);
    let lacks = needs::lacks(rig, &has);
    let lacks = lacks.iter().map(|lack| format!("not run: {lack}"));
    let assumed = needs::assumed(rig);
    let assumed = assumed.iter().map(|one| format!("assumed: {one}"));
    lacks.chain(assumed).collect()
}

/// Says what is to be said of a rig and of how its recordings were read, before any work.
pub(super) fn say_remarks<'r>(
    rig: &Rig,
    recordings: impl IntoIterator<Item = &'r Recording>,
    out: &mut dyn Write,
) -> io::Result<Vec<String>> {
    let mut remarks = remarks_on_rig(rig);
    let read = recordings.into_iter();
    let read = read.flat_map(Recording::named_remarks);
    remarks.extend(read.map(|one| format!("note: {one}")));
    for remark in &remarks {
        writeln!(out, "{remark}")?;
    }
    Ok(remarks)
}

/// The recordings' names.
pub(super) fn names(recordings: &[Recording]) -> Vec<&str> {
    recordings.iter().map(|one| one.name.as_str()).collect()
}

fn no_law(rig: &Rig) -> String {
    let has = |signal: &str| rig.signals.contains(signal);
    let absent = |needed: &[&str]| {
        let absent = needed.iter().filter(|signal| !has(signal));
        absent.copied().collect::<Vec<_>>().join(" and ")
    };
    let mut needs: Vec<String> = Vec::new();
    if rig.chambers.is_some() {
        let mut needed = vec![];
        if !has("p_b") {
            needed.push("p_a");
        }
        if rig.vessel.is_none() {
            needed.push("x");
        }
        if rig.valve.is_some() {
            needed.push("u");
        }
        let signals = absent(&needed);
        needs.push(match (signals.as_str(), rig.cylinder.is_some()) {
            ("", false) => "[chambers] a [cylinder] or a [vessel]".into(),
            (signals, _) => format!("[chambers] the signal {signals}"),
        });
    }
    if rig.carriage.is_some() {
        let signals = absent(&["x", "p_a", "p_b"]);
        needs.push(format!("[carriage] the signal {signals} (or x and force)"));
    } else if rig.friction.is_some() {
        needs.push(format!("[friction] the signal {}", absent(&["x", "force"])));
    }
    if rig.actuator.is_some() {
        needs.push(format!("[actuator] the signal {}", absent(&["u", "x"])));
    }
    if needs.is_empty() {
        return "the rig describes no law: it has neither [chambers], [carriage], [friction] nor [actuator]".into();
    }
    format!(
        "the recorded signals drive no law of the rig: it lacks for {}",
        needs.join(", for ")
    )
}

/// A bar that shows what is going on, on a terminal only.
pub(super) fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
        bar.set_style(style);
    }
    bar
}

/// The command as typed, the version and the files with their hashes.
pub(super) fn provenance<'p>(files: impl IntoIterator<Item = &'p PathBuf>) -> Provenance {
    let command = std::env::args()
        .enumerate()
        .map(|(place, word)| {
            if place == 0 {
                "pneuma".into()
            } else {
                quoted(&word)
            }
        })
        .collect::<Vec<String>>()
        .join(" ");
    let provenance = Provenance::new(command).fact("version", env!("CARGO_PKG_VERSION"));
    files.into_iter().fold(provenance, |provenance, path| {
        let path = without_part(path);
        let name = file_name(&path.display().to_string());
        if !path.is_file() {
            return provenance.fact("read once from a pipe, not hashed", name);
        }
        match hash::of_file(&path) {
            Ok((bytes, hash)) => provenance.file(name, bytes, hash),
            Err(_) => provenance,
        }
    })
}

/// What was assumed or not run, among the facts on how a page was made.
pub(super) fn with_remarks(provenance: Provenance, remarks: &[String]) -> Provenance {
    remarks.iter().fold(provenance, |provenance, remark| {
        let (what, which) = remark.split_once(": ").unwrap_or(("", remark));
        provenance.fact(what, which)
    })
}

/// A word of a command line, quoted where a shell would take it apart.
fn quoted(word: &str) -> String {
    let plain = |character: char| character.is_alphanumeric() || "-_=./,:+%@".contains(character);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", file_name(word).replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_part_is_of_rows_or_of_time() {
        let time_s: Vec<f64> = (0..100).map(|row| 0.1 * f64::from(row)).collect();
        let rows = |text: &str| Part::of(text).map(|part| part.rows(&time_s));
        assert_eq!(rows("0..50"), Some(0..50));
        assert_eq!(rows("1.95s..3.05s"), Some(20..31));
        assert_eq!(rows("0s..100s"), Some(0..100));
        for refused in ["50..0", "0..101", "3s..1s", "1s..50", "1..", "..", "a..b"] {
            assert_eq!(rows(refused), None, "{refused}");
        }
    }
}
