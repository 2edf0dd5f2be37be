//! A test machine that moves the carriage along a given way and measures the
//! force that holds it there.

use super::recording::rows;
use super::travel::Travel;
use crate::plant::friction::{Friction, Memory, Surroundings};

/// Length of a step: 50 us, short against the 30 um over which a bristle bends
/// at 0.1 m/s.
const STEP_S: f64 = 50e-6;

/// What the machine holds.
pub(super) struct Machine<'a> {
    pub(super) friction: &'a Friction,
    pub(super) mass_kg: f64,
    /// Force of the gas on the piston along `+x`, which varies with time.
    pub(super) gas_n: &'a dyn Fn(f64) -> f64,
}

/// A moment of the truth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) time_s: f64,
    pub(super) position_m: f64,
    /// Force on the carriage against `+x`.
    pub(super) force_n: f64,
}

impl Machine<'_> {
    /// Moves the carriage; returns a moment for each row.
    pub(super) fn moments(&self, travel: &Travel, rows_per_s: f64) -> Vec<Moment> {
        let steps_per_row = libm::round(1.0 / (rows_per_s * STEP_S)) as usize;
        let count = rows(travel.duration_s(), rows_per_s);
        // The speed is that over a step; the acceleration is that between two.
        let mut memory = Memory::default();
        let mut before_m = travel.position_m(0.0);
        let mut before_m_per_s = 0.0;
        let mut friction_n = 0.0;
        let mut moments = Vec::with_capacity(count);
        for step in 0..=(count - 1) * steps_per_row {
            let time_s = step as f64 * STEP_S;
            let position_m = travel.position_m(time_s);
            let speed_m_per_s = (position_m - before_m) / STEP_S;
            let push_n = self.mass_kg * (speed_m_per_s - before_m_per_s) / STEP_S;
            if step > 0 {
                let slip = self.friction.slip(&level(position_m), &memory);
                (friction_n, memory) = self.friction.advance(&slip, &memory, speed_m_per_s, STEP_S);
            }
            (before_m, before_m_per_s) = (position_m, speed_m_per_s);
            if step % steps_per_row == 0 {
                moments.push(Moment {
                    time_s,
                    position_m,
                    force_n: (self.gas_n)(time_s) - friction_n - push_n,
                });
            }
        }
        moments
    }
}

/// The friction is already that of its pressures.
fn level(position_m: f64) -> Surroundings {
    Surroundings {
        position_m,
        mean_gauge_pa: 0.0,
        difference_pa: 0.0,
    }
}
