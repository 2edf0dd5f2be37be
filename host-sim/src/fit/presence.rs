//! When an effect is there: one span of time in each recording.
//!
//! An effect that begins in mid-recording (a seal that tears, a fitting that
//! works loose) or comes and goes is the same effect in a part of the time. Its
//! law is run with it inside the span and without it outside; the state goes on
//! from one to the other.

use crate::laws::Track;
use crate::rig::Rig;
use std::ops::Range;

/// An effect and when it is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Presence {
    /// The effect.
    pub effect: &'static str,
    /// Begin and end of it in each recording, s; equal where it is not there.
    pub spans_s: Vec<(f64, f64)>,
}

impl Presence {
    /// In no recording.
    pub fn nowhere(effect: &'static str, recordings: usize) -> Self {
        Self {
            effect,
            spans_s: vec![(0.0, 0.0); recordings],
        }
    }

    /// In every recording over that span of it in which `gain` (one number per
    /// recording and row) has its largest sum.
    pub fn of_largest_gain(
        effect: &'static str,
        tracks: &[Track<'_>],
        gain: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let span = |(recording, track): (usize, &Track<'_>)| {
            let rows = largest_sum(track.len(), |row| gain(recording, row));
            let time_s = &track.recording.time_s;
            let at = |row: usize| time_s.get(row).copied();
            match (at(rows.start), at(rows.end)) {
                (Some(from), Some(to)) => (from, to),
                (Some(from), None) if !rows.is_empty() => (from, f64::INFINITY),
                _ => (0.0, 0.0),
            }
        };
        Self {
            effect,
            spans_s: tracks.iter().enumerate().map(span).collect(),
        }
    }

    /// The rows of a recording in which it is there.
    pub fn rows(&self, recording: usize, time_s: &[f64]) -> Range<usize> {
        let (from, to) = self.spans_s.get(recording).copied().unwrap_or((0.0, 0.0));
        let row = |at: f64| time_s.partition_point(|&time| time < at);
        row(from)..row(to)
    }

    /// The part of all rows in which it is there.
    pub fn share(&self, tracks: &[Track<'_>]) -> f64 {
        let rows: usize = tracks.iter().map(Track::len).sum();
        let there = tracks.iter().enumerate();
        let there: usize = there
            .map(|(recording, track)| self.rows(recording, &track.recording.time_s).len())
            .sum();
        there as f64 / rows.max(1) as f64
    }

    /// The rig where the effect is not there, and which keys are its own.
    pub(super) fn rig_without(&self, rig: &Rig) -> Rig {
        let mut without = rig.clone();
        without.effects.remove(self.effect);
        without
    }

    /// Whether a parameter is one of the effect's.
    pub(super) fn owns(&self, key: &str) -> bool {
        key.strip_prefix("effects.")
            .and_then(|rest| rest.strip_prefix(self.effect))
            .is_some_and(|rest| rest.starts_with('.'))
    }
}

/// The range whose sum is the largest (Kadane's algorithm); empty if no sum is
/// above nought. What is no number counts as nought.
fn largest_sum(rows: usize, value: impl Fn(usize) -> f64) -> Range<usize> {
    let (mut best, mut best_sum) = (0..0, 0.0);
    let (mut start, mut sum) = (0, 0.0);
    for row in 0..rows {
        let here = value(row);
        sum += if here.is_finite() { here } else { 0.0 };
        if sum > best_sum {
            (best, best_sum) = (start..row + 1, sum);
        }
        if sum <= 0.0 {
            (start, sum) = (row + 1, 0.0);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against every range there is.
    #[test]
    fn val_the_largest_sum_is_that_of_the_best_of_all_ranges() {
        let values = [1.0, -3.0, 2.0, f64::NAN, 2.0, -1.0, 3.0, -9.0, 4.0];
        let sum = |range: Range<usize>| -> f64 {
            values[range].iter().filter(|value| value.is_finite()).sum()
        };
        let all = (0..values.len()).flat_map(|from| (from..=values.len()).map(move |to| from..to));
        let best = all.map(sum).fold(0.0, f64::max);
        let found = largest_sum(values.len(), |row| values[row]);
        assert_eq!(found, 2..7);
        assert!((sum(found) - best).abs() < 1e-12);
        assert!(largest_sum(3, |_| -1.0).is_empty());
    }
}
