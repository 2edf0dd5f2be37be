//! A constant force that may be a gauge.
//!
//! A gauge of a chamber that is off by `e` shows on the carriage as a constant force of `A e`,
//! and in its chamber as an offset. Where the chambers were recorded the chamber decides; but
//! where noise would have hidden an offset of that size there, nothing does, and a force that is
//! named alone would be more than is known. A force that is there for a part of the time may be a
//! gauge that was off for as long, if that leapt by less than is told from noise.

use crate::estimate::candidates::Candidate;
use crate::estimate::leaps::{OFFSET, least_leap_pa};
use crate::estimate::sensor_noise;
use crate::finding::Finding;
use crate::laws::Law;
use crate::model::Side;
use crate::rig::Rig;
use crate::search::{Evidence, share_among};

/// The force that a gauge may be.
const FORCE: &str = "constant-force";

/// An offset of a gauge, and from which size on it would have shown, if in any, Pa.
type Gauge = (Candidate, Option<f64>);

/// Puts the gauges that the chambers could not have shown to be off beside a constant force
/// that is named in the carriage's law.
pub(crate) fn put_beside_force(rig: &Rig, laws: &mut [Finding]) {
    let chambers = laws.iter().find(|law| law.law == Law::Chambers);
    let [always, for_a_while] = chambers.map_or_else(Default::default, |law| {
        let for_a_while = (!law.has_named()).then(|| off_for_a_while(rig, &law.candidates));
        [always_off(law), for_a_while.unwrap_or_default()]
    });
    for law in laws {
        let Some((force, gain, force_n)) = named_force(law) else {
            continue;
        };
        let comes_and_goes = law.improved.presence.is_some();
        let gauges = if comes_and_goes {
            &for_a_while
        } else {
            &always
        };
        for gauge in hidden(rig, gauges, force_n) {
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

/// The gauges that may be off all the time, where the chambers' law has named nothing.
fn always_off(chambers: &Finding) -> Vec<Gauge> {
    let limits = chambers.limits.iter();
    let gauges = limits.map(|limit| {
        let sizes = limit.sizes.as_ref();
        let from_pa = sizes.and_then(|sizes| sizes.first()).map(|(_, size)| *size);
        (chambers.candidates[limit.candidate].clone(), from_pa)
    });
    gauges.filter(|(gauge, _)| gauge.effect == OFFSET).collect()
}

/// The gauges that may be off for a while.
fn off_for_a_while(rig: &Rig, candidates: &[Candidate]) -> Vec<Gauge> {
    let gauges = candidates.iter().filter(|one| one.effect == OFFSET);
    let leap = |gauge: &Candidate| {
        let side = side_of(gauge)?;
        let noise_pa = sensor_noise::declared(rig, side.pressure_signal())?;
        Some((gauge.clone(), Some(least_leap_pa(noise_pa))))
    };
    gauges.filter_map(leap).collect()
}

fn side_of(gauge: &Candidate) -> Option<Side> {
    let mut sides = Side::BOTH.into_iter();
    sides.find(|side| gauge.places.contains(&side.gauge_place()))
}

/// The constant force that is named, what it gains, and its size, N.
fn named_force(law: &Finding) -> Option<(usize, f64, f64)> {
    let mut named = law.evidence.iter().filter(|one| one.accepted);
    let force = named.find(|one| law.candidates[one.candidate].effect == FORCE)?;
    let free = law.candidates[force.candidate].free.first()?;
    let place = law.improved.place(&free.key)?;
    Some((force.candidate, force.gain, law.improved.values[place]))
}

/// The offsets of gauges that make such a force, and that the chambers would not have shown.
fn hidden(rig: &Rig, gauges: &[Gauge], force_n: f64) -> Vec<Candidate> {
    let may_be = |(gauge, from_pa): &&Gauge| {
        let area = side_of(gauge)
            .and_then(|side| rig.value(&format!("cylinder.area_{}_m2", side.letter())));
        let would_show =
            |area_m2: f64| from_pa.is_some_and(|from_pa| force_n.abs() >= area_m2 * from_pa.abs());
        area.is_some_and(|area_m2| !would_show(area_m2))
    };
    let hidden = gauges.iter().filter(may_be);
    hidden.map(|(gauge, _)| gauge.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::estimate::candidates::candidates;
    use crate::laws::Track;
    use truth_plant::{Kind, Request};

    fn hidden_at(force_n: f64, limit_pa: Option<f64>) -> Vec<&'static str> {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let all = candidates(Law::Chambers, &rig, &tracks, 1.0);
        let offsets = all.into_iter().filter(|one| one.effect == OFFSET);
        let gauges: Vec<Gauge> = offsets.map(|one| (one, limit_pa)).collect();
        let area_m2 = rig.value("cylinder.area_a_m2").unwrap();
        let found = hidden(&rig, &gauges, force_n * area_m2);
        found.iter().flat_map(|one| one.places.clone()).collect()
    }

    /// The force is here in newtons per square metre of the piston.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_a_gauge_stands_beside_the_force_that_it_makes_where_the_chambers_would_not_show_it() {
        let both = ["sensor.p_a", "sensor.p_b"];
        assert_eq!(hidden_at(2.9e3, Some(4e3)), both);
        assert_eq!(hidden_at(-2.9e3, Some(4e3)), both);
        assert_eq!(hidden_at(2.9e3, None), both);
        assert!(hidden_at(2.9e3, Some(1e3)).is_empty());
    }

    /// Both gauges off by 8 kPa for a fifth of the time, under 2.5 kPa of noise, were a constant
    /// force of 7.9 N.
    #[test]
    fn regress_a_force_for_a_while_may_be_a_gauge_whose_leap_noise_hides() {
        let hidden_under = |noise: f64| {
            let request = Request::new(9111, Kind::Nothing).with_noise(noise);
            let (rig, recordings) = drawn::read(&request);
            let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
            let all = candidates(Law::Chambers, &rig, &tracks, 1.0);
            hidden(&rig, &off_for_a_while(&rig, &all), -7.87).len()
        };
        assert_eq!([1.0, 10.0].map(hidden_under), [0, 2]);
    }
}
