//! `spool-dynamics`: the spool follows the command as a second-order lag.
//!
//! ```text
//! s'' = w^2 (u - s) - 2 zeta w s'
//! ```
//!
//! Source: data sheet, -3 dB at 100 Hz; zeta 0.6-0.9. The step is exact for a
//! command held over the step (the matrix exponential, once per parameter set):
//! w dt reaches 0.6 at 1 kHz, where a difference scheme is visibly wrong.
//! Confused with a pure delay (2 zeta / w = 2.2 ms) and with the lag of a
//! pressure sensor; a chirp above 50 Hz at fixed piston separates them.

use crate::math::{Matrix2, matrix_exponential};
use crate::real::Real;

/// Parameters; a natural frequency of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpoolDynamics<R> {
    /// w / (2 pi), Hz.
    pub natural_frequency_hz: R,
    /// zeta.
    pub damping_ratio: R,
}

/// The spool's position and speed in command units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpoolState<R> {
    /// Position, V.
    pub position: R,
    /// Speed times the step, V: of the position's own size, so that the
    /// transition matrix is well scaled.
    speed_step: R,
}

/// The exact transition over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpoolTransition<R> {
    matrix: Option<Matrix2<R>>,
}

impl<R: Real> SpoolState<R> {
    /// At rest at a position.
    pub fn at_rest(position: R) -> Self {
        Self {
            position,
            speed_step: R::ZERO,
        }
    }
}

impl<R: Real> SpoolDynamics<R> {
    /// The spool follows at once.
    pub const NEUTRAL: Self = Self {
        natural_frequency_hz: R::ZERO,
        damping_ratio: R::ONE,
    };

    /// The transition over `dt_s`, made once.
    ///
    /// A frequency so high that w dt > 10 counts as neutral: the spool then
    /// follows within the step.
    pub fn transition(&self, dt_s: R) -> SpoolTransition<R> {
        let angle = R::from_f64(core::f64::consts::TAU) * self.natural_frequency_hz * dt_s;
        if angle <= R::ZERO || angle > R::from_f64(10.0) {
            return SpoolTransition { matrix: None };
        }
        let two = R::from_f64(2.0);
        let damping = two * self.damping_ratio * angle;
        SpoolTransition {
            matrix: Some(matrix_exponential([
                [R::ZERO, R::ONE],
                [-angle * angle, -damping],
            ])),
        }
    }
}

impl<R: Real> SpoolDynamics<R> {
    /// How far the spool is behind a ramp, s: `2 zeta / w`.
    pub fn lag_s(&self) -> R {
        if self.natural_frequency_hz <= R::ZERO {
            return R::ZERO;
        }
        let omega = R::from_f64(core::f64::consts::TAU) * self.natural_frequency_hz;
        (self.damping_ratio + self.damping_ratio) / omega
    }
}

impl<R: Real> SpoolTransition<R> {
    /// Whether there is no lag.
    pub fn follows_at_once(&self) -> bool {
        self.matrix.is_none()
    }

    /// One step towards a held command; returns the mean position over the step
    /// (trapezoid).
    #[inline]
    pub fn step(&self, state: &mut SpoolState<R>, command: R) -> R {
        let Some(matrix) = self.matrix else {
            *state = SpoolState::at_rest(command);
            return command;
        };
        let before = state.position;
        let apart = state.position - command;
        state.position = command + matrix[0][0] * apart + matrix[0][1] * state.speed_step;
        state.speed_step = matrix[1][0] * apart + matrix[1][1] * state.speed_step;
        (before + state.position) * R::from_f64(0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_step_response_of_the_underdamped_spool() {
        let spool = SpoolDynamics {
            natural_frequency_hz: 100.0,
            damping_ratio: 0.7,
        };
        let (w, z) = (core::f64::consts::TAU * 100.0, 0.7_f64);
        let damped = w * libm::sqrt(1.0 - z * z);
        let transition = spool.transition(1e-3);
        let mut state = SpoolState::at_rest(0.0);
        for step in 1..20 {
            transition.step(&mut state, 1.0);
            let t = 1e-3 * f64::from(step);
            let expected = 1.0
                - libm::exp(-z * w * t)
                    * (libm::cos(damped * t) + z * w / damped * libm::sin(damped * t));
            assert!((state.position - expected).abs() < 1e-9, "at {t}");
        }
    }

    #[test]
    fn prop_neutral_spool_is_the_command() {
        let mut state = SpoolState::at_rest(1.0);
        let mean = SpoolDynamics::<f64>::NEUTRAL
            .transition(1e-3)
            .step(&mut state, 7.0);
        assert_eq!(mean.to_bits(), 7.0_f64.to_bits());
    }
}
