//! Thins long series so that what is drawn stays the same.
//!
//! The range of a series is cut into buckets about as wide as a pixel. Of each
//! bucket the first, lowest, highest and last point are kept (the "M4"
//! aggregation, Jugel et al., VLDB 2014): a line through them covers the same
//! pixels as the line through all points, and no extreme is ever lost. Buckets
//! divide the x range on the scale of the axis, so that the first decade of a
//! spectrum keeps its points; where x does not ascend (phase portraits) they
//! divide the sequence, and the extremes of x are kept as well.
//!
//! Limits: between kept points nothing is known, so a strongly magnified view
//! of a thinned series shows an envelope. A gap (a value that is not finite)
//! stays a gap, several gaps in one bucket may become one.

/// One point of a curve: x and y.
pub type Point = (f64, f64);

/// One point of a band: x, lower and upper bound.
pub type BandPoint = (f64, f64, f64);

/// Kept of every bucket: first, last, lowest, highest and one gap; where x
/// does not ascend also leftmost and rightmost.
const KEPT_PER_BUCKET: usize = 5;
const KEPT_PER_UNORDERED_BUCKET: usize = 7;

/// At most `budget` of the points (never fewer than one bucket's), extremes kept.
pub fn series(points: &[Point], budget: usize, logarithmic_x: bool) -> Vec<Point> {
    if points.len() <= budget {
        return points.to_vec();
    }
    let abscissae: Vec<f64> = points.iter().map(|point| point.0).collect();
    let ordered = ascends(&abscissae);
    let kept_per_bucket = if ordered {
        KEPT_PER_BUCKET
    } else {
        KEPT_PER_UNORDERED_BUCKET
    };
    buckets(&abscissae, budget / kept_per_bucket, logarithmic_x)
        .flat_map(|range| keep(&points[range], ordered))
        .collect()
}

/// The points at which a held value changes, and the last one: nothing is lost.
pub fn changes(points: &[Point]) -> Vec<Point> {
    let last = points.len().saturating_sub(1);
    let is_kept = |(place, point): &(usize, &Point)| {
        let before = place.checked_sub(1).map(|before| points[before].1);
        let changes = before.is_none_or(|before| before.to_bits() != point.1.to_bits());
        changes || *place == last
    };
    let kept = points.iter().enumerate().filter(is_kept);
    kept.map(|(_, point)| *point).collect()
}

/// At most `budget` points of a band: the envelope of every bucket.
pub fn band(points: &[BandPoint], budget: usize, logarithmic_x: bool) -> Vec<BandPoint> {
    if points.len() <= budget {
        return points.to_vec();
    }
    let abscissae: Vec<f64> = points.iter().map(|point| point.0).collect();
    buckets(&abscissae, budget, logarithmic_x)
        .map(|range| envelope(&points[range]))
        .collect()
}

/// Whether x never falls; what is not finite counts as falling.
pub fn ascends(abscissae: &[f64]) -> bool {
    abscissae.iter().all(|x| x.is_finite()) && abscissae.is_sorted()
}

/// Consecutive index ranges, one per bucket that holds any point.
fn buckets(
    abscissae: &[f64],
    count: usize,
    logarithmic_x: bool,
) -> impl Iterator<Item = std::ops::Range<usize>> {
    let positions = bucket_of_each(abscissae, count.max(1), logarithmic_x);
    let mut start = 0;
    std::iter::from_fn(move || {
        let bucket = *positions.get(start)?;
        let length = positions[start..]
            .iter()
            .take_while(|other| **other == bucket)
            .count();
        let range = start..start + length;
        start = range.end;
        Some(range)
    })
}

fn bucket_of_each(abscissae: &[f64], count: usize, logarithmic_x: bool) -> Vec<usize> {
    let length = abscissae.len();
    if !ascends(abscissae) {
        return (0..length).map(|index| index * count / length).collect();
    }
    // A logarithmic axis shows only what is positive: the rest shares a bucket.
    let smallest_shown = abscissae.iter().copied().find(|x| *x > 0.0).unwrap_or(1.0);
    let scale = |x: f64| {
        if logarithmic_x {
            x.max(smallest_shown).ln()
        } else {
            x
        }
    };
    let first = abscissae.first().copied().map_or(0.0, scale);
    let last = abscissae.last().copied().map_or(0.0, scale);
    let per_unit = if last > first {
        count as f64 / (last - first)
    } else {
        0.0
    };
    let bucket = |x: &f64| (((scale(*x) - first) * per_unit) as usize).min(count - 1);
    abscissae.iter().map(bucket).collect()
}

