//! Areas that never fall over the opening, by non-negative least squares.

use nalgebra::{DMatrix, DVector};
use ndarray::{Array1, Array2};
use rayon::prelude::*;

use super::Alignment;
use super::balance::{ChamberRows, Window};
use crate::model::Side;

/// They are fine up to here, V: dead zones are 0.2 to 0.5 V.
const FINE_UP_TO_V: f64 = 1.0;
/// From there on each interval is longer by this factor.
const GROWTH: f64 = 1.25;
/// How much the slope changes over 0.1 V where no data say it, one standard deviation, as a part of
/// the slope from shut to open: an edge changes it by the whole. It changes by chance, so that over
/// less it changes by the root.
const SLOPE_CHANGE: f64 = 0.5;
const SLOPE_CHANGES_OVER_V: f64 = 0.1;
/// How far the areas of both paths differ at one opening, one standard deviation, as a part of the
/// area of a straight curve there: a guess, as the lands of one spool are ground alike.
const PATHS_DIFFER: f64 = 0.1;
/// How far the guessed dead volume may be off, one standard deviation, as a part of it.
const DEAD_VOLUME_ERROR: f64 = 0.5;
/// Blocks of time of which one at a time is left out.
const BLOCKS: usize = 10;

/// Openings at which the areas are estimated.
pub(super) struct Grid {
    /// From nought up, V.
    pub(super) opening_v: Vec<f64>,
    /// Typical slope of the areas, m2/V.
    slope_m2_v: f64,
}

/// The areas and what was estimated with them.
pub(super) struct Areas {
    /// Supply and exhaust at the grid's points, m2.
    pub(super) area_m2: [Vec<f64>; 2],
    /// Their standard deviations, m2.
    pub(super) deviation_m2: [Vec<f64>; 2],
    /// Dead volumes of both chambers, m3.
    pub(super) dead_volume_m3: [f64; 2],
    /// Leak past the piston, m2.
    pub(super) leak_m2: f64,
    /// Weighted residual per window, rms.
    pub(super) misfit: f64,
}

impl Grid {
    /// Up to an opening, for a valve of this slope; points lie `finest_v` apart where paths begin to open.
    pub(super) fn up_to(widest_v: f64, finest_v: f64, slope_m2_v: f64) -> Self {
        let mut opening_v = vec![0.0];
        let (mut at_v, mut step_v) = (0.0, finest_v);
        while at_v + 1.5 * step_v < widest_v {
            at_v += step_v;
            opening_v.push(at_v);
            if at_v >= FINE_UP_TO_V {
                step_v *= GROWTH;
            }
        }
        opening_v.push(widest_v);
        Self {
            opening_v,
            slope_m2_v,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.opening_v.len()
    }

    /// The interval of an opening of 0 or more, and how far along it.
    fn place(&self, opening_v: f64) -> (usize, f64) {
        let last = self.len() - 1;
        let above = self
            .opening_v
            .partition_point(|point| *point <= opening_v)
            .clamp(1, last);
        let (from, to) = (self.opening_v[above - 1], self.opening_v[above]);
        (
            above - 1,
            ((opening_v - from) / (to - from)).clamp(0.0, 1.0),
        )
    }
}

/// Normal equations: `A' A`, `A' b`, `b' b`, windows.
#[derive(Clone)]
struct Sums {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    squares: f64,
    windows: f64,
}

/// The problem in its unknowns: areas of supply and exhaust at the grid's points, two dead volumes,
/// the leak.
pub(super) struct Problem<'a> {
    grid: &'a Grid,
    dead_volume_m3: [f64; 2],
    blocks: Vec<Sums>,
}

