//! The `pneuma` program: reads the command line, hands over to a command.

use std::io;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use host_sim::cli::{self, fit::FitArguments, inspect::InspectArguments};

/// Servo-pneumatic axes: check recordings against a rig file.
#[derive(Parser)]
#[command(name = "pneuma", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Fit(FitArguments),
    Inspect(InspectArguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    let outcome = match &cli.command {
        Command::Fit(arguments) => cli::fit::run(arguments, &mut out),
        Command::Inspect(arguments) => cli::inspect::run(arguments, &mut out),
    };
    ExitCode::from(cli::exit_status(outcome))
}
