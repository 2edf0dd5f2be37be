//! Sines in a command, and how a signal follows them.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::steady;

/// Periods that differ by less than this part are of one sine ...
const ONE_FREQUENCY: f64 = 0.04;
/// ... and amplitudes.
const ONE_AMPLITUDE: f64 = 0.06;
/// Fewest periods of a sine; the first is left out, as the answer settles.
const LEAST_PERIODS: usize = 3;
/// Rows of a period that a sine can be read from.
const ROWS_PER_PERIOD: usize = 8;

/// A stretch with a sine.
#[derive(Clone, Debug, PartialEq)]
pub struct Sine {
    /// Whole periods, the first left out.
    pub rows: Range<usize>,
    /// Frequency, Hz.
    pub frequency_hz: f64,
}

/// How a signal follows a sine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude of the command.
    pub amplitude: f64,
    /// Amplitude of the signal over that of the command.
    pub gain: f64,
    /// Phase of the signal less that of the command, rad, at most 0.
    pub phase_rad: f64,
}

/// The sines of a command, in order.
pub fn sines(time_s: &[f64], command: &[f64]) -> Vec<Sine> {
    let middle = steady::mean(command);
    let rises: Vec<usize> = (1..command.len())
        .filter(|row| command[row - 1] <= middle && command[*row] > middle)
        .collect();
    let period = |place: usize| {
        let rows = rises[place]..rises[place + 1];
        let top = rows
            .clone()
            .map(|row| (command[row] - middle).abs())
            .fold(0.0, f64::max);
        (time_s[rows.end] - time_s[rows.start], top)
    };
    let mut found = Vec::new();
    let mut first = 0;
    for place in 0..rises.len().saturating_sub(1) {
        let (length_s, top) = period(place);
        let is_last = place + 2 == rises.len();
        let is_next_alike = !is_last && {
            let (next_s, next_top) = period(place + 1);
            // A crossing is known to a row.
            let row_s = time_s[1] - time_s[0];
            (next_s - length_s).abs() < (ONE_FREQUENCY * length_s).max(1.5 * row_s)
                && (next_top / top - 1.0).abs() < ONE_AMPLITUDE
        };
        if is_next_alike {
            continue;
        }
        if place + 1 - first >= LEAST_PERIODS {
            let rows = rises[first + 1]..rises[place + 1];
            let periods = (place - first) as f64;
            let frequency_hz = periods / (time_s[rows.end] - time_s[rows.start]);
            if rows.len() as f64 >= ROWS_PER_PERIOD as f64 * periods
                && is_sine(&command[rows.clone()], middle)
            {
                found.push(Sine { rows, frequency_hz });
            }
        }
        first = place + 1;
    }
    found
}

/// A sine's mean square is half the square of its top; a triangle's is a third, a square's all.
fn is_sine(command: &[f64], middle: f64) -> bool {
    let top = command
        .iter()
        .map(|one| (one - middle).abs())
        .fold(0.0, f64::max);
    let square = steady::mean(
        &command
            .iter()
            .map(|one| (one - middle).powi(2))
            .collect::<Vec<f64>>(),
    );
    (0.42..0.6).contains(&(square / top.powi(2)))
}

impl Sine {
    /// How a signal follows this sine of the command.
    pub fn response(&self, time_s: &[f64], command: &[f64], signal: &[f64]) -> Response {
        let part = |all: &[f64]| self.phasor(time_s, all);
        let ((u_cos, u_sin), (s_cos, s_sin)) = (part(command), part(signal));
        let amplitude = u_cos.hypot(u_sin);
        let phase = (s_cos.atan2(s_sin) - u_cos.atan2(u_sin)).rem_euclid(TAU);
        Response {
            frequency_hz: self.frequency_hz,
            amplitude,
            gain: s_cos.hypot(s_sin) / amplitude,
            phase_rad: if phase > 0.1 { phase - TAU } else { phase },
        }
    }

    fn phasor(&self, time_s: &[f64], signal: &[f64]) -> (f64, f64) {
        let middle = steady::mean(&signal[self.rows.clone()]);
        let (mut cosine, mut sine) = (0.0, 0.0);
        for row in self.rows.clone() {
            let angle = TAU * self.frequency_hz * time_s[row];
            cosine += (signal[row] - middle) * angle.cos();
            sine += (signal[row] - middle) * angle.sin();
        }
        let half = 0.5 * self.rows.len() as f64;
        (cosine / half, sine / half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_two_sines_are_found_with_gain_and_phase() {
        let time_s: Vec<f64> = (0..8000).map(|row| f64::from(row) * 2e-4).collect();
        let frequency = |time: f64| if time < 0.8 { 10.0 } else { 40.0 };
        let command: Vec<f64> = time_s
            .iter()
            .map(|time| 5.0 + (TAU * frequency(*time) * time).sin())
            .collect();
        let answer: Vec<f64> = time_s
            .iter()
            .map(|time| 0.5 * (TAU * frequency(*time) * time - 0.6).sin())
            .collect();
        let found = sines(&time_s, &command);
        assert_eq!(found.len(), 2, "{found:?}");
        for (sine, hertz) in found.iter().zip([10.0, 40.0]) {
            let response = sine.response(&time_s, &command, &answer);
            assert!((response.frequency_hz / hertz - 1.0).abs() < 0.01);
            assert!((response.gain - 0.5).abs() < 0.01, "{response:?}");
            assert!((response.phase_rad + 0.6).abs() < 0.02, "{response:?}");
        }
    }

    #[test]
    fn val_a_triangle_is_no_sine() {
        let time_s: Vec<f64> = (0..8000).map(|row| f64::from(row) * 1e-3).collect();
        let command: Vec<f64> = time_s
            .iter()
            .map(|time| 5.0 - 4.0 * (time % 1.0 - 0.5).abs())
            .collect();
        assert_eq!(sines(&time_s, &command), []);
    }
}
