//! Telemetry to a recording.
//!
//! A row per frame, in the columns and units of the rig's `[signals]`; what the
//! rig does not name (reference, state, fault, the observer's belief) stands in
//! columns of its own behind. The command of a row is the one in force from it
//! to the next.
//!
//! No loss is unnoticed: frames that are missing leave their rows out, so that
//! time shows the gap, with a comment line in their place; a row whose
//! conversion failed is left out likewise. [`Losses`] tells where they went: on
//! the board (its queue was full), on the wire, or ticks that the board missed.

use std::fmt;
use std::io::{self, Write};

use firmware::codes::{
    AdcCode, COMMAND_V, FAILED_CONVERSION, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S,
};
use firmware::telemetry::{Record, Streaming};

use crate::recording::arrange;
use crate::report::number::Rounding;
use crate::rig::{Rig, RigError, Signals};

/// Digits of the numbers: as many as an `f32` has.
const DIGITS: i32 = 9;
/// Digits of the time, which counts ticks.
const TIME_DIGITS: i32 = 12;
const NANOSECONDS_PER_SECOND: f64 = 1e9;
/// So many rows at most are lost in a crash: a second at the usual tick.
const FLUSHED_ROWS: u64 = 1000;
/// Sequence numbers go round here.
const SEQUENCE_TURN: u32 = 1 << 16;

/// One column that telemetry can fill.
struct Channel {
    signal: &'static str,
    name: &'static str,
    value: fn(&Record) -> f64,
}

fn scaled(scale: &Scale, code: u16) -> f64 {
    f64::from(scale.value(code))
}

/// `t` comes first; its value is counted from the first row.
#[rustfmt::skip]
const CHANNELS: &[Channel] = &[
    Channel { signal: "t", name: "t_s", value: |_| 0.0 },
    Channel { signal: "u", name: "u_V", value: |row| scaled(&COMMAND_V, row.valve_in_force.0) },
    Channel { signal: "p_a", name: "p_a_Pa", value: |row| scaled(&PRESSURE_PA, row.codes.pressure_a.0) },
    Channel { signal: "p_b", name: "p_b_Pa", value: |row| scaled(&PRESSURE_PA, row.codes.pressure_b.0) },
    Channel { signal: "p_s", name: "p_s_Pa", value: |row| scaled(&PRESSURE_PA, row.codes.supply_pressure.0) },
    Channel { signal: "x", name: "x_m", value: |row| scaled(&POSITION_M, row.codes.position.0) },
    Channel { signal: "v", name: "v_m_s", value: |row| scaled(&VELOCITY_M_PER_S, row.codes.velocity.0) },
    Channel { signal: "", name: "reference_m", value: |row| f64::from(row.reference_position_m) },
    Channel { signal: "", name: "state", value: |row| f64::from(row.state) },
    Channel { signal: "", name: "fault", value: |row| f64::from(row.fault) },
    Channel { signal: "", name: "observer_x_m", value: |row| f64::from(row.estimate[0]) },
    Channel { signal: "", name: "observer_v_m_s", value: |row| f64::from(row.estimate[1]) },
    Channel { signal: "", name: "observer_friction_N", value: |row| f64::from(row.estimate[2]) },
    Channel { signal: "", name: "observer_disturbance_N", value: |row| f64::from(row.estimate[3]) },
];

/// The signals that a board records: name, the column that it goes to where a rig names no other, and
/// that column's unit.
pub fn recorded_signals() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    let signals = CHANNELS.iter().filter(|channel| !channel.signal.is_empty());
    signals.map(|channel| {
        let unit = match channel.signal {
            "t" => "s",
            "u" => "V",
            "x" => "m",
            "v" => "m/s",
            _ => "Pa(abs)",
        };
        (channel.signal, channel.name, unit)
    })
}

