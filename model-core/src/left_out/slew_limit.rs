//! `slew-limit`: the valve (or a positioner-driven stem) moves no faster than a
//! rate, which may differ by direction.
//!
//! ```text
//! y(t + dt) = y(t) + clamp(u - y(t), -falling dt, rising dt)
//! ```
//!
//! A spool's full stroke at 1.0-1.5 kV/s; a diaphragm actuator fills and
//! empties through different orifices, hence different rates. Signature: lag
//! that grows with the size of the command step. Confused with a first-order
//! lag; steps of several sizes separate them.

use crate::real::Real;

/// Rates in units of the signal per second; 0 (neutral) means no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlewLimit<R> {
    /// Fastest rise.
    pub rising_per_s: R,
    /// Fastest fall, as a positive number.
    pub falling_per_s: R,
}

impl<R: Real> SlewLimit<R> {
    /// No limit.
    pub const NEUTRAL: Self = Self {
        rising_per_s: R::ZERO,
        falling_per_s: R::ZERO,
    };

    /// The mean lag behind a step of this size, s: half of what it takes.
    pub fn lag_s(&self, size: R) -> R {
        let slower = self.rising_per_s.min(self.falling_per_s);
        if slower <= R::ZERO {
            return R::ZERO;
        }
        R::from_f64(0.5) * size / slower
    }

    /// Whether there is no limit either way.
    #[inline]
    pub fn is_none(&self) -> bool {
        self.rising_per_s <= R::ZERO && self.falling_per_s <= R::ZERO
    }

    /// How long a way takes, s; nought without a limit.
    #[inline]
    pub fn time_s(&self, way: R) -> R {
        let limit = self.limit(way);
        if limit <= R::ZERO {
            return R::ZERO;
        }
        way.abs() / limit
    }

    /// The rate that holds on a way of this sign; 0 for none.
    #[inline]
    fn limit(&self, way: R) -> R {
        if way > R::ZERO {
            self.rising_per_s
        } else {
            self.falling_per_s
        }
    }

    /// The next position on the way from `before` to `target`, and the mean one until then: on
    /// the way as fast as it can, and then there.
    #[inline]
    pub fn step(&self, before: R, target: R, dt_s: R) -> (R, R) {
        let wanted = target - before;
        let limit = self.limit(wanted);
        if limit <= R::ZERO {
            return (target, target);
        }
        let most = limit * dt_s;
        let way = wanted.clamp(-most, most);
        let after = before + way;
        let share_under_way = way.abs() / most;
        (after, after - R::from_f64(0.5) * share_under_way * way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the same limit in a thousand parts of a step.
    #[test]
    fn val_mean_over_a_step_is_that_of_a_fine_course() {
        let slew = SlewLimit {
            rising_per_s: 100.0,
            falling_per_s: 40.0,
        };
        for target in [5.0, 0.07, 0.0, -0.01, -3.0_f64] {
            let (mut fine, mut sum) = (0.0, 0.0);
            for _ in 0..1000 {
                let (next, _) = slew.step(fine, target, 1e-6);
                sum += 0.5 * (fine + next);
                fine = next;
            }
            let (end, mean) = slew.step(0.0, target, 1e-3);
            assert!((end - fine).abs() < 1e-9, "{target}");
            assert!((mean - 1e-3 * sum).abs() < 1e-6, "{target}: {mean} {sum}");
        }
        let free = SlewLimit::<f64>::NEUTRAL;
        let (end, mean) = free.step(1.0, 7.0, 1e-3);
        assert!((mean - 7.0).abs() + (end - 7.0).abs() < f64::EPSILON);
    }
}
