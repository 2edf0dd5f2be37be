//! The `pneuma` program: reads the command line, hands over to a command.

use std::env;
use std::io;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use host_sim::cli::{
    self, board::BoardArguments, check::CheckArguments, closed_loop::LoopArguments,
    commission::CommissionArguments, compare::CompareArguments, controller::ControllerArguments,
    convert::ConvertArguments, demo::DemoArguments, diagnose::DiagnoseArguments,
    doctor::DoctorArguments, fit::FitArguments, fleet::FleetArguments, fmu::FmuArguments,
    identify::IdentifyArguments, init::InitArguments, inspect::InspectArguments,
    paper::PaperArguments, record::RecordArguments, response::ResponseArguments,
    scope::ScopeArguments, settings::SettingsArguments, shell_help::CompletionsArguments,
    shell_help::ManArguments, simulate::SimulateArguments, trial::TrialArguments,
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
    Commission(CommissionArguments),
    Compare(CompareArguments),
    Completions(CompletionsArguments),
    Controller(ControllerArguments),
    Convert(ConvertArguments),
    Demo(DemoArguments),
    Diagnose(DiagnoseArguments),
    Doctor(DoctorArguments),
    Fit(FitArguments),
    Fleet(FleetArguments),
    Fmu(FmuArguments),
    Identify(IdentifyArguments),
    Init(InitArguments),
    Inspect(InspectArguments),
    Loop(LoopArguments),
    Man(ManArguments),
    Paper(PaperArguments),
    /// Reads a file of another program for a process that holds no memory in danger.
    #[command(name = READER, hide = true)]
    ReadDataFile,
    Record(RecordArguments),
    Response(ResponseArguments),
    Scope(ScopeArguments),
    Settings(SettingsArguments),
    Simulate(SimulateArguments),
    Trial(TrialArguments),
}

/// The argument with which the program reads files of other programs for itself.
const READER: &str = "read-data-file";

fn main() -> ExitCode {
    if let Ok(program) = env::current_exe() {
        data_files::read_apart(program, READER);
    }
    let cli = Cli::parse();
    let mut out = io::stdout().lock();
    let run = || match &cli.command {
        Command::Board(arguments) => cli::board::run(arguments, &mut out),
        Command::Check(arguments) => cli::check::run(arguments, &mut out),
        Command::Commission(arguments) => cli::commission::run(arguments, &mut out),
        Command::Compare(arguments) => cli::compare::run(arguments, &mut out),
        Command::Completions(arguments) => {
            cli::shell_help::completions(arguments, Cli::command(), &mut out)
        }
        Command::Controller(arguments) => cli::controller::run(arguments, &mut out),
        Command::Convert(arguments) => cli::convert::run(arguments, &mut out),
        Command::Demo(arguments) => cli::demo::run(arguments, &mut out),
        Command::Diagnose(arguments) => cli::diagnose::run(arguments, &mut out),
        Command::Doctor(arguments) => cli::doctor::run(arguments, &mut out),
        Command::Fit(arguments) => cli::fit::run(arguments, &mut out),
        Command::Fleet(arguments) => cli::fleet::run(arguments, &mut out),
        Command::Fmu(arguments) => cli::fmu::run(arguments, &mut out),
        Command::Identify(arguments) => cli::identify::run(arguments, &mut out),
        Command::Init(arguments) => cli::init::run(arguments, &mut out),
        Command::Inspect(arguments) => cli::inspect::run(arguments, &mut out),
        Command::Loop(arguments) => cli::closed_loop::run(arguments, &mut out),
        Command::Man(arguments) => cli::shell_help::man(arguments, Cli::command(), &mut out),
        Command::Paper(arguments) => cli::paper::run(arguments, &mut out),
        Command::ReadDataFile => Ok(data_files::serve(io::stdin().lock(), &mut out)?),
        Command::Record(arguments) => cli::record::run(arguments, &mut out),
        Command::Response(arguments) => cli::response::run(arguments, &mut out),
        Command::Scope(arguments) => cli::scope::run(arguments, &mut out),
        Command::Settings(arguments) => cli::settings::run(arguments, &mut out),
        Command::Simulate(arguments) => cli::simulate::run(arguments, &mut out),
        Command::Trial(arguments) => cli::trial::run(arguments, &mut out),
    };
    ExitCode::from(cli::exit_status(run))
}
