//! The frequency response from one signal of a recording to another, and that of the model.
//!
//! Spectra are averaged over overlapping windows (Welch 1967: Hann, half overlapped, each less its
//! mean), then over bands of a sixth of an octave. Of those averages
//!
//! ```text
//! H = S_io / S_ii        coherence = |S_io|^2 / (S_ii S_oo)
//! ```
//!
//! are the response (the estimator H1, right where the noise is in the output) and the share of the
//! output's power that follows the input by one linear law. The relative deviation of |H|, and the
//! deviation of its phase in radians, is sqrt((1 - c) / (2 n c)) for a coherence c of n independent
//! windows (Bendat and Piersol, *Random Data*, 4th edition, section 9.1). Half overlapped Hann
//! windows count for 1 / 1.056 of their number. Where nothing follows, one coherence of twenty is above
//! 1 - 0.05^(1/(n-1)) (the same, section 9.2.3): below it no response is seen.
//!
//! The model's response is estimated from its prediction in the place of the recorded output, with
//! the same windows: where both are estimated alike, a difference is one of the physics.
//!
//! Limits: the input has to be moved by somebody outside. Where the output acts back on it (a closed
//! loop) H lies between the axis and the inverse of the controller. An axis bends what is large: H
//! is that of this recording's motion.

use crate::compare::LawComparison;
use crate::identify::Residuals;
use crate::laws::{Track, median_step_s};
use crate::recording::Recording;
use crate::welch::Windows;
use rustfft::num_complex::Complex;
use serde::Serialize;

/// Windows at the least: with fewer a coherence says nothing.
const LEAST_WINDOWS: usize = 4;
/// Windows that a recording is cut into where nobody says otherwise.
const USUAL_WINDOWS: f64 = 10.0;
/// The longest window where nobody says otherwise, s.
const USUAL_LONGEST_S: f64 = 2.0;
/// Chance of a point that is seen though nothing follows.
const FALSE_SIGHT: f64 = 0.05;
/// Rows of a window at the least.
const LEAST_ROWS: usize = 16;
/// Windows of this kind for one independent window: 1 + 2 / 36, as half of a Hann window has the
/// correlation 1/6 with the other.
const PER_INDEPENDENT_WINDOW: f64 = 1.0 + 2.0 / 36.0;
/// Bands in an octave.
const BANDS_PER_OCTAVE: f64 = 6.0;
/// Above this share of the sampling rate a recording shows its own reading rather than the axis.
const HIGHEST_SHARE_OF_RATE: f64 = 0.4;

/// A response at one frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Mean frequency of the band, Hz.
    pub frequency_hz: f64,
    /// |H|, SI.
    pub magnitude: f64,
    /// Phase of H, degrees, unwrapped from low to high frequencies.
    pub phase_deg: f64,
    /// The share of the output's power that follows the input.
    pub coherence: f64,
    /// Relative deviation of |H|; of the phase in radians.
    pub relative_deviation: f64,
    /// Whether the output follows at all: a coherence that chance has in one of twenty points only.
    pub is_seen: bool,
}

/// From one signal to another.
#[derive(Clone, Debug, Serialize)]
pub struct Response {
    /// The signal that moves.
    pub input: String,
    /// The signal that follows.
    pub output: String,
    /// Length of a window, s.
    pub window_s: f64,
    /// Windows averaged.
    pub windows: usize,
    /// As recorded.
    pub recorded: Vec<Point>,
    /// As the model predicts; empty where it predicts no such signal.
    pub model: Vec<Point>,
}

/// The window where nobody says otherwise, s.
pub fn usual_window_s(recordings: &[Recording]) -> f64 {
    let longest = recordings.iter().map(Recording::duration_s);
    let longest_s = longest.fold(0.0, f64::max);
    // Half overlapped, n windows are (n + 1) / 2 long.
    (2.0 * longest_s / (USUAL_WINDOWS + 1.0)).min(USUAL_LONGEST_S)
}

