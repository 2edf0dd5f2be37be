//! The `pneuma` program: reads the command line, hands over to a command.

use std::io;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use host_sim::cli::{
    self, board::BoardArguments, check::CheckArguments, closed_loop::LoopArguments,
    compare::CompareArguments, controller::ControllerArguments, demo::DemoArguments,
    diagnose::DiagnoseArguments, fit::FitArguments, identify::IdentifyArguments,
    init::InitArguments, inspect::InspectArguments, record::RecordArguments,
    settings::SettingsArguments, shell_help::CompletionsArguments, shell_help::ManArguments,
    simulate::SimulateArguments, trial::TrialArguments,
};

/// Servo-pneumatic axes: simulate them, check their recordings, say what their
/// model leaves out.
#[derive(Parser)]
#[command(name = "pneuma", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Board(BoardArguments),
    Check(CheckArguments),
    Compare(CompareArguments),
    Completions(CompletionsArguments),
    Controller(ControllerArguments),
    Demo(DemoArguments),
    Diagnose(DiagnoseArguments),
    Fit(FitArguments),
    Identify(IdentifyArguments),
    Init(InitArguments),
    Inspect(InspectArguments),
    Loop(LoopArguments),
    Man(ManArguments),
    Record(RecordArguments),
    Settings(SettingsArguments),
    Simulate(SimulateArguments),
    Trial(TrialArguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    let run = || match &cli.command {
        Command::Board(arguments) => cli::board::run(arguments, &mut out),
        Command::Check(arguments) => cli::check::run(arguments, &mut out),
        Command::Compare(arguments) => cli::compare::run(arguments, &mut out),
        Command::Completions(arguments) => {
            cli::shell_help::completions(arguments, Cli::command(), &mut out)
        }
        Command::Controller(arguments) => cli::controller::run(arguments, &mut out),
        Command::Demo(arguments) => cli::demo::run(arguments, &mut out),
        Command::Diagnose(arguments) => cli::diagnose::run(arguments, &mut out),
        Command::Fit(arguments) => cli::fit::run(arguments, &mut out),
        Command::Identify(arguments) => cli::identify::run(arguments, &mut out),
        Command::Init(arguments) => cli::init::run(arguments, &mut out),
        Command::Inspect(arguments) => cli::inspect::run(arguments, &mut out),
        Command::Loop(arguments) => cli::closed_loop::run(arguments, &mut out),
        Command::Man(arguments) => cli::shell_help::man(arguments, Cli::command(), &mut out),
        Command::Record(arguments) => cli::record::run(arguments, &mut out),
        Command::Settings(arguments) => cli::settings::run(arguments, &mut out),
        Command::Simulate(arguments) => cli::simulate::run(arguments, &mut out),
        Command::Trial(arguments) => cli::trial::run(arguments, &mut out),
    };
    ExitCode::from(cli::exit_status(run))
}
