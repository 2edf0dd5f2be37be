//! The `pneuma` program: reads the command line, hands over to a command.

use std::io;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use host_sim::cli::{
    self, compare::CompareArguments, fit::FitArguments, inspect::InspectArguments,
};

/// Servo-pneumatic axes: check recordings, compare and fit a rig file to them.
#[derive(Parser)]
#[command(name = "pneuma", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Compare(CompareArguments),
    Fit(FitArguments),
    Inspect(InspectArguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    let outcome = match &cli.command {
        Command::Compare(arguments) => cli::compare::run(arguments, &mut out),
        Command::Fit(arguments) => cli::fit::run(arguments, &mut out),
        Command::Inspect(arguments) => cli::inspect::run(arguments, &mut out),
    };
    ExitCode::from(cli::exit_status(outcome))
}
