//! What a recording is worth before anything is fitted: its timing, each
//! signal's noise and quantum against what the rig declares, the excitation,
//! and the faults that forbid a diagnosis.
//!
//! A fault is a channel that cannot be true: dead, frozen while others prove
//! motion, saturated, dropping out, or at odds with another channel or the rig. The
//! tests ask for much more evidence than chance or a quiet rig gives (see
//! `faults.rs`): a false alarm here would throw away a good recording. Gaps and
//! jitter are reported, they are no faults; channels that are late against each
//! other are remarked on (see `lateness.rs`).

mod contradictions;
mod display;
mod excitation;
mod fault;
mod faults;
mod gauges;
mod held;
pub mod lateness;
mod leaps;
mod lifeless;
mod smoothing;
mod spikes;
mod statistics;

use serde::Serialize;

pub use excitation::Excitation;
pub use fault::{Fault, FaultKind};

/// A fault of a whole recording that was found otherwise.
pub(crate) fn whole(recording: &Recording, signal: &str, said: &str) -> Fault {
    fault::at_odds_as(FaultKind::Inconsistent, recording, signal, said)
}

use crate::recording::Recording;
use crate::rig::Rig;
pub(crate) use statistics::{Moved, correlation, moved, quantile};
use statistics::{as_float, median_step, ordinary_steps, runs};

/// A step longer than this many median steps is listed as a gap.
const GAP_STEPS: f64 = 5.0;
/// Gaps and spikes listed one by one; the rest is counted.
const LISTED: usize = 20;
const BAR_PA: f64 = 1e5;
/// Measured noise further than this factor from the declared one is noted: on the practice
/// recordings, whose noise is as declared, quantisation and motion make it 0.75 to 1.35.
const NOISE_FACTOR: f64 = 1.5;

/// The findings on one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// The file.
    pub recording: String,
    /// Number of rows.
    pub rows: usize,
    /// The instants of the rows.
    pub timing: Timing,
    /// Each signal that the rig names, in alphabetical order.
    pub signals: Vec<SignalReport>,
    /// What the recording excites.
    pub excitation: Excitation,
    /// Columns of the file that the rig does not name.
    pub unused_columns: Vec<String>,
    /// Worth knowing, no obstacle.
    pub notes: Vec<String>,
    /// Obstacles: the verdict is `data-fault`.
    pub faults: Vec<Fault>,
}

/// The instants of the rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Timing {
    /// First instant, s.
    pub first_s: f64,
    /// Last instant, s.
    pub last_s: f64,
    /// Median step, s.
    pub median_step_s: f64,
    /// Rows per second, by the median step.
    pub rate_hz: f64,
    /// Root mean square deviation of the steps from the median, gaps left
    /// out, s.
    pub jitter_s: f64,
    /// Shortest step, s.
    pub shortest_step_s: f64,
    /// Longest step, s.
    pub longest_step_s: f64,
    /// Number of gaps.
    pub gap_count: usize,
    /// The first gaps.
    pub gaps: Vec<Gap>,
}

/// A step between two rows far longer than usual.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// Line of the last row before.
    pub after_line: u32,
    /// Its instant, s.
    pub from_s: f64,
    /// Length, s.
    pub length_s: f64,
}

/// One signal in figures, SI.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SignalReport {
    /// Its name in the rig.
    pub name: String,
    /// Unit of the figures.
    pub unit: &'static str,
    /// Smallest value.
    pub minimum: f64,
    /// Largest value.
    pub maximum: f64,
    /// Mean over the rows.
    pub mean: f64,
    /// Smallest common step, if there is one.
    pub quantum: Option<f64>,
    /// Standard deviation of the noise, quantisation included.
    pub noise: f64,
    /// False when the quantum hides the noise, or when the signal moves too
    /// much from row to row to tell: the noise is then at most the figure.
    pub noise_visible: bool,
    /// What the rig declares.
    pub declared_noise: Option<f64>,
    /// What the rig declares.
    pub declared_resolution: Option<f64>,
    /// Share of rows that repeat the value of the row before.
    pub repeated_share: f64,
    /// Longest stretch of one value, rows.
    pub longest_run_rows: usize,
}

