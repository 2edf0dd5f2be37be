//! Velocity and acceleration out of a recorded position.
//!
//! A local quadratic, least squares over a window of time (Savitzky and Golay,
//! for uneven sampling), centred: no phase lag. The window is as short as the
//! noise allows: long enough that the velocity's noise, estimated from the
//! position's own noise, is a small part of the velocities that occur.

/// Position, velocity and acceleration at every row.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Smoothed position, m.
    pub position_m: Vec<f64>,
    /// Velocity, m/s.
    pub velocity_m_per_s: Vec<f64>,
    /// Acceleration, m/s2.
    pub acceleration_m_per_s2: Vec<f64>,
    /// Half width of the window, rows.
    pub half_width: usize,
}

/// The windows tried, half widths in rows.
const HALF_WIDTHS: [usize; 6] = [2, 4, 8, 12, 16, 24];
/// The acceleration's noise may be this share of its own spread.
const ACCELERATION_NOISE_SHARE: f64 = 0.1;

impl Motion {
    /// Motion from a position, with the narrowest window whose acceleration is
    /// not mostly noise.
    pub fn from_position(time_s: &[f64], position_m: &[f64]) -> Self {
        let noise = white_noise(position_m);
        let mut motion = Self::with_half_width(time_s, position_m, HALF_WIDTHS[0]);
        for &half_width in &HALF_WIDTHS[1..] {
            let step = median_step_s(time_s);
            let share = acceleration_noise(noise, motion.half_width, step)
                / spread(&motion.acceleration_m_per_s2).max(f64::MIN_POSITIVE);
            if share <= ACCELERATION_NOISE_SHARE {
                break;
            }
            motion = Self::with_half_width(time_s, position_m, half_width);
        }
        motion
    }

    /// Motion with a given window.
    pub fn with_half_width(time_s: &[f64], position_m: &[f64], half_width: usize) -> Self {
        let rows = time_s.len();
        let mut motion = Self {
            position_m: Vec::with_capacity(rows),
            velocity_m_per_s: Vec::with_capacity(rows),
            acceleration_m_per_s2: Vec::with_capacity(rows),
            half_width,
        };
        for row in 0..rows {
            let from = row.saturating_sub(half_width);
            let to = (row + half_width + 1).min(rows);
            let [position, velocity, acceleration] =
                local_quadratic(&time_s[from..to], &position_m[from..to], time_s[row]);
            motion.position_m.push(position);
            motion.velocity_m_per_s.push(velocity);
            motion.acceleration_m_per_s2.push(acceleration);
        }
        motion
    }
}

/// Least-squares quadratic about `centre`: value, slope and curvature there.
/// Fewer than three rows give a line or a constant.
pub fn local_quadratic(time_s: &[f64], values: &[f64], centre: f64) -> [f64; 3] {
    if time_s.len() < 3 {
        let slope = if time_s.len() == 2 {
            (values[1] - values[0]) / (time_s[1] - time_s[0])
        } else {
            0.0
        };
        let value = values.first().copied().unwrap_or(0.0);
        let start = time_s.first().copied().unwrap_or(centre);
        return [value + slope * (centre - start), slope, 0.0];
    }
    // Scaled time keeps the normal equations well conditioned.
    let scale = (time_s[time_s.len() - 1] - time_s[0]).max(f64::MIN_POSITIVE);
    let mut moments = [0.0; 5];
    let mut right = [0.0; 3];
    for (&time, &value) in time_s.iter().zip(values) {
        let tau = (time - centre) / scale;
        let powers = [1.0, tau, tau * tau];
        for (slot, power) in right.iter_mut().zip(powers) {
            *slot += power * value;
        }
        for (order, moment) in moments.iter_mut().enumerate() {
            *moment += powers[order.min(2)] * powers[order - order.min(2)];
        }
    }
    let matrix = nalgebra::Matrix3::new(
        moments[0], moments[1], moments[2], moments[1], moments[2], moments[3], moments[2],
        moments[3], moments[4],
    );
    let solution = matrix
        .lu()
        .solve(&nalgebra::Vector3::from(right))
        .unwrap_or_else(|| nalgebra::Vector3::new(right[0] / moments[0], 0.0, 0.0));
    [
        solution[0],
        solution[1] / scale,
        2.0 * solution[2] / (scale * scale),
    ]
}

/// Standard deviation of white noise in a smooth signal, from its third
/// differences (their variance is 20 times the noise's).
pub fn white_noise(values: &[f64]) -> f64 {
    let mut squares: Vec<f64> = values
        .windows(4)
        .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2))
        .collect();
    if squares.is_empty() {
        return 0.0;
    }
    // The mean of the lower 80 %: a few jumps are not noise.
    let keep = (squares.len() * 4 / 5).max(1);
    squares.select_nth_unstable_by(keep - 1, f64::total_cmp);
    let mean = squares[..keep].iter().sum::<f64>() / keep as f64;
    // For normal noise the lower 80 % of squares hold 0.431 of the mean square.
    (mean / 0.431 / 20.0).sqrt()
}

/// Noise of a quadratic's curvature over 2m+1 rows: sqrt(720/n^5) sigma / h^2.
fn acceleration_noise(noise: f64, half_width: usize, step_s: f64) -> f64 {
    let rows = (2 * half_width + 1) as f64;
    noise * (720.0 / rows.powi(5)).sqrt() / (step_s * step_s)
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The usual time between rows, s; 1 where there are fewer than two.
pub fn median_step_s(time_s: &[f64]) -> f64 {
    let steps = time_s.windows(2).map(|w| w[1] - w[0]);
    median(steps.collect()).unwrap_or(1.0)
}

/// The middle of the values by size, the upper one of two; `None` of none.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_parabola_is_met_exactly_at_uneven_times() {
        let time: Vec<f64> = (0..60)
            .map(|k| f64::from(k) * 0.01 + 0.003 * f64::from(k % 3))
            .collect();
        let x: Vec<f64> = time.iter().map(|t| 0.2 - 0.3 * t + 1.7 * t * t).collect();
        let motion = Motion::with_half_width(&time, &x, 6);
        for (row, t) in time.iter().enumerate() {
            assert!((motion.velocity_m_per_s[row] - (-0.3 + 3.4 * t)).abs() < 1e-9);
            assert!((motion.acceleration_m_per_s2[row] - 3.4).abs() < 1e-7);
        }
    }

    #[test]
    fn prop_noise_estimate_is_that_of_the_noise() {
        // A fixed linear congruential sequence, uniform: sd = range / sqrt(12).
        let mut seed = 12_345_u64;
        let values: Vec<f64> = (0..20_000)
            .map(|k| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let uniform = (seed >> 11) as f64 / (1u64 << 53) as f64;
                (f64::from(k) * 1e-3).sin() + uniform
            })
            .collect();
        let noise = white_noise(&values);
        assert!(
            (noise / (1.0_f64 / 12.0).sqrt() - 1.0).abs() < 0.1,
            "{noise}"
        );
    }
}
