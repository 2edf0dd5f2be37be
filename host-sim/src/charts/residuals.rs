//! Whether a residual is noise: fit, autocorrelation, cross-correlation with the inputs.
//!
//! * *Fit*: 100 % (1 − |residual| / |signal − its mean|), the normalised root mean square of
//!   system identification. A signal that hardly moves beside its noise has none.
//! * *Autocorrelation*: of white noise 95 % of the lags lie within 1.96/√N.
//! * *Cross-correlation*: residual against an input that came `lag` earlier. The band is
//!   1.96 √((R_e(0)R_u(0) + 2 Σ R_e R_u)/N), which allows for a residual that is not white
//!   (Ljung, System Identification, 2nd ed., 16.6).
//!
//! Limits: rows are taken as even in time. A position that is predicted in windows begins
//! each window at the recorded one, which the autocorrelation shows.

use crate::recording::Recording;
use crate::report::{Chart, Role, Section, Series};

/// Half the width of a 95 % band, in deviations.
const NORMAL_95: f64 = 1.96;
/// Lags shown, rows.
const MOST_LAGS: usize = 60;
/// Rows per lag at the least.
const ROWS_PER_LAG: usize = 8;
/// A signal whose spread is below this many times its noise is constant.
const MOVES: f64 = 3.0;
/// Height of a chart, CSS pixels.
const HEIGHT_PX: u32 = 170;

/// A residual of one signal in one recording, beside what it may hang on.
pub(super) struct Tested<'a> {
    /// The signal, as a reader calls it.
    pub(super) name: &'a str,
    /// The models' residuals with name and role; those that are not finite are passed over.
    pub(super) residuals: &'a [(&'a str, Role, Vec<f64>)],
    /// The inputs by name.
    pub(super) inputs: &'a [(&'a str, &'a [f64])],
    /// Time between rows, s.
    pub(super) step_s: f64,
}

/// Standard deviation of a signal over recordings, SI.
pub(super) fn spread<'a>(recordings: impl IntoIterator<Item = &'a Recording>, signal: &str) -> f64 {
    let columns = recordings.into_iter().filter_map(|one| one.signal(signal));
    let values: Vec<f64> = columns.flatten().copied().collect();
    centred(&values).map_or(0.0, |(_, energy)| energy.sqrt())
}

/// The fit in per cent; `None` where the signal does not move beside its noise.
pub(super) fn fit_percent(error_rms: f64, spread: f64, noise: f64) -> Option<f64> {
    let moves = spread > MOVES * noise && spread > 0.0;
    (moves && error_rms.is_finite()).then(|| 100.0 * (1.0 - error_rms / spread))
}

impl Tested<'_> {
    /// The charts of one signal, side by side.
    pub(super) fn show(&self, section: &mut Section) {
        let lags = self.lags();
        if lags == 0 {
            return;
        }
        let inputs = self.inputs.iter();
        let crossed = inputs.map(|input| self.cross_correlations(*input, lags));
        let charts: Vec<Chart> = std::iter::once(self.autocorrelations(lags))
            .chain(crossed)
            .collect();
        for pair in charts.chunks(2) {
            section.row(|row| pair.iter().for_each(|chart| row.chart(chart.clone())));
        }
    }

    /// The share of lags outside of the 95 % band, by model.
    pub(super) fn outside(&self) -> Vec<Option<f64>> {
        let lags = self.lags();
        let of = |(_, _, residual): &(&str, Role, Vec<f64>)| {
            let correlation = autocorrelation(residual, lags)?;
            let band = NORMAL_95 / (residual.len() as f64).sqrt();
            let outside = correlation[1..].iter().filter(|r| r.abs() > band).count();
            Some(outside as f64 / lags as f64)
        };
        self.residuals.iter().map(of).collect()
    }

    fn lags(&self) -> usize {
        let rows = self.residuals.first().map_or(0, |one| one.2.len());
        (rows / ROWS_PER_LAG).min(MOST_LAGS)
    }

    fn lag_ms(&self, lag: f64) -> f64 {
        1e3 * self.step_s * lag
    }

    fn autocorrelations(&self, lags: usize) -> Chart {
        let rows = self.residuals.first().map_or(1, |one| one.2.len());
        let band = NORMAL_95 / (rows.max(1) as f64).sqrt();
        let ends = [0, lags].map(|lag| (self.lag_ms(lag as f64), -band, band));
        let title = format!("{}: autocorrelation of the residual", self.name);
        let chart = self
            .axes(title)
            .band("95 % of white noise", Role::Noise, ends);
        let curves = self.residuals.iter().filter_map(|(name, role, residual)| {
            let correlation = autocorrelation(residual, lags)?;
            let points = correlation.into_iter().enumerate();
            let points = points.map(|(lag, r)| (self.lag_ms(lag as f64), r));
            Some(Series::new(*name, *role, points))
        });
        curves.fold(chart, Chart::series)
    }

    fn cross_correlations(&self, (input, values): (&str, &[f64]), lags: usize) -> Chart {
        let title = format!("{}: residual against {input}", self.name);
        let mut chart = self.axes(title);
        let last = self.residuals.last();
        let half = last.and_then(|(_, _, residual)| band_of_cross(residual, values, lags));
        if let (Some(half), Some((name, ..))) = (half, last) {
            let ends = [-(lags as f64), lags as f64].map(|lag| (self.lag_ms(lag), -half, half));
            chart = chart.band(format!("95 % if independent ({name})"), Role::Noise, ends);
        }
        let curves = self.residuals.iter().filter_map(|(name, role, residual)| {
            let correlation = cross_correlation(residual, values, lags)?;
            let points = correlation.into_iter();
            let points = points.map(|(lag, r)| (self.lag_ms(lag), r));
            Some(Series::new(*name, *role, points))
        });
        curves.fold(chart, Chart::series)
    }

    fn axes(&self, title: String) -> Chart {
        Chart::new(title)
            .x_axis("lag", "ms")
            .y_axis("correlation", "")
            .height(HEIGHT_PX)
            .level(0.0, "")
    }
}