/// What did not become a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Places where at least one row is missing.
    pub gaps: u64,
    /// Frames lost on the board: the queue was full.
    pub on_the_board: u64,
    /// Frames lost on the wire.
    pub on_the_wire: u64,
    /// Rows of ticks that the board itself did not see.
    pub missed_ticks: u64,
    /// Rows left out as a conversion had failed.
    pub failed_conversions: u64,
    /// Damaged frames, as the CRC told; most of them are among those lost on
    /// the wire.
    pub damaged_frames: u64,
}

impl Losses {
    /// Rows that are missing.
    pub fn rows(&self) -> u64 {
        self.on_the_board + self.on_the_wire + self.missed_ticks + self.failed_conversions
    }

    /// Rows between two frames, every `decimation`-th tick, counted by where they were lost.
    ///
    /// # Errors
    /// Where the board was started anew between them.
    pub fn count(
        &mut self,
        last: &Record,
        record: &Record,
        decimation: u16,
    ) -> Result<u64, RecorderError> {
        let ticks = record.tick.wrapping_sub(last.tick);
        if ticks == 0 || ticks > u32::MAX / 2 {
            return Err(RecorderError::Restarted(last.tick));
        }
        let stride = u32::from(decimation.max(1));
        let missing = (ticks / stride).saturating_sub(1);
        let by_sequence = record.sequence.wrapping_sub(last.sequence).wrapping_sub(1);
        // A silence of more than a turn of the sequence shows in the ticks only.
        let turns = missing.saturating_sub(u32::from(by_sequence)) / SEQUENCE_TURN;
        let lost = u32::from(by_sequence) + turns * SEQUENCE_TURN;
        let overflows = record.overflows.wrapping_sub(last.overflows);
        let on_the_board = u32::from(overflows).min(lost);
        let missed_ticks = missing.saturating_sub(lost);
        self.on_the_board += u64::from(on_the_board);
        self.on_the_wire += u64::from(lost - on_the_board);
        self.missed_ticks += u64::from(missed_ticks);
        Ok(u64::from(lost + missed_ticks))
    }

    /// Whether anything was lost or damaged.
    pub fn is_any(&self) -> bool {
        self.rows() + self.damaged_frames > 0
    }
}

impl fmt::Display for Losses {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "{} rows missing in {} gaps: {} lost on the board (queue full), {} lost on the wire, {} ticks missed by the board, {} failed conversions; {} damaged frames",
            self.rows(),
            self.gaps,
            self.on_the_board,
            self.on_the_wire,
            self.missed_ticks,
            self.failed_conversions,
            self.damaged_frames,
        )
    }
}

/// Why a recording ends before its time.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] io::Error),
    /// Ticks went back: the board was started anew.
    #[error("the board restarted after tick {0}: the recording ends there")]
    Restarted(u32),
}

/// Writes rows as frames come.
pub struct Recorder<W> {
    out: W,
    signals: Signals,
    /// The columns' channels, in order.
    columns: Vec<&'static Channel>,
    streaming: Streaming,
    first_tick: Option<u32>,
    last: Option<Record>,
    rows: u64,
    losses: Losses,
}

/// Refuses a rig that names a signal which no board measures.
pub fn check_signals(rig: &Rig, rig_name: &str) -> Result<(), RigError> {
    let measured = |name: &str| CHANNELS.iter().any(|channel| channel.signal == name);
    match rig.signals.iter().find(|(name, _)| !measured(name)) {
        None => Ok(()),
        Some((name, _)) => Err(RigError {
            file: rig_name.into(),
            line: None,
            key: Some(format!("signals.{name}")),
            problem: "the board does not measure it".into(),
            expected: "only t, u, p_a, p_b, p_s, x and v for a recording from a board".into(),
        }),
    }
}

