//! The areas of a valve's paths over its opening, out of recordings of the axis that it drives.
//!
//! A chamber of known volume is a flow meter: what flows in is what its pressure, its volume and its
//! heat exchange account for (the paper's (3)). The flow is linear in the areas, so that they follow
//! from one non-negative least squares problem, wherever the search starts:
//!
//! ```text
//! ((pV)' + (gamma-1) p V' - (gamma-1) Q') / (gamma R) = (T m')_supply + (T m')_exhaust
//! m' = A(opening) q(pressures)         A: linear between points, never falling
//! ```
//!
//! * [`measure`]: null, lag and areas of a rig and its recordings
//! * `balance.rs`: the balance in weak form, so that no pressure is differentiated
//! * `areas.rs`: the least squares problem
//! * `points.rs`: as few points of a table as the areas need
//!
//! Estimated beside the areas, so that they do not take it: dead volumes, a leak past the piston, the
//! time by which the opening is later than the command. A leak to the surroundings that both chambers
//! have cannot be told from the leakage of closed exhausts.

mod areas;
mod balance;
mod lateness;
mod points;
mod text;

pub use lateness::{Late, Lateness, lateness};
use rayon::prelude::*;
use serde::Serialize;

use areas::{Areas, Grid, Problem};
pub(crate) use balance::at_row;
use balance::{Axis, ChamberRows, Recorded};

use crate::golden_section::least_within;
use crate::laws::Track;
use crate::model::Values;
use crate::rig::Rig;

/// How far the null is searched about the rig's, V: beyond what a data sheet is off by.
const NULL_SEARCH_V: f64 = 0.4;
/// The longest lag from command to opening that is searched, s.
const LONGEST_LAG_S: f64 = 0.02;
/// Null and lag are found in turns.
const TURNS: usize = 2;
/// Both searches end at this part of their range.
const SEARCH_TOLERANCE: f64 = 5e-3;
/// Distance of the grid's points where paths begin to open, V: enough to align the command ...
const COARSE_V: f64 = 0.06;
/// ... and fine enough for the knee: a few hundredths of a volt there are some kPa in the chambers.
const FINE_V: f64 = 0.015;
/// Critical pressure ratios that are searched: those of orifices and valves (ISO 6358).
const CRITICAL_RATIOS: (f64, f64) = (0.1, 0.6);
/// Full opening of a valve of which nothing is known, V.
const FULL_V: f64 = 5.0;

/// The valve as recordings show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValveFlow {
    /// Command at which the spool is centred, V.
    pub null_v: f64,
    /// Time by which the opening is later than the command, s.
    pub lag_s: f64,
    /// Critical pressure ratio.
    pub critical_pressure_ratio: f64,
    /// The points of the estimate.
    pub points: Vec<Point>,
    /// Dead volumes of both chambers, m3.
    pub dead_volume_m3: [f64; 2],
    /// Area of a leak past the piston, m2.
    pub piston_leak_m2: f64,
    /// What the balance is off by, in units of what its noise and 5 % of the flow allow, rms.
    pub misfit: f64,
}

/// One opening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Opening, V.
    pub opening_v: f64,
    /// Areas from the supply and to the exhaust, m2.
    pub area_m2: [f64; 2],
    /// Their standard deviations, m2: from leaving out one tenth of the time after the other, and
    /// what the balance itself is off by.
    pub deviation_m2: [f64; 2],
}

/// Null and lag that are tried.
#[derive(Clone, Copy, Debug)]
struct Alignment {
    null_v: f64,
    lag_s: f64,
    way: Way,
}

/// How the opening is later than the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// All of it by the same time, as behind a tube.
    Delayed,
    /// As a spool of second order follows: what is short is also smaller.
    Followed,
}

/// Measures the valve.
///
/// # Errors
/// One line where rig or recordings lack what the balance needs.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<ValveFlow, String> {
    let mut search = Search::of(rig, tracks)?;
    search.align_either_way();
    let (_, areas) = search.areas(COARSE_V);
    search.axis = search.axis.with_dead_volumes(areas.dead_volume_m3);
    search.align();
    let off_v = (search.at.null_v - search.null_v).abs();
    if off_v > NULL_SEARCH_V * (1.0 - 2.0 * SEARCH_TOLERANCE) {
        return Err(format!(
            "no null within {NULL_SEARCH_V} V of the rig's {} V explains the flows",
            search.null_v
        ));
    }
    search.doubt_a_ratio_at_its_bound();
    let (grid, areas) = search.areas(FINE_V);
    Ok(points::measured(
        &grid,
        &areas,
        search.at,
        search.axis.critical_pressure_ratio(),
    ))
}

/// What is searched about the linear problem.
struct Search<'a> {
    axis: Axis,
    recorded: Vec<Recorded<'a>>,
    /// The rig's null, V.
    null_v: f64,
    slope_m2_v: f64,
    /// The rig's critical pressure ratio.
    stated_ratio: f64,
    at: Alignment,
}