/// The response of recordings from `input` to `output`, and that of the law that predicts the latter.
/// The error is one line.
pub fn response(
    tracks: &[Track<'_>],
    laws: &[LawComparison],
    (input, output): (&str, &str),
    window_s: f64,
) -> Result<Response, String> {
    let predicted = predictions(laws, tracks, output);
    let mut recorded = Spectra::new(tracks, window_s)?;
    let mut model = recorded.clone();
    for (place, track) in tracks.iter().enumerate() {
        let recording = track.recording;
        let column = |name: &str| {
            let missing = || format!("{}: there is no signal {name}", recording.name);
            recording.signal(name).ok_or_else(missing)
        };
        let (driving, following) = (column(input)?, column(output)?);
        recorded.add(recording, driving, following);
        if let Some(columns) = &predicted {
            model.add(recording, driving, &columns[place]);
        }
    }
    if recorded.windows < LEAST_WINDOWS {
        return Err(format!(
            "{} windows of {window_s} s in all, expected {LEAST_WINDOWS} at least: longer recordings or \
             shorter windows",
            recorded.windows
        ));
    }
    Ok(Response {
        input: input.to_owned(),
        output: output.to_owned(),
        window_s,
        windows: recorded.windows,
        recorded: recorded.points(),
        model: predicted.map_or_else(Vec::new, |_| model.points()),
    })
}

/// What the law of this output predicts, per recording; rows that it leaves out are no numbers.
fn predictions(
    laws: &[LawComparison],
    tracks: &[Track<'_>],
    output: &str,
) -> Option<Vec<Vec<f64>>> {
    let places = laws.iter().flat_map(|law| {
        let signals = law.signals.iter().enumerate();
        signals.map(move |(place, signal)| (&law.residuals, place, signal.located.signal))
    });
    let mut of_output = places.filter(|(_, _, signal)| *signal == output);
    let (residuals, place, _): (&Residuals, usize, &str) = of_output.next()?;
    let each = tracks
        .iter()
        .zip(&residuals[place])
        .map(|(track, residual)| {
            let recorded = track.recording.signal(output).unwrap_or(&[]);
            recorded.iter().zip(residual).map(|(r, e)| r + e).collect()
        });
    Some(each.collect())
}

/// Averaged spectra of an input and an output.
#[derive(Clone)]
struct Spectra {
    step_s: f64,
    window: Windows,
    input: Vec<f64>,
    output: Vec<f64>,
    cross: Vec<Complex<f64>>,
    windows: usize,
}

impl Spectra {
    fn new(tracks: &[Track<'_>], window_s: f64) -> Result<Self, String> {
        let step_s = tracks
            .iter()
            .map(|track| median_step_s(&track.recording.time_s))
            .fold(0.0, f64::max);
        let rows = (window_s / step_s).round();
        if !(rows >= LEAST_ROWS as f64 && rows <= 1e8) {
            return Err(format!(
                "a window of {window_s} s with rows every {step_s} s, expected {LEAST_ROWS} rows at least"
            ));
        }
        let rows = rows as usize;
        let half = rows / 2 + 1;
        Ok(Self {
            step_s,
            window: Windows::new(rows),
            input: vec![0.0; half],
            output: vec![0.0; half],
            cross: vec![Complex::default(); half],
            windows: 0,
        })
    }

    /// Adds a recording, brought to even rows by straight lines between its own.
    fn add(&mut self, recording: &Recording, input: &[f64], output: &[f64]) {
        let time_s = &recording.time_s;
        let [input, output] = [input, output].map(|column| even(time_s, column, self.step_s));
        let rows = self.window.rows();
        for from in self.window.starts(input.len()) {
            self.add_window(&input[from..from + rows], &output[from..from + rows]);
        }
    }

    /// One window; one with a row that is left out says nothing.
    fn add_window(&mut self, input: &[f64], output: &[f64]) {
        if !input.iter().chain(output).all(|value| value.is_finite()) {
            return;
        }
        let [input, output] = [input, output].map(|column| self.window.spectrum(column));
        for (bin, (i, o)) in input.iter().zip(&output).take(self.cross.len()).enumerate() {
            self.input[bin] += i.norm_sqr();
            self.output[bin] += o.norm_sqr();
            self.cross[bin] += i.conj() * o;
        }
        self.windows += 1;
    }

    /// The response by bands. The first two bins hold what the mean and the window leave.
    fn points(&self) -> Vec<Point> {
        let bin_hz = 1.0 / (self.step_s * self.window.rows() as f64);
        let highest = (HIGHEST_SHARE_OF_RATE * self.window.rows() as f64) as usize;
        let width = (1.0 / BANDS_PER_OCTAVE).exp2();
        let mut points = Vec::new();
        let mut from = 2;
        while from < highest {
            let to = ((from as f64 * width) as usize).clamp(from + 1, highest);
            points.extend(self.point(from..to, bin_hz));
            from = to;
        }
        unwrap(&mut points);
        points
    }

    fn point(&self, bins: std::ops::Range<usize>, bin_hz: f64) -> Option<Point> {
        let input: f64 = self.input[bins.clone()].iter().sum();
        let output: f64 = self.output[bins.clone()].iter().sum();
        let cross: Complex<f64> = self.cross[bins.clone()].iter().sum();
        if !(input > 0.0 && output > 0.0) {
            return None;
        }
        let response = cross / input;
        let coherence = (cross.norm_sqr() / (input * output)).min(1.0);
        // Neighbours of a bin share its Hann window: two bins are worth little more than one.
        let independent = self.windows as f64 * (bins.len() as f64 / 2.0).max(1.0);
        let independent = independent / PER_INDEPENDENT_WINDOW;
        let by_chance = 1.0 - FALSE_SIGHT.powf(1.0 / (independent - 1.0));
        let middle = 0.5 * (bins.start + bins.end - 1) as f64;
        Some(Point {
            frequency_hz: middle * bin_hz,
            magnitude: response.norm(),
            phase_deg: response.arg().to_degrees(),
            coherence,
            relative_deviation: ((1.0 - coherence) / (2.0 * independent * coherence)).sqrt(),
            is_seen: coherence > by_chance,
        })
    }
}

/// A column at even times, by straight lines.
fn even(time_s: &[f64], column: &[f64], step_s: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else {
        return Vec::new();
    };
    let count = ((last - first) / step_s + 1e-9) as usize + 1;
    let mut row = 0;
    let mut values = Vec::with_capacity(count);
    for place in 0..count {
        let at_s = first + place as f64 * step_s;
        while row + 2 < time_s.len() && time_s[row + 1] < at_s {
            row += 1;
        }
        let Some(end_s) = time_s.get(row + 1) else {
            values.push(column[row]);
            continue;
        };
        let share = ((at_s - time_s[row]) / (end_s - time_s[row])).clamp(0.0, 1.0);
        values.push(column[row] + share * (column[row + 1] - column[row]));
    }
    values
}

/// Phases without jumps of a turn, from one point that is seen to the next.
fn unwrap(points: &mut [Point]) {
    let mut before_deg = None;
    for point in points.iter_mut().filter(|point| point.is_seen) {
        let turns = before_deg.map_or(0.0, |before: f64| {
            ((point.phase_deg - before) / 360.0).round()
        });
        point.phase_deg -= 360.0 * turns;
        before_deg = Some(point.phase_deg);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;
    use std::collections::BTreeMap;
    use std::f64::consts::TAU;

    /// Noise through a lag of first order, exact between rows, and noise on what is read of it.
    fn lagged(lag_s: f64, noise: f64, rows: usize) -> Recording {
        const STEP_S: f64 = 1e-3;
        let (mut driving, mut reading) = (Noise::new(5, 0), Noise::new(5, 1));
        let keep = (-STEP_S / lag_s).exp();
        let mut state = 0.0;
        let (mut u, mut x) = (Vec::new(), Vec::new());
        for _ in 0..rows {
            let command = driving.normal();
            u.push(command);
            x.push(state + noise * reading.normal());
            state = keep * state + (1.0 - keep) * command;
        }
        let time_s = (0..rows).map(|row| row as f64 * STEP_S).collect();
        let signals = BTreeMap::from([("u".to_owned(), u), ("x".to_owned(), x)]);
        Recording::from_signals("lagged", time_s, signals)
    }

    fn of(recording: &Recording) -> Response {
        let tracks = [Track::new(recording)];
        response(&tracks, &[], ("u", "x"), 1.0).unwrap()
    }

    /// The response of the discrete lag: (1 - k) z^-1 / (1 - k z^-1).
    fn exact(lag_s: f64, frequency_hz: f64) -> Complex<f64> {
        let keep = (-1e-3 / lag_s).exp();
        let delay = Complex::from_polar(1.0, -TAU * frequency_hz * 1e-3);
        (1.0 - keep) * delay / (1.0 - keep * delay)
    }

    #[test]
    fn val_a_lag_has_its_known_response() {
        let found = of(&lagged(0.02, 0.0, 60_000));
        assert!(found.recorded.len() > 30 && found.model.is_empty());
        for point in found
            .recorded
            .iter()
            .filter(|point| point.frequency_hz > 3.0)
        {
            let known = exact(0.02, point.frequency_hz);
            let off = point.magnitude / known.norm() - 1.0;
            assert!(off.abs() < 0.02, "{point:?}: {}", known.norm());
            let phase = point.phase_deg - known.arg().to_degrees();
            assert!(
                (phase - 360.0 * (phase / 360.0).round()).abs() < 2.0,
                "{point:?}"
            );
            assert!(point.coherence > 0.98, "{point:?}");
        }
    }

    #[test]
    fn val_coherence_is_the_share_of_power_and_deviations_cover() {
        let noise = 0.1;
        let found = of(&lagged(0.02, noise, 60_000));
        let mut covered = 0;
        for point in &found.recorded {
            let known = exact(0.02, point.frequency_hz);
            let share = known.norm_sqr() / (known.norm_sqr() + noise * noise);
            assert!((point.coherence - share).abs() < 0.2, "{point:?}: {share}");
            let off = (point.magnitude / known.norm() - 1.0).abs();
            covered += usize::from(off < 2.0 * point.relative_deviation);
        }
        // Two deviations hold 95 %; of some forty points four or five may be outside.
        let share = covered as f64 / found.recorded.len() as f64;
        assert!(share > 0.85, "{share}");
    }

    #[test]
    fn val_where_nothing_follows_one_point_of_twenty_is_seen() {
        let mut recording = lagged(0.02, 0.0, 200_000);
        let mut other = Noise::new(9, 3);
        let x = (0..recording.len()).map(|_| other.normal()).collect();
        recording.signals.insert("x".to_owned(), x);
        let tracks = [Track::new(&recording)];
        // Windows of many lengths: some hundred points.
        let lengths = [0.1, 0.15, 0.22, 0.33, 0.5, 0.7, 1.0, 1.4, 2.0];
        let (mut seen, mut all) = (0, 0);
        for window_s in lengths {
            let found = response(&tracks, &[], ("u", "x"), window_s).unwrap();
            seen += found.recorded.iter().filter(|point| point.is_seen).count();
            all += found.recorded.len();
        }
        let share = seen as f64 / all as f64;
        // Neighbours of a band and windows of one recording are not independent: a factor.
        assert!(share > 0.005 && share < 0.12, "{seen} of {all}");
    }

    #[test]
    fn prop_too_few_windows_are_refused() {
        let short = lagged(0.02, 0.0, 1500);
        let tracks = [Track::new(&short)];
        let said = response(&tracks, &[], ("u", "x"), 1.0).unwrap_err();
        assert!(said.contains("expected 4 at least"), "{said}");
        let said = response(&tracks, &[], ("u", "x"), 0.001).unwrap_err();
        assert!(said.contains("expected 16 rows"), "{said}");
        let said = response(&tracks, &[], ("u", "v"), 0.1).unwrap_err();
        assert!(said.contains("no signal v"), "{said}");
    }
}