/// The points of one bucket that stay, in their order.
fn keep(bucket: &[Point], ordered: bool) -> Vec<Point> {
    let finite = || {
        bucket
            .iter()
            .enumerate()
            .filter(|(_, (x, y))| x.is_finite() && y.is_finite())
    };
    let y_of = |entry: &(usize, &Point)| entry.1.1;
    let x_of = |entry: &(usize, &Point)| entry.1.0;
    let mut kept = vec![
        finite().next(),
        finite().min_by(|a, b| y_of(a).total_cmp(&y_of(b))),
        finite().max_by(|a, b| y_of(a).total_cmp(&y_of(b))),
        finite().next_back(),
        bucket
            .iter()
            .enumerate()
            .find(|(_, (x, y))| !(x.is_finite() && y.is_finite())),
    ];
    if !ordered {
        kept.push(finite().min_by(|a, b| x_of(a).total_cmp(&x_of(b))));
        kept.push(finite().max_by(|a, b| x_of(a).total_cmp(&x_of(b))));
    }
    let mut indices: Vec<usize> = kept.into_iter().flatten().map(|(index, _)| index).collect();
    indices.sort_unstable();
    indices.dedup();
    indices.into_iter().map(|index| bucket[index]).collect()
}

/// `f64::min` and `max` pass over what is not a number; infinities are left
/// for the page to show as a gap.
fn envelope(bucket: &[BandPoint]) -> BandPoint {
    let lower = bucket.iter().map(|point| point.1).fold(f64::NAN, f64::min);
    let upper = bucket.iter().map(|point| point.2).fold(f64::NAN, f64::max);
    (bucket[bucket.len() / 2].0, lower, upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wave(count: usize) -> Vec<Point> {
        (0..count)
            .map(|index| (index as f64 * 1e-3, (index as f64 * 0.01).sin()))
            .collect()
    }

    #[test]
    fn regress_single_spikes_survive() {
        let mut points = wave(40_000);
        points[12_345].1 = 99.0;
        points[31_001].1 = -99.0;
        let thin = series(&points, 3_000, false);
        assert!(thin.len() <= 3_000 && thin.len() > 1_000);
        assert!(thin.contains(&points[12_345]) && thin.contains(&points[31_001]));
        assert_eq!(thin.first(), points.first());
        assert_eq!(thin.last(), points.last());
    }

    #[test]
    fn regress_a_spectrum_keeps_its_first_decade() {
        let points: Vec<Point> = (1..=40_000).map(|index| (f64::from(index), 1.0)).collect();
        let low = |thin: Vec<Point>| thin.iter().filter(|point| point.0 <= 100.0).count();
        assert!(low(series(&points, 3_000, true)) >= 90);
        assert!(low(series(&points, 3_000, false)) < 20);
    }

    #[test]
    fn regress_gaps_stay_gaps() {
        let mut points = wave(10_000);
        points[5_000].1 = f64::NAN;
        points[7_000].1 = f64::INFINITY;
        let gaps = series(&points, 1_000, false)
            .iter()
            .filter(|point| !point.1.is_finite())
            .count();
        assert_eq!(gaps, 2);
    }

    #[test]
    fn regress_a_band_keeps_its_envelope() {
        let mut points: Vec<BandPoint> = (0..10_000).map(|i| (f64::from(i), -1.0, 1.0)).collect();
        points[777].2 = 8.0;
        points[778].1 = f64::NAN;
        let thin = band(&points, 500, false);
        assert!(thin.len() <= 500);
        assert!(thin.iter().any(|point| point.2 > 7.9));
        assert!(thin.iter().all(|point| point.1 < -0.9));
    }

    proptest! {
        #[test]
        fn prop_extremes_and_budget_hold(
            values in prop::collection::vec(-1e6..1e6_f64, 1..4_000),
            budget in 10_usize..500,
            ordered: bool,
        ) {
            let x = |index: usize| if ordered { index as f64 } else { (index as f64 * 0.7).cos() };
            let points: Vec<Point> =
                values.iter().enumerate().map(|(index, y)| (x(index), *y)).collect();
            let thin = series(&points, budget, false);
            prop_assert!(thin.len() <= budget.max(KEPT_PER_UNORDERED_BUCKET));
            let extremes = |points: &[Point]| {
                let y = points.iter().map(|point| point.1);
                let x = points.iter().map(|point| point.0);
                (
                    (y.clone().fold(f64::NAN, f64::min), y.fold(f64::NAN, f64::max)),
                    (x.clone().fold(f64::NAN, f64::min), x.fold(f64::NAN, f64::max)),
                )
            };
            prop_assert_eq!(extremes(&thin), extremes(&points));
        }
    }
}
