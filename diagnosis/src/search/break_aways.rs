//! How well the break-aways of a rig are known.
//!
//! Their floor is what contacts of another form than the model's leave. Where the contact is of
//! the model's form they are known to a quarter of it, and a seal that ages a little goes by
//! under the floor (7 to 9 N of rise left 0.5 to 0.9 N; the right model leaves 0.1 to 0.2 N). So
//! what break-aways alone show is fitted before anything is judged: where it takes most of what
//! they miss away, and more than chance does, they are known to what it leaves.

use crate::estimate::{Bench, Fitted};
use crate::laws::{Law, balance};
use crate::search::is_by_chance;
use crate::thresholds::MOST_IS_TAKEN;

impl Bench<'_> {
    /// Learns how well break-aways are known; the baseline, fitted again where that is better
    /// than was assumed.
    pub(crate) fn learn_break_aways(&mut self, baseline: Fitted) -> Fitted {
        let Some(known_to_n) = self.best_known_to_n(&baseline) else {
            return baseline;
        };
        let noise = &mut self.noise[balance::BREAKAWAY];
        let of_inputs = noise.powi(2) - self.break_aways_known_to_n.powi(2);
        *noise = known_to_n.hypot(of_inputs.max(0.0).sqrt());
        self.break_aways_known_to_n = known_to_n;
        self.fit(&[], Some(&baseline)).unwrap_or(baseline)
    }

    /// What an effect that break-aways alone show leaves of them, N, where that says how well
    /// they are known.
    fn best_known_to_n(&self, baseline: &Fitted) -> Option<f64> {
        if self.law != Law::Balance {
            return None;
        }
        let of_rests = (0..self.candidates.len()).filter(|&one| self.candidates[one].is_of_rests);
        let models = of_rests.filter_map(|one| self.fit(&[one], Some(baseline)));
        let known_to_n = models.filter_map(|model| self.known_to_n(&model, baseline));
        known_to_n.reduce(f64::min)
    }

    fn known_to_n(&self, model: &Fitted, baseline: &Fitted) -> Option<f64> {
        let squares = self.squared_at_events([baseline, model]);
        let more = model.shared - baseline.shared;
        let free = squares.len().checked_sub(more).filter(|&free| free > 0)?;
        let sum = |of: fn(&(f64, f64)) -> f64| squares.iter().map(of).sum::<f64>();
        let (before, after) = (sum(|pair| pair.0), sum(|pair| pair.1));
        let known_to_n = (after / free as f64).sqrt();
        let is_told = after < MOST_IS_TAKEN * before && !is_by_chance(squares, more);
        (is_told && known_to_n < self.break_aways_known_to_n).then_some(known_to_n)
    }
}

#[cfg(test)]
mod tests {
    use crate::drawn;
    use crate::laws::{Law, Track, balance};
    use truth_plant::{Kind, Strength};

    /// A stiction that rises by 8 N, seen by few, went by under the floor of the break-aways; where
    /// nothing is missing the floor stays.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_a_weak_ageing_tells_how_well_break_aways_are_known() {
        let known_to_n = |kind: Kind| {
            let (rig, recordings) = drawn::of_kind(kind, 7404, Strength::Weak, "dwell-stiction");
            let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
            let (mut bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
            let learned = bench.learn_break_aways(baseline.clone());
            let is_missed = bench.may_miss(&learned, balance::BREAKAWAY);
            (bench.break_aways_known_to_n, is_missed)
        };
        let (known_to_n_of_weak, is_missed) = known_to_n(Kind::Single);
        assert!(
            known_to_n_of_weak < 0.3 && is_missed,
            "{known_to_n_of_weak}"
        );
        assert_eq!(
            known_to_n(Kind::Nothing),
            (balance::BREAKAWAY_NOISE_N, false)
        );
    }
}
