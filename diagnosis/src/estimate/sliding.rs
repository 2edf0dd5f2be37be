//! What the balance of forces misses while sliding, and waves along the way in it.

use super::bench::Bench;
use super::fitted::Fitted;
use crate::estimate::wave::{self, Wave};
use crate::laws::balance;
use nalgebra::Vector2;

/// What a model misses of the balances of forces while sliding.
pub(crate) struct Sliding<'a> {
    rows: Vec<Row<'a>>,
    noise_n: f64,
    /// How far apart they lie, m.
    pub way_m: f64,
}

/// One balance.
pub(crate) struct Row<'a> {
    /// The positions that it counts.
    around_m: &'a [f64],
    curvature: &'a [f64],
    /// What it misses, N.
    missed_n: f64,
}

/// Into so many parts the way is divided to look for a zone.
const ZONE_BINS: usize = 100;

/// A stretch of the way with more friction than elsewhere.
pub(crate) struct Zone {
    /// Its middle, m.
    pub middle_m: f64,
    /// Its length, m.
    pub length_m: f64,
    /// How much more, N.
    pub more_n: f64,
}

/// What is missed in a part of the way, in the direction of the friction.
#[derive(Clone, Copy, Default)]
struct Share {
    sum_n: f64,
    rows: f64,
}

impl Share {
    fn add(&mut self, missed_n: f64) {
        self.sum_n += missed_n;
        self.rows += 1.0;
    }

    /// By how much more this part misses than the rest, N, and how many squares of newtons that
    /// explains.
    fn against(&self, all: &Self) -> (f64, f64) {
        let others = all.rows - self.rows;
        if self.rows < 1.0 || others < 1.0 {
            return (0.0, 0.0);
        }
        let more_n = self.sum_n / self.rows - (all.sum_n - self.sum_n) / others;
        let weight = self.rows * others / all.rows;
        (more_n, more_n * more_n * weight)
    }
}

impl std::ops::Add for Share {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            sum_n: self.sum_n + other.sum_n,
            rows: self.rows + other.rows,
        }
    }
}

/// How the balances of each recording weigh a position as an acceleration.
pub(crate) fn curvatures(bench: &Bench<'_>) -> Vec<Vec<f64>> {
    bench.tracks.iter().map(balance::curvature).collect()
}

impl<'a> Sliding<'a> {
    /// `None` where nothing slides.
    pub fn of(bench: &Bench<'a>, model: &Fitted, curvatures: &'a [Vec<f64>]) -> Option<Self> {
        let sliding = bench.residuals_of(model).swap_remove(0);
        let mut rows = Vec::new();
        for ((track, missed_n), curvature) in bench.tracks.iter().zip(&sliding).zip(curvatures) {
            let position_m = track.recording.signal("x")?;
            let half = curvature.len() / 2;
            let told = missed_n.iter().enumerate().filter(|(_, n)| n.is_finite());
            rows.extend(told.map(|(row, &missed_n)| Row {
                around_m: &position_m[row - half..=row + half],
                curvature,
                missed_n,
            }));
        }
        let places = || rows.iter().map(Row::at_m);
        let way_m = places().reduce(f64::max)? - places().reduce(f64::min)?;
        Some(Self {
            rows,
            noise_n: bench.noise[0],
            way_m,
        })
    }

    /// The energy of what is missed, above the noise's and in units of it.
    pub fn missed(&self) -> f64 {
        let squares = self.rows.iter().map(|row| row.missed_n.powi(2));
        squares.sum::<f64>() / self.noise_n.powi(2) - self.rows.len() as f64
    }

    /// The zone of the way whose friction is off by most, of those with these lengths, m: its
    /// middle, its length and by how much, N. Beside what is off everywhere.
    pub fn largest_zone(&self, lengths_m: (f64, f64)) -> Option<Zone> {
        let from_m = self.rows.iter().map(Row::at_m).reduce(f64::min)?;
        let bin_m = self.way_m / ZONE_BINS as f64;
        let mut bins = [Share::default(); ZONE_BINS];
        for row in &self.rows {
            let bin = ((row.at_m() - from_m) / bin_m) as usize;
            bins[bin.min(ZONE_BINS - 1)].add(row.held(0.0).x * row.missed_n);
        }
        let all = bins.iter().fold(Share::default(), |sum, bin| sum + *bin);
        let mut best: Option<(f64, Zone)> = None;
        for first in 0..ZONE_BINS {
            let mut inside = Share::default();
            for (last, bin) in bins.iter().enumerate().skip(first) {
                inside = inside + *bin;
                let length_m = (last + 1 - first) as f64 * bin_m;
                let (more_n, explained) = inside.against(&all);
                let is_told = lengths_m.0 <= length_m && length_m <= lengths_m.1;
                if is_told && best.as_ref().is_none_or(|(most, _)| explained > *most) {
                    let middle_m = from_m + first as f64 * bin_m + 0.5 * length_m;
                    best = Some((
                        explained,
                        Zone {
                            middle_m,
                            length_m,
                            more_n,
                        },
                    ));
                }
            }
        }
        best.map(|(_, zone)| zone)
    }

    /// The wave along the way that explains most, of those with these periods, by the force that
    /// one of so many radians per metre makes in a balance.
    pub fn largest(
        &self,
        periods_m: (f64, f64),
        force_n: impl Fn(&Row<'a>, f64) -> Vector2<f64> + Sync,
    ) -> Option<Wave> {
        let force_n = &force_n;
        wave::largest(self.way_m, periods_m, |radians_per_m| {
            let of_row = move |row: &Row<'a>| {
                let change = force_n(row, radians_per_m) / self.noise_n;
                (change, row.missed_n / self.noise_n)
            };
            self.rows.iter().map(of_row)
        })
    }
}

impl Row<'_> {
    fn at_m(&self) -> f64 {
        self.around_m[self.around_m.len() / 2]
    }

    /// The acceleration that a cosine and a sine of the position seem to have.
    pub fn curved(&self, radians_per_m: f64) -> Vector2<f64> {
        let rows = self.around_m.iter().zip(self.curvature);
        rows.map(|(place_m, weight)| turned(place_m * radians_per_m) * *weight)
            .sum()
    }

    /// The same as forces along the way.
    pub fn pushed(&self, radians_per_m: f64) -> Vector2<f64> {
        turned(self.at_m() * radians_per_m)
    }

    /// As frictions.
    pub fn held(&self, radians_per_m: f64) -> Vector2<f64> {
        let way_m = self.around_m[self.around_m.len() - 1] - self.around_m[0];
        self.pushed(radians_per_m) * way_m.signum()
    }
}

fn turned(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}
