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

/// A span moved, end by end, to where a cost is least: a chamber remembers for
/// seconds what came in while the model was the wrong one, so that hundredths of
/// a second show. Steps get smaller; each is taken as long as it helps.
pub fn refined(span_s: (f64, f64), cost: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
    const STEPS_S: [f64; 5] = [0.2, 0.05, 0.02, 0.005, 0.002];
    const MOST_MOVES: usize = 4;
    let (mut best, mut least) = (span_s, cost(span_s));
    for step_s in STEPS_S {
        for (begin_s, end_s) in [(step_s, 0.0), (-step_s, 0.0), (0.0, step_s), (0.0, -step_s)] {
            for _ in 0..MOST_MOVES {
                let moved = (best.0 + begin_s, best.1 + end_s);
                if moved == best || moved.1 <= moved.0 {
                    break;
                }
                let here = cost(moved);
                if here >= least {
                    break;
                }
                (best, least) = (moved, here);
            }
        }
    }
    best
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

    #[test]
    fn val_a_span_is_refined_to_the_least_cost() {
        let cost = |(from, to): (f64, f64)| (from - 1.234).abs() + (to - 5.5_f64).abs().min(9.0);
        let (from, to) = refined((1.0, 5.0), cost);
        assert!(
            (from - 1.234).abs() < 3e-3 && (to - 5.5).abs() < 3e-3,
            "{from} {to}"
        );
        let (_, to) = refined((1.0, f64::INFINITY), |(from, _)| (from - 1.1).abs());
        assert!(to.is_infinite(), "an effect that stays");
    }

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
