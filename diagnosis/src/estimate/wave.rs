//! Something that comes again and again along the way, A sin(2 pi x / period + phase): the one of
//! all periods that it may have which explains most of what is missed.

use crate::text::plain;
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Periods that the error of a scale may have, m; of the longest ...
const OF_A_SCALE_M: (f64, f64) = (1e-3, 0.1);
/// ... so many lie in the way that was travelled: less than two may be a scale of another gain.
const LEAST_CYCLES: f64 = 2.0;
/// Steps from one wave number to the next, in cycles over the way that was travelled.
const CYCLES: f64 = 0.25;
/// Finer steps around the best of these.
const FINER: usize = 16;
/// A wave is what is missed if it takes away this part of the energy ...
const OF_A_WAVE: f64 = 0.5;
/// ... and chance seldom does as much at any period: one in so many.
const CHANCE: f64 = 1e3;

/// An error of the position, or whatever else has these sizes, along the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    pub period_m: f64,
    /// Of the cosine and of the sine of the position.
    pub sizes: Vector2<f64>,
    /// Energy that it takes away, in units of the noise's of one row.
    pub gain: f64,
    /// Periods that were tried.
    tried: f64,
}

/// The shortest and the longest period that the error of a scale may have over such a way, m.
pub(crate) fn of_a_scale_m(way_m: f64) -> (f64, f64) {
    let (shortest_m, longest_m) = OF_A_SCALE_M;
    (shortest_m, longest_m.min(way_m / LEAST_CYCLES))
}

/// The wave that takes away most, of those between the shortest and the longest period. What a
/// cosine and a sine of this many radians per metre change in each row, and what is missed there,
/// both in units of the noise, are handed in by `rows`.
pub(crate) fn largest<I: Iterator<Item = (Vector2<f64>, f64)>>(
    way_m: f64,
    (shortest_m, longest_m): (f64, f64),
    rows: impl Fn(f64) -> I + Sync,
) -> Option<Wave> {
    let step_per_m = CYCLES / way_m.max(shortest_m);
    let (first, last) = (1.0 / longest_m, 1.0 / shortest_m);
    let tried = ((last - first) / step_per_m).ceil();
    let fitted = |per_m: f64| {
        let mut normal = Matrix2::zeros();
        let mut right = Vector2::zeros();
        for (change, missed) in rows(TAU * per_m) {
            normal += change * change.transpose();
            right += change * missed;
        }
        let sizes = normal.try_inverse()? * right;
        Some(Wave {
            period_m: 1.0 / per_m,
            sizes,
            gain: sizes.dot(&right),
            tried,
        })
    };
    let best = |from_per_m: f64, step_per_m: f64, count: usize| {
        let tried = (0..count).into_par_iter();
        let waves = tried.filter_map(|step| fitted(from_per_m + step as f64 * step_per_m));
        waves.max_by(|a, b| a.gain.total_cmp(&b.gain))
    };
    let near = best(first, step_per_m, tried as usize)?;
    let finer_per_m = step_per_m / FINER as f64;
    best(
        near.period_m.recip() - step_per_m,
        finer_per_m,
        2 * FINER + 1,
    )
}

impl Wave {
    /// Whether it is most of what is missed, an energy, and no accident.
    pub fn explains(&self, missed: f64) -> bool {
        self.gain > 2.0 * (CHANCE * self.tried).ln() && self.gain > OF_A_WAVE * missed
    }

    pub fn amplitude_m(&self) -> f64 {
        self.sizes.norm()
    }

    /// What a position is off by, m.
    pub fn at_m(&self, position_m: f64) -> f64 {
        let (sine, cosine) = (TAU * position_m / self.period_m).sin_cos();
        self.sizes.x * cosine + self.sizes.y * sine
    }

    pub fn in_words(self) -> String {
        format!(
            "periodic: amplitude {} µm, wavelength {} mm",
            plain(1e6 * self.amplitude_m(), 2),
            plain(1e3 * self.period_m, 3)
        )
    }
}
