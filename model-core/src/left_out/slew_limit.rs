//! `slew-limit`: the valve (or a positioner-driven stem) moves no faster than a
//! rate, which may differ by direction.
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

    /// The next position on the way from `position` to `target`.
    #[inline]
    pub fn step(&self, position: R, target: R, dt_s: R) -> R {
        let wanted = target - position;
        let limit = if wanted > R::ZERO {
            self.rising_per_s
        } else {
            self.falling_per_s
        };
        if limit <= R::ZERO {
            return target;
        }
        let most = limit * dt_s;
        position + wanted.clamp(-most, most)
    }

    /// The mean position over a step that went from `before` to `after`: on the way as
    /// fast as it can, and then there.
    #[inline]
    pub fn mean(&self, before: R, after: R, dt_s: R) -> R {
        let way = after - before;
        let limit = if way > R::ZERO {
            self.rising_per_s
        } else {
            self.falling_per_s
        };
        if limit <= R::ZERO {
            return after;
        }
        let share_under_way = way.abs() / (limit * dt_s);
        after - R::from_f64(0.5) * share_under_way * way
    }
}
