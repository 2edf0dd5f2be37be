//! What windows need of an input: the least of their errors over its size.

use std::ops::Range;

/// One window: its rows and what the prediction is too high by, in units of the
/// noise, all outputs after each other.
pub(super) struct Window {
    pub(super) recording: usize,
    pub(super) rows: Range<usize>,
    pub(super) errors: Vec<f64>,
}

/// What a window needs of an input.
#[derive(Clone, Debug)]
pub(super) struct Need {
    /// By how much it would have to be off, and the deviation of that.
    pub(super) value: f64,
    pub(super) deviation: f64,
    /// Where the errors go with more of it; none where it takes no more.
    pub(super) direction: Option<Vec<f64>>,
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What one window needs of an input, of whose errors at some sizes are known, and what is
/// left of them: the least on the straight lines from each size to the next. How well it is
/// known is told by the flattest line on the way there from nought: a valve that is shut
/// leaks much the same on either side of its dead zone.
pub(super) fn need(sizes: &[f64], errors: &[&[f64]]) -> Option<(Need, Vec<f64>)> {
    let lines = sizes.windows(2).zip(errors.windows(2));
    let lines: Vec<Option<Least>> = lines
        .map(|(sizes, errors)| least_on_line(sizes, errors))
        .collect();
    let known = lines.iter().flatten();
    let least = known.min_by(|a, b| a.energy.total_cmp(&b.energy))?;
    let is_passed = |sizes: &[f64]| match least.need.value {
        above if above > 0.0 => sizes[1] > 0.0 && sizes[0] < above,
        below => sizes[0] < 0.0 && sizes[1] > below,
    };
    let passed = sizes
        .windows(2)
        .zip(&lines)
        .filter(|(sizes, _)| is_passed(sizes));
    let deviations = passed.map(|(_, line)| line.as_ref().map_or(f64::INFINITY, Least::deviation));
    let need = Need {
        deviation: deviations.fold(least.deviation(), f64::max),
        ..least.need.clone()
    };
    Some((need, least.left.clone()))
}

/// The least energy of all windows together, on the straight lines from each size tried to the
/// next.
pub(super) fn least_for_all(tried: &[Vec<Window>]) -> f64 {
    let product = |one: &[Window], other: &[Window]| -> f64 {
        let windows = one.iter().zip(other);
        windows.map(|(a, b)| dot(&a.errors, &b.errors)).sum()
    };
    let on_line = |ends: &[Vec<Window>]| {
        let (from, to) = (product(&ends[0], &ends[0]), product(&ends[1], &ends[1]));
        let between = product(&ends[0], &ends[1]);
        let square = from - 2.0 * between + to;
        let part = ((from - between) / square).clamp(0.0, 1.0);
        let energy = from + 2.0 * part * (between - from) + part * part * square;
        if energy.is_finite() { energy } else { from }
    };
    let lines = tried.windows(2).map(on_line);
    lines.fold(f64::INFINITY, f64::min)
}

/// Where errors are least between two sizes.
pub(super) struct Least {
    pub(super) energy: f64,
    pub(super) need: Need,
    pub(super) left: Vec<f64>,
}

impl Least {
    pub(super) fn deviation(&self) -> f64 {
        self.need.deviation
    }
}

/// None where the errors stay as they are.
pub(super) fn least_on_line(sizes: &[f64], errors: &[&[f64]]) -> Option<Least> {
    let ends = errors[0].iter().zip(errors[1]);
    let across: Vec<f64> = ends.map(|(from, to)| to - from).collect();
    let square = dot(&across, &across);
    let part = (-dot(errors[0], &across) / square).clamp(0.0, 1.0);
    let points = errors[0].iter().zip(&across);
    let left: Vec<f64> = points.map(|(error, step)| error + part * step).collect();
    let energy = dot(&left, &left);
    let length = sizes[1] - sizes[0];
    (square > 0.0 && energy.is_finite()).then(|| Least {
        energy,
        need: Need {
            value: sizes[0] + part * length,
            deviation: length / square.sqrt(),
            direction: (part > 0.0 && part < 1.0).then_some(across),
        },
        left,
    })
}
