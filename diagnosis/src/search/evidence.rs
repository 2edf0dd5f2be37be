//! What speaks for an effect, as a number and in words.

use crate::estimate::fold_squares::FoldSquares;
use crate::thresholds::{CHANCE_OF_BREAK_AWAYS, MATERIAL_SHARE};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Log odds that an effect was there, over the log odds of the part of the misfit that it
/// explains: a logistic fit to the 242 candidates of 134 concealed cases (seeds 1 to 3
/// of `pneuma trial`) that explained more than 1 %.
const LOG_ODDS_IN_TRIALS: (f64, f64) = (-1.26, 0.93);

/// What cross-validation says of one effect in one set.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// The candidate.
    pub candidate: usize,
    /// Cross-validated RMS error with it over without it, above the noise, for
    /// the output that it helps most.
    pub ratio: f64,
    /// Part of the baseline's misfit energy that it accounts for, for that output.
    pub share: f64,
    /// Folds in which it makes the prediction better, and folds in all.
    pub folds_better: (usize, usize),
    /// Gain in log-likelihood that the folds add up to.
    pub gain: f64,
    /// Probability that it is there: on long recordings from how often such effects were
    /// in concealed trials; else that its gain on independent parts of the data is no
    /// accident (Student's t over the folds, not calibrated).
    pub probability: f64,
    /// Whether a parameter of it stands on a bound (its neutral value mostly).
    pub at_bound: bool,
    /// Whether chance makes as much of so few break-aways, or any effect of what is missed.
    pub is_chance: bool,
    /// Whether it is accepted.
    pub accepted: bool,
    /// Whether it is a shift in time that is plain and no more than the order in which a
    /// logger reads.
    pub is_sampling: bool,
    /// Whether it is plain and too small to matter.
    pub is_negligible: bool,
    /// Whether it would do as well as one that is.
    pub is_alternative: bool,
    /// Whether held-out recordings speak against it.
    pub is_refuted: bool,
    /// Whether it is in the place of an ordinary number that came out far off.
    pub is_of_strayed: bool,
    /// Whether it was accepted until something better was found.
    pub is_superseded: bool,
}

impl Evidence {
    /// An effect that is not needed: nothing material is left without it. `gain` is
    /// what it would bring alone.
    pub(crate) fn needless(candidate: usize, gain: f64) -> Self {
        Self {
            candidate,
            ratio: 1.0,
            share: 0.0,
            folds_better: (0, 0),
            gain,
            probability: 0.01,
            at_bound: false,
            is_chance: false,
            accepted: false,
            is_sampling: false,
            is_negligible: false,
            is_alternative: false,
            is_refuted: false,
            is_of_strayed: false,
            is_superseded: false,
        }
    }

    /// An effect that an ordinary number, far off, stood in for.
    pub(crate) fn of_strayed(candidate: usize, gain: f64, probability: f64) -> Self {
        Self {
            share: 1.0,
            probability,
            accepted: true,
            is_of_strayed: true,
            ..Self::needless(candidate, gain)
        }
    }

    /// An effect that would do as well as the one that was accepted.
    pub(crate) fn alternative(self, probability: f64) -> Self {
        Self {
            probability,
            is_alternative: true,
            ..self
        }
    }

    /// It was good until something better was found.
    pub(crate) fn decline(&mut self) {
        self.is_superseded |= self.accepted;
        self.accepted = false;
        self.is_alternative = false;
        self.probability = self.probability.min(1.0 - self.probability).max(0.01);
    }

    /// Held-out recordings speak against what was accepted.
    pub(crate) fn refute(&mut self) {
        self.is_refuted = self.accepted;
        if self.accepted || self.is_alternative {
            self.decline();
        }
    }

    /// Whether it stays in the model without a name: plain, but nothing that matters.
    pub(crate) fn stays_unnamed(&self) -> bool {
        self.is_sampling || self.is_negligible
    }

    /// Why it was declined, in words; `None` if it was not.
    pub fn reason(&self) -> Option<String> {
        if self.accepted {
            return None;
        }
        if self.is_refuted {
            return Some("refuted by held-out recordings".into());
        }
        if self.is_alternative {
            return Some("indistinguishable from a named effect in these recordings".into());
        }
        if self.is_superseded {
            return Some("another effect explains the recordings better".into());
        }
        if self.is_chance {
            return Some("chance explains as much".into());
        }
        if self.folds_better.1 == 0 {
            return Some("the others leave no misfit for it".into());
        }
        let (better, folds) = self.folds_better;
        Some(if self.is_sampling {
            "within the channel order of a logger; stays in the model".into()
        } else if self.at_bound {
            "fitted size is zero or at a bound".into()
        } else if self.ratio >= 1.0 {
            format!(
                "does not improve the prediction ({:+.1} %)",
                100.0 * (self.ratio - 1.0)
            )
        } else if self.is_negligible {
            "significant, but too small to be relevant; stays in the model".into()
        } else if self.share < MATERIAL_SHARE {
            format!(
                "explains {:.1} % of the misfit: not material",
                100.0 * self.share
            )
        } else {
            format!(
                "reduces the error by only {:.1} %, in {better} of {folds} parts",
                100.0 * (1.0 - self.ratio)
            )
        })
    }
}

