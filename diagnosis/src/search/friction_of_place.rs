//! Where a friction that changes along the stroke begins.
//!
//! A fit finds the length of a wave from starts within half a turn of it over the whole way that
//! was travelled, and no list of lengths is so fine where they are short; a zone it finds from one
//! that lies over it. In what a model misses while it slides the wave is linear in all but its
//! length, the zone in all but its ends: those that explain most are one more start, with their
//! sizes.

use crate::estimate::candidates::Candidate;
use crate::estimate::sliding::{self, Row, Sliding};
use crate::estimate::{Bench, Fitted};
use crate::laws::Law;

const EFFECT: &str = "position-dependent-friction";

/// What a model misses while it slides, and its dry level, N.
type Missed<'a> = (Sliding<'a>, f64);
/// The start of a form's candidate that explains most of it.
type Begin = fn(&Missed<'_>, &Candidate) -> Option<Vec<f64>>;

const FORMS: [(&str, Begin); 2] = [("wave", missed_wave), ("zone", missed_zone)];

impl Bench<'_> {
    /// Has frictions of the place begin, too, where these models miss one.
    pub(crate) fn begin_frictions_of_place_where_missed(&mut self, by: &[&Fitted]) {
        if self.law != Law::Balance {
            return;
        }
        let curvatures = sliding::curvatures(self);
        let missed = |model: &&Fitted| {
            let level_n = self.value_in(model, "friction.coulomb_N")?;
            Some((Sliding::of(self, model, &curvatures)?, level_n))
        };
        let missed: Vec<Missed<'_>> = by.iter().filter_map(missed).collect();
        for (form, begin) in FORMS {
            let is_it = |one: &&mut Candidate| (one.effect, one.form) == (EFFECT, Some(form));
            if let Some(candidate) = self.candidates.iter_mut().find(is_it) {
                let starts = missed.iter().filter_map(|one| begin(one, candidate));
                let starts: Vec<Vec<f64>> = starts.collect();
                candidate.starts.extend(starts);
            }
        }
    }
}

/// Cosine, sine and length, as the candidate has them.
fn missed_wave((sliding, level_n): &Missed<'_>, candidate: &Candidate) -> Option<Vec<f64>> {
    let wave = sliding.largest(bounds(candidate, "wavelength_m")?, Row::held)?;
    let shares = wave.sizes / *level_n;
    Some(vec![shares.x, shares.y, wave.period_m])
}

/// Share, middle and length.
fn missed_zone((sliding, level_n): &Missed<'_>, candidate: &Candidate) -> Option<Vec<f64>> {
    let zone = sliding.largest_zone(bounds(candidate, "zone_length_m")?)?;
    Some(vec![zone.more_n / level_n, zone.middle_m, zone.length_m])
}

/// Between which a length is looked for, m.
fn bounds(candidate: &Candidate, key: &str) -> Option<(f64, f64)> {
    let free = candidate.free.iter().find(|free| free.key.ends_with(key))?;
    Some((free.parameter.lower, free.parameter.upper))
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
        bench.begin_frictions_of_place_where_missed(&[&baseline, &given]);
        bench.keep_best_starts(&[&baseline, &given]);
        let outcome = search::search(&bench, &baseline, &|_| ());
        let wave = drawn::tried(&bench, EFFECT, "force-balance");
        assert_eq!(outcome.improved.set, [wave]);
        let key = format!("effects.{EFFECT}.wavelength_m");
        let found_m = outcome.improved.value(&key).unwrap();
        assert!((found_m / built_in_m - 1.0).abs() < 0.01, "{found_m} m");
    }
}
