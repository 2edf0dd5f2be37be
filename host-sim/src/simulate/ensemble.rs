//! What a scenario comes to as well as the rig is known: many runs, each with numbers drawn from
//! their uncertainties.
//!
//! The draws are those of [`wrongly_known`]: normal, cut at two deviations, by the rig's
//! `[uncertainty]` or, where it states none, by what data sheets and balances usually leave. Shown
//! are, row by row, the values below which 5, 50 and 95 of 100 runs lie.

use super::{Sample, simulate};
use crate::knowledge::wrongly_known;
use crate::rig::RigError;
use crate::scenario::Scenario;
use rayon::prelude::*;
use std::io::{self, Write};

/// Shares of the runs below the three lines.
pub const SHARES: [f64; 3] = [0.05, 0.5, 0.95];
/// Runs that have to be left at a row: where more have met the end of the stroke the table ends.
const LEAST_SHARE: f64 = 0.9;

/// A signal over the runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Its name, with the unit.
    pub name: &'static str,
    /// What it is, for people, and its unit.
    pub title: (&'static str, &'static str),
    /// By row: below which 5, 50 and 95 of 100 runs lie.
    pub rows: Vec<[f64; 3]>,
}

/// Many runs of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// Times of the rows, s.
    pub time_s: Vec<f64>,
    /// The signals.
    pub bands: Vec<Band>,
    /// Runs.
    pub runs: usize,
    /// Runs that met the end of the stroke.
    pub stopped: usize,
}

/// Name, title, unit and value of a signal, in the unit.
type Shown = (&'static str, &'static str, &'static str, fn(&Sample) -> f64);

const SHOWN: [Shown; 4] = [
    ("x_mm", "position", "mm", |row| 1e3 * row.position_m),
    ("v_m_s", "velocity", "m/s", |row| row.velocity_m_s),
    ("p_a_kPa", "pressure of chamber a, absolute", "kPa", |row| {
        1e-3 * row.pressure_a_pa
    }),
    ("p_b_kPa", "pressure of chamber b, absolute", "kPa", |row| {
        1e-3 * row.pressure_b_pa
    }),
];

/// Runs a scenario so many times; the same seed gives the same runs.
///
/// # Errors
/// Where numbers that were drawn make no axis.
pub fn ensemble(scenario: &Scenario, runs: usize, seed: u64) -> Result<Ensemble, RigError> {
    let each = (0..runs as u64).into_par_iter().map(|run| {
        let mut drawn = scenario.clone();
        drawn.rig = wrongly_known(&scenario.rig, seed.wrapping_add(run));
        Ok(simulate(&drawn)?.samples)
    });
    let all: Vec<Vec<Sample>> = each.collect::<Result<_, RigError>>()?;
    let longest = all.iter().max_by_key(|rows| rows.len());
    let whole: Vec<f64> = longest
        .into_iter()
        .flatten()
        .map(|row| row.time_s)
        .collect();
    let left = |row: usize| all.iter().filter(|rows| rows.len() > row).count();
    let least = (LEAST_SHARE * runs as f64).ceil() as usize;
    let rows = (0..whole.len())
        .take_while(|row| left(*row) >= least.max(1))
        .count();
    let bands = SHOWN.map(|(name, title, unit, value)| Band {
        name,
        title: (title, unit),
        rows: (0..rows).map(|row| shares(&all, row, value)).collect(),
    });
    Ok(Ensemble {
        stopped: all.iter().filter(|rows| rows.len() < whole.len()).count(),
        time_s: whole.into_iter().take(rows).collect(),
        bands: bands.into(),
        runs,
    })
}

/// The values below which the shares of the runs lie, straight lines between runs.
fn shares(all: &[Vec<Sample>], row: usize, value: fn(&Sample) -> f64) -> [f64; 3] {
    let there = all.iter().filter_map(|rows| rows.get(row));
    let mut values: Vec<f64> = there.map(value).collect();
    values.sort_by(f64::total_cmp);
    SHARES.map(|share| {
        let place = share * values.len().saturating_sub(1) as f64;
        let (below, part) = (place as usize, place.fract());
        let at = |place: usize| {
            values
                .get(place)
                .or(values.last())
                .copied()
                .unwrap_or(f64::NAN)
        };
        at(below) + part * (at(below + 1) - at(below))
    })
}

impl Ensemble {
    /// Writes the bands as CSV: time, then three columns a signal.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        write!(out, "t_s")?;
        for band in &self.bands {
            for share in SHARES {
                write!(out, ",{}_{:02.0}", band.name, 100.0 * share)?;
            }
        }
        writeln!(out)?;
        for (row, time_s) in self.time_s.iter().enumerate() {
            write!(out, "{time_s}")?;
            for value in self.bands.iter().flat_map(|band| band.rows[row]) {
                write!(out, ",{value:.6}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    }

    /// The widest band of a signal, from 5 to 95 of 100 runs, and when, s.
    pub fn widest(&self, band: &Band) -> (f64, f64) {
        let widths = band.rows.iter().zip(&self.time_s);
        let widths = widths.map(|([low, _, high], time_s)| (high - low, *time_s));
        widths.fold(
            (0.0, 0.0),
            |most, one| if one.0 > most.0 { one } else { most },
        )
    }
}
