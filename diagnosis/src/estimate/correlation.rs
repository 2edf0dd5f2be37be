//! How many successive rows count as one.

/// Integrated autocorrelation time of residuals, in rows: how many rows count
/// as one. Summed up to the first correlation below 0.05; the largest of the
/// outputs.
pub fn correlation_length(residuals: &[Vec<Vec<f64>>]) -> f64 {
    residuals
        .iter()
        .flatten()
        .map(|column| integrated_autocorrelation(column))
        .fold(1.0, f64::max)
}

pub(crate) fn integrated_autocorrelation(column: &[f64]) -> f64 {
    let finite: Vec<f64> = column.iter().copied().filter(|r| r.is_finite()).collect();
    let count = finite.len();
    let mean = finite.iter().sum::<f64>() / count.max(1) as f64;
    let variance = finite.iter().map(|r| (r - mean).powi(2)).sum::<f64>();
    if count < 8 || variance <= 0.0 {
        return 1.0;
    }
    let correlation = |lag: usize| {
        let products = finite.iter().zip(&finite[lag..]);
        products.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / variance
    };
    // Lags grow by a quarter each: the sum is an integral over a slow curve.
    let (mut time, mut lag, mut last) = (1.0, 1_usize, 1.0);
    let mut previous = 0_usize;
    while lag < count / 4 {
        let here = correlation(lag);
        time += (lag - previous) as f64 * (here + last).max(0.0);
        if here < 0.05 {
            break;
        }
        (previous, last) = (lag, here);
        lag += (lag / 4).max(1);
    }
    time
}
