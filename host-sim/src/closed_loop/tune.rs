//! The search for the comparison controller's gains: what an engineer does by
//! hand on a machine, done by a simplex until nothing improves.
//!
//! The cost is that of the marks themselves: the mean logarithm of every marked
//! figure over its mark, over all cases, on the rig known as wrongly as in the
//! table, with seeds that the table does not use. Gains are searched for as
//! logarithms, which keeps them positive and their scales alike.

use super::drive::Drive;
use super::pid::{PidController, PidGains};
use super::score::{Case, Score, ScoreError, score};
use crate::rig::Rig;
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;

/// Seeds of the search; those of the table count from 1.
const SEEDS: [u64; 2] = [1001, 1002];
/// A figure this far below its mark is good enough: no reward beyond.
const GOOD_ENOUGH: f64 = 0.3;
/// Cost of a run that ends in an end stop.
const END_STOP_COST: f64 = 10.0;
/// Edge of the first simplex: a factor of 1.5 in one gain.
const FIRST_STEP: f64 = 0.4;

/// Where the search begins: gains, velocity feedback and jump. On these axes the
/// open valve moves the load at about 2 m/s per volt, against an air spring of
/// some 35 rad/s: hence a feedforward near 0.5 V s/m and a proportional gain of
/// tens of volts per metre. Beyond that nobody knows beforehand: slow, fast, and
/// fast with a jump well into the open valve.
const BEGINNINGS: [(f64, f64, f64); 3] = [(15.0, 0.5, 1.0), (60.0, 2.0, 1.0), (100.0, 6.0, 2.5)];

fn beginning(
    (proportional_v_per_m, derivative_v_s_per_m, jump_share): (f64, f64, f64),
) -> PidGains {
    PidGains {
        proportional_v_per_m,
        integral_v_per_m_s: proportional_v_per_m,
        derivative_v_s_per_m,
        feedforward_v_s_per_m: 0.5,
        acceleration_v_s2_per_m: 0.02,
        jump_share,
        jump_band_v: 0.03,
        rest_band_m: 3e-5,
    }
}

/// Corners whose costs spread less than this are one.
const SAME_COST: f64 = 1e-3;

struct Search<'a> {
    rig: &'a Rig,
}

impl CostFunction for Search<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, logarithms: &Self::Param) -> Result<f64, Error> {
        Ok(cost(self.rig, gains(logarithms))?)
    }
}

fn gains(logarithms: &[f64]) -> PidGains {
    let mut row = [0.0; 8];
    for (gain, logarithm) in row.iter_mut().zip(logarithms) {
        *gain = libm::exp(*logarithm);
    }
    PidGains::from_array(row)
}

fn cost(rig: &Rig, gains: PidGains) -> Result<f64, ScoreError> {
    let factory = |known: &Rig| {
        let drive: Box<dyn Drive> = Box::new(PidController::new(known, gains)?);
        Ok(drive)
    };
    let scores = score(rig, &factory, &Case::ALL, &SEEDS)?;
    Ok(scores.iter().map(cost_of).sum::<f64>() / SEEDS.len() as f64)
}

fn cost_of(score: &Score) -> f64 {
    let mut sum = 0.0;
    for measured in &score.cases {
        if measured.hit_end_stop {
            sum += END_STOP_COST;
        }
        for (measure, value) in &measured.measures {
            if let Some(mark) = measure.mark(measured.case) {
                sum += libm::log((value / mark).max(GOOD_ENOUGH));
            }
        }
    }
    sum
}

/// The gains for a rig: a simplex from each beginning, then on from the best
/// with a new one, each of at most so many steps.
pub fn tune_pid(rig: &Rig, steps: u64) -> Result<PidGains, Error> {
    let mut best: Option<(f64, PidGains)> = None;
    for from in BEGINNINGS {
        let found = simplex(rig, beginning(from), steps)?;
        if best.is_none_or(|(cost, _)| found.0 < cost) {
            best = Some(found);
        }
    }
    let (_, gains) = best.ok_or_else(|| Error::msg("there is nowhere to begin"))?;
    Ok(simplex(rig, gains, steps)?.1)
}

/// The gains for a rig, a simplex on from those of a similar one.
pub fn retune_pid(rig: &Rig, from: PidGains, steps: u64) -> Result<PidGains, Error> {
    Ok(simplex(rig, from, steps)?.1)
}

/// The best gains that a simplex finds, with their cost.
fn simplex(rig: &Rig, from: PidGains, steps: u64) -> Result<(f64, PidGains), Error> {
    let begin = from.to_array().map(libm::log).to_vec();
    let mut corners = vec![begin.clone()];
    for place in 0..begin.len() {
        let mut corner = begin.clone();
        corner[place] += FIRST_STEP;
        corners.push(corner);
    }
    let solver = NelderMead::new(corners).with_sd_tolerance(SAME_COST)?;
    let search = Executor::new(Search { rig }, solver)
        .configure(|state| state.max_iters(steps))
        .run()?;
    let state = search.state();
    let found = gains(state.get_best_param().unwrap_or(&begin));
    Ok((state.get_best_cost(), found))
}
