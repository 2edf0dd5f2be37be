//! Orifice area over the valve's opening: linear between points.

use crate::real::Real;

/// The most points a table holds. The MPYE's published table has 40.
pub const TABLE_CAPACITY: usize = 48;

/// Openings closer than this are one point, V.
const LEAST_APART_V: f64 = 1e-6;

/// Why a table cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFault {
    /// Fewer than two points, or more than [`TABLE_CAPACITY`].
    Length(usize),
    /// The two columns differ in length.
    LengthsDiffer,
    /// Openings must begin at nought and rise; this point does not.
    OpeningNotRising(usize),
    /// Areas must be finite, not negative and never fall; this point is not so.
    AreaNotRising(usize),
}

/// Area over opening, with a stretch of the openings and a scale of the areas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaTable<R> {
    openings_v: [R; TABLE_CAPACITY],
    areas_m2: [R; TABLE_CAPACITY],
    length: usize,
    /// Factor on every opening of the table.
    pub opening_stretch: R,
    /// Factor on every area of the table.
    pub area_scale: R,
}

impl<R: Real> AreaTable<R> {
    /// A table from openings in V (rising from nought) and areas in m2 (rising
    /// or level; the first is the leakage of the closed path).
    pub fn new(openings_v: &[f64], areas_m2: &[f64]) -> Result<Self, TableFault> {
        let length = openings_v.len();
        if length != areas_m2.len() {
            return Err(TableFault::LengthsDiffer);
        }
        if !(2..=TABLE_CAPACITY).contains(&length) {
            return Err(TableFault::Length(length));
        }
        let mut table = Self {
            length,
            ..Self::closed()
        };
        let mut last_opening = -1.0;
        let mut last_area = 0.0;
        for (point, (&opening, &area)) in openings_v.iter().zip(areas_m2).enumerate() {
            if !(opening.is_finite() && opening > last_opening) || (point == 0 && opening != 0.0) {
                return Err(TableFault::OpeningNotRising(point));
            }
            if !(area.is_finite() && area >= last_area) {
                return Err(TableFault::AreaNotRising(point));
            }
            (last_opening, last_area) = (opening, area);
            table.openings_v[point] = R::from_f64(opening);
            table.areas_m2[point] = R::from_f64(area);
        }
        Ok(table)
    }

    /// A path that is shut tight at every opening.
    pub fn closed() -> Self {
        let mut table = Self {
            openings_v: [R::ZERO; TABLE_CAPACITY],
            areas_m2: [R::ZERO; TABLE_CAPACITY],
            length: 2,
            opening_stretch: R::ONE,
            area_scale: R::ONE,
        };
        table.openings_v[1] = R::ONE;
        table
    }

    /// Gives every point but the first the area of another opening, off by so much, V: what a
    /// valve shows whose spool does not go where it is asked to. Openings at which that bends
    /// become points, as far as there is room. No area falls.
    pub fn open_elsewhere(&mut self, bends_v: &[R], off_by_v: impl Fn(R) -> R) {
        let straight = Self {
            opening_stretch: R::ONE,
            area_scale: R::ONE,
            ..*self
        };
        for &bend_v in bends_v {
            self.insert_point(bend_v, R::ZERO);
        }
        let mut before_m2 = self.areas_m2[0];
        for point in 1..self.length {
            let opening_v = at(&self.openings_v, point);
            let area_m2 = straight.area_m2(opening_v + off_by_v(opening_v));
            before_m2 = area_m2.max(before_m2);
            self.areas_m2[point] = before_m2;
        }
    }

    /// Makes an opening a point of this area, unless one is there or there is no room.
    pub(super) fn insert_point(&mut self, opening_v: R, area_m2: R) {
        let apart_v = R::from_f64(LEAST_APART_V);
        let mut points = self.openings_v().iter();
        let is_there = points.any(|point_v| (*point_v - opening_v).abs() < apart_v);
        if is_there || opening_v <= R::ZERO || self.length == TABLE_CAPACITY {
            return;
        }
        let mut place = self.length;
        while place > 1 && at(&self.openings_v, place - 1) > opening_v {
            self.openings_v[place] = at(&self.openings_v, place - 1);
            self.areas_m2[place] = at(&self.areas_m2, place - 1);
            place -= 1;
        }
        self.openings_v[place] = opening_v;
        self.areas_m2[place] = area_m2;
        self.length += 1;
    }

    /// The openings of the points, V.
    pub fn openings_v(&self) -> &[R] {
        self.openings_v.get(..self.length).unwrap_or(&[])
    }

    /// The areas of the points, m2.
    pub fn areas_m2(&self) -> &[R] {
        self.areas_m2.get(..self.length).unwrap_or(&[])
    }

    /// Area at an opening of nought or more; level beyond the last point.
    #[inline]
    pub fn area_m2(&self, opening_v: R) -> R {
        let stretched = opening_v / self.opening_stretch;
        let last = self.length - 1;
        let area = if stretched <= R::ZERO {
            self.areas_m2[0]
        } else if stretched >= at(&self.openings_v, last) {
            at(&self.areas_m2, last)
        } else {
            let above = self.first_above(&self.openings_v, stretched);
            interpolate(&self.openings_v, &self.areas_m2, above, stretched)
        };
        area * self.area_scale
    }

    /// The opening up to which only the leakage flows, V.
    pub fn edge_v(&self) -> R {
        let mut point = 0;
        while point < self.last_point() && at(&self.areas_m2, point + 1) <= self.areas_m2[0] {
            point += 1;
        }
        self.point_v(point)
    }

    /// Opening of a point before [`Self::opening_stretch`], V; of the last one beyond it.
    pub(super) fn opening_at(&self, point: usize) -> R {
        at(&self.openings_v, point.min(self.last_point()))
    }

