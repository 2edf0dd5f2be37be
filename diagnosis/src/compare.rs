//! Predictions of a rig as given against recordings: how large the misfit is, where
//! and when.

use serde::Serialize;

use crate::estimate::Bench;
use crate::identify::{OwnUnit, Residuals, own_unit, prediction, residuals_as_given, rms};
use crate::laws::{Law, Track};
use crate::locate::{Located, locate};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use crate::text::{Columns, plain};
use std::fmt;

/// Significant digits of errors.
const DIGITS: usize = 3;
/// Variables shown on the terminal.
const SHOWN_VARIABLES: usize = 3;
/// Intervals shown on the terminal.
const SHOWN_INTERVALS: usize = 4;
/// A misfit within this many times the noise is noise.
const NOISE_ONLY: f64 = 1.2;

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
    /// Where and when it deviates.
    #[serde(flatten)]
    pub located: Located,
    /// Noise of the sensor, SI.
    pub noise: f64,
    /// The unit of the rig file.
    pub own: Option<OwnUnit>,
    /// RMS error per recording, SI.
    pub by_recording: Vec<(String, f64)>,
    /// The unit in which a person reads it.
    #[serde(skip)]
    pub(crate) reading: Reading,
}

/// Predicts one law with the rig's numbers as they are (initial states
/// estimated) and looks where it deviates from the recordings. The error is one
/// line.
pub fn compare_law(law: Law, rig: &Rig, tracks: &[Track<'_>]) -> Result<LawComparison, String> {
    let residuals = residuals_as_given(law, rig, tracks, &[])
        .ok_or_else(|| format!("{}: no finite prediction with these numbers", law.title()))?;
    let noise = Bench::new(law, rig, tracks).noise;
    let mut signals: Vec<SignalComparison> = locate(law, rig, tracks, &residuals)
        .into_iter()
        .zip(noise)
        .zip(&residuals)
        .map(|((located, noise), columns)| SignalComparison {
            own: own_unit(rig, located.signal),
            reading: Reading::of_signal(rig, located.signal),
            by_recording: by_recording(tracks, columns),
            located,
            noise,
        })
        .collect();
    share_by_noise(&mut signals);
    Ok(LawComparison {
        law,
        prediction: prediction(law),
        signals,
        residuals,
    })
}

/// Each signal's part of the law's misfit, counted in sensor noise: the spread of a signal that
/// hardly moves says nothing.
fn share_by_noise(signals: &mut [SignalComparison]) {
    let energy = |signal: &SignalComparison| signal.over_noise().powi(2);
    let whole: f64 = signals.iter().map(energy).sum();
    for signal in signals {
        signal.located.share = energy(signal) / whole.max(f64::MIN_POSITIVE);
    }
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

impl SignalComparison {
    /// The rms misfit over the noise of the sensor.
    pub fn over_noise(&self) -> f64 {
        self.located.rms / self.noise.max(f64::MIN_POSITIVE)
    }
}

/// The finding in one sentence: the signal that is furthest from its noise.
pub fn headline(rig: &Rig, laws: &[LawComparison]) -> String {
    let signals = laws.iter().flat_map(|law| &law.signals);
    let by_noise =
        |a: &&SignalComparison, b: &&SignalComparison| a.over_noise().total_cmp(&b.over_noise());
    let Some(worst) = signals.max_by(by_noise) else {
        return "No signal can be predicted from this rig file and these recordings.".into();
    };
    let (located, times) = (&worst.located, worst.over_noise());
    if times <= NOISE_ONLY {
        return format!(
            "The model predicts every signal to within {NOISE_ONLY} times its sensor noise."
        );
    }
    let reading = Reading::of_signal(rig, located.signal);
    format!(
        "{} has the largest misfit: {} {} rms, {} times the sensor noise ({}).",
        signals::titled(located.signal),
        plain(reading.difference(located.rms), DIGITS),
        reading.unit,
        plain(times, 2),
        located.when
    )
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
        "rms misfit",
        "sensor noise",
        "misfit/noise",
        "signal sd",
    ];
    let mut columns = Columns::new(2, &headings);
    for signal in signals {
        let located = &signal.located;
        let figure = |value: f64| plain(signal.reading.difference(value), DIGITS);
        columns.row([
            signals::spoken(located.signal).to_owned(),
            signal.reading.unit.clone(),
            figure(located.rms),
            figure(signal.noise),
            plain(signal.over_noise(), DIGITS),
            figure(located.spread),
        ]);
    }
    columns
}

fn write_located(out: &mut fmt::Formatter<'_>, located: &Located) -> fmt::Result {
    writeln!(
        out,
        "  {}: {}",
        signals::spoken(located.signal),
        located.when
    )?;
    let named: Vec<String> = located
        .variables
        .iter()
        .filter(|variable| variable.significant)
        .take(SHOWN_VARIABLES)
        .map(|one| format!("{} {:.0} %", one.name, 100.0 * one.eta_squared))
        .collect();
    if !named.is_empty() {
        let by = match located.quantity {
            quantity if quantity == located.signal => String::new(),
            quantity => format!(" (as an error in {quantity})"),
        };
        writeln!(out, "    correlates with{by}: {}", named.join(", "))?;
    }
    if located.intervals.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "    {:.0} % of the squared error in {:.0} % of the time:",
        100.0 * located.interval_share,
        100.0 * located.interval_time
    )?;
    for (name, from, to) in located.intervals.iter().take(SHOWN_INTERVALS) {
        writeln!(
            out,
            "      {name}: {} to {} s",
            plain(*from, 4),
            plain(*to, 4)
        )?;
    }
    let rest = located.intervals.len().saturating_sub(SHOWN_INTERVALS);
    if rest > 0 {
        writeln!(out, "      and {rest} more")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(signal: &'static str, rms: f64, noise: f64, spread: f64) -> SignalComparison {
        let rig = Rig::parse("format = \"rig/1\"\n", "rig.toml").unwrap();
        SignalComparison {
            located: Located {
                place: "chamber-a",
                signal,
                unit: "Pa",
                rms,
                spread,
                share: 1.0,
                mean: 0.0,
                intervals: Vec::new(),
                interval_share: 0.0,
                interval_time: 0.0,
                quantity: signal,
                quantity_unit: "Pa",
                variables: Vec::new(),
                when: "constant offset".into(),
            },
            noise,
            own: None,
            by_recording: Vec::new(),
            reading: Reading::of_signal(&rig, signal),
        }
    }

    /// A supply of constant pressure that is predicted to 6.7 kPa was "off by 2575 % of what the
    /// signal does", beside a chamber pressure 37 kPa off.
    #[test]
    fn prop_the_headline_counts_in_noise_whatever_the_signal_does() {
        let rig = Rig::parse("format = \"rig/1\"\n", "rig.toml").unwrap();
        for spread in [1.0, 261.0, 1e5] {
            let law = LawComparison {
                law: Law::Chambers,
                prediction: String::new(),
                signals: vec![
                    compared("p_a", 36_837.0, 260.0, 60_350.0),
                    compared("p_s", 6_720.0, 260.0, spread),
                ],
                residuals: Vec::new(),
            };
            let sentence = headline(&rig, std::slice::from_ref(&law));
            let expected = "Chamber A pressure has the largest misfit: 36.8 kPa rms, 142 times the sensor noise (constant offset).";
            assert_eq!(sentence, expected);
            let shown = law.to_string();
            assert!(!shown.contains("p_a") && shown.contains("chamber A pressure"));
        }
        let law = LawComparison {
            law: Law::Chambers,
            prediction: String::new(),
            signals: vec![compared("p_s", 270.0, 260.0, 1.0)],
            residuals: Vec::new(),
        };
        assert!(headline(&rig, &[law]).starts_with("The model predicts every signal"));
    }
}
