//! `pneuma fmu`: a unit for other simulation tools.

use std::env;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::CommandError;
use super::inputs::{bad_input, read_rig};
use super::outputs::check_outputs;
use crate::fmu::{Kind, LIBRARY, Standard, TICK_S, pack, variables};
use crate::output::write_whole;
use crate::text::file_name;

/// Write an axis, the board's controller or its observer as a functional mock-up unit (FMI 2.0 or
/// 3.0, co-simulation) for Simulink, Modelica tools, FMPy and others.
///
/// The numbers of the rig and all effects are parameters of the unit.
#[derive(Args, Clone, Debug)]
pub struct FmuArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: PathBuf,
    /// What the unit is.
    #[arg(long, value_enum)]
    pub kind: KindArgument,
    /// The file to write: a name that ends in .fmu.
    #[arg(long)]
    pub out: PathBuf,
    /// The version of the standard.
    #[arg(long, value_enum, default_value = "2.0")]
    pub fmi: StandardArgument,
    /// The library of the unit; otherwise the one beside this program.
    #[arg(long)]
    pub library: Option<PathBuf>,
}

/// What a unit is.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum KindArgument {
    /// The axis behind its converters.
    Plant,
    /// The board's control task.
    Controller,
    /// What the board believes of an axis that something else drives.
    Observer,
}

/// The version of the standard.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum StandardArgument {
    /// Most tools read it.
    #[value(name = "2.0")]
    Two,
    /// The present one.
    #[value(name = "3.0")]
    Three,
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If rig or library cannot be used, or the file not be written.
pub fn run(arguments: &FmuArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let shown = file_name(&arguments.out.display().to_string());
    if arguments
        .out
        .extension()
        .is_none_or(|ending| ending != "fmu")
    {
        return Err(bad_input(format!(
            "{shown}: expected a name that ends in .fmu"
        )));
    }
    let library_path = library_path(arguments)?;
    check_outputs(&[&arguments.rig, &library_path], &[&arguments.out])?;
    let kind = match arguments.kind {
        KindArgument::Plant => Kind::Plant,
        KindArgument::Controller => Kind::Controller,
        KindArgument::Observer => Kind::Observer,
    };
    let standard = match arguments.fmi {
        StandardArgument::Two => Standard::Two,
        StandardArgument::Three => Standard::Three,
    };
    let rig = read_rig(&arguments.rig)?;
    let library_name = library_path.display();
    let library = fs::read(&library_path).map_err(|error| {
        bad_input(format!(
            "{library_name}: cannot be read: {error}, expected the library that \
             `cargo build --release -p fmu` makes, beside this program or as --library"
        ))
    })?;
    let bytes = pack(standard, kind, &rig, &library).map_err(|error| {
        let culprit = match error {
            crate::fmu::ArchiveError::Rig(_) => arguments.rig.display(),
            _ => library_name,
        };
        bad_input(format!("{culprit}: {error}"))
    })?;
    write_whole(&arguments.out, |file| file.write_all(&bytes))?;
    let count = variables(kind, &rig).map_or(0, |list| list.len());
    let (name, tick_ms) = (kind.name(), 1e3 * TICK_S);
    writeln!(
        out,
        "{shown}: {name} with {count} variables, stepped by {tick_ms} ms"
    )?;
    Ok(())
}

/// The library that was asked for, or the one beside the program.
fn library_path(arguments: &FmuArguments) -> Result<PathBuf, CommandError> {
    if let Some(path) = &arguments.library {
        return Ok(path.clone());
    }
    let program = env::current_exe()?;
    let (before, after) = (env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    Ok(program.with_file_name(format!("{before}{LIBRARY}{after}")))
}
