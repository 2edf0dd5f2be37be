//! A table in the place of a force that no effect of the list explains.
//!
//! An effect of no list has no law to fit, but it has a shape. Where the force
//! balance misses something and no effect explains it, a force that is piecewise
//! linear over the position, or over the velocity, is fitted together with all
//! ordinary parameters. It stays if stretches that were left out of the fit are plainly
//! better predicted with it than with the effects that were found (as well, if those come and go
//! at moments that were chosen to suit them), and then goes into
//! the improved rig as `[effects.unknown-force]`: simulator and controller hold it like
//! any effect. The held-out recordings judge it as they judge a named one.
//!
//! Limits: nine knots over what was recorded, so a wave shorter than a quarter of it
//! does not show. A force over time or with a memory of its own is located only.

use super::candidates::Candidate;
use super::fitted::{Bench, Fitted};
use super::search::plain_ratio;
use crate::fit::law_problem::{Folds, FreeParameter};
use crate::laws::{Law, Track};
use crate::model::knot_key;
use model_core::left_out::{ForceVariable, KNOTS};

/// The name in a rig file; no verdict names it.
pub const NAME: &str = "unknown-force";

/// A table that stood up to data it was not fitted to.
#[derive(Clone, Debug)]
pub struct Term {
    /// Its candidate.
    pub candidate: usize,
    /// What it is a table of.
    pub variable: ForceVariable,
    /// Part of the amplitude of the misfit, above the noise, that it takes away in
    /// data it was not fitted to.
    pub share: f64,
}

/// The word for what a force may be tabled over, and its unit.
pub fn name(variable: ForceVariable) -> (&'static str, &'static str) {
    match variable {
        ForceVariable::Position => ("position", "m"),
        ForceVariable::Velocity => ("velocity", "m/s"),
    }
}

