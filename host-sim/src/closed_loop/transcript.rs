//! What went over a link, as a file: the frames in their order, from the
//! greeting to the end. Two runs are the same when their transcripts are.

use super::drive::{Drive, DriveError, HostController};
use super::run::Run;
use crate::wire::{Wire, framed};
use firmware::control_task::ControlTask;
use firmware::link::{self, CommandRecord, FromPlant};
use firmware::tick::Sample;
use std::io::{self, Read, Write};

/// Writes the transcript of a run.
pub fn write(run: &Run, tick_period_ns: u32, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(&framed(&link::hello(tick_period_ns))?)?;
    for row in &run.rows {
        out.write_all(&framed(&link::sample(&row.sample))?)?;
        out.write_all(&framed(&row.command.payload())?)?;
    }
    out.write_all(&framed(&link::end())?)
}

/// How a replay went.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Samples answered again.
    pub ticks: u64,
    /// The first answer that is another one: recorded and recomputed.
    pub first_difference: Option<(CommandRecord, CommandRecord)>,
    /// Answers that are others.
    pub differences: u64,
}

/// Why a transcript could not be replayed.
#[derive(Debug, thiserror::Error)]
pub enum TranscriptError {
    /// It could not be read.
    #[error("cannot be read: {0}")]
    Read(#[from] io::Error),
    /// It is no transcript.
    #[error("{0}")]
    Content(String),
    /// The controller failed.
    #[error(transparent)]
    Drive(#[from] DriveError),
}

/// Answers the recorded samples again and compares every answer to the byte.
pub fn replay(transcript: impl Read, task: ControlTask) -> Result<Replay, TranscriptError> {
    let mut wire = Wire::new(transcript);
    let mut controller = HostController::new(task);
    let mut replay = Replay {
        ticks: 0,
        first_difference: None,
        differences: 0,
    };
    let mut open: Option<Sample> = None;
    while let Some(payload) = wire.receive()? {
        if let Some(FromPlant::Sample(sample)) = link::from_plant(&payload) {
            open = Some(sample);
        } else if let Some(recorded) = link::read_command(&payload) {
            let sample = open.take().filter(|sample| sample.tick == recorded.tick);
            let sample = sample.ok_or_else(|| {
                let tick = recorded.tick;
                TranscriptError::Content(format!("tick {tick}: a command without its sample"))
            })?;
            replay.compare(recorded, controller.command(&sample)?);
        }
    }
    if wire.dropped() > 0 || replay.ticks == 0 {
        return Err(TranscriptError::Content(format!(
            "holds {} ticks and {} damaged frames; expected a transcript as --transcript writes it",
            replay.ticks,
            wire.dropped()
        )));
    }
    Ok(replay)
}

impl Replay {
    fn compare(&mut self, recorded: CommandRecord, recomputed: CommandRecord) {
        self.ticks += 1;
        if recorded.payload() == recomputed.payload() {
            return;
        }
        self.differences += 1;
        self.first_difference.get_or_insert((recorded, recomputed));
    }
}
