//! What a command writes: refused before any work where it would replace an
//! input or another output, then written whole.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use same_file::Handle;
use serde::Serialize;

use super::CommandError;
use super::inputs::{bad_input, without_part};
use crate::output::{behind_links, folder_of, write_whole};
use crate::report::Page;
use crate::text::file_name;

/// Refuses, before any work is done, to write over an input (a part of a
/// recording is the file that it is a part of), over another output, into what
/// standard input or output stand for, or over what is no regular file.
pub(super) fn check_outputs(inputs: &[&PathBuf], outputs: &[&PathBuf]) -> Result<(), CommandError> {
    let inputs: Vec<Place> = inputs.iter().map(|path| Place::of_input(path)).collect();
    read_once(&inputs)?;
    let mut taken: Vec<Place> = Vec::new();
    for output in outputs {
        let refuse = |problem: &str| {
            let shown = file_name(&output.display().to_string());
            Err(bad_input(format!("{shown}: {problem}")))
        };
        if output.as_os_str() == "-" {
            return refuse(
                "is no file, expected the name of one: the terminal shows the result anyway",
            );
        }
        if output.to_string_lossy().ends_with(std::path::is_separator) {
            return refuse("names a folder, expected a file in it");
        }
        if without_part(output) != **output {
            return refuse("would be read as a part of a recording, expected a name without @");
        }
        let place = Place::of(output);
        if inputs.contains(&place) {
            return refuse("is an input, expected another file to write to");
        }
        if taken.contains(&place) {
            return refuse("is to hold two outputs, expected a file for each");
        }
        if place.is_standard(Handle::stdin()) {
            return refuse("is read as standard input, expected another file to write to");
        }
        if place.is_standard(Handle::stdout()) {
            return refuse("receives standard output already, expected another file to write to");
        }
        if !folder_of(&place.path).is_dir() {
            return refuse("the folder does not exist, expected an existing folder");
        }
        if place.path.exists() && !place.path.is_file() {
            return refuse("is no regular file, expected a file to write to");
        }
        taken.push(place);
    }
    Ok(())
}

/// Refuses a pipe that is given twice: it can be read once, and the second reader would wait for ever.
fn read_once(inputs: &[Place]) -> Result<(), CommandError> {
    for (index, place) in inputs.iter().enumerate() {
        let is_pipe = place.path.exists() && !place.path.is_file() && !place.path.is_dir();
        if is_pipe && inputs[..index].contains(place) {
            let shown = file_name(&place.path.display().to_string());
            return Err(bad_input(format!(
                "{shown}: is a pipe and is given twice, expected each input once"
            )));
        }
    }
    Ok(())
}

/// Where a file stands, whatever it is called: links followed, the file itself
/// known where it exists.
struct Place {
    path: PathBuf,
    file: Option<Handle>,
}

impl Place {
    fn of(path: &Path) -> Self {
        let path = behind_links(path).unwrap_or_else(|_| path.to_owned());
        let folder = fs::canonicalize(folder_of(&path));
        let path = match (folder, path.file_name()) {
            (Ok(folder), Some(name)) => folder.join(name),
            _ => path,
        };
        // A pipe is not opened to be compared: that would wait for its writer.
        let file = path
            .is_file()
            .then(|| Handle::from_path(&path).ok())
            .flatten();
        Self { path, file }
    }

    fn of_input(path: &Path) -> Self {
        Self::of(&without_part(path))
    }

    fn is_standard(&self, stream: io::Result<Handle>) -> bool {
        matches!((&self.file, stream), (Some(file), Ok(stream)) if *file == stream)
    }
}

impl PartialEq for Place {
    fn eq(&self, other: &Self) -> bool {
        let is_one_file = self.file.is_some() && self.file == other.file;
        is_one_file || self.path == other.path
    }
}

/// Writes a file whole; see [`crate::output`].
pub(super) fn write_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CommandError> {
    write_whole(path, write).map_err(|error| cannot_write(path, &error))
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

pub(super) fn cannot_write(path: &Path, error: &io::Error) -> CommandError {
    let path = file_name(&path.display().to_string());
    bad_input(format!("{path}: cannot be written: {error}"))
}
