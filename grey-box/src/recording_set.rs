//! Recordings that are given together: an order that does not depend on how
//! they were typed, and rows that two of them share.

use std::cmp::Ordering;
use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::recording::Recording;

/// Rows in a row that make two recordings the same measurement. Of noisy
/// channels a few rows would do; a lone gauge of 12 bits repeats short patterns
/// by chance.
const SHARED_ROWS: usize = 50;
/// Of those, rows that differ from the one before: a rest repeats itself.
const CHANGING_ROWS: usize = 10;

/// Of the variance of two independent readings of one quantity, the part that two exports of one
/// measurement may differ by. Rounding to a step of the noise itself leaves 1/24 of it (step
/// squared over twelve against twice the noise); another measurement leaves all of it.
const REWORKED_PART: f64 = 0.05;
/// Pairs of rows from which a variance is told from twenty times as much.
const LEAST_PAIRS: usize = 100;
/// Stamps closer than this part of a step are one row: exports round their stamps.
const SAME_STAMP_STEPS: f64 = 0.1;

/// Sorts by name, then by content: the order in which recordings were typed
/// changes no result.
pub fn sort(recordings: &mut [Recording]) {
    recordings.sort_by(|a, b| a.name.cmp(&b.name).then_with(|| by_content(a, b)));
}

/// The same recordings, sorted.
pub fn sorted(mut recordings: Vec<Recording>) -> Vec<Recording> {
    sort(&mut recordings);
    recordings
}

fn by_content(a: &Recording, b: &Recording) -> Ordering {
    let columns = |one: &Recording| -> Vec<Vec<u64>> {
        let bits = |column: &Vec<f64>| column.iter().map(|value| value.to_bits()).collect();
        std::iter::once(&one.time_s)
            .chain(one.signals.values())
            .map(bits)
            .collect()
    };
    columns(a).cmp(&columns(b))
}

/// The line in `b` at which a stretch begins that stands in `a` too, whatever
/// the files are called and whenever the clock of either was started. Signals
/// that only one of the two holds do not count.
pub fn shared_stretch(a: &Recording, b: &Recording) -> Option<u32> {
    let common: Vec<&str> = a
        .signals
        .keys()
        .filter(|name| b.signals.contains_key(*name))
        .map(String::as_str)
        .collect();
    if common.is_empty() {
        return None;
    }
    let of_a: HashSet<u64> = stretches(a, &common).map(|(_, hash)| hash).collect();
    let shared = stretches(b, &common).find(|(_, hash)| of_a.contains(hash))?;
    b.line.get(shared.0).copied()
}

/// The line in `b` from which on it is the measurement of `a` written anew: thinned, rounded, in
/// other units or with its clock set to nought. Its sensor noise tells: two measurements of one
/// motion differ by the noise of both, two exports of one measurement by next to nothing.
pub fn reworked_stretch(a: &Recording, b: &Recording) -> Option<u32> {
    let starts_s = a.time_s.first().zip(b.time_s.first())?;
    let clocks = [0.0, starts_s.0 - starts_s.1];
    let pairs = |later_s: f64| same_stamps(&a.time_s, &b.time_s, later_s);
    let pairs = clocks.map(pairs).into_iter();
    let first = pairs
        .filter(|pairs| has_one_noise(a, b, pairs))
        .filter_map(|pairs| Some(pairs.first()?.1));
    first.min().and_then(|row| b.line.get(row).copied())
}

