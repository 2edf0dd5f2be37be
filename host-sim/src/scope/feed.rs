//! What board and pages share.

use super::signals::{Row, row};
use crate::board::recorder::{Losses, Recorder, RecorderError};
use crate::board::words;
use crate::output::Pending;
use crate::text::file_name;
use firmware::status::Status;
use firmware::telemetry::{Record, Streaming};
use firmware::tick::State;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Rows that are kept for pages: two minutes at 1 kHz.
const KEPT_ROWS: usize = 120_000;
/// Notes that a page gets when it opens.
const KEPT_NOTES: usize = 200;

/// Something that happened.
#[derive(Clone, Debug, Serialize)]
pub struct Note {
    /// When, ms since 1970.
    pub at_ms: i64,
    /// What.
    pub text: String,
    /// Whether it is not as wished.
    pub wrong: bool,
}

/// How things are.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Condition {
    /// The board's state in words, or why there is none.
    pub state: String,
    /// The fault that waits to be acknowledged.
    pub fault: Option<String>,
    /// Rows that are missing; empty where none is.
    pub losses: String,
    /// The recording under way: file, length.
    pub recording: Option<String>,
    /// The gains as they are on the board, as far as this program set them.
    pub gains: BTreeMap<String, f64>,
}

/// A recording under way.
struct Recording {
    recorder: Recorder<Pending>,
    path: PathBuf,
    as_mcap: bool,
}

#[derive(Default)]
struct Inner {
    rows: VecDeque<Row>,
    /// Rows before the first one that is kept.
    gone: u64,
    notes: VecDeque<Note>,
    notes_gone: u64,
    condition: Condition,
    streaming: Option<Streaming>,
    last: Option<Record>,
    losses: Losses,
    recording: Option<Recording>,
    /// Recordings that stand and are wanted as MCAP too.
    to_pack: Vec<PathBuf>,
}

/// What board and pages share.
#[derive(Default)]
pub struct Feed {
    inner: Mutex<Inner>,
}

impl Feed {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // What a thread that broke down left is still rows and words.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The board streams; what it counted before says nothing any more.
    pub fn begin(&self, streaming: Streaming) {
        let mut inner = self.lock();
        inner.streaming = Some(streaming);
        inner.last = None;
    }

    /// How the board streams, since it last began.
    pub fn streaming(&self) -> Option<Streaming> {
        self.lock().streaming
    }

    /// Takes a tick.
    pub fn take(&self, record: &Record) {
        let mut inner = self.lock();
        if let (Some(last), Some(streaming)) = (inner.last, &inner.streaming) {
            let decimation = streaming.decimation;
            // A board that was started anew counts from nought.
            if let Ok(missing) = inner.losses.count(&last, record, decimation) {
                inner.losses.gaps += u64::from(missing > 0);
            }
        }
        inner.last = Some(*record);
        inner.rows.push_back(row(record));
        if inner.rows.len() > KEPT_ROWS {
            inner.rows.pop_front();
            inner.gone += 1;
        }
        let recorded = inner
            .recording
            .as_mut()
            .map(|own| own.recorder.take(record));
        if let Some(Err(error)) = recorded {
            let why = match error {
                RecorderError::Output(error) => format!("it cannot be written: {error}"),
                error @ RecorderError::Restarted(_) => error.to_string(),
            };
            finish(&mut inner, Some(&why));
        }
    }

    /// The board's own report.
    pub fn report(&self, status: &Status) {
        let mut inner = self.lock();
        let is_fault = status.state == State::Fault;
        inner.condition.state = words::state(status.state).to_owned();
        let line = status.finding.filter(|_| is_fault).map(words::fault_line);
        if line.is_some() && line != inner.condition.fault {
            let text = line.clone().unwrap_or_default();
            push_note(&mut inner, text, true);
        }
        inner.condition.fault = line;
    }

    /// There is no board, and why.
    pub fn gone(&self, why: &str) {
        let mut inner = self.lock();
        inner.condition.state = "no board".to_owned();
        inner.condition.fault = None;
        push_note(&mut inner, why.to_owned(), true);
    }

    /// Something happened; it stands in the recording too.
    pub fn note(&self, text: impl Into<String>, wrong: bool) {
        push_note(&mut self.lock(), text.into(), wrong);
    }

