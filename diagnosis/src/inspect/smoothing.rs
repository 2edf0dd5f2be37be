//! Pressures that the logger has smoothed with a moving average.
//!
//! White noise averaged over `L` rows has differences that come back with the other
//! sign `L` rows later: the correlation of its differences is -1/2 at that lag and
//! nought elsewhere. Third differences keep the noise and drop the motion. Of the
//! practice recordings none is below -0.1 at any lag; at 1000 rows -0.4 is twelve
//! deviations of chance, at all 200 lags together less than once in 1e30.
//!
//! A smoothed pressure is late by half of the width and lacks what is quicker.

use super::SignalReport;
use super::fault::{Fault, FaultKind, at_odds_as};
use super::statistics::quantile;
use crate::recording::Recording;

/// Correlation at the width from which on a column is smoothed.
const SMOOTHED: f64 = -0.4;
/// Lags so near to the width share its correlation, and all others have less than this.
const NEAR_WIDTH: usize = 3;
const ELSEWHERE: f64 = 0.25;
/// Widths that are looked for, rows: below, third differences of white noise correlate too.
const WIDTHS: std::ops::RangeInclusive<usize> = 4..=200;
/// Fewer rows say nothing.
const LEAST_ROWS: usize = 1000;
/// Lateness from which on a fault is, s: spool and tubes take two milliseconds and more.
const LATE_S: f64 = 0.002;
/// Larger differences are motion, in deviations of the noise.
const CLIPPED: f64 = 4.0;

/// A moving average over a pressure: its width in rows.
pub(super) fn width_rows(report: &SignalReport, values: &[f64]) -> Option<usize> {
    if !report.name.starts_with("p_") || values.len() < LEAST_ROWS {
        return None;
    }
    let mut differences: Vec<f64> = values
        .windows(4)
        .map(|row| row[3] - 3.0 * row[2] + 3.0 * row[1] - row[0])
        .collect();
    let mut sizes: Vec<f64> = differences.iter().map(|one| one.abs()).collect();
    // The median size of a normal draw is 0.6745 of its deviation.
    let most = CLIPPED * quantile(&mut sizes, 0.5) / 0.6745;
    differences
        .iter_mut()
        .for_each(|one| *one = one.clamp(-most, most));
    let product = |lag: usize| -> f64 {
        let pairs = differences.iter().zip(&differences[lag..]);
        pairs.map(|(one, other)| one * other).sum()
    };
    let whole = product(0);
    let (width, least) = WIDTHS
        .map(|lag| (lag, product(lag) / whole))
        .min_by(|one, other| one.1.total_cmp(&other.1))?;
    // A periodic motion correlates at other lags too; an average only at its width.
    let is_alone = WIDTHS
        .filter(|lag| lag.abs_diff(width) > NEAR_WIDTH)
        .all(|lag| (product(lag) / whole).abs() < ELSEWHERE);
    (least < SMOOTHED && is_alone).then_some(width)
}

/// How late a moving average makes a column, s.
pub(super) fn late_s(width_rows: usize, rate_hz: f64) -> f64 {
    0.5 * (width_rows - 1) as f64 / rate_hz
}

/// The finding as a clause behind the signal's name.
pub(super) fn said(width_rows: usize, rate_hz: f64) -> String {
    format!(
        "is smoothed by a moving average over {width_rows} rows, and late by {:.1} ms; record it unsmoothed",
        1e3 * late_s(width_rows, rate_hz)
    )
}

/// A pressure that is late by so much that it hides what valve and tubes do.
pub(super) fn smoothed(
    recording: &Recording,
    report: &SignalReport,
    values: &[f64],
    rate_hz: f64,
) -> Option<Fault> {
    let width = width_rows(report, values)?;
    (late_s(width, rate_hz) > LATE_S).then(|| {
        at_odds_as(
            FaultKind::Smoothed,
            recording,
            &report.name,
            &said(width, rate_hz),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;

    fn report() -> SignalReport {
        SignalReport {
            name: "p_a".into(),
            ..SignalReport::default()
        }
    }

    /// Noise on a slow swing, averaged over so many rows before.
    fn averaged(width: usize) -> Vec<f64> {
        let mut noise = Noise::new(5, 0);
        let raw: Vec<f64> = (0..4000)
            .map(|row| 5e5 + 1e5 * (f64::from(row) * 0.01).sin() + 250.0 * noise.normal())
            .collect();
        let mean = |rows: &[f64]| rows.iter().sum::<f64>() / width as f64;
        raw.windows(width).map(mean).collect()
    }

    /// A motion that repeats, with gauges so quiet that their differences are the motion's.
    #[test]
    fn prop_a_periodic_motion_is_no_average() {
        for period in [40.0, 124.0, 333.0] {
            let values: Vec<f64> = (0..6000)
                .map(|row| {
                    let phase = f64::from(row) / period * std::f64::consts::TAU;
                    5e5 + 1e5 * phase.sin() + 2e4 * (3.0 * phase).sin()
                })
                .collect();
            assert_eq!(width_rows(&report(), &values), None, "{period}");
        }
    }

    #[test]
    fn val_the_width_of_a_moving_average_is_found_and_none_in_white_noise() {
        assert_eq!(width_rows(&report(), &averaged(1)), None);
        for width in [4, 7, 20, 150] {
            assert_eq!(width_rows(&report(), &averaged(width)), Some(width));
        }
    }
}
