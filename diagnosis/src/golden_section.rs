//! The least of a function of one number.

/// The place of the least of a function with one valley, to this part of the interval, by golden
/// section.
pub(crate) fn least_within(
    (mut from, mut to): (f64, f64),
    tolerance: f64,
    cost: impl Fn(f64) -> f64,
) -> f64 {
    const SECTION: f64 = 0.618_033_988_749_894_9;
    let tolerance = tolerance * (to - from);
    let (mut left, mut right) = (to - SECTION * (to - from), from + SECTION * (to - from));
    let (mut at_left, mut at_right) = (cost(left), cost(right));
    while to - from > tolerance {
        if at_left <= at_right {
            (to, right, at_right) = (right, left, at_left);
            left = to - SECTION * (to - from);
            at_left = cost(left);
        } else {
            (from, left, at_left) = (left, right, at_right);
            right = from + SECTION * (to - from);
            at_right = cost(right);
        }
    }
    0.5 * (from + to)
}
