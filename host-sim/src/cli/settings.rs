//! `pneuma settings`: a rig to a board's settings.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use firmware::settings::Settings;
use firmware::settings::record::{self, VERSION, content_crc};
use indicatif::{ProgressBar, ProgressStyle};

use super::inputs::{bad_input, read_rig};
use super::outputs::{check_outputs, write_bytes};
use super::{CommandError, wiring_of};
use crate::board::image::write_into;
use crate::board::port::{BAUD, Port};
use crate::board::send::{Kept, SendError, send};
use crate::settings::{stays_behind, wired};
use crate::text::file_name;

/// A record that comes from here is the first: in the slots of a blank board.
const FIRST_SEQUENCE: u32 = 1;

/// Write a rig's settings to a file, into an image or to a board, or show them.
///
/// Every number is judged as the board judges it: what it would refuse is
/// refused here, by name. A board takes settings at rest only and keeps them
/// over a loss of power.
#[derive(Args, Clone, Debug)]
#[command(group = clap::ArgGroup::new("from").required(true).args(["rig", "show"]))]
pub struct SettingsArguments {
    /// The rig file, as written by hand or by `pneuma diagnose`.
    #[arg(long)]
    pub rig: Option<PathBuf>,
    /// Show what a settings file, or a copy of a board's slot, holds.
    #[arg(long, conflicts_with_all = ["out", "into", "serial"])]
    pub show: Option<PathBuf>,
    /// Write the record as a slot holds it.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write the record into the first slot of an image (ELF), and blank the second.
    #[arg(long)]
    pub into: Option<PathBuf>,
    /// Send them to the board at a serial port, or at HOST:PORT.
    #[arg(long)]
    pub serial: Option<String>,
    /// Rate of the serial port.
    #[arg(long, default_value_t = BAUD, requires = "serial")]
    pub baud: u32,
    /// The board uses them until its next start and does not store them.
    #[arg(long, requires = "serial")]
    pub try_out: bool,
    /// The wiring of this axis was checked with this rig (`pneuma board check-wiring`): without
    /// it the board follows no reference until it is checked.
    #[arg(long, requires = "rig")]
    pub wiring_checked: bool,
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &SettingsArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    if let Some(path) = &arguments.show {
        return show(path, out);
    }
    let Some(rig_path) = &arguments.rig else {
        return Ok(());
    };
    if arguments.out.is_none() && arguments.into.is_none() && arguments.serial.is_none() {
        return Err(bad_input(
            "nothing to do with the settings, expected --out FILE, --into IMAGE or --serial PORT",
        ));
    }
    let outputs: Vec<&PathBuf> = arguments.out.iter().chain(&arguments.into).collect();
    check_outputs(&[rig_path], &outputs)?;
    let rig = read_rig(rig_path)?;
    let rig_name = file_name(&rig_path.display().to_string());
    let settings = wired(&rig, wiring_of(!arguments.wiring_checked))
        .map_err(|error| bad_input(format!("{rig_name}: {error}")))?;
    for line in stays_behind(&rig) {
        writeln!(out, "note: {line}; it is not among the settings")?;
    }
    if let Some(path) = &arguments.out {
        write_bytes(path, &slot_record(&settings)?)?;
        say(out, &path.display().to_string(), "written")?;
    }
    if let Some(path) = &arguments.into {
        into_image(path, &settings)?;
        say(
            out,
            &path.display().to_string(),
            "first slot written, second blanked",
        )?;
    }
    if let Some(port) = &arguments.serial {
        let kept = if arguments.try_out {
            Kept::UntilStart
        } else {
            Kept::Stored
        };
        let sent = to_board((port, arguments.baud), &settings, kept)?;
        sent.map_err(|error| bad_input(format!("{}: {error}", file_name(port))))?;
        say(out, port, kept.text())?;
    }
    Ok(())
}

fn say(out: &mut dyn Write, place: &str, what: &str) -> Result<(), CommandError> {
    writeln!(out, "{}: {what}", file_name(place))?;
    Ok(out.flush()?)
}

fn slot_record(settings: &Settings) -> Result<record::Record, CommandError> {
    record::encode(FIRST_SEQUENCE, settings)
        .ok_or_else(|| bad_input("the settings are longer than any record"))
}

fn into_image(path: &Path, settings: &Settings) -> Result<(), CommandError> {
    let name = file_name(&path.display().to_string());
    let cannot = |error: &dyn ToString| bad_input(format!("{name}: {}", error.to_string()));
    let image = fs::read(path).map_err(|error| cannot(&format!("cannot be read: {error}")))?;
    let changed = write_into(&image, &slot_record(settings)?).map_err(|error| cannot(&error))?;
    write_bytes(path, &changed)
}

/// Sends settings; how the board takes them.
pub(super) fn to_board(
    (port, baud): (&str, u32),
    settings: &Settings,
    kept: Kept,
) -> Result<Result<(), SendError>, CommandError> {
    let content = record::encode_content(settings)
        .ok_or_else(|| bad_input("the settings are longer than any record"))?;
    let mut board = Port::open(port, baud).map_err(bad_input)?;
    let bar = ProgressBar::new(content.len() as u64);
    let template = "settings {bar:30} {bytes}/{total_bytes}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    let sent = send(&mut board, &content, kept, |arrived| {
        bar.set_position(arrived as u64);
    });
    bar.finish_and_clear();
    Ok(sent)
}

fn show(path: &Path, out: &mut dyn Write) -> Result<(), CommandError> {
    let name = file_name(&path.display().to_string());
    let bytes =
        fs::read(path).map_err(|error| bad_input(format!("{name}: cannot be read: {error}")))?;
    let stored = record::decode(&bytes).map_err(|fault| bad_input(format!("{name}: {fault}")))?;
    let settings = &stored.settings;
    let content = record::encode_content(settings).unwrap_or_default();
    writeln!(
        out,
        "{name}: settings, version {VERSION}, writing {}, {} bytes, CRC {:08x}",
        stored.sequence,
        content.len(),
        content_crc(&content),
    )?;
    let mut lines: Vec<String> = Vec::new();
    settings.visit(&mut |field| lines.push(format!("  {} = {}", field.name, field.value)));
    let valve = &settings.valve;
    for (name, points) in [
        ("openings_v", &valve.openings_v),
        ("supply_areas_m2", &valve.supply_areas_m2),
        ("exhaust_areas_m2", &valve.exhaust_areas_m2),
    ] {
        lines.push(format!("  valve.{name} = {points:?}"));
    }
    lines.push(format!(
        "  valve.feeds_a_above_null = {}",
        valve.feeds_a_above_null
    ));
    let thermal = format!("{:?}", settings.chambers.thermal);
    let model = thermal.split([' ', '{']).next().unwrap_or_default();
    lines.push(format!("  chambers.thermal = {model}"));
    lines.sort();
    for line in lines {
        writeln!(out, "{line}")?;
    }
    // A board would judge them so at the usual tick of 1 ms.
    match settings.axis(1e-3) {
        Ok(_) => writeln!(out, "  a board accepts them")?,
        Err(fault) => writeln!(out, "  FAULT: a board refuses them: {fault}")?,
    }
    Ok(out.flush()?)
}
