//! Spectra of windows of a signal (Welch 1967): Hann, half overlapped, each less its mean.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Hann windows of so many rows, half overlapped.
#[derive(Clone)]
pub struct Windows {
    weights: Vec<f64>,
    transform: Arc<dyn Fft<f64>>,
}

impl Windows {
    /// Windows of so many rows. The transform is the scalar one: the same bytes on every processor.
    pub fn new(rows: usize) -> Self {
        let hann = |row: usize| 0.5 - 0.5 * (TAU * row as f64 / rows as f64).cos();
        Self {
            weights: (0..rows).map(hann).collect(),
            transform: FftPlannerScalar::new().plan_fft_forward(rows),
        }
    }

    /// Rows of a window.
    pub fn rows(&self) -> usize {
        self.weights.len()
    }

    /// The sum of the squares of its weights.
    pub fn power(&self) -> f64 {
        self.weights.iter().map(|weight| weight * weight).sum()
    }

    /// Where the windows of a signal of so many rows begin.
    pub fn starts(&self, rows: usize) -> impl Iterator<Item = usize> + use<> {
        let end = (rows + 1).saturating_sub(self.rows());
        (0..end).step_by((self.rows() / 2).max(1))
    }

    /// The spectrum of one window of rows.
    pub fn spectrum(&self, rows: &[f64]) -> Vec<Complex<f64>> {
        let mean = rows.iter().sum::<f64>() / rows.len() as f64;
        let weighted = rows.iter().zip(&self.weights);
        let mut values: Vec<Complex<f64>> = weighted
            .map(|(value, weight)| Complex::new((value - mean) * weight, 0.0))
            .collect();
        self.transform.process(&mut values);
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of three periods in a window: half of its amplitude times the mean weight, a half, in bin 3.
    #[test]
    fn val_a_sine_stands_in_its_bin() {
        let windows = Windows::new(60);
        let sine: Vec<f64> = (0..120)
            .map(|row| 5.0 + (TAU * 3.0 * f64::from(row) / 60.0).sin())
            .collect();
        let starts: Vec<usize> = windows.starts(sine.len()).collect();
        assert_eq!(starts, [0, 30, 60]);
        for start in starts {
            let spectrum = windows.spectrum(&sine[start..start + 60]);
            assert!((spectrum[3].norm() - 60.0 / 4.0).abs() < 1e-9);
            assert!(spectrum[0].norm() < 1e-9 && spectrum[6].norm() < 1e-9);
        }
        assert!((windows.power() - 60.0 * 3.0 / 8.0).abs() < 1e-9);
        assert_eq!(windows.starts(59).count(), 0);
    }
}