    /// The gains as they are now.
    pub fn set_gains(&self, gains: BTreeMap<String, f64>) {
        self.lock().condition.gains = gains;
    }

    /// A recording begins, which is wanted as MCAP too or not.
    pub fn record(&self, recorder: Recorder<Pending>, path: PathBuf, as_mcap: bool) {
        let mut inner = self.lock();
        push_note(
            &mut inner,
            format!("recording into {}", shown(&path)),
            false,
        );
        inner.recording = Some(Recording {
            recorder,
            path,
            as_mcap,
        });
    }

    /// Whether a recording is under way.
    pub fn is_recording(&self) -> bool {
        self.lock().recording.is_some()
    }

    /// The recording ends.
    pub fn end_recording(&self) {
        finish(&mut self.lock(), None);
    }

    /// Recordings that stand and are wanted as MCAP too, for whoever writes them: once each.
    pub fn take_to_pack(&self) -> Vec<PathBuf> {
        std::mem::take(&mut self.lock().to_pack)
    }

    /// How things are.
    pub fn condition(&self) -> Condition {
        let inner = self.lock();
        let mut condition = inner.condition.clone();
        if inner.losses.is_any() {
            condition.losses = format!("{} rows missing", inner.losses.rows());
        }
        condition.recording = inner.recording.as_ref().map(|own| {
            let seconds = own.recorder.duration_s();
            format!("{}, {seconds:.0} s", shown(&own.path))
        });
        condition
    }

    /// What was lost since the program began.
    pub fn losses(&self) -> Losses {
        self.lock().losses
    }

    /// Rows from a place on, at most so many, and the place after them. Rows that are gone are
    /// passed over: their ticks show it.
    pub fn rows_from(&self, place: u64, most: usize) -> (Vec<Row>, u64) {
        let inner = self.lock();
        let first = place.max(inner.gone);
        let skip = usize::try_from(first - inner.gone).unwrap_or(usize::MAX);
        let rows: Vec<Row> = inner.rows.iter().skip(skip).take(most).copied().collect();
        let after = first + rows.len() as u64;
        (rows, after)
    }

    /// The place of the newest row.
    pub fn end(&self) -> u64 {
        let inner = self.lock();
        inner.gone + inner.rows.len() as u64
    }

    /// Notes from a place on, and the place after them.
    pub fn notes_from(&self, place: u64) -> (Vec<Note>, u64) {
        let inner = self.lock();
        let skip = place.saturating_sub(inner.notes_gone);
        let skip = usize::try_from(skip).unwrap_or(usize::MAX);
        let notes: Vec<Note> = inner.notes.iter().skip(skip).cloned().collect();
        (notes, inner.notes_gone + inner.notes.len() as u64)
    }
}

fn shown(path: &std::path::Path) -> String {
    file_name(&path.display().to_string())
}

fn push_note(inner: &mut Inner, text: String, wrong: bool) {
    if let Some(recording) = &mut inner.recording {
        // What cannot be written shows at the next row.
        let _ = recording.recorder.remark(&text);
    }
    let at_ms = jiff::Timestamp::now().as_millisecond();
    inner.notes.push_back(Note { at_ms, text, wrong });
    if inner.notes.len() > KEPT_NOTES {
        inner.notes.pop_front();
        inner.notes_gone += 1;
    }
}

fn finish(inner: &mut Inner, why: Option<&str>) {
    let Some(Recording {
        recorder,
        path,
        as_mcap,
    }) = inner.recording.take()
    else {
        return;
    };
    let seconds = recorder.duration_s();
    let (pending, rows, losses) = recorder.finish();
    let name = shown(&path);
    let (text, wrong) = match pending.finish() {
        Ok(()) => {
            inner.to_pack.extend(as_mcap.then_some(path));
            let reason = why.map_or_else(String::new, |why| format!("; it ended early: {why}"));
            let lost = match losses.is_any() {
                true => format!(", {losses}"),
                false => String::new(),
            };
            (
                format!("{name}: {rows} rows, {seconds:.3} s{lost}{reason}"),
                why.is_some(),
            )
        }
        Err(error) => (format!("{name}: cannot be written: {error}"), true),
    };
    push_note(inner, text, wrong);
}
