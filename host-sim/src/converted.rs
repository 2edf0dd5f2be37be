//! A recording as a file of another program, in the rig's columns and units: what `pneuma convert`
//! and the scope write.

use std::io::Write;
use std::path::Path;

use data_files::{Column, Target};

use crate::output::write_whole;
use crate::recording::{Recording, as_recorded};
use crate::rig::Rig;

/// Writes a recording in the form of `target`, text where there is none; how many columns it has.
///
/// # Errors
/// In words: if the form cannot hold it, or the file cannot be written.
pub fn write(
    recording: &Recording,
    rig: &Rig,
    (path, target): (&Path, Option<Target>),
) -> Result<usize, String> {
    let columns = as_recorded(recording, &rig.signals);
    let bytes = match target {
        None => None,
        Some(target) => Some(data_files::write(target, &columns, &recording.time_s)?),
    };
    let written = write_whole(path, |file| match &bytes {
        None => write_text(&columns, file),
        Some(bytes) => file.write_all(bytes),
    });
    written.map_err(|error| error.to_string())?;
    Ok(columns.len())
}

/// A table as CSV: names, units, rows.
fn write_text(columns: &[Column], file: &mut dyn Write) -> std::io::Result<()> {
    let mut text = data_files::Text::from(columns.to_vec());
    std::io::copy(&mut text.reader, file).map(|_| ())
}
