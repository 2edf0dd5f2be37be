//! Rest: the load stands where it should, and the valve may stand too.
//!
//! Friction holds the load; only the bending of its bristles, some micrometres,
//! follows the force, which the closed valve's leakage lets sink in some seconds.
//! That is let be: the place is what is held, and every crossing of the dead zone
//! is a step of the spool. When the load has crept off by more than an indifferent
//! distance, the force is moved once by what bends the bristles back,
//! `sigma0 e`, as fast as the loop allows, and the valve closes again. A larger error
//! means that the load sticks elsewhere, and rest is given up for a new approach.

use super::{Ahead, Errors, Gains};
use crate::axis::Axis;
use crate::observer::ObserverState;
use crate::real::Real;

/// Bandwidth of what decides about rest, 1/s: position and speed averaged over
/// 50 ms leave 1 um of the sensor's noise.
const MOTION_PER_S: f64 = 20.0;
/// Mean of the absolute observed velocity above which the load moves, m/s: five
/// times what the sensor's noise leaves.
const MOVING_M_PER_S: f64 = 1.5e-3;
/// Share of the Coulomb friction that may be held at rest: LuGre creeps above it.
const HELD_SHARE: f64 = 0.7;
/// Less than this is not worth a crossing of the dead zone: a share of what bends the
/// bristles by the indifferent distance, and a force, N.
const LEAST_CORRECTED_SHARE: f64 = 0.2;
const LEAST_CORRECTION_N: f64 = 1.0;
/// A correction that has not come about by now asks for more, s: the valve's edge
/// lies further out than is known.
const PATIENCE_S: f64 = 0.02;
/// What each overshoot at standstill leaves of the speed of approach, and the least.
const OVERSHOT_SHARE: f64 = 0.6;
const LEAST_APPROACH_SHARE: f64 = 0.1;

/// Memory of rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rest<R> {
    resting: bool,
    correction: Option<Correction<R>>,
    mean_error_m: R,
    mean_speed_m_per_s: R,
    approach_share: R,
    /// On which side the load stuck last: -1, 1, or 0 while the reference moves.
    side: R,
}

/// The force on its way to another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Correction<R> {
    /// Where it goes, N.
    wanted_n: R,
    /// How fast, N/s.
    rate_n_per_s: R,
    /// Since when, s.
    age_s: R,
}

impl<R: Real> Correction<R> {
    /// The rate that is asked for now, N/s: more while the force does not come.
    fn rate_n_per_s(&self) -> R {
        self.rate_n_per_s * (R::ONE + self.age_s / R::from_f64(PATIENCE_S))
    }

    /// Whether more is lacking than will come by itself until a valve that is told to
    /// shut has shut.
    fn is_short(&self, force_n: R, lead_s: R) -> bool {
        let rate = self.rate_n_per_s();
        (self.wanted_n - force_n - rate * lead_s) * rate > R::ZERO
    }
}

impl<R: Real> Rest<R> {
    /// Not at rest, nothing known of the past.
    pub(super) fn left() -> Self {
        Self {
            resting: false,
            correction: None,
            mean_error_m: R::ZERO,
            mean_speed_m_per_s: R::ZERO,
            approach_share: R::ONE,
            side: R::ZERO,
        }
    }

    pub(super) fn is_resting(&self) -> bool {
        self.resting
    }

    /// How much slower than at first an error is approached: each time the load
    /// overshot, the next attempt is gentler, so that hunting dies out.
    pub(super) fn approach_share(&self) -> R {
        self.approach_share
    }

    /// The rate at which the force is to change, N/s, if it is to change.
    pub(super) fn wanted_n_per_s(&self) -> Option<R> {
        self.correction.as_ref().map(Correction::rate_n_per_s)
    }

    /// One tick.
    pub(super) fn step(
        &mut self,
        gains: &Gains<R>,
        axis: &Axis<R>,
        observer: &ObserverState<R>,
        ahead: &Ahead<R>,
        errors: &Errors<R>,
        force_n: R,
    ) {
        let error_m = errors.position_m;
        let motion = axis.dt_s * R::from_f64(MOTION_PER_S);
        let speed = observer.carriage.velocity_m_per_s.abs();
        self.mean_error_m += motion * (error_m - self.mean_error_m);
        self.mean_speed_m_per_s += motion * (speed - self.mean_speed_m_per_s);
        if !ahead.is_still {
            self.resting = false;
            self.correction = None;
            self.approach_share = R::ONE;
            self.side = R::ZERO;
            return;
        }
        self.count_overshoot(error_m, gains.rest_error_m);
        if self.resting {
            self.resting = self.mean_error_m.abs() <= gains.lost_error_m;
            self.correction = if self.resting {
                self.corrected(gains, axis, observer, force_n)
            } else {
                None
            };
        } else if self.mean_error_m.abs().max(error_m.abs()) < gains.rest_error_m
            && self.mean_speed_m_per_s < R::from_f64(MOVING_M_PER_S)
        {
            self.resting = true;
        }
    }

    /// What remains of a correction, or a new one where there is reason for it.
    fn corrected(
        &mut self,
        gains: &Gains<R>,
        axis: &Axis<R>,
        observer: &ObserverState<R>,
        force_n: R,
    ) -> Option<Correction<R>> {
        let Some(correction) = self.correction else {
            return self.begun(gains, axis, observer, force_n);
        };
        if correction.is_short(force_n, gains.lead_s) {
            let age_s = correction.age_s + axis.dt_s;
            return Some(Correction {
                age_s,
                ..correction
            });
        }
        // The mean is of the time before.
        self.mean_error_m = R::ZERO;
        None
    }

    /// A new correction: for what the load has crept off, or for more than may be held.
    fn begun(
        &self,
        gains: &Gains<R>,
        axis: &Axis<R>,
        observer: &ObserverState<R>,
        force_n: R,
    ) -> Option<Correction<R>> {
        let stiffness = axis.carriage.bristle.stiffness_n_per_m;
        let most_n = R::from_f64(HELD_SHARE) * observer.friction_at(axis, R::ZERO).coulomb_n;
        let least_n = (R::from_f64(LEAST_CORRECTED_SHARE) * stiffness * gains.indifferent_m)
            .max(R::from_f64(LEAST_CORRECTION_N));
        let has_crept = self.mean_error_m.abs() > gains.indifferent_m;
        let bent_n = if has_crept {
            stiffness * self.mean_error_m
        } else {
            R::ZERO
        };
        let wanted_n = (force_n + bent_n).clamp(-most_n, most_n);
        let change_n = wanted_n - force_n;
        (change_n.abs() > least_n).then(|| Correction {
            wanted_n,
            rate_n_per_s: gains.rest_force_per_s * change_n,
            age_s: R::ZERO,
        })
    }

    fn count_overshoot(&mut self, error_m: R, tolerance_m: R) {
        let is_other_side = error_m * self.side < R::ZERO && error_m.abs() > tolerance_m;
        if is_other_side {
            self.approach_share = (self.approach_share * R::from_f64(OVERSHOT_SHARE))
                .max(R::from_f64(LEAST_APPROACH_SHARE));
        }
        if is_other_side || self.side.abs() < R::from_f64(0.5) {
            self.side = error_m.signum();
        }
    }
}
