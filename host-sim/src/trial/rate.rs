//! How often out of how many.

use crate::report::number;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A count out of a number of tries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rate {
    /// How often.
    pub count: usize,
    /// Out of how many.
    pub of: usize,
}

impl Rate {
    /// Counts what is true.
    pub fn over(tries: impl IntoIterator<Item = bool>) -> Self {
        tries
            .into_iter()
            .fold(Self::default(), |rate, is_true| Self {
                count: rate.count + usize::from(is_true),
                of: rate.of + 1,
            })
    }

    /// The share; none without a try.
    pub fn share(self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }

    /// Wilson's interval of 95 %: where the true rate may be. Good also for few
    /// tries and for rates near 0 and 1 (Wilson 1927).
    pub fn interval(self) -> Option<(f64, f64)> {
        const NORMAL_95: f64 = 1.959_964;
        let share = self.share()?;
        let of = self.of as f64;
        let square = NORMAL_95 * NORMAL_95;
        let middle = (share + 0.5 * square / of) / (1.0 + square / of);
        let variance = share * (1.0 - share) / of + 0.25 * square / (of * of);
        let half = NORMAL_95 * variance.sqrt() / (1.0 + square / of);
        Some(((middle - half).max(0.0), (middle + half).min(1.0)))
    }

    /// [`Self::interval`] as a person reads it, %; empty without a try.
    pub fn interval_in_words(self) -> String {
        let percent = |share: f64| number::fixed(100.0 * share, 0);
        let interval = self.interval();
        interval.map_or_else(String::new, |(low, high)| {
            format!("{} to {} %", percent(low), percent(high))
        })
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.share() {
            Some(share) => write!(
                formatter,
                "{} % ({}/{})",
                number::fixed(100.0 * share, 0),
                self.count,
                self.of
            ),
            None => formatter.write_str("–"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_wilsons_interval() {
        // Brown, Cai, DasGupta 2001: 0 of 10 gives 0 to 0.278; 5 of 10 0.237 to 0.763.
        let close = |a: f64, b: f64| (a - b).abs() < 1e-3;
        let (low, high) = Rate { count: 0, of: 10 }.interval().unwrap();
        assert!(close(low, 0.0) && close(high, 0.2775));
        let (low, high) = Rate { count: 5, of: 10 }.interval().unwrap();
        assert!(close(low, 0.2366) && close(high, 0.7634));
        assert_eq!(Rate::default().interval(), None);
    }

    #[test]
    fn regress_rates_are_read_with_their_counts() {
        assert_eq!(Rate::over([true, true, false]).to_string(), "67 % (2/3)");
        assert_eq!(Rate::default().to_string(), "–");
    }
}
