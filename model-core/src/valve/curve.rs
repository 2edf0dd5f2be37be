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
/// An area within this part of the leakage is the leakage: two deviations of a measured flow.
const LEAKAGE_KNOWN_TO: f64 = 0.1;
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

    /// The path opens by so much later, V: every point past the first moves, as far as the
    /// openings go on to rise.
    #[must_use]
    pub fn later(self, shift_v: R) -> Self {
        let mut moved = self;
        let mut before_v = R::ZERO;
        for point in 1..=self.last_point() {
            let own_v = self.opening_at(point);
            let least_v = before_v + (own_v - self.opening_at(point - 1)) * R::from_f64(LEAST_PART);
            before_v = (own_v + shift_v).max(least_v);
            moved.set_opening(point, before_v);
        }
        moved
    }

    /// Between which openings of the table the areas begin to rise, V; `None` of one whose areas
    /// never rise. A table whose second point lets more through than the first says no more than
    /// that the edge lies between the two.
    pub fn edge_between_v(&self) -> Option<(R, R)> {
        let edge = self.edge();
        let (own_v, next_v) = (self.opening_at(edge), self.opening_at(edge + 1));
        (next_v > own_v).then_some((own_v, next_v))
    }

    /// Where the areas begin to rise as the next two points have it, V: their chord meets the
    /// leakage there, or leaves the gap. A curve that bends up past its edge begins before, one
    /// that bends down after.
    pub fn edge_by_chord_v(&self) -> Option<R> {
        let (own_v, next_v) = self.edge_between_v()?;
        let next = self.edge() + 1;
        if next == self.last_point() {
            return Some(R::from_f64(0.5) * (own_v + next_v));
        }
        let rise_m2 = self.point_area(next) - self.point_area(self.edge());
        let (_, slope) = self.chord(next + 1);
        if slope <= R::ZERO {
            return Some(own_v);
        }
        Some((next_v - rise_m2 / slope).max(own_v))
    }

    /// Number of the last point that has the leakage alone.
    fn edge(&self) -> usize {
        let areas = self.areas_m2();
        let leakage = areas.first().map_or(0.0, |area| area.value());
        let is_closed = |area: &&R| area.value() <= leakage * (1.0 + LEAKAGE_KNOWN_TO);
        let closed = areas.iter().take_while(is_closed);
        closed.count().saturating_sub(1)
    }

    fn move_edge(&mut self, edge_v: R) {
        let Some((own_v, next_v)) = self.edge_between_v() else {
            return;
        };
        let edge = self.edge();
        let near_v = (next_v - own_v) * R::from_f64(LEAST_PART);
        let most_v = next_v - near_v;
        if edge > 0 {
            return self.set_opening(edge, edge_v.max(own_v).min(most_v));
        }
        // The first point stays, and what flows at it flows up to the edge.
        let leakage_m2 = self.point_area(edge);
        self.insert_point(edge_v.max(own_v + near_v).min(most_v), leakage_m2);
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

#[cfg(test)]
mod tests {
    use super::*;

    const OPENINGS_V: [f64; 9] = [0.0, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0, 3.5, 5.0];
    const EDGE_V: f64 = 0.24;

    /// A valve that opens at [`EDGE_V`] by a power of a sine.
    fn area_m2(opening_v: f64, exponent: f64) -> f64 {
        let part = ((opening_v - EDGE_V) / (5.0 - EDGE_V)).clamp(0.0, 1.0);
        let quarter = 0.5 * core::f64::consts::PI;
        1e-7 + 17e-6 * libm::pow(libm::sin(quarter * part), exponent)
    }

    fn table(exponent: f64) -> AreaTable<f64> {
        let areas_m2 = OPENINGS_V.map(|opening_v| area_m2(opening_v, exponent));
        AreaTable::new(&OPENINGS_V, &areas_m2).unwrap()
    }

    /// What a table misses of the curve at the most, as a part of its area.
    fn missed(table: &AreaTable<f64>, exponent: f64) -> f64 {
        let openings_v = (0..500).map(|step| 0.01 * f64::from(step));
        let off = |opening_v: f64| {
            let truth_m2 = area_m2(opening_v, exponent);
            (table.area_m2(opening_v) / truth_m2 - 1.0).abs()
        };
        openings_v.map(off).fold(0.0, f64::max)
    }

    #[test]
    fn val_nine_points_and_the_edge_give_a_smooth_curve() {
        for exponent in [1.1, 1.25, 1.5] {
            let chords = table(exponent);
            let curve = chords.curved(Some(EDGE_V), 1.0);
            let (before, after) = (missed(&chords, exponent), missed(&curve, exponent));
            assert!(after < 0.2 * before, "{exponent}: {before} to {after}");
            assert!(after < 0.05, "{exponent}: {after}");
        }
    }

    #[test]
    fn prop_a_path_that_opens_later_has_the_areas_of_less_opening() {
        let table = table(1.25).curved(Some(EDGE_V), 1.0);
        for shift_v in [-0.02, 0.0, 0.03] {
            let later = table.later(shift_v);
            for opening_v in [0.0, 0.1, 0.25, 0.5, 2.0, 4.9] {
                let apart_m2 = later.area_m2(opening_v) - table.area_m2(opening_v - shift_v);
                assert!(apart_m2.abs() < 1e-16, "{shift_v} at {opening_v}");
            }
        }
        let openings_v = table.later(-9.0);
        let openings_v = openings_v.openings_v();
        assert!(openings_v.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn prop_points_are_met_no_area_falls_and_nought_changes_nothing() {
        let chords = table(1.25);
        assert_eq!(chords.curved(None, 0.0), chords);
        for roundness in [0.3, 1.0] {
            let curve = chords.curved(None, roundness);
            for opening_v in OPENINGS_V {
                let apart_m2 = curve.area_m2(opening_v) - chords.area_m2(opening_v);
                assert!(apart_m2.abs() < 1e-18, "{opening_v}");
            }
            let areas_m2 = curve.areas_m2();
            assert!(areas_m2.windows(2).all(|pair| pair[0] <= pair[1]));
            assert!(areas_m2.len() <= TABLE_CAPACITY);
        }
    }

    #[test]
    fn prop_an_edge_stays_in_its_gap_and_a_full_table_keeps_its_chords() {
        let (from_v, to_v) = table(1.25).edge_between_v().unwrap();
        assert!((from_v - 0.2).abs() < 1e-12 && (to_v - 0.3).abs() < 1e-12);
        for edge_v in [-1.0, 0.25, 9.0] {
            let curve = table(1.25).curved(Some(edge_v), 1.0);
            assert!(curve.openings_v().windows(2).all(|pair| pair[0] < pair[1]));
        }
        let openings_v: [f64; TABLE_CAPACITY] = core::array::from_fn(|point| 0.1 * point as f64);
        let areas_m2 = openings_v.map(|opening_v| area_m2(opening_v, 1.25));
        let full = AreaTable::<f64>::new(&openings_v, &areas_m2).unwrap();
        assert_eq!(full.curved(None, 1.0), full);
        let level = AreaTable::<f64>::new(&[0.0, 1.0], &[1e-8, 1e-8]).unwrap();
        assert_eq!(level.edge_between_v(), None);
        assert_eq!(level.curved(Some(0.5), 0.0), level);
    }

    /// Nine points of which the second lets more through than the leakage.
    #[test]
    fn val_an_edge_before_the_second_point_is_a_point_of_its_own() {
        let openings_v = [0.0, 0.3, 0.4, 0.6, 1.0, 2.0, 3.5, 5.0];
        let areas_m2 = openings_v.map(|opening_v| area_m2(opening_v, 1.25));
        let chords = AreaTable::<f64>::new(&openings_v, &areas_m2).unwrap();
        assert_eq!(chords.edge_between_v(), Some((0.0, 0.3)));
        let curve = chords.curved(Some(EDGE_V), 1.0);
        assert!(missed(&chords, 1.25) > 1.0);
        assert!(missed(&curve, 1.25) < 0.05, "{}", missed(&curve, 1.25));
        for edge_v in [-1.0, 0.0, 0.1, 0.29, 9.0] {
            let curve = chords.curved(Some(edge_v), 0.0);
            assert!(curve.openings_v().windows(2).all(|pair| pair[0] < pair[1]));
            for opening_v in openings_v {
                let apart_m2 = curve.area_m2(opening_v) - chords.area_m2(opening_v);
                assert!(apart_m2.abs() < 1e-18, "{opening_v}");
            }
        }
    }

    #[test]
    fn val_the_chord_past_the_gap_finds_the_edge_of_a_straight_curve() {
        fn straight<const N: usize>(edge_v: f64, openings_v: [f64; N]) -> f64 {
            let area = |opening_v: f64| 1e-8 + 4e-6 * (opening_v - edge_v).max(0.0);
            let table = AreaTable::<f64>::new(&openings_v, &openings_v.map(area)).unwrap();
            table.edge_by_chord_v().unwrap()
        }
        assert!((straight(0.13, [0.0, 0.2, 0.5, 5.0]) - 0.13).abs() < 1e-12);
        assert!((straight(0.27, [0.0, 0.2, 0.5, 1.0]) - 0.27).abs() < 1e-12);
        assert!((straight(-0.4, [0.0, 0.2, 0.5]) - 0.0).abs() < 1e-12);
        assert!((straight(0.4, [0.0, 1.0]) - 0.5).abs() < 1e-12);
    }
}