/// Least and largest value of a variable in the recordings.
fn range(variable: ForceVariable, tracks: &[Track<'_>]) -> Option<(f64, f64)> {
    let motions = tracks.iter().filter_map(|track| track.motion.as_ref());
    let values = motions.flat_map(|motion| match variable {
        ForceVariable::Position => motion.position_m.iter(),
        ForceVariable::Velocity => motion.velocity_m_per_s.iter(),
    });
    let empty = (f64::INFINITY, f64::NEG_INFINITY);
    let (from, to) = values.fold(empty, |(least, most), &value| {
        (least.min(value), most.max(value))
    });
    (from < to).then_some((from, to))
}

fn candidate(variable: ForceVariable, bench: &Bench<'_>) -> Option<Candidate> {
    let (from, to) = range(variable, bench.tracks)?;
    let of_velocity = f64::from(u8::from(variable == ForceVariable::Velocity));
    let ends = [("of_velocity", of_velocity), ("from", from), ("to", to)];
    let keys: Vec<String> = (0..KNOTS).map(knot_key).collect();
    let size = bench.largest_force_n();
    Some(Candidate::table(NAME, "force-balance", &ends, &keys, size))
}

/// Variable, force against +x and its deviation at every knot.
pub fn table(candidate: &Candidate, model: &Fitted) -> Vec<(f64, f64, f64)> {
    let end = |which: &str| {
        let key = format!("effects.{NAME}.{which}");
        let switch = candidate.switches.iter().find(|(name, _)| *name == key);
        switch.map_or(f64::NAN, |(_, value)| *value)
    };
    let (from, to) = (end("from"), end("to"));
    let knot = |(index, free): (usize, &FreeParameter)| {
        let place = model.place(&free.key)?;
        let x = from + (to - from) * index as f64 / (KNOTS - 1) as f64;
        let deviation = model.standard_deviations[place].unwrap_or(f64::INFINITY);
        Some((x, model.values[place], deviation))
    };
    candidate.free.iter().enumerate().filter_map(knot).collect()
}

/// The table that explains most of what the baseline misses, with the model that holds
/// it; `None` where none predicts data that it was not fitted to plainly better than
/// the `named` effects do. The bench gets its candidate.
pub fn find(bench: &mut Bench<'_>, baseline: &Fitted, named: &Fitted) -> Option<(Term, Fitted)> {
    if !matches!(bench.law, Law::Balance | Law::Force) {
        return None;
    }
    let lengths: Vec<usize> = bench.tracks.iter().map(Track::len).collect();
    let folds = std::mem::replace(&mut bench.folds, Folds::interleaved(&lengths));
    let found = best(bench, baseline, named);
    bench.folds = folds;
    found
}

fn best(bench: &mut Bench<'_>, baseline: &Fitted, named: &Fitted) -> Option<(Term, Fitted)> {
    let before = bench.candidates.len();
    let left = |bench: &Bench<'_>, model: &Fitted| above_noise(bench, &bench.cross_validate(model));
    let left_by_baseline = left(bench, baseline);
    let left_by_named = if named.set.is_empty() {
        left_by_baseline
    } else {
        left(bench, named)
    };
    let most = if named.presence.is_some() {
        1.0
    } else {
        plain_ratio(named.set.len())
    };
    let mut best: Option<(Term, Fitted)> = None;
    for variable in [ForceVariable::Position, ForceVariable::Velocity] {
        let Some(candidate) = candidate(variable, bench) else {
            continue;
        };
        let index = bench.candidates.len();
        bench.candidates.push(candidate);
        let Some(with) = bench.fit(&[index], Some(baseline)) else {
            continue;
        };
        let left_by_table = left(bench, &with);
        let term = Term {
            candidate: index,
            variable,
            share: 1.0 - (left_by_table / left_by_baseline).sqrt(),
        };
        let is_better = best
            .as_ref()
            .is_none_or(|(best, _)| best.share < term.share);
        if (left_by_table / left_by_named).sqrt() <= most && is_better {
            best = Some((term, with));
        }
    }
    if best.is_none() {
        bench.candidates.truncate(before);
    }
    best
}

/// Energy above the noise of squares by output and fold, each output in its noise.
fn above_noise(bench: &Bench<'_>, judged: &[Vec<f64>]) -> f64 {
    let outputs = judged.iter().zip(&bench.noise);
    outputs
        .map(|(squares, noise)| {
            let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
            (mean / noise.powi(2) - 1.0).max(f64::MIN_POSITIVE)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::candidates::candidates;
    use crate::diagnose::{drawn, noise, search};
    use truth_plant::Strength;

    /// Coefficient of v |v| in a table, beside one of v and a constant, by least squares:
    /// how much is viscous and how much is quadratic the declared friction decides.
    fn quadratic(table: &[(f64, f64, f64)]) -> f64 {
        let row = |&(v, _, _): &(f64, f64, f64)| [v * v.abs(), v, 1.0];
        let rows: Vec<f64> = table.iter().flat_map(row).collect();
        let forces = table.iter().map(|&(_, force_n, _)| force_n);
        let matrix = nalgebra::DMatrix::from_row_slice(table.len(), 3, &rows);
        let right = nalgebra::DVector::from_iterator(table.len(), forces);
        matrix.svd(true, true).solve(&right, 1e-12).unwrap()[0]
    }

    #[test]
    fn val_drag_that_grows_with_the_square_of_the_speed_comes_out_as_its_table() {
        let (rig, recordings) = drawn::off_list(77, Strength::Medium, "quadratic-friction");
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(Law::Balance, &rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        bench.noise = noise::floor(&bench, &baseline);
        bench.candidates = candidates(Law::Balance, &rig, &tracks, 1.0);
        let (term, model) = find(&mut bench, &baseline, &baseline).unwrap();
        assert_eq!(term.variable, ForceVariable::Velocity);
        let table = table(&bench.candidates[term.candidate], &model);
        // Drawn were 39.02 N s2/m2.
        let coefficient = quadratic(&table);
        println!("{coefficient} N s2/m2, {} of the misfit", term.share);
        assert!(term.share > 0.8, "{}", term.share);
        assert!((coefficient / 39.02 - 1.0).abs() < 0.15, "{coefficient}");
    }
}
