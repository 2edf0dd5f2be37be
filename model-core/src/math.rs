//! Compensated accumulation and small dense mathematics, without allocation.

use crate::real::Real;
use core::f64::consts::FRAC_PI_2;

/// A sum that keeps what rounding cuts off (Kahan).
///
/// In `f32` a position of 0.25 m has a spacing of 30 nm and a pressure of
/// 5 bar one of 0.03-0.06 Pa: at 0.1 mm/s and 10 kHz a plain sum stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated<R> {
    /// The sum, rounded.
    pub value: R,
    carry: R,
}

impl<R: Real> Compensated<R> {
    /// A sum that begins at `value`.
    pub fn new(value: R) -> Self {
        Self {
            value,
            carry: R::ZERO,
        }
    }

    /// Adds an increment.
    #[inline]
    pub fn add(&mut self, increment: R) {
        let corrected = increment - self.carry;
        let sum = self.value + corrected;
        self.carry = (sum - self.value) - corrected;
        self.value = sum;
    }
}

/// A 2 x 2 matrix, by rows.
pub type Matrix2<R> = [[R; 2]; 2];

/// Product of two 2 x 2 matrices.
pub fn multiply<R: Real>(a: Matrix2<R>, b: Matrix2<R>) -> Matrix2<R> {
    let entry = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

/// exp(a) by scaling, a Taylor series and squaring.
///
/// Scaling by 2^-6 and eight terms leave a relative error under 1e-12 for
/// entries up to 10 (the series' remainder is |a/64|^9/9!); the count of
/// operations is fixed. Serves every damping ratio alike, where the closed form
/// needs three branches.
pub fn matrix_exponential<R: Real>(a: Matrix2<R>) -> Matrix2<R> {
    const SQUARINGS: u32 = 6;
    const TERMS: u32 = 8;
    let scale = R::from_f64(1.0 / f64::from(1u32 << SQUARINGS));
    let small = a.map(|row| row.map(|entry| entry * scale));
    let identity = [[R::ONE, R::ZERO], [R::ZERO, R::ONE]];
    let mut sum = identity;
    let mut term = identity;
    for order in 1..=TERMS {
        let inverse = R::from_f64(1.0 / f64::from(order));
        term = multiply(term, small).map(|row| row.map(|entry| entry * inverse));
        for (row, addend) in sum.iter_mut().zip(term) {
            row[0] += addend[0];
            row[1] += addend[1];
        }
    }
    for _ in 0..SQUARINGS {
        sum = multiply(sum, sum);
    }
    sum
}

/// Cosine and sine of an angle in turns (1 is the whole circle).
///
/// Reduced to an eighth of a turn, then Taylor series to x^15 and x^14: their
/// remainders at pi/4 are 5e-17 and 3e-18. One polynomial for every scalar: the
/// library's sine of an `f32` computes in `f64`, which the chip has no unit for.
pub fn cosine_sine_of_turns<R: Real>(turns: R) -> (R, R) {
    let quarters = turns.abs() * R::from_f64(4.0);
    let quadrant = (quarters + R::from_f64(0.5)).whole();
    #[expect(clippy::cast_precision_loss, reason = "far under 2^52 quadrants")]
    let angle = (quarters - R::from_f64(quadrant as f64)) * R::from_f64(FRAC_PI_2);
    let square = angle * angle;
    let series = |inverse_factors: [f64; 7]| {
        inverse_factors.iter().rev().fold(R::ONE, |sum, factor| {
            R::ONE - square * R::from_f64(1.0 / factor) * sum
        })
    };
    // cos x = 1 - x2/(1 2) (1 - x2/(3 4) (...)), sin x = x (1 - x2/(2 3) (...)).
    let cosine = series([2.0, 12.0, 30.0, 56.0, 90.0, 132.0, 182.0]);
    let sine = angle * series([6.0, 20.0, 42.0, 72.0, 110.0, 156.0, 210.0]);
    let (cosine, sine) = match quadrant % 4 {
        0 => (cosine, sine),
        1 => (-sine, cosine),
        2 => (-cosine, -sine),
        _ => (sine, -cosine),
    };
    (cosine, if turns < R::ZERO { -sine } else { sine })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_cosine_and_sine_agree_with_the_library() {
        for step in -3000_i32..3000 {
            let turns = f64::from(step) * 1.37e-3;
            let angle = core::f64::consts::TAU * turns;
            let (cosine, sine) = cosine_sine_of_turns(turns);
            assert!((cosine - libm::cos(angle)).abs() < 1e-14, "at {turns}");
            assert!((sine - libm::sin(angle)).abs() < 1e-14, "at {turns}");
            let (narrow, _) = cosine_sine_of_turns(turns as f32);
            assert!((f64::from(narrow) - cosine).abs() < 4e-6, "at {turns}");
        }
    }

    #[test]
    fn prop_compensated_sum_does_not_stall_in_f32() {
        let mut plain = 0.25_f32;
        let mut sum = Compensated::new(0.25_f32);
        for _ in 0..100_000 {
            plain += 1e-8;
            sum.add(1e-8);
        }
        assert!((plain - 0.25).abs() < 1e-9, "the plain sum stands still");
        assert!((f64::from(sum.value) - 0.251).abs() < 1e-7);
    }

    #[test]
    fn val_matrix_exponential_of_an_oscillator() {
        // x'' = -w^2 x - 2 z w x', w = 2 pi 100, z = 0.7, t = 1 ms: closed form.
        let (w, z, t) = (628.318_530_717_958_6_f64, 0.7_f64, 1e-3_f64);
        let damped = w * libm::sqrt(1.0 - z * z);
        let decay = libm::exp(-z * w * t);
        let expected = decay * (libm::cos(damped * t) + z * w / damped * libm::sin(damped * t));
        let exponential = matrix_exponential([[0.0, t], [-w * w * t, -2.0 * z * w * t]]);
        // The entries are scaled badly (w^2 t = 395), hence the looser bound.
        assert!((exponential[0][0] - expected).abs() < 1e-9);
    }
}
