//! When an effect is there: spans of time in each recording.
//!
//! An effect that begins in mid-recording (a seal that tears, a fitting that
//! works loose) or comes and goes is the same effect in a part of the time. Its
//! law is run with it inside the spans and without it outside; the state goes on
//! from one to the other.

use crate::laws::Track;
use crate::rig::Rig;
use std::ops::Range;

/// An effect and when it is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Presence {
    /// The effect.
    pub effect: &'static str,
    /// Begins and ends of it in each recording, s; none where it is not there.
    pub spans_s: Vec<Vec<(f64, f64)>>,
}

/// A span more must bring this part of the gain of the best one, else noise is one; and a rest
/// between two parts of a span must lose as much to cut it.
const WORTH_A_SPAN: f64 = 0.2;

impl Presence {
    /// In no recording.
    pub fn nowhere(effect: &'static str, recordings: usize) -> Self {
        Self {
            effect,
            spans_s: vec![Vec::new(); recordings],
        }
    }

    /// In every recording over that one span of it in which `gain` (one number per
    /// recording and row) has its largest sum.
    pub fn of_largest_gain(
        effect: &'static str,
        tracks: &[Track<'_>],
        gain: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let best = |recording: usize, gain: &dyn Fn(usize) -> f64| {
            vec![largest_sum(tracks[recording].len(), gain).0]
        };
        Self::of_rows(effect, tracks, gain, best)
    }

    /// The same over as many spans as are worth one; one that brings less than `least` (a number
    /// per recording) is none.
    pub fn of_gains(
        effect: &'static str,
        tracks: &[Track<'_>],
        gain: impl Fn(usize, usize) -> f64,
        least: impl Fn(usize) -> f64,
    ) -> Self {
        let best = |recording: usize, gain: &dyn Fn(usize) -> f64| {
            let rows = tracks[recording].len();
            let (single, sum) = largest_sum(rows, gain);
            if sum <= least(recording) {
                return Vec::new();
            }
            let several = largest_sums(rows, gain, least(recording).max(WORTH_A_SPAN * sum));
            if several.len() > 1 {
                several
            } else {
                vec![single]
            }
        };
        Self::of_rows(effect, tracks, gain, best)
    }

    fn of_rows(
        effect: &'static str,
        tracks: &[Track<'_>],
        gain: impl Fn(usize, usize) -> f64,
        best: impl Fn(usize, &dyn Fn(usize) -> f64) -> Vec<Range<usize>>,
    ) -> Self {
        let spans = |(recording, track): (usize, &Track<'_>)| {
            let time_s = &track.recording.time_s;
            let at = |row: usize| time_s.get(row).copied().unwrap_or(f64::INFINITY);
            let mut rows = best(recording, &|row| gain(recording, row));
            rows.retain(|rows| !rows.is_empty());
            let span = |rows: Range<usize>| (at(rows.start), at(rows.end));
            rows.into_iter().map(span).collect()
        };
        Self {
            effect,
            spans_s: tracks.iter().enumerate().map(spans).collect(),
        }
    }

    /// The stretches of rows of a recording in which it is there, one after another.
    pub fn rows(&self, recording: usize, time_s: &[f64]) -> Vec<Range<usize>> {
        let row = |at: f64| time_s.partition_point(|&time| time < at);
        let spans = self.spans_s.get(recording).into_iter().flatten();
        let mut rows: Vec<Range<usize>> = spans.map(|&(from, to)| row(from)..row(to)).collect();
        rows.sort_by_key(|rows| rows.start);
        let mut apart: Vec<Range<usize>> = Vec::with_capacity(rows.len());
        for rows in rows.into_iter().filter(|rows| !rows.is_empty()) {
            match apart.last_mut() {
                Some(last) if rows.start <= last.end => last.end = last.end.max(rows.end),
                _ => apart.push(rows),
            }
        }
        apart
    }

    /// The part of all rows in which it is there.
    pub fn share(&self, tracks: &[Track<'_>]) -> f64 {
        let rows: usize = tracks.iter().map(Track::len).sum();
        let there = tracks.iter().enumerate().flat_map(|(recording, track)| {
            let stretches = self.rows(recording, &track.recording.time_s);
            stretches.into_iter().map(|rows| rows.len())
        });
        there.sum::<usize>() as f64 / rows.max(1) as f64
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

/// Each of the spans of a recording moved to where a cost is least.
pub fn refined_each(
    spans_s: &[(f64, f64)],
    cost: impl Fn(&[(f64, f64)]) -> f64,
) -> Vec<(f64, f64)> {
    let mut best = spans_s.to_vec();
    for index in 0..best.len() {
        let with = |span_s: (f64, f64)| {
            let mut moved = best.clone();
            moved[index] = span_s;
            moved
        };
        best[index] = refined(best[index], |span_s| cost(&with(span_s)));
    }
    best
}

/// Steps by which the ends of a span are moved, s: smaller and smaller.
const STEPS_S: [f64; 5] = [0.2, 0.05, 0.02, 0.005, 0.002];

/// A span moved, end by end, to where a cost is least: a chamber remembers for
/// seconds what came in while the model was the wrong one, so that hundredths of
/// a second show. Steps get smaller; each is taken as long as it helps.
fn refined(span_s: (f64, f64), cost: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
    const MOST_MOVES: usize = 4;
    let (mut best, mut least) = (span_s, cost(span_s));
    for step_s in STEPS_S {
        for (begin_s, end_s) in [(step_s, 0.0), (-step_s, 0.0), (0.0, step_s), (0.0, -step_s)] {
            for _ in 0..MOST_MOVES {
                let Some(moved) = moved(best, begin_s, end_s) else {
                    break;
                };
                let here = cost(moved);
                if here >= least {
                    break;
                }
                (best, least) = (moved, here);
            }
        }
    }
    tightened(best, |moved| cost(moved) <= least)
}

/// A span as short as it may be without a loss: while a carriage rests nothing tells whether an
/// effect is there, and it begins where it shows. One that shows nowhere stays: it may have no
/// end, and would be drawn in for ever.
fn tightened(span_s: (f64, f64), is_as_good: impl Fn((f64, f64)) -> bool) -> (f64, f64) {
    let mut best = span_s;
    if is_as_good((span_s.1, span_s.1)) {
        return best;
    }
    for step_s in STEPS_S {
        for (begin_s, end_s) in [(step_s, 0.0), (0.0, -step_s)] {
            let drawn_in = |best| moved(best, begin_s, end_s).filter(|&moved| is_as_good(moved));
            while let Some(shorter) = drawn_in(best) {
                best = shorter;
            }
        }
    }
    best
}

/// A span with its ends elsewhere; none where nothing is left of it, or it stays as it is.
fn moved(span_s: (f64, f64), begin_s: f64, end_s: f64) -> Option<(f64, f64)> {
    let moved = (span_s.0 + begin_s, span_s.1 + end_s);
    (moved != span_s && moved.0 < moved.1).then_some(moved)
}

/// The range whose sum is the largest, and that (Kadane's algorithm); empty if no sum is
/// above nought. What is no number counts as nought.
fn largest_sum(rows: usize, value: impl Fn(usize) -> f64) -> (Range<usize>, f64) {
    let (mut best, mut best_sum) = (0..0, 0.0);
    let (mut start, mut sum) = (0, 0.0);
    for row in 0..rows {
        sum += finite(value(row));
        if sum > best_sum {
            (best, best_sum) = (start..row + 1, sum);
        }
        if sum <= 0.0 {
            (start, sum) = (row + 1, 0.0);
        }
    }
    (best, best_sum)
}

/// The ranges whose sums, less `toll` for each, come to the most together: from row to row the
/// best that ends outside a range and the best that ends inside one (Bellman).
fn largest_sums(rows: usize, value: impl Fn(usize) -> f64, toll: f64) -> Vec<Range<usize>> {
    let (mut outside, mut inside) = (0.0, f64::NEG_INFINITY);
    // By row: whether the best inside begins there, and whether the best outside ends one there.
    let mut moves = Vec::with_capacity(rows);
    for row in 0..rows {
        let begins = outside - toll > inside;
        let before = inside.max(outside - toll);
        let ends = inside > outside;
        outside = outside.max(inside);
        inside = before + finite(value(row));
        moves.push((begins, ends));
    }
    let (mut ranges, mut end) = (Vec::new(), (inside > outside).then_some(rows));
    for (row, (begins, ends)) in moves.into_iter().enumerate().rev() {
        match end {
            Some(to) if begins => {
                ranges.push(row..to);
                end = None;
            }
            None if ends => end = Some(row),
            _ => {}
        }
    }
    ranges.reverse();
    ranges
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;

    #[test]
    fn val_a_span_is_refined_to_the_least_cost() {
        let cost = |(from, to): (f64, f64)| (from - 1.234).abs() + (to - 5.5_f64).abs().min(9.0);
        let (from, to) = refined((1.0, 5.0), cost);
        assert!(
            (from - 1.234).abs() < 3e-3 && (to - 5.5).abs() < 3e-3,
            "{from} {to}"
        );
        // Nothing tells from 2.1 to 3.0 whether it is there.
        let flat = |(from, to): (f64, f64)| {
            (from - 2.1).min(0.0).abs() + (from - 3.0).max(0.0) + (to - 5.5_f64).abs().min(9.0)
        };
        let (from, _) = refined((2.5, 5.0), flat);
        assert!((from - 3.0).abs() < 3e-3, "{from}");
        let nowhere = (1.0, f64::INFINITY);
        assert_eq!(refined(nowhere, |_| 1.0), nowhere, "it shows nowhere");
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
        let (found, most) = largest_sum(values.len(), |row| values[row]);
        assert_eq!(found, 2..7);
        assert!((sum(found) - best).abs() < 1e-12 && (most - best).abs() < 1e-12);
        assert!(largest_sum(3, |_| -1.0).0.is_empty());
    }

    /// Against every pair of ranges there is.
    #[test]
    fn val_the_largest_sums_are_those_of_the_best_of_all_pairs() {
        let values = [
            1.0,
            -3.0,
            2.0,
            4.0,
            -5.0,
            0.5,
            3.0,
            -1.0,
            f64::NAN,
            2.5,
            -1.0,
        ];
        let toll = 1.5;
        let worth = |range: &Range<usize>| -> f64 {
            let sum: f64 = values[range.clone()]
                .iter()
                .map(|value| finite(*value))
                .sum();
            sum - toll
        };
        let ends = 0..=values.len();
        let all: Vec<Range<usize>> = ends
            .clone()
            .flat_map(|from| (from + 1..=values.len()).map(move |to| from..to))
            .collect();
        let pairs = all
            .iter()
            .flat_map(|one| all.iter().map(move |other| (one, other)));
        let apart = pairs.filter(|(one, other)| one.end < other.start);
        let best = apart
            .map(|(one, other)| worth(one) + worth(other))
            .fold(0.0, f64::max);
        let found = largest_sums(values.len(), |row| values[row], toll);
        assert_eq!(
            found,
            [2..4, 5..10],
            "the gap between them costs more than a range"
        );
        assert!((found.iter().map(worth).sum::<f64>() - best).abs() < 1e-12);
        assert!(largest_sums(3, |_| -1.0, 0.1).is_empty());
        let whole = largest_sums(3, |_| 1.0, 0.1);
        assert_eq!((whole.len(), whole[0].clone()), (1, 0..3));
    }

    /// A rest in which nothing shows does not cut a span in two, and an effect that goes and
    /// comes back is there twice.
    #[test]
    fn prop_an_effect_that_comes_back_is_there_twice() {
        let recording = Recording::from_signals(
            "r",
            (0..100).map(f64::from).collect(),
            std::collections::BTreeMap::new(),
        );
        let tracks = [Track::new(&recording)];
        let spans = |gain: fn(usize) -> f64| {
            let found = Presence::of_gains("e", &tracks, |_, row| gain(row), |_| 0.0);
            let rows = found.rows(0, &recording.time_s);
            (found.spans_s[0].clone(), rows)
        };
        let (spans_s, rows) = spans(|row| match row {
            10..20 | 60..70 => 1.0,
            30..40 => 0.0,
            _ => -0.4,
        });
        assert_eq!(spans_s, [(10.0, 20.0), (60.0, 70.0)]);
        assert_eq!(rows, [10..20, 60..70]);
        let (spans_s, _) = spans(|row| if (10..50).contains(&row) { 1.0 } else { -0.001 });
        assert_eq!(spans_s, [(10.0, 50.0)]);
        let (spans_s, _) = spans(|row| match row {
            40..45 => -0.1,
            20.. => 1.0,
            _ => -1.0,
        });
        assert_eq!(spans_s, [(20.0, f64::INFINITY)]);
    }

    /// Single rows of noise in recordings without the effect, and a recording in which it shows
    /// little.
    #[test]
    fn prop_an_effect_is_where_it_brings_more_than_its_ends_are_worth() {
        let time_s: Vec<f64> = (0..100).map(f64::from).collect();
        let recording = |name| Recording::from_signals(name, time_s.clone(), [].into());
        let recordings = ["without", "a little", "plain"].map(recording);
        let tracks = recordings.each_ref().map(Track::new);
        let noise = |row: usize| if row.is_multiple_of(7) { 1.0 } else { -0.5 };
        let gain = |at: usize, row: usize| noise(row) + [0.0, 1.0, 5e3][at];
        let found = Presence::of_gains("e", &tracks, gain, |_| 10.0);
        let all = vec![(0.0, f64::INFINITY)];
        assert_eq!(found.spans_s, [vec![], all.clone(), all]);
    }
}
