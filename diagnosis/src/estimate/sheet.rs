//! How well a rig file keeps the deviations that it states, all of them together.
//!
//! Who takes one deviation for granted takes them all: data sheets are off by factors. Where the
//! numbers of a rig come out three of their deviations off as a rule, one that is six off says
//! nothing of the axis. Their common scale is the median of how far the numbers are off, over that
//! of a normal distribution; the one number that an effect bends does not move a median.

use crate::imprecise;
use crate::rig::Rig;

/// What half of all normal deviations stay below.
const MEDIAN: f64 = 0.6745;
/// A rig file is believed before any recording is seen, as if so many of its numbers had come out as
/// stated: the middles of equal parts of the normal deviations' sizes.
const BELIEVED: [f64; 5] = [0.126, 0.385, 0.674, 1.036, 1.645];
/// Recordings determine a number if it is known from them to this part of what is stated.
const DETERMINED: f64 = 0.5;

/// How far the numbers that recordings determine are off, in stated deviations.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sheet(Vec<f64>);

impl Sheet {
    /// Takes up a number of the rig file, if the recordings determine it. What the rig does not
    /// state itself says nothing of it.
    pub fn take_up(&mut self, rig: &Rig, key: &str, found: f64, known_to: Option<f64>) {
        let stated = rig
            .uncertainty_sd(key)
            .filter(|_| !imprecise::is_built_in(key));
        let (Some(given), Some(stated), Some(known_to)) = (rig.value(key), stated, known_to) else {
            return;
        };
        if known_to < DETERMINED * stated {
            self.0.push((found - given).abs() / stated);
        }
    }

    /// With the numbers of another.
    pub fn and(&self, other: &Self) -> Self {
        Self([&self.0[..], &other.0].concat())
    }

    /// As many numbers as are believed, come out as stated.
    #[cfg(test)]
    pub fn that_keeps_its_word() -> Self {
        Self(BELIEVED.to_vec())
    }

    /// How many times larger than stated the deviations are, 1 at least.
    pub fn scale(&self) -> f64 {
        let mut all = [&BELIEVED[..], &self.0].concat();
        all.sort_by(f64::total_cmp);
        let middle = all.len() / 2;
        let median = if all.len().is_multiple_of(2) {
            0.5 * (all[middle - 1] + all[middle])
        } else {
            all[middle]
        };
        (median / MEDIAN).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;
    use crate::verdict::remarks::TOO_SURE;

    fn drawn(seed: u64, numbers: usize, scale: f64) -> Sheet {
        let mut noise = Noise::new(seed, 0);
        Sheet(
            (0..numbers)
                .map(|_| (scale * noise.normal()).abs())
                .collect(),
        )
    }

    fn mean_scale(numbers: usize, scale: f64) -> f64 {
        let scales = (0..400).map(|seed| drawn(seed, numbers, scale).scale());
        scales.sum::<f64>() / 400.0
    }

    #[test]
    fn prop_a_sheet_that_keeps_its_word_is_taken_by_its_word() {
        assert_eq!(Sheet::default().scale().to_bits(), 1.0_f64.to_bits());
        assert!(mean_scale(14, 1.0) < 1.2);
        let too_sure = (0..400).filter(|&seed| drawn(seed, 14, 1.0).scale() > TOO_SURE);
        assert!(too_sure.count() <= 20);
    }

    #[test]
    fn prop_a_sheet_three_times_too_sure_is_believed_less_the_more_numbers_say_so() {
        let scales = [5, 14, 40].map(|numbers| mean_scale(numbers, 3.0));
        assert!(
            scales[0] > 1.3 && scales[1] > 1.7 && scales[2] > 2.3,
            "{scales:?}"
        );
        assert!(scales[2] < 3.2, "{scales:?}");
    }

    /// Three numbers that an effect bends, among the others of an axis.
    #[test]
    fn prop_what_an_effect_bends_stands_out() {
        let mut sheet = drawn(1, 11, 1.0);
        sheet.0.extend([7.0, 9.0, 12.0]);
        assert!(sheet.scale() < 1.7, "{}", sheet.scale());
    }
}