/// On long recordings chance plays no part; what is in doubt is whether the form
/// is the right one, and of that the part of the misfit's energy that it takes
/// away is the measure; what hardly matters says less.
pub(crate) fn explained_probability(ratio: f64, share: f64) -> f64 {
    let material = (share / MATERIAL_SHARE).clamp(0.0, 1.0);
    probability_of((1.0 - ratio * ratio) * material)
}

/// How often effects that explained such a part of what is missed were there in concealed
/// trials (docs/method.md).
pub(crate) fn probability_of(explained: f64) -> f64 {
    let explained = explained.clamp(0.01, 0.99);
    let (offset, slope) = LOG_ODDS_IN_TRIALS;
    let odds = (offset + slope * (explained / (1.0 - explained)).ln()).exp();
    (odds / (1.0 + odds)).max(0.01)
}

/// Probability that the mean gain over the folds is above nought, by Student's
/// t; for a declined effect also scaled down by how far it is from material.
pub(crate) fn probability(
    with: &FoldSquares,
    without: &FoldSquares,
    accepted: bool,
    share: f64,
) -> f64 {
    let gains: Vec<f64> = with
        .beside(without)
        .map(|(with, without)| 0.5 * (without / with).ln())
        .collect();
    let (count, average) = (gains.len() as f64, mean(&gains));
    let spread = gains
        .iter()
        .map(|gain| (gain - average).powi(2))
        .sum::<f64>()
        / (count - 1.0);
    let deviation = (spread / count).sqrt().max(1e-9);
    let statistic = average / deviation;
    let chance = match StudentsT::new(0.0, 1.0, (count - 1.0).max(1.0)) {
        Ok(distribution) if statistic.is_finite() => distribution.cdf(statistic),
        // Folds without rows or without error say nothing.
        _ => 0.5,
    };
    let material = if accepted {
        1.0
    } else {
        0.5 * (share / MATERIAL_SHARE).clamp(0.0, 1.0)
    };
    (chance * material).clamp(0.01, 0.99)
}

/// Each fold counts as one independent observation of the error's variance.
pub(crate) fn log_gain(with: &FoldSquares, without: &FoldSquares) -> f64 {
    with.beside(without)
        .map(|(with, without)| 0.5 * (without / with).ln())
        .sum()
}

/// Probability that so many more numbers, fitted to nothing but chance, lower the mean of the
/// squares from one to the other: Fisher's F.
fn by_chance(before: &[f64], after: &[f64], more: usize) -> f64 {
    let numbers = more.max(1) as f64;
    let free = after.len() as f64 - numbers;
    let lowered = mean(before) / mean(after).max(f64::MIN_POSITIVE) - 1.0;
    let statistic = lowered.max(0.0) * free / numbers;
    FisherSnedecor::new(numbers, free).map_or(1.0, |chance| chance.sf(statistic))
}

/// Whether chance lowers the squares of single events, before and after, as far as so many more
/// numbers do; without the event that gains most, as a single one may have been no break-away.
pub(crate) fn is_by_chance(events: Vec<(f64, f64)>, more: usize) -> bool {
    by_chance_without_one(events, more) > CHANCE_OF_BREAK_AWAYS
}

/// Probability of chance from squares before and after, without the pair that gains most.
fn by_chance_without_one(mut events: Vec<(f64, f64)>, more: usize) -> f64 {
    events.sort_by(|a, b| (a.0 - a.1).total_cmp(&(b.0 - b.1)));
    events.pop();
    let (before, after): (Vec<f64>, Vec<f64>) = events.into_iter().unzip();
    by_chance(&before, &after, more)
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One event of sixty that is 11 N off, as seen where a carriage crept on, was a load behind a
    /// spring with probability 0.95.
    #[test]
    fn regress_a_single_event_is_no_evidence() {
        let noise = |event: usize| 0.01 + 0.001 * (event % 7) as f64;
        let mut events: Vec<(f64, f64)> = (0..60).map(|e| (noise(e), 0.95 * noise(e))).collect();
        events.push((120.0, 0.0));
        let (before, after): (Vec<f64>, Vec<f64>) = events.iter().copied().unzip();
        assert!(by_chance(&before, &after, 3) < CHANCE_OF_BREAK_AWAYS);
        assert!(is_by_chance(events.clone(), 3));
        events.extend([(30.0, 0.1), (25.0, 0.1), (35.0, 0.1)]);
        assert!(!is_by_chance(events, 3));
    }

    /// Tables of F: 5.18 with 3 and 17 degrees of freedom, and 4.96 with 1 and 10 (at 0.05).
    #[test]
    fn val_chance_is_that_of_the_tables() {
        let with = |events: usize, more: usize, statistic: f64| {
            let before = 1.0 + statistic * more as f64 / (events - more) as f64;
            by_chance(&vec![before; events], &vec![1.0; events], more)
        };
        assert!((with(20, 3, 5.18) - 0.01).abs() < 1e-4);
        assert!((with(11, 1, 4.96) - 0.05).abs() < 1e-4);
    }

    #[test]
    fn prop_no_more_events_than_numbers_show_nothing() {
        assert!(by_chance(&[9.0; 3], &[1e-9; 3], 3) >= 1.0);
        assert!(by_chance(&[], &[], 1) >= 1.0);
        assert!(by_chance(&[1.0; 9], &[2.0; 9], 1) >= 1.0);
    }
}
