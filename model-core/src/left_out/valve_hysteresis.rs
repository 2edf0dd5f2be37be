//! `valve-hysteresis`: play between command and spool (or stem).
//!
//! ```text
//! s = clamp(s, u - w/2, u + w/2)
//! ```
//!
//! Data sheet of the MPYE: at most 0.4 % of the stroke, 40 mV; 0.1-0.15 V when
//! aged. Signature: a command that reverses does nothing at first. Confused
//! with a wider dead zone; a slow triangle through the null separates them.

use crate::real::Real;

/// Parameter; a width of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveHysteresis<R> {
    /// Full width of the play, in units of the command.
    pub width: R,
}

impl<R: Real> ValveHysteresis<R> {
    /// No play.
    pub const NEUTRAL: Self = Self { width: R::ZERO };

    /// The position after the play, from the one before.
    #[inline]
    pub fn step(&self, position: R, command: R) -> R {
        let half = self.width * R::from_f64(0.5);
        let (lower, upper) = (command - half, command + half);
        if position < lower {
            lower
        } else if position > upper {
            upper
        } else if lower <= upper {
            position
        } else {
            // Only NaN gets here: held back, it would pass for a steady command.
            command
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_reversal_within_the_play_does_nothing() {
        let play = ValveHysteresis { width: 0.1_f64 };
        let up = play.step(0.0, 1.0);
        assert!((up - 0.95).abs() < 1e-12);
        assert!((play.step(up, 0.92) - 0.95).abs() < 1e-12);
        assert!((play.step(up, 0.80) - 0.85).abs() < 1e-12);
    }

    #[test]
    fn regress_a_nan_command_is_not_held_back() {
        for width in [0.0, 0.1] {
            assert!(ValveHysteresis { width }.step(1.0, f64::NAN).is_nan());
        }
    }
}