impl<W: Write> Recorder<W> {
    /// Writes the header.
    pub fn new(
        mut out: W,
        rig: &Rig,
        rig_name: &str,
        streaming: Streaming,
    ) -> Result<Self, RecorderStartError> {
        check_signals(rig, rig_name)?;
        let offered: Vec<(&str, &str)> = CHANNELS
            .iter()
            .map(|channel| (channel.signal, channel.name))
            .collect();
        let arranged = arrange(rig, rig_name, &offered)?;
        let (names, places): (Vec<String>, Vec<usize>) = arranged.into_iter().unzip();
        writeln!(out, "{}", names.join(","))?;
        Ok(Self {
            out,
            signals: rig.signals.clone(),
            columns: places.into_iter().map(|place| &CHANNELS[place]).collect(),
            streaming,
            first_tick: None,
            last: None,
            rows: 0,
            losses: Losses::default(),
        })
    }

    /// Takes a frame.
    pub fn take(&mut self, record: &Record) -> Result<(), RecorderError> {
        let missing = match &self.last {
            None => 0,
            Some(last) => self.losses.count(last, record, self.streaming.decimation)?,
        };
        if missing > 0 {
            self.losses.gaps += 1;
            writeln!(self.out, "# {missing} rows missing")?;
        }
        self.first_tick.get_or_insert(record.tick);
        self.last = Some(*record);
        if let Some(signal) = failed_conversion(record) {
            self.losses.failed_conversions += 1;
            self.losses.gaps += 1;
            writeln!(
                self.out,
                "# a row is missing: the conversion of {signal} failed"
            )?;
            return Ok(());
        }
        self.rows += 1;
        self.write_row(record)?;
        Ok(())
    }

    fn write_row(&mut self, record: &Record) -> io::Result<()> {
        let time_s = self.time_s(record.tick);
        // Written at once: what a crash leaves ends with a whole row.
        let mut row = String::new();
        for (place, channel) in self.columns.iter().enumerate() {
            if place > 0 {
                row.push(',');
            }
            let is_time = channel.signal == "t";
            let (value_si, digits) = if is_time {
                (time_s, TIME_DIGITS)
            } else {
                ((channel.value)(record), DIGITS)
            };
            let value = match self.signals.get(channel.signal) {
                Some(signal) => signal.from_si(value_si, self.signals.gauge_zero_pa),
                None => value_si,
            };
            // A reference that asks for nothing leaves its cell empty.
            if value.is_finite() {
                row += &Rounding::Significant(digits).apply(value).to_string();
            }
        }
        row.push('\n');
        self.out.write_all(row.as_bytes())?;
        if self.rows.is_multiple_of(FLUSHED_ROWS) {
            self.out.flush()?;
        }
        Ok(())
    }

    /// Writes what happened between two rows, as a comment.
    pub fn remark(&mut self, text: &str) -> io::Result<()> {
        let line = crate::text::one_line(text);
        writeln!(self.out, "# {:.3} s: {line}", self.duration_s())
    }

    /// Time of a tick since the first row, s.
    fn time_s(&self, tick: u32) -> f64 {
        let first = self.first_tick.unwrap_or(tick);
        let ticks = f64::from(tick.wrapping_sub(first));
        ticks * f64::from(self.streaming.tick_period_ns) / NANOSECONDS_PER_SECOND
    }

    /// Time recorded so far, s.
    pub fn duration_s(&self) -> f64 {
        self.last.map_or(0.0, |last| self.time_s(last.tick))
    }

    /// Rows written so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// What was lost so far.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// What was written to, the rows in it and what was lost.
    pub fn finish(self) -> (W, u64, Losses) {
        (self.out, self.rows, self.losses)
    }
}

/// Why a recording cannot begin; one line.
#[derive(Debug, thiserror::Error)]
pub enum RecorderStartError {
    /// The rig asks for what a board cannot give.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] io::Error),
}

/// The first signal whose conversion failed.
fn failed_conversion(record: &Record) -> Option<&'static str> {
    let codes = &record.codes;
    let all: [(&str, AdcCode); 5] = [
        ("x", codes.position),
        ("p_a", codes.pressure_a),
        ("p_b", codes.pressure_b),
        ("p_s", codes.supply_pressure),
        ("v", codes.velocity),
    ];
    let failed = all.iter().find(|(_, code)| *code == FAILED_CONVERSION);
    failed.map(|(signal, _)| *signal)
}
