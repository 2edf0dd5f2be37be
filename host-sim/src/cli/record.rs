//! `pneuma record`: a board's telemetry to a recording.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use firmware::telemetry::{read_tick, stream};
use indicatif::{ProgressBar, ProgressStyle};

use super::CommandError;
use super::board_port::not_done;
use super::inputs::{bad_input, read_rig, spinner};
use super::outputs::{cannot_write, check_outputs};
use super::stop::stop_wish;
use crate::board::orders::begin_stream;
use crate::board::port::{BAUD, Port, PortError};
use crate::board::recorder::{Losses, Recorder, RecorderError, RecorderStartError, check_signals};
use crate::output::Pending;
use crate::text::file_name;

/// How long a board may be silent.
const SILENCE: Duration = Duration::from_secs(3);
/// How often the wish to stop is looked at.
const GLANCE: Duration = Duration::from_millis(100);
const PROGRESS_ROWS: u64 = 100;

/// Record a board's telemetry, in the columns of the rig's signals.
///
/// Ends after --seconds, with Ctrl-C, or when the board hangs up; an end before
/// --seconds exits with status 2 and keeps what was recorded. The recording
/// stands in its place when it is whole; until then, and after a crash, its rows
/// are in OUT.XXXXXX.partial beside it. Rows that are
/// missing are counted by where they were lost; the recording has a gap and a
/// comment in their place.
#[derive(Args, Clone, Debug)]
pub struct RecordArguments {
    /// The board's serial port, or HOST:PORT.
    #[arg(long)]
    pub serial: String,
    /// The rig file, whose `[signals]` say columns and units.
    #[arg(long)]
    pub rig: PathBuf,
    /// The recording to write.
    #[arg(long)]
    pub out: PathBuf,
    /// Length of the recording, s.
    #[arg(long)]
    pub seconds: Option<f64>,
    /// Record every N-th tick.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub decimate: u16,
    /// Exit with status 2 if anything was lost.
    #[arg(long)]
    pub strict: bool,
    /// Rate of the serial port.
    #[arg(long, default_value_t = BAUD)]
    pub baud: u32,
}

/// How a recording ended.
enum Ending {
    /// As wished.
    Done,
    /// Before its time.
    Early(String),
}

/// Runs the command, writing to `out`.
pub fn run(arguments: &RecordArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    check_outputs(&[&arguments.rig], &[&arguments.out])?;
    if arguments
        .seconds
        .is_some_and(|seconds| !(seconds.is_finite() && seconds > 0.0))
    {
        return Err(bad_input("--seconds: expected a number above 0"));
    }
    let rig = read_rig(&arguments.rig)?;
    let rig_name = arguments.rig.display().to_string();
    check_signals(&rig, &rig_name).map_err(bad_input)?;
    let mut port = Port::open(&arguments.serial, arguments.baud).map_err(bad_input)?;
    let streaming = begin_stream(&mut port, arguments.decimate)
        .map_err(|error| not_done(&arguments.serial, &error))?;
    let damaged_before = port.damaged();
    let pending = Pending::create(&arguments.out);
    let pending = pending.map_err(|error| cannot_write(&arguments.out, &error))?;
    let start = Recorder::new(pending, &rig, &rig_name, streaming);
    let mut recorder = start.map_err(|error| match error {
        RecorderStartError::Rig(error) => bad_input(error),
        RecorderStartError::Output(error) => cannot_write(&arguments.out, &error),
    })?;
    let ending = record(&mut port, &mut recorder, arguments)?;
    // The board may have gone: then there is nothing to stop.
    let _ = port.send(&stream(0));
    let seconds = recorder.duration_s();
    let (pending, rows, mut losses) = recorder.finish();
    let written = pending.finish();
    written.map_err(|error| cannot_write(&arguments.out, &error))?;
    losses.damaged_frames = u64::from(port.damaged() - damaged_before);
    report(arguments, rows, seconds, &losses, &ending, out)?;
    judge(arguments, &losses, &ending)
}

fn record<W: Write>(
    port: &mut Port,
    recorder: &mut Recorder<W>,
    arguments: &RecordArguments,
) -> Result<Ending, CommandError> {
    let stopped = stop_wish()?;
    let bar = progress(arguments.seconds);
    let mut last_heard = Instant::now();
    let ending = loop {
        if stopped.load(Ordering::Relaxed) {
            break match arguments.seconds {
                Some(seconds) => Ending::Early(format!("it was stopped before {seconds} s")),
                None => Ending::Done,
            };
        }
        if last_heard.elapsed() > SILENCE {
            break Ending::Early(format!("the board fell silent for {} s", SILENCE.as_secs()));
        }
        let payload = match port.receive(Instant::now() + GLANCE) {
            Ok(payload) => payload,
            Err(PortError::Closed(_)) if arguments.seconds.is_none() => break Ending::Done,
            Err(error) => break Ending::Early(error.to_string()),
        };
        let Some(tick) = payload.as_deref().and_then(read_tick) else {
            continue;
        };
        last_heard = Instant::now();
        match recorder.take(&tick) {
            Ok(()) => {}
            Err(RecorderError::Output(error)) => return Err(cannot_write(&arguments.out, &error)),
            Err(error @ RecorderError::Restarted(_)) => break Ending::Early(error.to_string()),
        }
        if recorder.rows().is_multiple_of(PROGRESS_ROWS) {
            show_progress(&bar, recorder);
        }
        let seconds = arguments.seconds;
        if seconds.is_some_and(|seconds| recorder.duration_s() >= seconds) {
            break Ending::Done;
        }
    };
    bar.finish_and_clear();
    Ok(ending)
}

fn progress(seconds: Option<f64>) -> ProgressBar {
    let Some(seconds) = seconds else {
        return spinner();
    };
    let bar = ProgressBar::new((seconds * 1e3) as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent} % {msg} ({eta})") {
        bar.set_style(style);
    }
    bar
}

fn show_progress<W: Write>(bar: &ProgressBar, recorder: &Recorder<W>) {
    let missing = recorder.losses().rows();
    bar.set_position((recorder.duration_s() * 1e3) as u64);
    bar.set_message(format!("{} rows, {missing} missing", recorder.rows()));
}

fn report(
    arguments: &RecordArguments,
    rows: u64,
    seconds: f64,
    losses: &Losses,
    ending: &Ending,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    let name = file_name(&arguments.out.display().to_string());
    writeln!(out, "{name}: {rows} rows, 0 to {seconds:.3} s")?;
    if losses.is_any() {
        writeln!(out, "  LOST: {losses}")?;
    } else {
        writeln!(out, "  nothing was lost")?;
    }
    if let Ending::Early(reason) = ending {
        writeln!(out, "  ENDED EARLY: {}", file_name(reason))?;
    }
    Ok(out.flush()?)
}

fn judge(
    arguments: &RecordArguments,
    losses: &Losses,
    ending: &Ending,
) -> Result<(), CommandError> {
    let name = file_name(&arguments.out.display().to_string());
    match ending {
        Ending::Early(reason) => Err(bad_input(format!("{name}: ended early: {reason}"))),
        Ending::Done if arguments.strict && losses.is_any() => {
            Err(bad_input(format!("{name}: {losses}")))
        }
        Ending::Done => Ok(()),
    }
}