/// Looks a recording over.
pub fn inspect(rig: &Rig, recording: &Recording) -> Inspection {
    let timing = timing(recording);
    let signals: Vec<SignalReport> = recording
        .signals
        .iter()
        .map(|(name, values)| signal_report(rig, recording, name, values))
        .collect();
    let excitation = excitation::excitation(rig, recording, &signals);
    let faults = faults::faults(rig, recording, &signals, &excitation, timing.rate_hz);
    let mut notes = notes(recording, &signals);
    notes.extend(smoothing_notes(
        recording,
        &signals,
        &faults,
        timing.rate_hz,
    ));
    if let gauges::Supply::SetOtherwise(note) = gauges::supply(rig, recording) {
        notes.push(note);
    }
    notes.extend(open_ports(rig, recording, &signals));
    Inspection {
        recording: recording.name.clone(),
        rows: recording.len(),
        timing,
        signals,
        excitation,
        unused_columns: recording.unused_columns.clone(),
        notes,
        faults,
    }
}

impl Inspection {
    /// The report on one signal.
    pub fn signal(&self, name: &str) -> Option<&SignalReport> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

fn timing(recording: &Recording) -> Timing {
    let time_s = &recording.time_s;
    let (Some(first_s), Some(last_s)) = (time_s.first(), time_s.last()) else {
        return Timing::default();
    };
    let median_step_s = median_step(time_s);
    let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let gaps = gaps(recording, &steps, GAP_STEPS * median_step_s);
    Timing {
        first_s: *first_s,
        last_s: *last_s,
        median_step_s,
        rate_hz: if median_step_s > 0.0 {
            1.0 / median_step_s
        } else {
            0.0
        },
        jitter_s: jitter(&steps, median_step_s),
        shortest_step_s: steps.iter().copied().reduce(f64::min).unwrap_or(0.0),
        longest_step_s: steps.iter().copied().reduce(f64::max).unwrap_or(0.0),
        gap_count: gaps.len(),
        gaps: gaps.into_iter().take(LISTED).collect(),
    }
}

fn jitter(steps: &[f64], median_s: f64) -> f64 {
    let ordinary = || steps.iter().filter(|step| **step <= GAP_STEPS * median_s);
    let squares: f64 = ordinary().map(|step| (step - median_s).powi(2)).sum();
    (squares / as_float(ordinary().count().max(1))).sqrt()
}

fn gaps(recording: &Recording, steps: &[f64], longest_s: f64) -> Vec<Gap> {
    steps
        .iter()
        .enumerate()
        .filter(|(_, step)| **step > longest_s)
        .map(|(place, step)| Gap {
            after_line: recording.line[place],
            from_s: recording.time_s[place],
            length_s: *step,
        })
        .collect()
}

fn signal_report(rig: &Rig, recording: &Recording, name: &str, values: &[f64]) -> SignalReport {
    /// Noise under this share of the quantum cannot be told from rounding,
    /// which alone is `1 / sqrt(12) = 0.29` of it.
    const VISIBLE_SHARE: f64 = 0.35;
    let declared = rig.signals.get(name);
    /// Noise above this share of the span may be motion ...
    const RAGGED_SHARE: f64 = 0.02;
    /// ... and is, when first differences show this much more than third ones.
    const RAGGED_FACTOR: f64 = 1.25;
    let quantum = statistics::quantum(values);
    let ordinary = ordinary_steps(&recording.time_s);
    let noise = statistics::noise(values, &ordinary);
    let minimum = values.iter().copied().reduce(f64::min).unwrap_or(0.0);
    let maximum = values.iter().copied().reduce(f64::max).unwrap_or(0.0);
    let ragged = noise > RAGGED_SHARE * (maximum - minimum)
        && statistics::roughness(values, &ordinary) > RAGGED_FACTOR * noise;
    let runs = runs(values);
    let longest = runs.iter().map(|run| run.length).max().unwrap_or(0);
    let rows = as_float(values.len().max(1));
    SignalReport {
        name: name.into(),
        unit: si_unit(rig, name),
        minimum,
        maximum,
        mean: values.iter().sum::<f64>() / rows,
        quantum,
        noise,
        noise_visible: !ragged && noise > quantum.unwrap_or(0.0) * VISIBLE_SHARE,
        declared_noise: declared.and_then(|signal| signal.noise),
        declared_resolution: declared.and_then(|signal| signal.resolution),
        repeated_share: as_float(values.len() - runs.len()) / rows,
        longest_run_rows: longest,
    }
}

/// The unit of a signal after conversion. A raw sensor voltage with a scale is
/// shown in the unit that the signal has.
fn si_unit(rig: &Rig, name: &str) -> &'static str {
    let recorded = rig.signals.get(name).map(|signal| signal.unit.dimension());
    crate::rig::signal_dimension(name, recorded).map_or("?", |dimension| dimension.si_unit())
}

