//! A constant force that may be a gauge.
//!
//! A gauge of a chamber that is off by `e` shows on the carriage as a constant force of `A e`,
//! and in its chamber as an offset. Where the chambers were recorded the chamber decides; but
//! where noise would have hidden an offset of that size there, nothing does, and a force that is
//! named alone would be more than is known.

use super::LawDiagnosis;
use super::candidates::Candidate;
use super::leaps::OFFSET;
use super::limits::Limit;
use super::search::{Evidence, share_among};
use crate::laws::Law;
use crate::model::Side;
use crate::rig::Rig;

/// The force that a gauge may be.
const FORCE: &str = "constant-force";

/// Puts the gauges that the chambers could not have shown to be off beside a constant force
/// that is named in the carriage's law.
pub(super) fn put_beside_force(rig: &Rig, laws: &mut [LawDiagnosis]) {
    let chambers = laws.iter().find(|law| law.law == Law::Chambers);
    let limits: Vec<(Limit, Candidate)> = chambers.map_or_else(Vec::new, |law| {
        let limits = law.limits.iter();
        limits
            .map(|limit| (limit.clone(), law.candidates[limit.candidate].clone()))
            .collect()
    });
    for law in laws
        .iter_mut()
        .filter(|law| law.improved.presence.is_none())
    {
        let Some((force, gain, force_n)) = named_force(law) else {
            continue;
        };
        for gauge in hidden(rig, &limits, force_n) {
            let rival = law.candidates.len();
            law.candidates.push(gauge);
            law.rivals.push((force, rival));
            law.evidence.push(Evidence::needless(rival, gain));
            // What was simulated tells the force from others.
            law.next_experiment = None;
        }
        share_among(&law.rivals, &mut law.evidence);
    }
}

/// The constant force that is named, what it gains, and its size, N.
fn named_force(law: &LawDiagnosis) -> Option<(usize, f64, f64)> {
    let mut named = law.evidence.iter().filter(|one| one.accepted);
    let force = named.find(|one| law.candidates[one.candidate].effect == FORCE)?;
    let free = law.candidates[force.candidate].free.first()?;
    let place = law.improved.place(&free.key)?;
    Some((force.candidate, force.gain, law.improved.values[place]))
}

/// The offsets of gauges that make such a force, and that the chambers would not have shown.
fn hidden(rig: &Rig, limits: &[(Limit, Candidate)], force_n: f64) -> Vec<Candidate> {
    let may_be = |(limit, gauge): &&(Limit, Candidate)| {
        let mut sides = Side::BOTH.into_iter();
        let own = sides.find(|side| gauge.places.contains(&side.gauge_place()));
        let area = own.and_then(|side| rig.value(&format!("cylinder.area_{}_m2", side.letter())));
        let sizes = limit.sizes.as_ref().and_then(|sizes| sizes.first());
        let would_show = |area_m2: f64| {
            sizes.is_some_and(|(_, from_pa)| force_n.abs() >= area_m2 * from_pa.abs())
        };
        gauge.effect == OFFSET && area.is_some_and(|area_m2| !would_show(area_m2))
    };
    let gauges = limits.iter().filter(may_be);
    gauges.map(|(_, gauge)| gauge.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::candidates::candidates;
    use super::super::drawn;
    use super::*;
    use crate::laws::Track;
    use truth_plant::{Kind, Request};

    fn hidden_at(force_n: f64, limit_pa: Option<f64>) -> Vec<&'static str> {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let all = candidates(Law::Chambers, &rig, &tracks, 1.0);
        let limit = |(candidate, one): (usize, Candidate)| {
            let key = one.free[0].key.clone();
            let sizes = limit_pa.map(|pa| vec![(key, pa)]);
            (Limit { candidate, sizes }, one)
        };
        let limits: Vec<_> = all.into_iter().enumerate().map(limit).collect();
        let area_m2 = rig.value("cylinder.area_a_m2").unwrap();
        let found = hidden(&rig, &limits, force_n * area_m2);
        found.iter().flat_map(|one| one.places.clone()).collect()
    }

    /// The force is here in newtons per square metre of the piston.
    #[test]
    fn prop_a_gauge_stands_beside_the_force_that_it_makes_where_the_chambers_would_not_show_it() {
        let both = ["sensor.p_a", "sensor.p_b"];
        assert_eq!(hidden_at(2.9e3, Some(4e3)), both);
        assert_eq!(hidden_at(-2.9e3, Some(4e3)), both);
        assert_eq!(hidden_at(2.9e3, None), both);
        assert!(hidden_at(2.9e3, Some(1e3)).is_empty());
    }
}
