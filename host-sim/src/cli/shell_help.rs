//! `pneuma completions` and `pneuma man`: what a shell and `man` know of the program.

use super::CommandError;
use super::inputs::bad_input;
use clap::{Args, Command};
use clap_complete::Shell;
use std::io::Write;

/// Print the completions for a shell: `pneuma completions bash > FILE` in the folder where
/// the shell looks for them.
#[derive(Args, Debug)]
pub struct CompletionsArguments {
    /// The shell.
    pub shell: Shell,
}

/// Print the manual page, of the program or of one of its commands: `pneuma man | man -l -`.
#[derive(Args, Debug)]
pub struct ManArguments {
    /// A command, such as diagnose; the program as a whole without one.
    pub command: Option<String>,
}

/// Prints the completions.
///
/// # Errors
/// If they cannot be written.
pub fn completions(
    arguments: &CompletionsArguments,
    mut program: Command,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    // The generator itself panics where a reader has gone.
    let mut script = Vec::new();
    let name = program.get_name().to_owned();
    clap_complete::generate(arguments.shell, &mut program, name, &mut script);
    Ok(out.write_all(&script)?)
}

/// Prints a manual page.
///
/// # Errors
/// If there is no such command, or the page cannot be written.
pub fn man(
    arguments: &ManArguments,
    mut program: Command,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    // Then a command knows that its page is called `pneuma-NAME`.
    program.build();
    let page_of = match &arguments.command {
        None => program,
        Some(name) => program.find_subcommand(name).cloned().ok_or_else(|| {
            bad_input(format!(
                "{name}: no such command; `pneuma --help` lists them"
            ))
        })?,
    };
    Ok(clap_mangen::Man::new(page_of).render(out)?)
}
