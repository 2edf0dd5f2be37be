//! Rest: the load stands where it should, and the valve may stand too.
//!
//! Friction holds the load; only the bending of its bristles, some micrometres,
//! follows the force. So an error of a few micrometres is corrected by the force
//! `sigma0 e` once, on coming to rest, and slowly later; a larger one means that
//! the load sticks elsewhere, and rest is given up for a new approach.

use super::{Ahead, Errors, Gains};
use crate::axis::Axis;
use crate::observer::ObserverState;
use crate::real::Real;

/// Bandwidths of what decides about rest, 1/s: position and speed averaged over
/// 50 ms leave 1 um of the sensor's noise; the force, which the valve follows,
/// over 125 ms.
const MOTION_PER_S: f64 = 20.0;
const FORCE_PER_S: f64 = 8.0;
/// Mean of the absolute observed velocity above which the load moves, m/s: five
/// times what the sensor's noise leaves.
const MOVING_M_PER_S: f64 = 1.5e-3;
/// Share of the Coulomb friction that may be held at rest: LuGre creeps above it.
const HELD_SHARE: f64 = 0.7;
/// What each overshoot at standstill leaves of the speed of approach, and the least.
const OVERSHOT_SHARE: f64 = 0.6;
const LEAST_APPROACH_SHARE: f64 = 0.1;

/// Memory of rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rest<R> {
    resting: bool,
    /// The force to hold, N.
    held_n: R,
    mean_error_m: R,
    mean_speed_m_per_s: R,
    mean_force_n: R,
    approach_share: R,
    /// On which side the load stuck last: -1, 1, or 0 while the reference moves.
    side: R,
}

impl<R: Real> Rest<R> {
    /// Not at rest, nothing known of the past.
    pub(super) fn left() -> Self {
        Self {
            resting: false,
            held_n: R::ZERO,
            mean_error_m: R::ZERO,
            mean_speed_m_per_s: R::ZERO,
            mean_force_n: R::ZERO,
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

    /// The force that lacks, N.
    pub(super) fn lacking_n(&self) -> R {
        self.held_n - self.mean_force_n
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
        self.mean_force_n += axis.dt_s * R::from_f64(FORCE_PER_S) * (force_n - self.mean_force_n);
        if !ahead.is_still {
            self.resting = false;
            self.approach_share = R::ONE;
            self.side = R::ZERO;
            return;
        }
        self.count_overshoot(error_m, gains.rest_error_m);
        let levels = observer.friction_at(axis, ahead.velocity_m_per_s);
        let most_n = R::from_f64(HELD_SHARE) * levels.coulomb_n;
        let stiffness = axis.carriage.bristle.stiffness_n_per_m;
        if self.resting {
            let beyond = self.mean_error_m
                - self
                    .mean_error_m
                    .clamp(-gains.indifferent_m, gains.indifferent_m);
            let change_n = axis.dt_s * gains.rest_integral_per_s * stiffness * beyond;
            self.held_n = (self.held_n + change_n).clamp(-most_n, most_n);
            self.resting = self.mean_error_m.abs() <= gains.lost_error_m;
        } else if self.mean_error_m.abs().max(error_m.abs()) < gains.rest_error_m
            && self.mean_speed_m_per_s < R::from_f64(MOVING_M_PER_S)
        {
            self.resting = true;
            self.held_n = (force_n + stiffness * error_m).clamp(-most_n, most_n);
            self.mean_force_n = force_n;
        }
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