/// Rows of two clocks with the same stamp, that of the second put later.
fn same_stamps(a_s: &[f64], b_s: &[f64], later_s: f64) -> Vec<(usize, usize)> {
    let step_s = match (a_s, b_s) {
        ([a0, .., a1], [b0, .., b1]) => {
            let steps = |from: f64, to: f64, rows: usize| (to - from) / (rows - 1) as f64;
            steps(*a0, *a1, a_s.len()).min(steps(*b0, *b1, b_s.len()))
        }
        _ => return Vec::new(),
    };
    let within_s = SAME_STAMP_STEPS * step_s;
    let rows = b_s.iter().enumerate();
    let of_a = |(row, stamp): (usize, &f64)| {
        let stamp = stamp + later_s;
        let next = a_s.partition_point(|other| *other < stamp - within_s);
        let found = a_s
            .get(next)
            .is_some_and(|other| *other <= stamp + within_s);
        found.then_some((next, row))
    };
    rows.filter_map(of_a).collect()
}

/// Whether two recordings share the noise of every gauge of which either shows any. A command
/// has none: it repeats itself in every measurement.
fn has_one_noise(a: &Recording, b: &Recording, pairs: &[(usize, usize)]) -> bool {
    if pairs.len() < LEAST_PAIRS {
        return false;
    }
    let gauges = a.signals.keys().filter(|name| *name != "u");
    let mut shares = gauges.filter_map(|name| {
        let (a, b) = (a.signal(name)?, b.signal(name)?);
        let independent = noise_variance(a)? + noise_variance(b)?;
        let differences = pairs
            .iter()
            .map(|&(of_a, of_b)| (a[of_a] - b[of_b]).powi(2));
        let differences: Vec<f64> = differences.filter(|one| one.is_finite()).collect();
        let variance = differences.iter().sum::<f64>() / differences.len().max(1) as f64;
        (independent > 0.0).then_some(variance / independent)
    });
    let mut any = false;
    let all = shares.all(|share| {
        any = true;
        share < REWORKED_PART
    });
    any && all
}

/// Variance of what differs from row to row at random, by the median of the third differences: a
/// motion that the rows resolve leaves none of itself in them, and fewer than half of the rows
/// where it does.
fn noise_variance(column: &[f64]) -> Option<f64> {
    /// Sum of the squares of 1, -3, 3, -1.
    const GAIN: f64 = 20.0;
    /// Median of the square of a normal number of variance one.
    const MEDIAN_SQUARE: f64 = 0.4549;
    let rows = column.windows(4);
    let third = rows.map(|row| (row[3] - 3.0 * (row[2] - row[1]) - row[0]).powi(2));
    let mut squares: Vec<f64> = third.filter(|square| square.is_finite()).collect();
    let middle = squares.len().checked_sub(1)? / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median / (GAIN * MEDIAN_SQUARE))
}

/// The stretches of rows in which something changes: first row and hash.
fn stretches(recording: &Recording, signals: &[&str]) -> impl Iterator<Item = (usize, u64)> {
    /// An odd multiplier of full length, for a polynomial over the rows (Knuth's
    /// for congruential generators).
    const BASE: u64 = 6_364_136_223_846_793_005;
    let rows = row_hashes(recording, signals);
    let oldest = (1..SHARED_ROWS).fold(1_u64, |power, _| power.wrapping_mul(BASE));
    let (mut hash, mut changes) = (0_u64, 0_usize);
    (0..rows.len()).filter_map(move |row| {
        if row >= SHARED_ROWS {
            let gone = row - SHARED_ROWS;
            hash = hash.wrapping_sub(rows[gone].wrapping_mul(oldest));
            changes -= usize::from(rows[gone + 1] != rows[gone]);
        }
        hash = hash.wrapping_mul(BASE).wrapping_add(rows[row]);
        changes += usize::from(row > 0 && rows[row] != rows[row - 1]);
        let first = (row + 1).checked_sub(SHARED_ROWS)?;
        (changes >= CHANGING_ROWS).then_some((first, hash))
    })
}

