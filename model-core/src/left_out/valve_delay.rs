//! `valve-delay`: the valve acts on the command of a while ago.
//!
//! ```text
//! y(t) = u(t - delay)
//! ```
//!
//! Dead time of the amplifier and coil, or of the path from DAC to valve.
//! A command held over each step and delayed by a fraction of a step has as its
//! mean over the step the weighted mean of two neighbours, so the linear
//! interpolation is exact in the mean. Confused with spool lag and with tube
//! delay (|cos| 0.9-0.98 after refit): a chirp at fixed piston separates the
//! first, bursts at two piston positions the second.

use crate::real::Real;

/// The longest delay, in steps.
pub const DELAY_CAPACITY: usize = 64;

/// Parameter; 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveDelay<R> {
    /// Dead time, s; saturates at [`DELAY_CAPACITY`] - 2 steps.
    pub delay_s: R,
}

/// The commands of the last steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayLine<R> {
    past: [R; DELAY_CAPACITY],
    newest: usize,
}

impl<R: Real> DelayLine<R> {
    /// A command that has stood since long ago.
    pub fn holding(command: R) -> Self {
        Self {
            past: [command; DELAY_CAPACITY],
            newest: 0,
        }
    }

    fn ago(&self, steps: usize) -> R {
        self.past[(self.newest + DELAY_CAPACITY - steps) % DELAY_CAPACITY]
    }
}

impl<R: Real> ValveDelay<R> {
    /// No delay.
    pub const NEUTRAL: Self = Self { delay_s: R::ZERO };

    /// Takes the newest command, returns the delayed one.
    #[inline]
    pub fn step(&self, line: &mut DelayLine<R>, command: R, dt_s: R) -> R {
        line.newest = (line.newest + 1) % DELAY_CAPACITY;
        line.past[line.newest] = command;
        if self.delay_s <= R::ZERO {
            return command;
        }
        let longest = R::from_f64((DELAY_CAPACITY - 2) as f64);
        let steps = (self.delay_s / dt_s).min(longest);
        let whole = steps.whole().min(DELAY_CAPACITY - 2);
        let fraction = steps - R::from_f64(whole as f64);
        line.ago(whole) * (R::ONE - fraction) + line.ago(whole + 1) * fraction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_ramp_comes_out_late_by_the_delay() {
        for delay_s in [0.0, 0.4e-3, 1e-3, 2.7e-3, 0.05] {
            let delay = ValveDelay { delay_s };
            let mut line = DelayLine::holding(0.0);
            let mut out = 0.0;
            for step in 1..200 {
                out = delay.step(&mut line, f64::from(step) * 1e-3, 1e-3);
            }
            assert!((out - (0.199 - delay_s)).abs() < 1e-12, "{delay_s}: {out}");
        }
    }

    #[test]
    fn prop_absurd_delay_saturates() {
        let delay = ValveDelay { delay_s: 1e9 };
        let mut line = DelayLine::holding(3.0_f64);
        assert_eq!(
            delay.step(&mut line, 5.0, 1e-3).to_bits(),
            3.0_f64.to_bits()
        );
    }
}