impl<'a> Problem<'a> {
    /// Of all chambers in all recordings.
    pub(super) fn new(
        grid: &'a Grid,
        dead_volume_m3: [f64; 2],
        rows: &[ChamberRows],
        at: Alignment,
    ) -> Self {
        let count = 2 * grid.len() + 3;
        let of_chamber = |chamber: &ChamberRows| -> Vec<Sums> {
            let windows = chamber.windows(at);
            let of_block = |windows: &[Window]| {
                let mut sums = Sums::new(count);
                for window in windows {
                    let row = Self::design(grid, chamber.side, window, count);
                    sums.add(&row, window.wanted / window.deviation);
                    let place = 2 * grid.len() + usize::from(chamber.side == Side::B);
                    sums.take_noise_out(place, window);
                }
                sums
            };
            windows
                .chunks(windows.len().div_ceil(BLOCKS).max(1))
                .map(of_block)
                .collect()
        };
        let of_chambers: Vec<Vec<Sums>> = rows.par_iter().map(of_chamber).collect();
        let mut blocks = vec![Sums::new(count); BLOCKS];
        for sums in &of_chambers {
            for (block, one) in blocks.iter_mut().zip(sums) {
                block.join(one);
            }
        }
        Self {
            grid,
            dead_volume_m3,
            blocks,
        }
    }

    /// One row of the design, in units of its deviation: places and factors.
    fn design(grid: &Grid, side: Side, window: &Window, count: usize) -> Vec<f64> {
        let mut row = vec![0.0; count];
        let points = grid.len();
        for &(opening_v, supply, exhaust) in &window.paths {
            for (offset, opening_v, factor) in
                [(0, opening_v, supply), (points, -opening_v, exhaust)]
            {
                let (interval, along) = grid.place(opening_v.max(0.0));
                row[offset + interval] += factor * (1.0 - along);
                row[offset + interval + 1] += factor * along;
            }
        }
        row[2 * points + usize::from(side == Side::B)] = -window.per_dead_volume;
        row[2 * points + 2] = window.per_leak;
        row.iter().map(|factor| factor / window.deviation).collect()
    }

    /// What is left of the balance at the best areas.
    pub(super) fn misfit(&self) -> f64 {
        let sums = self.sums(None);
        sums.cost(&self.solve(&sums))
    }

    /// The areas.
    pub(super) fn solved(&self) -> Areas {
        let sums = self.sums(None);
        let best = self.solve(&sums);
        let points = self.grid.len();
        let of = |all: &DVector<f64>| {
            [0, points].map(|from| all.rows(from, points).iter().copied().collect::<Vec<f64>>())
        };
        let left_out: Vec<DVector<f64>> = (0..BLOCKS)
            .map(|block| self.solve(&self.sums(Some(block))))
            .collect();
        // Jackknife: (n-1)/n times the sum of squares about the mean.
        let deviation = DVector::from_fn(best.len(), |place, _| {
            let values = left_out.iter().map(|one| one[place]);
            let mean = values.clone().sum::<f64>() / BLOCKS as f64;
            let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
            (squares * (BLOCKS - 1) as f64 / BLOCKS as f64).sqrt()
        });
        Areas {
            area_m2: of(&best),
            deviation_m2: of(&deviation),
            dead_volume_m3: [best[2 * points], best[2 * points + 1]],
            leak_m2: best[2 * points + 2],
            misfit: (sums.cost(&best) / sums.windows.max(1.0)).sqrt(),
        }
    }

    fn sums(&self, without: Option<usize>) -> Sums {
        let mut sums = self.prior();
        for (block, one) in self.blocks.iter().enumerate() {
            if Some(block) != without {
                sums.join(one);
            }
        }
        sums
    }

