//! A smooth curve through the points of a table, as a finer table.
//!
//! The area of a real valve bends between the points at which it was measured, and it begins to
//! rise somewhere between the last point that shows the leakage alone and the next. Chords miss
//! both: by 2 % of the area between points a fifth of a volt apart, by 15 % of the leakage at
//! the edge. The curve here is the monotone cubic of Fritsch and Carlson (1980, SIAM J. Numer.
//! Anal. 17) with the slopes of Fritsch and Butland (1984, SIAM J. Sci. Stat. Comput. 5): it
//! goes through every point, and no area falls. From the edge to the next point it is the power
//! of the opening that ends with the slope of that curve.

use super::area_table::{AreaTable, TABLE_CAPACITY};
use crate::real::Real;

/// The most points put between two of the table: three leave a sixteenth of what a chord misses.
const MOST_BETWEEN: usize = 3;
/// The area past the edge rises with this power of the opening at the most.
const MOST_EXPONENT: f64 = 3.0;
/// Nearest that the edge comes to its neighbours, as a part of their distance.
const LEAST_PART: f64 = 0.02;

impl<R: Real> AreaTable<R> {
    /// Lets the area begin to rise at `edge_v`, which is held between the last point with the
    /// leakage alone and the next, and rounds the rest: 0 leaves chords between the points, 1 is
    /// the smooth curve. A table without room for points between its own keeps its chords.
    #[must_use]
    pub fn curved(self, edge_v: Option<R>, roundness: R) -> Self {
        let mut points = self;
        if let Some(edge_v) = edge_v {
            points.move_edge(edge_v);
        }
        if roundness.value() == 0.0 {
            return points;
        }
        points.rounded(roundness)
    }

    /// Number of the last point that has the leakage alone.
    fn edge(&self) -> usize {
        let areas = self.areas_m2();
        let leakage = areas.first().map_or(0.0, |area| area.value());
        let closed = areas.iter().take_while(|area| area.value() <= leakage);
        closed.count().saturating_sub(1)
    }

    fn move_edge(&mut self, edge_v: R) {
        let edge = self.edge();
        let (own_v, next_v) = (self.opening_at(edge), self.opening_at(edge + 1));
        let most_v = next_v - (next_v - own_v) * R::from_f64(LEAST_PART);
        // A table whose area rises from nought on has no edge to move.
        if edge > 0 && next_v > own_v {
            self.set_opening(edge, edge_v.max(own_v).min(most_v));
        }
    }

    fn rounded(&self, roundness: R) -> Self {
        let (edge, last) = (self.edge(), self.last_point());
        let between = (TABLE_CAPACITY - 1 - last) / (last - edge).max(1);
        let between = between.min(MOST_BETWEEN);
        let finer = (0..=last).flat_map(|point| {
            let steps = if point < edge || point == last {
                0
            } else {
                between
            };
            let at = move |step: usize| {
                let part = step as f64 / (steps + 1) as f64;
                self.on_curve(point, part, roundness)
            };
            (0..=steps).map(at)
        });
        let mut table = Self::of_points(finer);
        table.opening_stretch = self.opening_stretch;
        table.area_scale = self.area_scale;
        table
    }

    /// Opening and area at a part of the way from a point to the next.
    fn on_curve(&self, point: usize, part: f64, roundness: R) -> (R, R) {
        let (from_v, to_v) = (self.opening_at(point), self.opening_at(point + 1));
        let (from_m2, to_m2) = (self.point_area(point), self.point_area(point + 1));
        let (width_v, rise_m2) = (to_v - from_v, to_m2 - from_m2);
        let way = R::from_f64(part);
        let bow_m2 = if part <= 0.0 || rise_m2 <= R::ZERO {
            R::ZERO
        } else if point == self.edge() {
            let end = self.slope(point + 1) * width_v / rise_m2;
            rise_m2 * (power(part, end) - way)
        } else {
            let [begin, end] = [point, point + 1].map(|point| self.slope(point) * width_v);
            let left = R::ONE - way;
            way * left * (left * (begin - rise_m2) - way * (end - rise_m2))
        };
        let area_m2 = from_m2 + way * rise_m2 + roundness * bow_m2;
        (from_v + way * width_v, area_m2)
    }

    /// Slope of the curve at a point past the edge, m2/V.
    fn slope(&self, point: usize) -> R {
        let last = self.last_point();
        if point >= last {
            return self.slope_at_end();
        }
        let ((before_v, before), (after_v, after)) = (self.chord(point), self.chord(point + 1));
        if before <= R::ZERO || after <= R::ZERO {
            return R::ZERO;
        }
        let three = R::from_f64(3.0);
        let near_before = after_v + after_v + before_v;
        let near_after = before_v + before_v + after_v;
        three * (before_v + after_v) / (near_before / before + near_after / after)
    }

    /// Slope of the parabola through the last three points, as far as no area falls.
    fn slope_at_end(&self) -> R {
        let last = self.last_point();
        let (end_v, end) = self.chord(last);
        if last < 2 {
            return end;
        }
        let (before_v, before) = self.chord(last - 1);
        let parabola = ((end_v + end_v + before_v) * end - end_v * before) / (end_v + before_v);
        parabola.max(R::ZERO).min(end * R::from_f64(3.0))
    }

    /// Width, V, and slope, m2/V, of the chord that ends at a point.
    fn chord(&self, end: usize) -> (R, R) {
        let begin = end.saturating_sub(1);
        let width_v = self.opening_at(end) - self.opening_at(begin);
        let rise_m2 = self.point_area(end) - self.point_area(begin);
        (width_v, rise_m2 / width_v)
    }
}

/// `part` to the power of `exponent`, which is held to where an orifice that opens has it: in
/// proportion to its width, or to the square of it.
fn power<R: Real>(part: f64, exponent: R) -> R {
    let exponent = exponent.max(R::ONE).min(R::from_f64(MOST_EXPONENT));
    R::from_f64(part).powf(exponent)
}
