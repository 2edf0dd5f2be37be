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

/// Sorts by name, then by content: the order in which recordings were typed
/// changes no result.
pub fn sort(recordings: &mut [Recording]) {
    recordings.sort_by(|a, b| a.name.cmp(&b.name).then_with(|| by_content(a, b)));
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
