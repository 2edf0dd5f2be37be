//! What the commands share: reading rigs and recordings, writing pages and
//! JSON, and saying how a page was made.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::CommandError;
use crate::laws::Law;
use crate::recording::Recording;
use crate::report::{Page, Provenance};
use crate::rig::Rig;
use crate::text::file_name;

pub(super) fn bad_input(error: impl ToString) -> CommandError {
    CommandError::BadInput(error.to_string())
}

pub(super) fn read_rig(path: &Path) -> Result<Rig, CommandError> {
    Rig::read(path).map_err(bad_input)
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
    let short = |path: &PathBuf| {
        let name = path.file_name().unwrap_or(path.as_os_str());
        file_name(&name.to_string_lossy())
    };
    let names: Vec<String> = paths.iter().map(short).collect();
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

/// Reads a recording, or a part of one: `run.csv@0..50` is its first half, in
/// percent of its rows. A file of that very name goes first.
pub(super) fn read_recording(path: &Path, rig: &Rig) -> Result<Recording, CommandError> {
    let text = path.to_string_lossy();
    let recording = match text.rsplit_once('@').filter(|_| !path.exists()) {
        None => Recording::read(path, &rig.signals).map_err(bad_input)?,
        Some((file, part)) => {
            let Some((from, to)) = percentages(part) else {
                return Err(bad_input(format!(
                    "{}: expected a part such as @0..50, rising percentages of the rows from 0 to 100",
                    file_name(&text)
                )));
            };
            let whole = Recording::read(file, &rig.signals).map_err(bad_input)?;
            let row = |percent: f64| (whole.len() as f64 * percent / 100.0).round() as usize;
            whole.part(row(from)..row(to))
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

/// First and last percent of `from..to`.
fn percentages(part: &str) -> Option<(f64, f64)> {
    let (from, to) = part.split_once("..")?;
    let (from, to): (f64, f64) = (from.parse().ok()?, to.parse().ok()?);
    (0.0 <= from && from < to && to <= 100.0).then_some((from, to))
}

/// Refuses to write over an input or over another output, or over what is no
/// regular file, before any work is done.
pub(super) fn check_outputs(inputs: &[&PathBuf], outputs: &[&PathBuf]) -> Result<(), CommandError> {
    let same = |a: &Path, b: &Path| match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    for (place, output) in outputs.iter().enumerate() {
        let shown = file_name(&output.display().to_string());
        if inputs.iter().any(|input| same(input, output)) {
            return Err(bad_input(format!(
                "{shown}: is an input, expected another file to write to"
            )));
        }
        if outputs[..place].iter().any(|other| same(other, output)) {
            return Err(bad_input(format!(
                "{shown}: is to hold two outputs, expected a file for each"
            )));
        }
        let folder = output.parent().filter(|path| !path.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return Err(bad_input(format!(
                "{shown}: is in no folder that there is, expected one to write to"
            )));
        }
        if output.exists() && !output.is_file() {
            return Err(bad_input(format!(
                "{shown}: is no regular file, expected one to write to"
            )));
        }
    }
    Ok(())
}

/// Refuses a row of a recording that is given twice: fitted to twice it counts for two, and
/// held out as well it proves nothing.
pub(super) fn check_apart(train: &[PathBuf], held_out: &[PathBuf]) -> Result<(), CommandError> {
    let all: Vec<&PathBuf> = train.iter().chain(held_out).collect();
    for (place, path) in all.iter().enumerate() {
        let Some(other) = all[..place].iter().position(|other| overlap(other, path)) else {
            continue;
        };
        let shown = file_name(&path.display().to_string());
        return Err(bad_input(if other < train.len() && place >= train.len() {
            format!(
                "{shown}: holds rows that are trained on too ({}), expected different recordings",
                file_name(&all[other].display().to_string())
            )
        } else {
            format!("{shown}: holds rows that are given twice, expected each recording once")
        }));
    }
    Ok(())
}

/// Whether two recordings, or parts of them, share rows; a copy under another name is the same
/// file. What cannot be read is refused where it is read.
fn overlap(one: &Path, other: &Path) -> bool {
    let ((one, a), (other, b)) = (file_and_part(one), file_and_part(other));
    if a.0 >= b.1 || b.0 >= a.1 {
        return false;
    }
    let length = |path: &Path| fs::metadata(path).map(|data| data.len()).ok();
    length(&one).is_some()
        && length(&one) == length(&other)
        && fs::read(&one).ok() == fs::read(&other).ok()
}

/// The file of an argument, and the part of its rows in percent.
fn file_and_part(path: &Path) -> (PathBuf, (f64, f64)) {
    let text = path.to_string_lossy();
    let part = text.rsplit_once('@').filter(|_| !path.exists());
    let part = part.and_then(|(file, part)| Some((file.into(), percentages(part)?)));
    part.unwrap_or((path.into(), (0.0, 100.0)))
}

/// The laws that the rig describes and its signals drive; one line where there
/// is none, with what is missing.
pub(super) fn laws(rig: &Rig) -> Result<Vec<Law>, CommandError> {
    let has = |signal: &str| rig.signals.contains(signal);
    let laws = Law::of(rig, &has);
    if laws.is_empty() {
        return Err(bad_input(no_law(rig)));
    }
    Ok(laws)
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

/// Written beside and renamed: an interrupted run leaves the old file or the
/// new one, never half of one.
pub(super) fn write_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CommandError> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".partial");
    let written = File::create(&beside).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()
    });
    written
        .and_then(|()| fs::rename(&beside, path))
        .map_err(|error| cannot_write(path, &error))
}

pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), CommandError> {
    write_with(path, |out| out.write_all(bytes))
}

pub(super) fn write_text(path: &Path, text: &str) -> Result<(), CommandError> {
    write_bytes(path, text.as_bytes())
}

pub(super) fn write_json(path: &Path, content: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string_pretty(content).map_err(bad_input)?;
    write_text(path, &(text + "\n"))
}

pub(super) fn write_page(path: &Path, page: &Page) -> Result<(), CommandError> {
    page.write(path).map_err(|error| cannot_write(path, &error))
}

fn cannot_write(path: &Path, error: &io::Error) -> CommandError {
    let path = file_name(&path.display().to_string());
    bad_input(format!("{path}: cannot be written: {error}"))
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
        let name = file_name(&path.display().to_string());
        match fingerprint(path) {
            Ok((bytes, hash)) => provenance.file(name, bytes, hash),
            Err(_) => provenance,
        }
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

/// Size and SHA-256 of a file.
fn fingerprint(path: &Path) -> io::Result<(u64, String)> {
    let mut file = File::open(path)?;
    let mut digest = Sha256::new();
    let mut block = vec![0_u8; 1 << 16];
    let mut bytes = 0;
    loop {
        let count = file.read(&mut block)?;
        if count == 0 {
            break;
        }
        bytes += count as u64;
        digest.update(&block[..count]);
    }
    let hash: String = digest
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Ok((bytes, hash))
}