fn row_hashes(recording: &Recording, signals: &[&str]) -> Vec<u64> {
    let columns: Vec<&[f64]> = signals
        .iter()
        .filter_map(|name| recording.signal(name))
        .collect();
    let hash = |row: usize| {
        let mut hasher = DefaultHasher::new();
        for column in &columns {
            column[row].to_bits().hash(&mut hasher);
        }
        hasher.finish()
    };
    (0..recording.len()).map(hash).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;
    use std::collections::BTreeMap;

    /// Pressure that falls, with noise, on the grid of a gauge of 12 bits.
    fn decay(name: &str, seed: u64) -> Recording {
        let mut noise = Noise::new(seed, 0);
        let time_s: Vec<f64> = (0..2000).map(|row| f64::from(row) * 0.1).collect();
        let grid_pa = 1e6 / 4096.0;
        let pressure = |time_s: &f64| {
            let pressure_pa = 6e5 * (-time_s / 60.0).exp() + 300.0 * noise.normal();
            (pressure_pa / grid_pa).round() * grid_pa
        };
        let p_a: Vec<f64> = time_s.iter().map(pressure).collect();
        Recording::from_signals(name, time_s, BTreeMap::from([("p_a".to_owned(), p_a)]))
    }

    #[test]
    fn prop_a_part_is_found_under_another_name_clock_and_company() {
        let whole = decay("whole.csv", 1);
        let mut part = whole.part(700..900);
        part.name = "copy.csv".into();
        part.time_s.iter_mut().for_each(|time| *time -= 70.0);
        let idle = vec![0.0; part.len()];
        part.signals.insert("x".into(), idle);
        assert_eq!(shared_stretch(&whole, &part), Some(701));
        assert_eq!(shared_stretch(&part, &whole), Some(701));
    }

    #[test]
    fn prop_repeated_experiments_share_nothing() {
        assert_eq!(shared_stretch(&decay("a", 1), &decay("b", 2)), None);
        let mut at_rest = decay("rest", 1);
        for column in at_rest.signals.values_mut() {
            column.fill(1e5);
        }
        assert_eq!(shared_stretch(&at_rest, &at_rest.clone()), None);
    }

    /// The same recording at another rate, grid, unit and clock.
    fn exported(whole: &Recording, stride: usize, grid: f64, later_s: f64) -> Recording {
        let mut copy = whole.thinned(stride);
        copy.name = "export.csv".into();
        copy.time_s.iter_mut().for_each(|time| *time += later_s);
        let readings = copy.signals.values_mut().flatten();
        readings.for_each(|one| *one = (*one / 7.0 / grid).round() * grid * 7.0);
        copy
    }

    #[test]
    fn prop_a_thinned_rounded_or_converted_export_is_the_same_measurement() {
        let whole = decay("whole.csv", 1);
        for (stride, grid, later_s) in [
            (1, 1e-9, 0.0),
            (1, 40.0, 0.0),
            (5, 1e-9, 0.0),
            (3, 20.0, -70.0),
        ] {
            let mut copy = exported(&whole.part(500..2000), stride, grid, 0.0);
            assert_eq!(
                reworked_stretch(&whole, &copy),
                Some(501),
                "{stride} {grid}"
            );
            copy = exported(&whole, stride, grid, later_s);
            assert_eq!(reworked_stretch(&whole, &copy), Some(1), "{stride} {grid}");
            assert_eq!(reworked_stretch(&copy, &whole), Some(1), "{stride} {grid}");
        }
    }

    #[test]
    fn prop_another_measurement_of_the_same_motion_is_another() {
        for seed in 2..20 {
            let (one, other) = (decay("a", 1), decay("b", seed));
            assert_eq!(reworked_stretch(&one, &other), None);
            assert_eq!(
                reworked_stretch(&one, &exported(&other, 2, 40.0, 0.0)),
                None
            );
        }
    }

    #[test]
    fn prop_any_order_is_sorted_into_one() {
        let mut all = [decay("b", 1), decay("a", 2), decay("a", 3)];
        sort(&mut all);
        let sorted = all.clone();
        all.reverse();
        sort(&mut all);
        assert_eq!(all, sorted);
    }
}