    /// Moves a point to another opening.
    pub(super) fn set_opening(&mut self, point: usize, opening_v: R) {
        if let Some(own_v) = self.openings_v.get_mut(point) {
            *own_v = opening_v;
        }
    }

    /// A table of no stretch and scale that goes on as `points` do: opening, V, and area, m2.
    /// Those beyond its capacity are left out.
    pub(super) fn of_points(points: impl Iterator<Item = (R, R)>) -> Self {
        let mut table = Self::closed();
        table.length = 0;
        for (point, (opening_v, area_m2)) in points.take(TABLE_CAPACITY).enumerate() {
            table.openings_v[point] = opening_v;
            table.areas_m2[point] = area_m2;
            table.length = point + 1;
        }
        table
    }

    /// Number of the last point.
    #[inline]
    pub(super) fn last_point(&self) -> usize {
        self.length - 1
    }

    /// Opening of a point, V.
    #[inline]
    pub(super) fn point_v(&self, point: usize) -> R {
        at(&self.openings_v, point.min(self.last_point())) * self.opening_stretch
    }

    /// Area of a point before [`Self::area_scale`], m2.
    #[inline]
    pub(super) fn point_area(&self, point: usize) -> R {
        at(&self.areas_m2, point.min(self.last_point()))
    }

    /// Index of the first entry above `value`, or the last one; at least 1.
    fn first_above(&self, column: &[R; TABLE_CAPACITY], value: R) -> usize {
        let (mut above, mut last) = (1, self.length - 1);
        while above < last {
            let middle = usize::midpoint(above, last);
            if at(column, middle) <= value {
                above = middle + 1;
            } else {
                last = middle;
            }
        }
        above
    }
}

/// The entry at this place, or the last one: no place panics.
#[inline]
fn at<R: Real>(column: &[R; TABLE_CAPACITY], place: usize) -> R {
    column[place.min(TABLE_CAPACITY - 1)]
}

/// y at x, on the line through the points `above - 1` and `above`.
fn interpolate<R: Real>(
    xs: &[R; TABLE_CAPACITY],
    ys: &[R; TABLE_CAPACITY],
    above: usize,
    x: R,
) -> R {
    let below = above.saturating_sub(1);
    let (x0, x1) = (at(xs, below), at(xs, above));
    let (y0, y1) = (at(ys, below), at(ys, above));
    if x1 > x0 {
        y0 + (x - x0) * ((y1 - y0) / (x1 - x0))
    } else {
        y1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_spool_that_goes_elsewhere_has_the_areas_of_there_and_none_falls() {
        let openings_v = [0.0, 0.3, 1.0, 2.0];
        let areas_m2 = [1e-7, 1e-7, 2e-6, 5e-6];
        let table = AreaTable::<f64>::new(&openings_v, &areas_m2).unwrap();
        let mut half = table;
        half.open_elsewhere(&[3.0, 0.6, 1.0, 4.0, 0.0], |opening_v| -0.5 * opening_v);
        assert_eq!(half.openings_v(), [0.0, 0.3, 0.6, 1.0, 2.0, 3.0, 4.0]);
        for &opening_v in half.openings_v() {
            let expected_m2 = table.area_m2(0.5 * opening_v);
            assert!((half.area_m2(opening_v) - expected_m2).abs() < 1e-18);
        }
        let mut folded = table;
        let many_v: [f64; 2 * TABLE_CAPACITY] = core::array::from_fn(|point| 0.01 * point as f64);
        folded.open_elsewhere(&many_v, |opening_v| 1.0 - opening_v);
        assert_eq!(folded.openings_v().len(), TABLE_CAPACITY);
        let areas_m2 = folded.areas_m2();
        assert!(areas_m2.windows(2).all(|pair| pair[0] <= pair[1]));
        assert!((areas_m2[0] - 1e-7).abs() < 1e-18);
    }

    #[test]
    fn prop_points_are_met_and_the_ends_are_level() {
        let mut table = AreaTable::<f64>::new(&[0.0, 0.3, 1.0], &[1e-7, 1e-7, 5e-6]).unwrap();
        for (opening, area) in [
            (0.0, 1e-7),
            (0.3, 1e-7),
            (1.0, 5e-6),
            (9.0, 5e-6),
            (-1.0, 1e-7),
        ] {
            assert!((table.area_m2(opening) - area).abs() < 1e-20);
        }
        table.opening_stretch = 2.0;
        table.area_scale = 3.0;
        assert!((table.area_m2(2.0) - 15e-6).abs() < 1e-18);
        assert!((table.area_m2(1.3) - 3.0 * (1e-7 + 4.9e-6 * 0.5)).abs() < 1e-18);
    }

    #[test]
    fn prop_impossible_tables_are_refused() {
        let refuse = |openings: &[f64], areas: &[f64]| AreaTable::<f64>::new(openings, areas).err();
        assert_eq!(refuse(&[0.0], &[0.0]), Some(TableFault::Length(1)));
        assert_eq!(refuse(&[0.0, 1.0], &[0.0]), Some(TableFault::LengthsDiffer));
        assert_eq!(
            refuse(&[0.0, 0.0], &[0.0, 1.0]),
            Some(TableFault::OpeningNotRising(1))
        );
        assert_eq!(
            refuse(&[0.1, 1.0], &[0.0, 1.0]),
            Some(TableFault::OpeningNotRising(0))
        );
        assert_eq!(
            refuse(&[0.0, 1.0], &[1.0, 0.5]),
            Some(TableFault::AreaNotRising(1))
        );
        assert_eq!(
            refuse(&[0.0, 1.0], &[0.0, f64::NAN]),
            Some(TableFault::AreaNotRising(1))
        );
    }
}
