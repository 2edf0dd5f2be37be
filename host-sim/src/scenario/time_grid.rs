//! Times as decimals: so many steps add up to what a person wrote.

/// Times are decimals: rounding to this many parts of a second undoes what
/// sums and products of them add, so that 0.1 s + 0.2 s is 0.3 s.
const TIME_GRID_PER_S: f64 = 1e12;

/// The time to the nearest part of the grid of decimals.
pub(crate) fn on_time_grid(time_s: f64) -> f64 {
    (time_s * TIME_GRID_PER_S).round() / TIME_GRID_PER_S
}
