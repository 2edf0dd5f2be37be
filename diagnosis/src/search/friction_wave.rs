//! Where a friction that comes and goes along the stroke begins.
//!
//! A fit finds the length of a wave from starts within half a turn of it over the whole way that
//! was travelled, and no list of lengths is so fine where they are short. In what a model misses
//! while it slides the wave is linear in all but its length: of all lengths the one that explains
//! most is one more start, with its sizes.

use crate::estimate::candidates::Candidate;
use crate::estimate::sliding::{self, Row, Sliding};
use crate::estimate::{Bench, Fitted};
use crate::laws::Law;

const EFFECT: &str = "position-dependent-friction";
const FORM: &str = "wave";

impl Bench<'_> {
    /// Has waves of friction begin, too, where these models miss one.
    pub(crate) fn begin_waves_where_missed(&mut self, by: &[&Fitted]) {
        let is_wave = |one: &Candidate| (one.effect, one.form) == (EFFECT, Some(FORM));
        let wave = self.candidates.iter().position(is_wave);
        if let Some(index) = wave.filter(|_| self.law == Law::Balance) {
            let starts = by.iter().filter_map(|model| self.missed_wave(model, index));
            let starts: Vec<Vec<f64>> = starts.collect();
            self.candidates[index].starts.extend(starts);
        }
    }

    /// Cosine, sine and length, as the candidate has them.
    fn missed_wave(&self, model: &Fitted, candidate: usize) -> Option<Vec<f64>> {
        let free = &self.candidates[candidate].free;
        let length = free
            .iter()
            .find(|free| free.key.ends_with("wavelength_m"))?;
        let bounds_m = (length.parameter.lower, length.parameter.upper);
        let level_n = self.value_in(model, "friction.coulomb_N")?;
        let curvatures = sliding::curvatures(self);
        let wave = Sliding::of(self, model, &curvatures)?.largest(bounds_m, Row::held)?;
        let shares = wave.sizes / level_n;
        Some(vec![shares.x, shares.y, wave.period_m])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::laws::Track;
    use crate::search;
    use truth_plant::{Kind, Request, Strength};

    /// A wave of 45 mm lay between two starts, and the law was unknown.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_a_short_wave_is_found_from_what_is_missed() {
        let request = Request::new(1_066_143_083, Kind::Single).with_noise(1.0);
        let request = request.with_effect(EFFECT).unwrap();
        let request = request.with_strength(Strength::Medium);
        let built_in_m = request.draw().truth.effects[0].parameters["wavelength_m"];
        let (rig, recordings) = drawn::read(&request);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (mut bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let given = bench.as_given(&baseline);
        bench.begin_waves_where_missed(&[&baseline, &given]);
        bench.keep_best_starts(&[&baseline, &given]);
        let outcome = search::search(&bench, &baseline, &|_| ());
        let wave = drawn::tried(&bench, EFFECT, "force-balance");
        assert_eq!(outcome.improved.set, [wave]);
        let key = format!("effects.{EFFECT}.wavelength_m");
        let found_m = outcome.improved.value(&key).unwrap();
        assert!((found_m / built_in_m - 1.0).abs() < 0.01, "{found_m} m");
    }
}
