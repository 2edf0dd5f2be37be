//! `pneuma board run`: an experiment on the board, recorded.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use firmware::experiment::frames::Report;
use firmware::experiment::{Envelope, Stage, Step};
use indicatif::{ProgressBar, ProgressStyle};

use super::CommandError;
use super::board_port::{BoardPort, not_done};
use super::inputs::{bad_input, bare_name, read_rig};
use super::outputs::{cannot_write, check_outputs};
use super::stop::stop_wish;
use crate::board::experiment::{self as runs, RunError};
use crate::board::orders::{OrderError, begin_stream, ready};
use crate::board::port::Port;
use crate::board::recorder::{Losses, Recorder, RecorderError, RecorderStartError, check_signals};
use crate::board::words;
use crate::experiment::{self, Program};
use crate::output::Pending;
use crate::report::number;
use crate::text::file_name;

/// An experiment.
///
/// The board keeps the envelope itself: a measured value beyond it, a silent host,
/// Ctrl-C or a fault end the run with the valve at its null; that is said, the
/// recording is kept, and the exit status is 2. The recording begins and ends with
/// the axis at rest; experiment, rig and firmware are in its head.
#[derive(Args, Clone, Debug)]
pub struct RunArguments {
    /// The experiment file, see docs/experiments.md.
    pub experiment: PathBuf,
    /// Where the board is.
    #[command(flatten)]
    pub port: BoardPort,
    /// The rig file, whose `[signals]` say columns and units.
    #[arg(long)]
    pub rig: PathBuf,
    /// The recording to write.
    #[arg(long)]
    pub out: PathBuf,
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If a file cannot be used, the board is not ready, or the run ends early.
pub fn run(arguments: &RunArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let (program, report) = recorded(arguments, out)?;
    let name = file_name(&arguments.experiment.display().to_string());
    match ending(&program, &report) {
        None => {
            writeln!(out, "{name}: ran to its end")?;
            Ok(out.flush()?)
        }
        Some(why) => Err(bad_input(format!("{name}: {why}"))),
    }
}

/// Runs an experiment and records it; what came of it.
pub(super) fn recorded(
    arguments: &RunArguments,
    out: &mut dyn Write,
) -> Result<(Program, Report), CommandError> {
    check_outputs(&[&arguments.experiment, &arguments.rig], &[&arguments.out])?;
    let program = experiment::read(&arguments.experiment).map_err(bad_input)?;
    let rig = read_rig(&arguments.rig)?;
    let rig_name = arguments.rig.display().to_string();
    check_signals(&rig, &rig_name).map_err(bad_input)?;
    let name = file_name(&arguments.experiment.display().to_string());
    writeln!(out, "{name}: {}", lines_of(&program).join("\n  "))?;
    out.flush()?;
    let mut port = Port::open(&arguments.port.serial, arguments.port.baud).map_err(bad_input)?;
    let untold = |error: &OrderError| not_done(&arguments.port.serial, error);
    let status = ready(&mut port).map_err(|error| untold(&error))?;
    let failed = |error: RunError| refused(arguments, &error);
    runs::send(&mut port, &program).map_err(failed)?;
    let firmware = words::program(&status).unwrap_or_else(|| "firmware unknown".into());
    let streaming = begin_stream(&mut port, 1).map_err(|error| untold(&error))?;
    let damaged_before = port.damaged();
    let mut pending =
        Pending::create(&arguments.out).map_err(|error| cannot_write(&arguments.out, &error))?;
    write_head(&mut pending, &program, (arguments, &firmware))?;
    let mut recorder =
        Recorder::new(pending, &rig, &rig_name, streaming).map_err(|error| match error {
            RecorderStartError::Rig(error) => bad_input(error),
            RecorderStartError::Output(error) => cannot_write(&arguments.out, &error),
        })?;
    let stopped = stop_wish()?;
    let bar = bar(&program);
    let outcome = runs::run(&mut port, &program, &mut recorder, |progress| {
        bar.set_position((1e3 * progress.time_s) as u64);
        bar.set_message(program.name_of(progress.place));
        !stopped.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let seconds = recorder.duration_s();
    let (pending, rows, mut losses) = recorder.finish();
    let written = pending.finish();
    written.map_err(|error| cannot_write(&arguments.out, &error))?;
    losses.damaged_frames = u64::from(port.damaged() - damaged_before);
    tell_recording(arguments, (rows, seconds), &losses, out)?;
    let report = outcome.map_err(failed)?;
    Ok((program, report))
}

fn refused(arguments: &RunArguments, error: &RunError) -> CommandError {
    match error {
        RunError::Order(error) => not_done(&arguments.port.serial, error),
        RunError::Recorder(RecorderError::Output(error)) => cannot_write(&arguments.out, error),
        error => bad_input(format!("{}: {error}", file_name(&arguments.port.serial))),
    }
}

/// What will move, and within what.
pub(super) fn lines_of(program: &Program) -> Vec<String> {
    let fixed = |value: f32, digits| number::fixed(f64::from(value), digits);
    // Tenths of a millimetre in a narrow envelope.
    let places = |span_m: f32| if span_m < 0.02 { 1 } else { 0 };
    let Envelope {
        position_m: [low_m, high_m],
        speed_m_per_s,
        pressure_pa: [low_pa, high_pa],
        force_n,
    } = program.envelope;
    let mut lines = vec![
        format!("{} s", number::fixed(program.seconds(), 1)),
        format!(
            "within {} to {} mm, {} m/s, {} to {} bar absolute, {} N",
            fixed(1e3 * low_m, places(high_m - low_m)),
            fixed(1e3 * high_m, places(high_m - low_m)),
            fixed(speed_m_per_s, 2),
            fixed(1e-5 * low_pa, 2),
            fixed(1e-5 * high_pa, 2),
            fixed(force_n, 0)
        ),
    ];
    let described = program.steps.iter().enumerate();
    lines.extend(
        described
            .map(|(place, step)| format!("{}: {}", program.name_of(place), said(step, &fixed))),
    );
    lines
}

fn said(step: &Step, fixed: &dyn Fn(f32, usize) -> String) -> String {
    let what = match *step {
        Step::Opening { from_v, to_v, .. } => {
            format!("opening {} to {} V", fixed(from_v, 2), fixed(to_v, 2))
        }
        Step::Triangle {
            amplitude_v,
            period_s,
            ..
        } => format!(
            "opening {} V to and fro in {} s",
            fixed(amplitude_v, 2),
            fixed(period_s, 2)
        ),
        Step::Chirp {
            amplitude_v,
            from_hz,
            to_hz,
            ..
        } => format!(
            "opening {} V, {} to {} Hz",
            fixed(amplitude_v, 2),
            fixed(from_hz, 2),
            fixed(to_hz, 2)
        ),
        Step::Multisine { rms_v, base_hz, .. } => format!(
            "opening {} V rms, {} to {} Hz",
            fixed(rms_v, 2),
            fixed(base_hz, 2),
            fixed(8.0 * base_hz, 2)
        ),
        Step::Bursts {
            amplitude_v,
            shortest_s,
            longest_s,
            ..
        } => format!(
            "opening {} V there and back, {} to {} s each",
            fixed(amplitude_v, 2),
            fixed(shortest_s, 3),
            fixed(longest_s, 3)
        ),
        Step::Force { force_n, .. } => format!("gas pushes {} N", fixed(force_n, 0)),
        Step::Move { to_m, .. } => format!("load to {} mm", fixed(1e3 * to_m, 1)),
        Step::Hold { .. } => "load held".into(),
        Step::Sine {
            amplitude_m,
            frequency_hz,
            ..
        } => format!(
            "load swings {} mm at {} Hz",
            fixed(1e3 * amplitude_m, 1),
            fixed(frequency_hz, 2)
        ),
    };
    let digits = if step.seconds() < 0.1 { 3 } else { 2 };
    format!("{what}, {} s", fixed(step.seconds(), digits))
}

/// The experiment's file as comments, so that a recording says what it is of.
fn write_head(
    pending: &mut Pending,
    program: &Program,
    (arguments, firmware): (&RunArguments, &str),
) -> Result<(), CommandError> {
    let (experiment, rig) = (bare_name(&arguments.experiment), bare_name(&arguments.rig));
    writeln!(pending, "# experiment {experiment}, rig {rig}, {firmware}")?;
    for line in program.text.lines() {
        writeln!(pending, "{}", format!("# {line}").trim_end())?;
    }
    Ok(())
}

fn bar(program: &Program) -> ProgressBar {
    let bar = ProgressBar::new((1e3 * program.seconds()) as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent} % {msg} ({eta})") {
        bar.set_style(style);
    }
    bar
}

fn tell_recording(
    arguments: &RunArguments,
    (rows, seconds): (u64, f64),
    losses: &Losses,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let name = file_name(&arguments.out.display().to_string());
    let lost = if losses.is_any() {
        format!("LOST: {losses}")
    } else {
        "nothing was lost".into()
    };
    Ok(writeln!(
        out,
        "{name}: {rows} rows, 0 to {seconds:.3} s; {lost}"
    )?)
}

/// Why a run ended before its end, where, and at what; none where it did not.
pub(super) fn ending(program: &Program, report: &Report) -> Option<String> {
    if report.stage == Stage::Done {
        return None;
    }
    let at = program.name_of(usize::from(report.place));
    let value = runs::value_in_words(report).map_or(String::new(), |value| format!(" ({value})"));
    Some(format!(
        "ended early in {at}: {}{value}; the valve is at its null",
        runs::why(report.reason)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_kind_of_step_is_said() {
        let text = "format = \"experiment/1\"\n[envelope]\nposition_m = [-0.1, 0.1]\nspeed_m_s = 1.0\n\
                    pressure_Pa = [5e4, 8e5]\nforce_N = 300.0\n\
                    [[step]]\nkind = \"ramp\"\nfrom_V = -0.5\nto_V = 0.5\nseconds = 2.0\n\
                    [[step]]\nkind = \"force\"\nforce_N = 40.0\nseconds = 2.0\n";
        let program = experiment::parse(text, "e.toml").expect("a program");
        let lines = lines_of(&program);
        assert_eq!(
            lines,
            [
                "4.0 s",
                "within \u{2212}100 to 100 mm, 1.00 m/s, 0.50 to 8.00 bar absolute, 300 N",
                "step 1 (ramp): opening \u{2212}0.50 to 0.50 V, 2.00 s",
                "step 2 (force): gas pushes 40 N, 2.00 s",
            ]
        );
    }
}