    /// What is known without data: curves bend little, the lands of one spool are alike, dead volumes
    /// are about the rig's.
    fn prior(&self) -> Sums {
        let points = self.grid.len();
        let mut sums = Sums::new(2 * points + 3);
        let opening_v = &self.grid.opening_v;
        for offset in [0, points] {
            for point in 1..points - 1 {
                let mut row = vec![0.0; 2 * points + 3];
                let apart_v = 0.5 * (opening_v[point + 1] - opening_v[point - 1]);
                let deviation =
                    SLOPE_CHANGE * self.grid.slope_m2_v * (apart_v / SLOPE_CHANGES_OVER_V).sqrt();
                let before = 1.0 / (opening_v[point] - opening_v[point - 1]) / deviation;
                let after = 1.0 / (opening_v[point + 1] - opening_v[point]) / deviation;
                row[offset + point - 1] = before;
                row[offset + point] = -before - after;
                row[offset + point + 1] = after;
                sums.add(&row, 0.0);
            }
        }
        for (point, at_v) in opening_v.iter().enumerate() {
            let mut row = vec![0.0; 2 * points + 3];
            let deviation = PATHS_DIFFER * self.grid.slope_m2_v * at_v.max(opening_v[1]);
            row[point] = 1.0 / deviation;
            row[points + point] = -row[point];
            sums.add(&row, 0.0);
        }
        for (place, volume_m3) in self.dead_volume_m3.iter().enumerate() {
            let mut row = vec![0.0; 2 * points + 3];
            row[2 * points + place] = 1.0 / (DEAD_VOLUME_ERROR * volume_m3);
            sums.add(&row, 1.0 / DEAD_VOLUME_ERROR);
        }
        sums.windows = 0.0;
        sums
    }

    /// Areas that rise, and nothing below nought: the unknowns as sums of non-negative steps.
    fn solve(&self, sums: &Sums) -> DVector<f64> {
        let points = self.grid.len();
        let count = sums.right.len();
        let steps = DMatrix::from_fn(count, count, |row, column| {
            let same_curve =
                row < 2 * points && column < 2 * points && (row < points) == (column < points);
            f64::from(if same_curve {
                row >= column
            } else {
                row == column
            })
        });
        let matrix = steps.transpose() * &sums.matrix * &steps;
        let right = steps.transpose() * &sums.right;
        // Unknowns in units of their own.
        let unit = DVector::from_fn(count, |place, _| {
            1.0 / matrix[(place, place)].max(f64::MIN_POSITIVE).sqrt()
        });
        let scaled = DMatrix::from_fn(count, count, |row, column| {
            matrix[(row, column)] * unit[row] * unit[column]
                + if row == column { 1e-10 } else { 0.0 }
        });
        let Some(root) = scaled.cholesky() else {
            return DVector::zeros(count);
        };
        let upper = root.l().transpose();
        let target = root
            .l()
            .solve_lower_triangular(&right.component_mul(&unit))
            .unwrap_or_else(|| DVector::zeros(count));
        let upper = Array2::from_shape_fn((count, count), |(row, column)| upper[(row, column)]);
        let target = Array1::from_iter(target.iter().copied());
        let (found, _) = nnls::nnls(upper.view(), target.view());
        let found = DVector::from_iterator(count, found.iter().copied());
        steps * found.component_mul(&unit)
    }
}

impl Sums {
    fn new(count: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
            squares: 0.0,
            windows: 0.0,
        }
    }

    fn add(&mut self, row: &[f64], wanted: f64) {
        let filled: Vec<(usize, f64)> = row
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, factor)| *factor != 0.0)
            .collect();
        for &(one, factor) in &filled {
            self.right[one] += factor * wanted;
            for &(other, by) in &filled {
                self.matrix[(one, other)] += factor * by;
            }
        }
        self.squares += wanted * wanted;
        self.windows += 1.0;
    }

    /// Noise of the pressure stands in the dead volume's column and in what it has to explain: its
    /// squares, which would draw the volume to nought, are taken out of the sums.
    fn take_noise_out(&mut self, place: usize, window: &Window) {
        let square = (window.noise / window.deviation).powi(2);
        self.matrix[(place, place)] -= square;
        self.right[place] += window.stroke_m3 * square;
        self.squares -= window.stroke_m3.powi(2) * square;
    }

    fn join(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.right += &other.right;
        self.squares += other.squares;
        self.windows += other.windows;
    }

    fn cost(&self, at: &DVector<f64>) -> f64 {
        (at.dot(&(&self.matrix * at)) - 2.0 * at.dot(&self.right) + self.squares).max(0.0)
    }
}