/// Ports that are open on purpose.
fn open_ports(rig: &Rig, recording: &Recording, signals: &[SignalReport]) -> Vec<String> {
    let open = |report: &SignalReport| {
        let values = recording.signal(&report.name)?;
        match gauges::open_chamber(rig, recording, report, values)? {
            gauges::OpenChamber::Bench(said) => Some(said),
            gauges::OpenChamber::Fault(_) => None,
        }
    };
    signals.iter().filter_map(open).collect()
}

fn notes(recording: &Recording, signals: &[SignalReport]) -> Vec<String> {
    let mut notes = recording.remarks.clone();
    notes.extend(signals.iter().filter_map(noise_note));
    if recording.last_row_unterminated {
        let line = recording.line.last().copied().unwrap_or(0);
        notes.push(format!(
            "line {line}: the last row has no line end; its last number may be cut"
        ));
    }
    notes
}

/// Columns that are smoothed, by less than what makes a fault.
fn smoothing_notes(
    recording: &Recording,
    signals: &[SignalReport],
    faults: &[Fault],
    rate_hz: f64,
) -> Vec<String> {
    let note = |report: &SignalReport| {
        // A channel with a fault has its cause already.
        if faults.iter().any(|fault| fault.signal == report.name) {
            return None;
        }
        let values = recording.signal(&report.name)?;
        let width = smoothing::width_rows(report, values)?;
        Some(format!(
            "{} {}",
            report.name,
            smoothing::said(width, rate_hz)
        ))
    };
    signals.iter().filter_map(note).collect()
}

fn noise_note(signal: &SignalReport) -> Option<String> {
    let declared = signal.declared_noise?;
    let ratio = signal.noise / declared;
    // Noise that does not show is at most the figure: more may be declared than that, not less.
    let is_off = ratio < 1.0 / NOISE_FACTOR || signal.noise_visible && ratio > NOISE_FACTOR;
    (is_off && signal.noise > 0.0).then(|| {
        format!(
            "{}: measured noise {:.3e} {unit}, declared {declared:.3e} {unit}, a factor of {ratio:.2}; the larger counts",
            signal.name,
            signal.noise,
            unit = signal.unit
        )
    })
}

/// The rig with the noise that counts: of each signal the larger of what is declared and what
/// its rows show, the median over the recordings. A data sheet is off by two to five; a model
/// that is judged by too small a noise misses something everywhere.
pub fn with_noise_in_use(rig: &Rig, inspections: &[Inspection]) -> Rig {
    let mut in_use = rig.clone();
    for (name, signal) in &mut in_use.signals.by_name {
        let Some(declared) = signal.noise else {
            continue;
        };
        let reports = inspections.iter().filter_map(|one| one.signal(name));
        let visible = reports.filter(|report| report.noise_visible);
        let mut measured: Vec<f64> = visible.map(|report| report.noise).collect();
        let measured = quantile(&mut measured, 0.5);
        // Rows show the rounding as well, which is declared by itself.
        let rounding = signal.resolution.unwrap_or(0.0) / 12.0_f64.sqrt();
        let own = (measured.powi(2) - rounding.powi(2)).max(0.0).sqrt();
        signal.noise = Some(declared.max(own));
    }
    in_use
}

/// A remark on data or rig that was tested.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// The key that it concerns, such as `signals.p_a`.
    pub about: String,
    /// What was found.
    pub says: String,
    /// How probable so much is by chance, where that was reckoned.
    pub p_value: Option<f64>,
}

/// What is to be said of the noise that a rig declares: the first remark on each signal.
pub fn noise_doubts(inspections: &[Inspection]) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = Vec::new();
    for signal in inspections.iter().flat_map(|one| &one.signals) {
        let about = format!("signals.{}.noise", signal.name);
        let is_new = doubts.iter().all(|doubt| doubt.about != about);
        if let Some(says) = noise_note(signal).filter(|_| is_new) {
            doubts.push(Doubt {
                about,
                says,
                p_value: None,
            });
        }
    }
    doubts
}
