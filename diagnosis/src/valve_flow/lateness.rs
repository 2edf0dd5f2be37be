//! A position or a command that is late against the pressure of a chamber, by the same balance.
//!
//! A position that is late shifts the work of the piston against the pressure; a command that is
//! logged late opens the valve before it is given. The times at which the balance is off the least
//! say by how much, whatever the areas are: they are estimated anew for each time that is tried.

use super::areas::Problem;
use super::balance::{ChamberRows, MARGIN_S};
use super::{Alignment, COARSE_V, SEARCH_TOLERANCE, Search};
use crate::golden_section::least_within;
use crate::laws::Track;
use crate::model::Side;
use crate::rig::Rig;

/// Times that are searched for the position, s: a field bus or a logger in turns, either way.
const POSITION_S: (f64, f64) = (-0.04, 0.04);
/// Times that are searched for the opening, s: no opening comes before its command, so that what is
/// below nought is a command that was logged late.
const OPENING_S: (f64, f64) = (-0.04, MARGIN_S - STEP_S);
/// Places where the searches begin: a fast motion has valleys beside the right one.
const PLACES: usize = 9;
/// Both are found in turns, so many at the most.
const MOST_TURNS: usize = 4;
/// By this much each time is moved to see how sharp the valley is, s.
const STEP_S: f64 = 1e-3;
/// Windows lie half of one apart: two neighbours are one observation.
const OVERLAP: f64 = 2.0;

/// A time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Late {
    /// The time.
    pub late_s: f64,
    /// Its standard deviation.
    pub deviation_s: f64,
    /// The part of what is off without it that it explains, 0 to 1.
    pub explains: f64,
}

/// What is late against the pressure of a chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lateness {
    /// The recorded position; below nought where the pressure is later than it.
    pub position: Late,
    /// The opening against the recorded command: spool, tube and delay make it late; below nought
    /// where the command was logged late.
    pub opening: Late,
    /// What the balance is off by with both, in units of what its noise and 5 % of the flow allow,
    /// rms.
    pub misfit: f64,
}

/// Measures both in recordings of one logger; `None` where rig or recordings lack what the balance
/// needs, or where nothing moves.
pub fn lateness(rig: &Rig, tracks: &[Track<'_>], side: Side) -> Option<Lateness> {
    let mut search = Search::of(rig, tracks).ok()?;
    search.recorded.retain(|one| one.is_of(side));
    search.align();
    let (_, areas) = search.areas(COARSE_V);
    search.axis = search.axis.with_dead_volumes(areas.dead_volume_m3);
    let (mut position_s, mut opening_s) = (0.0, search.at.lag_s);
    for _ in 0..MOST_TURNS {
        let before_s = position_s;
        position_s = least_of_many(POSITION_S, |late_s| search.misfit_of(late_s, opening_s));
        let rows = search.rows(&search.axis, position_s);
        opening_s = least_of_many(OPENING_S, |late_s| search.misfit_at(&rows, late_s));
        if (position_s - before_s).abs() < STEP_S {
            break;
        }
    }
    let rows = search.rows(&search.axis, position_s);
    let windows: usize = rows.iter().map(|one| one.windows(search.at).len()).sum();
    let found = Found {
        misfit: search.misfit_at(&rows, opening_s),
        windows: windows.max(1) as f64,
    };
    Some(Lateness {
        position: found.late(position_s, |late_s| search.misfit_of(late_s, opening_s))?,
        opening: found.late(opening_s, |late_s| search.misfit_at(&rows, late_s))?,
        misfit: (found.misfit / found.windows).sqrt(),
    })
}

/// Where the balance is off the least.
struct Found {
    misfit: f64,
    windows: f64,
}

impl Found {
    /// A time with what the misfit about it says of it; `None` where it says nothing.
    fn late(&self, late_s: f64, misfit: impl Fn(f64) -> f64) -> Option<Late> {
        let around = misfit(late_s - STEP_S) + misfit(late_s + STEP_S);
        let curvature = (around - 2.0 * self.misfit) / STEP_S.powi(2);
        let variance = OVERLAP * 2.0 * self.misfit / self.windows / curvature;
        (variance > 0.0).then(|| Late {
            late_s,
            deviation_s: variance.sqrt(),
            explains: 1.0 - self.misfit / misfit(0.0).max(f64::MIN_POSITIVE),
        })
    }
}

impl Search<'_> {
    /// What the balance is off by, where the position is so late and the opening so much later than
    /// its command.
    fn misfit_of(&self, position_late_s: f64, lag_s: f64) -> f64 {
        self.misfit_at(&self.rows(&self.axis, position_late_s), lag_s)
    }

    /// The same of rows that are there.
    fn misfit_at(&self, rows: &[ChamberRows], lag_s: f64) -> f64 {
        let grid = self.grid(rows, COARSE_V);
        let at = Alignment { lag_s, ..self.at };
        Problem::new(&grid, self.axis.dead_volumes_m3(), rows, at).misfit()
    }
}

/// The place of the least of a function with several valleys.
fn least_of_many((from, to): (f64, f64), cost: impl Fn(f64) -> f64) -> f64 {
    let apart = (to - from) / (PLACES - 1) as f64;
    let place = |index: usize| from + index as f64 * apart;
    let costs: Vec<f64> = (0..PLACES).map(|index| cost(place(index))).collect();
    let best = (0..PLACES).min_by(|one, other| costs[*one].total_cmp(&costs[*other]));
    let at = place(best.unwrap_or_default());
    let nearby = ((at - apart).max(from), (at + apart).min(to));
    least_within(nearby, SEARCH_TOLERANCE, cost)
}