impl<'a> Search<'a> {
    /// Of a rig and its recordings, begun where the rig says.
    fn of(rig: &Rig, tracks: &'a [Track<'_>]) -> Result<Self, String> {
        let values = Values::of(rig);
        let valve = rig.valve.as_ref().ok_or("the rig file has no [valve]")?;
        let full_v = valve.opening_v.last().copied().unwrap_or(FULL_V);
        let full_m2 = valve.supply_area_m2.last().copied().unwrap_or_default();
        let axis = Axis::of(&values)?;
        let recorded = tracks.iter().map(|track| axis.recorded(&values, track));
        let recorded: Vec<[Recorded<'_>; 2]> = recorded.collect::<Result<_, String>>()?;
        Ok(Self {
            stated_ratio: axis.critical_pressure_ratio(),
            axis,
            recorded: recorded.into_iter().flatten().collect(),
            null_v: valve.null_v,
            slope_m2_v: full_m2 / full_v,
            at: Alignment {
                null_v: valve.null_v,
                lag_s: 0.0,
                way: Way::Delayed,
            },
        })
    }

    /// The rows of an axis whose position is late by so much.
    fn rows(&self, axis: &Axis, position_late_s: f64) -> Vec<ChamberRows> {
        let recorded = self.recorded.par_iter();
        recorded
            .map(|one| axis.rows(one, position_late_s))
            .collect()
    }

    fn grid(&self, rows: &[ChamberRows], finest_v: f64) -> Grid {
        let widest_v = rows
            .iter()
            .map(|one| one.widest_v(self.null_v))
            .fold(0.0, f64::max);
        Grid::up_to(widest_v, finest_v, self.slope_m2_v)
    }

    /// [`align`](Self::align) the way that explains more.
    fn align_either_way(&mut self) {
        let begun = (self.axis.clone(), self.at);
        let tried = [Way::Delayed, Way::Followed].map(|way| {
            (self.axis, self.at) = (begun.0.clone(), Alignment { way, ..begun.1 });
            self.align();
            let rows = self.rows(&self.axis, 0.0);
            let grid = self.grid(&rows, COARSE_V);
            let problem = Problem::new(&grid, self.axis.dead_volumes_m3(), &rows, self.at);
            (problem.misfit(), self.axis.clone(), self.at)
        });
        let [delayed, followed] = tried;
        let better = if followed.0 < delayed.0 {
            followed
        } else {
            delayed
        };
        (self.axis, self.at) = (better.1, better.2);
    }

    /// Lag, null and critical pressure ratio of the least misfit.
    fn align(&mut self) {
        let rows = self.rows(&self.axis, 0.0);
        let grid = self.grid(&rows, COARSE_V);
        let dead_volumes_m3 = self.axis.dead_volumes_m3();
        let misfit =
            |rows: &[ChamberRows], at| Problem::new(&grid, dead_volumes_m3, rows, at).misfit();
        let at = &mut self.at;
        for _ in 0..TURNS {
            at.lag_s = least_within((0.0, LONGEST_LAG_S), SEARCH_TOLERANCE, |lag_s| {
                misfit(&rows, Alignment { lag_s, ..*at })
            });
            let within_v = (self.null_v - NULL_SEARCH_V, self.null_v + NULL_SEARCH_V);
            at.null_v = least_within(within_v, SEARCH_TOLERANCE, |null_v| {
                misfit(&rows, Alignment { null_v, ..*at })
            });
        }
        let at = self.at;
        let with_ratio = |ratio: f64| self.axis.clone().with_critical_pressure_ratio(ratio);
        let of_ratio = |ratio: f64| misfit(&self.rows(&with_ratio(ratio), 0.0), at);
        self.axis = with_ratio(least_within(CRITICAL_RATIOS, SEARCH_TOLERANCE, of_ratio));
    }

    /// A critical pressure ratio at the bound of its search is none: the rig's own is as good.
    fn doubt_a_ratio_at_its_bound(&mut self) {
        let (least, most) = CRITICAL_RATIOS;
        let bound = 2.0 * SEARCH_TOLERANCE * (most - least);
        let ratio = self.axis.critical_pressure_ratio();
        if ratio < least + bound || ratio > most - bound {
            let axis = self.axis.clone();
            self.axis = axis.with_critical_pressure_ratio(self.stated_ratio);
        }
    }

    fn areas(&self, finest_v: f64) -> (Grid, Areas) {
        let rows = self.rows(&self.axis, 0.0);
        let grid = self.grid(&rows, finest_v);
        let areas = Problem::new(&grid, self.axis.dead_volumes_m3(), &rows, self.at).solved();
        (grid, areas)
    }
}