/// Less its mean; `None` if anything is not finite or nothing varies.
fn centred(values: &[f64]) -> Option<(Vec<f64>, f64)> {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let energy = centred.iter().map(|value| value * value).sum::<f64>() / count;
    (energy.is_finite() && energy > 0.0).then_some((centred, energy))
}

/// Mean of the products of two columns, the first `lag` rows later; over all rows.
fn product(later: &[f64], earlier: &[f64], lag: usize) -> f64 {
    let pairs = later.iter().skip(lag).zip(earlier);
    pairs.map(|(one, other)| one * other).sum::<f64>() / later.len().max(1) as f64
}

/// Normalised, from lag 0 on.
fn autocorrelation(residual: &[f64], lags: usize) -> Option<Vec<f64>> {
    let (centred, energy) = centred(residual)?;
    let lags = 0..=lags;
    Some(
        lags.map(|lag| product(&centred, &centred, lag) / energy)
            .collect(),
    )
}

/// Normalised, by lag: positive where the input came earlier.
fn cross_correlation(residual: &[f64], input: &[f64], lags: usize) -> Option<Vec<(f64, f64)>> {
    if residual.len() != input.len() {
        return None;
    }
    let ((residual, of_residual), (input, of_input)) = (centred(residual)?, centred(input)?);
    let norm = (of_residual * of_input).sqrt();
    let before = (1..=lags)
        .rev()
        .map(|lag| (-(lag as f64), product(&input, &residual, lag)));
    let after = (0..=lags).map(|lag| (lag as f64, product(&residual, &input, lag)));
    Some(
        before
            .chain(after)
            .map(|(lag, r)| (lag, r / norm))
            .collect(),
    )
}

/// Half the width of the band of a cross-correlation between independent signals.
fn band_of_cross(residual: &[f64], input: &[f64], lags: usize) -> Option<f64> {
    let (one, other) = (
        autocorrelation(residual, lags)?,
        autocorrelation(input, lags)?,
    );
    let sum: f64 = one.iter().zip(&other).skip(1).map(|(a, b)| a * b).sum();
    let variance = (1.0 + 2.0 * sum).max(1.0) / residual.len() as f64;
    Some(NORMAL_95 * variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;

    fn white(seed: u64, rows: usize) -> Vec<f64> {
        let mut noise = Noise::new(seed, 0);
        (0..rows).map(|_| noise.normal()).collect()
    }

    fn tested(residual: Vec<f64>) -> f64 {
        let residuals = [("improved", Role::Improved, residual)];
        let tested = Tested {
            name: "signal",
            residuals: &residuals,
            inputs: &[],
            step_s: 1e-3,
        };
        tested.outside()[0].unwrap()
    }

    #[test]
    fn prop_white_noise_stays_in_its_band_and_a_lagged_one_does_not() {
        let all: f64 = (0..40).map(|seed| tested(white(seed, 4_000))).sum();
        assert!((0.03..0.07).contains(&(all / 40.0)), "{}", all / 40.0);
        let coloured: Vec<f64> = white(7, 4_000)
            .iter()
            .scan(0.0, |state, noise| {
                *state = 0.95 * *state + noise;
                Some(*state)
            })
            .collect();
        assert!(tested(coloured) > 0.5);
    }

    #[test]
    fn prop_an_input_that_acts_late_shows_at_its_lag_and_an_independent_one_does_not() {
        let input = white(1, 5_000);
        let acts = |row: usize| {
            if row >= 12 {
                0.3 * input[row - 12]
            } else {
                0.0
            }
        };
        let noise = white(2, 5_000);
        let residual: Vec<f64> = (0..5_000).map(|row| acts(row) + noise[row]).collect();
        let of = |input: &[f64]| cross_correlation(&residual, input, 40).unwrap();
        let largest = |correlation: Vec<(f64, f64)>| {
            let by_size = |a: &(f64, f64), b: &(f64, f64)| a.1.abs().total_cmp(&b.1.abs());
            correlation.into_iter().max_by(by_size).unwrap()
        };
        let band = band_of_cross(&residual, &input, 40).unwrap();
        let (lag, size) = largest(of(&input));
        assert!((lag - 12.0).abs() < 0.5 && size > 5.0 * band);
        let other = white(3, 5_000);
        let outside = of(&other).iter().filter(|(_, r)| r.abs() > band).count();
        assert!(outside <= 10, "{outside} of 81");
    }

    #[test]
    fn regress_a_constant_supply_has_no_fit() {
        assert_eq!(fit_percent(260.0, 261.0, 250.0), None);
        assert_eq!(fit_percent(0.0, 2.0, 0.1), Some(100.0));
        assert_eq!(fit_percent(1.0, 2.0, 0.1), Some(50.0));
        assert_eq!(fit_percent(f64::NAN, 2.0, 0.1), None);
    }
}
