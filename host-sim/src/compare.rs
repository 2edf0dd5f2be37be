//! Predictions of a rig as it is against recordings: how far, where and when
//! they part.

use serde::Serialize;

use crate::diagnose::fitted::Bench;
use crate::diagnose::locate::{Located, locate};
use crate::identify::{OwnUnit, Residuals, own_unit, prediction, residuals_as_given, rms};
use crate::laws::{Law, Track};
use crate::rig::Rig;
use crate::text::{Columns, plain};
use std::fmt;

/// Significant digits of errors.
const DIGITS: usize = 3;
/// Variables told on the terminal.
const TOLD_VARIABLES: usize = 3;
/// Intervals told on the terminal.
const TOLD_INTERVALS: usize = 4;

/// One law compared.
#[derive(Clone, Debug, Serialize)]
pub struct LawComparison {
    /// The law.
    #[serde(serialize_with = "title")]
    pub law: Law,
    /// How it is predicted, in words.
    pub prediction: String,
    /// Per predicted signal: how far and where.
    pub signals: Vec<SignalComparison>,
    /// Residuals for plots, by output, recording and row.
    #[serde(skip)]
    pub residuals: Residuals,
}

fn title<S: serde::Serializer>(law: &Law, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(law.title())
}

/// One predicted signal compared.
#[derive(Clone, Debug, Serialize)]
pub struct SignalComparison {
    /// Where and when it parts.
    #[serde(flatten)]
    pub located: Located,
    /// Noise of the sensor, SI.
    pub noise: f64,
    /// The unit of the rig file.
    pub own: Option<OwnUnit>,
    /// RMS error per recording, SI.
    pub by_recording: Vec<(String, f64)>,
}

/// Predicts one law with the rig's numbers as they are (initial states
/// estimated) and looks where it parts from the recordings. The error is one
/// line.
pub fn compare_law(law: Law, rig: &Rig, tracks: &[Track<'_>]) -> Result<LawComparison, String> {
    let residuals = residuals_as_given(law, rig, tracks, &[])
        .ok_or_else(|| format!("{}: no finite prediction with these numbers", law.title()))?;
    let noise = Bench::new(law, rig, tracks).noise;
    let signals = locate(law, rig, tracks, &residuals)
        .into_iter()
        .zip(noise)
        .zip(&residuals)
        .map(|((located, noise), columns)| SignalComparison {
            own: own_unit(rig, located.signal),
            by_recording: by_recording(tracks, columns),
            located,
            noise,
        })
        .collect();
    Ok(LawComparison {
        law,
        prediction: prediction(law),
        signals,
        residuals,
    })
}

fn by_recording(tracks: &[Track<'_>], columns: &[Vec<f64>]) -> Vec<(String, f64)> {
    let pairs = tracks.iter().zip(columns);
    pairs
        .map(|(track, column)| {
            let name = track.recording.name.clone();
            (name, rms(std::slice::from_ref(column)))
        })
        .collect()
}

impl LawComparison {
    /// The findings of all signals.
    pub fn located(&self) -> Vec<Located> {
        self.signals.iter().map(|one| one.located.clone()).collect()
    }
}

impl fmt::Display for LawComparison {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}: {}", self.law.title(), self.prediction)?;
        write!(out, "{}", figures(&self.signals))?;
        for signal in &self.signals {
            write_located(out, &signal.located)?;
        }
        Ok(())
    }
}

fn figures(signals: &[SignalComparison]) -> Columns {
    let headings = [
        "signal",
        "unit",
        "RMS error",
        "sensor noise",
        "signal sd",
        "share",
    ];
    let mut columns = Columns::new(2, &headings);
    for signal in signals {
        let located = &signal.located;
        let row = |unit: &str, si_per_unit: f64| {
            let figure = |value: f64| plain(value / si_per_unit, DIGITS);
            [
                located.signal.to_owned(),
                unit.to_owned(),
                figure(located.rms),
                figure(signal.noise),
                figure(located.spread),
                format!("{:.0} %", 100.0 * located.share),
            ]
        };
        columns.row(row(located.unit, 1.0));
        let other = |own: &&OwnUnit| (own.si_per_unit - 1.0).abs() > f64::EPSILON;
        if let Some(own) = signal.own.as_ref().filter(other) {
            columns.row(row(&own.unit, own.si_per_unit));
        }
    }
    columns
}

fn write_located(out: &mut fmt::Formatter<'_>, located: &Located) -> fmt::Result {
    writeln!(out, "  {}: {}", located.signal, located.when)?;
    let named: Vec<String> = located
        .variables
        .iter()
        .filter(|variable| variable.significant)
        .take(TOLD_VARIABLES)
        .map(|one| format!("{} {:.0} %", one.name, 100.0 * one.eta_squared))
        .collect();
    if !named.is_empty() {
        let by = match located.quantity {
            quantity if quantity == located.signal => String::new(),
            quantity => format!(" (judged by its error's {quantity})"),
        };
        writeln!(out, "    goes with{by}: {}", named.join(", "))?;
    }
    if located.intervals.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "    {:.0} % of it in {:.0} % of the time:",
        100.0 * located.interval_share,
        100.0 * located.interval_time
    )?;
    for (name, from, to) in located.intervals.iter().take(TOLD_INTERVALS) {
        writeln!(
            out,
            "      {name}: {} to {} s",
            plain(*from, 4),
            plain(*to, 4)
        )?;
    }
    let rest = located.intervals.len().saturating_sub(TOLD_INTERVALS);
    if rest > 0 {
        writeln!(out, "      and {rest} more")?;
    }
    Ok(())
}
