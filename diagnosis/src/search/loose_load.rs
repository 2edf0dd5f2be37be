//! A load in its play, fitted to windows of the carriage's position.
//!
//! The balance of forces follows the load behind the recorded motion through the whole
//! recording: an error of its place makes it meet the carriage at a wrong moment, and the
//! next error is larger. A soft contact that does not bounce is least harmed by that, so
//! the balance finds that there is a play, how wide it is and how heavy the load, but a
//! contact six times too soft (36 N/mm for 200 N/mm on a practice axis). Over a window of
//! a quarter of a second, begun with the load where the forces before it show it to be
//! ([`crate::laws`]), the blows are few, and how the carriage rings after them says
//! what the contact is.
//!
//! In some windows the load is met at a wrong moment all the same. Squares would be made
//! of those alone, so a window counts by ln(1 + E / M), with E its mean square and M the
//! median one at the start (Cauchy's likelihood). All numbers are varied together, by
//! values; then derivatives lead on. There are many hollows: three starts are followed, and
//! how far their ends lie apart is counted into how well each number is known.
//!
//! What else was found with the load as the balance has it is then asked for again.

use crate::estimate::fitted::without;
use crate::estimate::{Bench, Fitted};
use crate::fit::compass::{self, Varied};
use crate::fit::law_problem::{FreeParameter, windows};
use crate::laws::{Law, balance, median};
use rayon::prelude::*;

/// A contact of metal, stiffness in N/m and damping in N s/m: it bounces.
const HARD_CONTACT: (f64, f64) = (2e5, 100.0);
/// Plays with which a hard contact is tried, over that of the soft one ...
const PLAYS: [f64; 5] = [0.35, 0.5, 0.7, 1.0, 1.4];
/// ... of which so many are followed.
const FOLLOWED: usize = 2;

/// What the windows come to.
pub(crate) struct Refined {
    /// The model of the balance that they began with, without what is needless.
    pub begun: Fitted,
    /// The same with its numbers fitted to them.
    pub model: Fitted,
    /// The candidate with the play.
    pub candidate: usize,
    /// Effects beside it that are needed no more, now that the load is as they show it.
    pub needless: Vec<usize>,
    /// Part of the energy that the refitted baseline leaves of the windows that the model
    /// explains.
    pub share: f64,
}

/// The model with its numbers fitted to the windows, if it holds a load in its play and the
/// windows show it better than where the balance ended.
pub(crate) fn refined(searched: &Bench<'_>, baseline: &Fitted, model: &Fitted) -> Option<Refined> {
    let is_loose = |index: &usize| searched.candidates[*index].is_rough;
    let candidate = *model.set.iter().find(|index| is_loose(index))?;
    if searched.law != Law::Balance || model.presence.is_some() {
        return None;
    }
    let mut bench = Bench::new(Law::Carriage, searched.rig, searched.tracks);
    bench.candidates.clone_from(&searched.candidates);
    let windows = Windows::new(&bench, &bench.restricted(model, &model.set))?;
    let (mut begun, mut kept) = (model.clone(), windows.refined(searched, model)?);
    let mut needless = Vec::new();
    for companion in without(&model.set, candidate) {
        let Some(fewer) = searched.without(&begun, companion) else {
            continue;
        };
        let end = windows.ended(searched, &fewer, &kept);
        if let Some(end) = end.filter(|end| windows.are_met_by(searched, end, &kept)) {
            (begun, kept) = (fewer, end);
            needless.push(companion);
        }
    }
    let energy = |model: &Fitted| {
        let model = bench.restricted(model, &model.set);
        mean_squares(&bench, &model).iter().sum::<f64>()
    };
    Some(Refined {
        share: 1.0 - energy(&kept) / energy(&bench.restricted(baseline, &[])),
        begun,
        model: kept,
        candidate,
        needless,
    })
}

/// The model of the balance with the numbers of the carriage.
fn in_terms_of(searched: &Bench<'_>, model: &Fitted, carriage: &Fitted) -> Fitted {
    let place = |name: &String| carriage.place(name);
    let places: Vec<Option<usize>> = model.names.iter().map(place).collect();
    let values = places.iter().zip(&model.values);
    let values = values.map(|(place, value)| place.map_or(*value, |place| carriage.values[place]));
    let known = places.iter().zip(&model.standard_deviations);
    let known = known
        .map(|(place, known)| place.map_or(*known, |place| carriage.standard_deviations[place]));
    Fitted {
        standard_deviations: known.collect(),
        ..searched.with_values(model, values.collect())
    }
}

/// The windows of a bench's recordings.
struct Windows<'a> {
    bench: &'a Bench<'a>,
    count: usize,
    /// The median mean square of a window at the start, m2.
    usual: f64,
}

impl<'a> Windows<'a> {
    fn new(bench: &'a Bench<'a>, begun: &Fitted) -> Option<Self> {
        let squares = mean_squares(bench, begun);
        let count = squares.len();
        let usual = median(squares)?;
        Some(Self {
            bench,
            count,
            usual: usual.max(bench.noise[0].powi(2)),
        })
    }

    /// A model of the balance with its numbers fitted to the windows, if they are met better so
    /// than where the balance ended.
    fn refined(&self, searched: &Bench<'_>, model: &Fitted) -> Option<Fitted> {
        let begun = self.bench.restricted(model, &model.set);
        let mut starts = self.hard_contacts(&begun)?;
        self.best_first(&mut starts);
        starts.truncate(FOLLOWED);
        starts.push(begun.clone());
        let followed = |start| self.followed(start, 1.0);
        let mut ends: Vec<Fitted> = starts.par_iter().filter_map(followed).collect();
        self.best_first(&mut ends);
        let mut best = self.followed(ends.first()?, 0.5)?;
        best.standard_deviations = self.deviations(&best, &ends);
        let is_better = self.cost(&best) < self.cost(&begun);
        is_better.then(|| in_terms_of(searched, model, &best))
    }

    /// A model of the balance where it meets the windows best: refined by itself, or led on from the
    /// numbers of one with more effects. (There are many hollows, and beside an effect that came to
    /// nothing it stands in the same.)
    fn ended(&self, searched: &Bench<'_>, model: &Fitted, more: &Fitted) -> Option<Fitted> {
        let led_on = || {
            let end = self.followed(&self.bench.restricted(more, &model.set), 0.5)?;
            Some(in_terms_of(searched, model, &end))
        };
        let (refined, led_on) = rayon::join(|| self.refined(searched, model), led_on);
        let costly = [refined, led_on].into_iter().flatten().map(|end| {
            let of_windows = self.bench.restricted(&end, &end.set);
            (self.cost(&of_windows), end)
        });
        let best = costly.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, end)| end)
    }

    /// Whether a model with fewer effects meets windows and break-aways as well, each of its
    /// numbers less counted as much as in Schwarz's criterion. What the balance found beside a load
    /// that it has wrong may make up for that: a contact six times too soft had a friction by
    /// pressure beside it.
    fn are_met_by(&self, searched: &Bench<'_>, fewer: &Fitted, more: &Fitted) -> bool {
        let [(cost, _), (before, seen)] = [fewer, more].map(|model| self.missed(searched, model));
        let numbers = more.shared.saturating_sub(fewer.shared);
        cost - before < 0.5 * numbers as f64 * (seen as f64).ln()
    }

    /// The cost of windows and break-aways together, and how many there are.
    fn missed(&self, searched: &Bench<'_>, model: &Fitted) -> (f64, usize) {
        let noise_n = searched.noise[balance::BREAKAWAY];
        let events = searched.missed_at_events(model);
        let told = events.iter().filter(|missing_n| missing_n.is_finite());
        let counted = told.map(|missing_n| (missing_n / noise_n).powi(2).ln_1p());
        let counted: Vec<f64> = counted.collect();
        let of_windows = self.cost(&self.bench.restricted(model, &model.set));
        let of_events = 0.5 * counted.iter().sum::<f64>();
        (of_windows + of_events, self.count + counted.len())
    }

    /// Half the logarithm of the likelihood, with the priors, without its sign.
    fn cost(&self, model: &Fitted) -> f64 {
        let of_window = |square: f64| {
            let counted = (1.0 + square / self.usual).ln();
            if counted.is_nan() {
                f64::INFINITY
            } else {
                counted
            }
        };
        let squares = mean_squares(self.bench, model).into_iter();
        0.5 * (squares.map(of_window).sum::<f64>() + self.bench.contradiction(model))
    }

    /// Sorts models by their costs, each a run of all recordings and so counted once.
    fn best_first(&self, models: &mut Vec<Fitted>) {
        let costly = models.drain(..).map(|model| (self.cost(&model), model));
        let mut costly: Vec<(f64, Fitted)> = costly.collect();
        costly.sort_by(|a, b| a.0.total_cmp(&b.0));
        models.extend(costly.into_iter().map(|(_, model)| model));
    }

    /// The model with a hard contact, and several plays.
    fn hard_contacts(&self, model: &Fitted) -> Option<Vec<Fitted>> {
        let place = |key: &str| {
            let is_it = |name: &String| name.ends_with(&format!("load-backlash.{key}"));
            model.names.iter().position(is_it)
        };
        let [stiffness, damping] = [place("stiffness_N_m")?, place("damping_Ns_m")?];
        let gap = place("gap_m")?;
        let with = |play: f64| {
            let mut values = model.values.clone();
            (values[stiffness], values[damping]) = HARD_CONTACT;
            values[gap] *= play;
            Fitted {
                values,
                ..model.clone()
            }
        };
        Some(PLAYS.map(with).to_vec())
    }

    /// Where values and then derivatives lead from a start; `part` as for the values.
    fn followed(&self, start: &Fitted, part: f64) -> Option<Fitted> {
        let walked = self.walked(start, part);
        let led = self.bench.finished(&walked)?;
        Some(if self.cost(&led) < self.cost(&walked) {
            led
        } else {
            Fitted {
                standard_deviations: led.standard_deviations,
                ..walked
            }
        })
    }

    /// How well each number is known: by the derivatives at the best end, and by how far from
    /// it the other ends are, as much as the windows allow for them.
    fn deviations(&self, best: &Fitted, ends: &[Fitted]) -> Vec<Option<f64>> {
        let least = self.cost(best);
        let weighed = ends
            .iter()
            .map(|end| (end, (least - self.cost(end)).exp().min(1.0)));
        let weighed: Vec<(&Fitted, f64)> = weighed.collect();
        let all: f64 = weighed.iter().map(|(_, weight)| weight).sum();
        let known = |(index, here): (usize, &Option<f64>)| {
            let apart = |(end, weight): &(&Fitted, f64)| {
                weight * (end.values[index] - best.values[index]).powi(2)
            };
            let apart = weighed.iter().map(apart).sum::<f64>() / (1.0 + all);
            here.map(|here| here.hypot(apart.sqrt()))
        };
        best.standard_deviations
            .iter()
            .enumerate()
            .map(known)
            .collect()
    }

    /// The model with its shared numbers where the windows are met best, near to where
    /// they are: `part` of what is not known of each is the first step.
    fn walked(&self, model: &Fitted, part: f64) -> Fitted {
        let free = self.bench.free(&model.set);
        let varied = |(free, &start): (&FreeParameter, &f64)| {
            let unsure = free.parameter.prior.map_or(f64::INFINITY, |prior| {
                prior.standard_deviation / prior.mean.abs()
            });
            Varied::of(free.parameter, start, part * unsure.min(compass::WIDE_STEP))
        };
        let begun: Vec<Varied> = free.iter().zip(&model.values).map(varied).collect();
        let moved = |numbers: &[f64]| {
            let mut values = model.values.clone();
            values[..numbers.len()].copy_from_slice(numbers);
            Fitted {
                values,
                ..model.clone()
            }
        };
        let end = compass::descend(&begun, |numbers| self.cost(&moved(numbers)));
        self.bench.with_values(model, moved(&end).values)
    }
}

/// The mean square of each window of every recording, m2.
fn mean_squares(bench: &Bench<'_>, model: &Fitted) -> Vec<f64> {
    let residuals = bench.residuals_of(model);
    let of_recording = |(track, residuals): (&crate::laws::Track<'_>, &Vec<f64>)| {
        let window_s = bench.law.fit_window_s().unwrap_or(f64::INFINITY);
        let of_window = |rows: std::ops::Range<usize>| {
            let count = rows.len().max(1) as f64;
            residuals[rows]
                .iter()
                .map(|error| error * error)
                .sum::<f64>()
                / count
        };
        let windows = windows(&track.recording.time_s, window_s).into_iter();
        windows.map(of_window).collect::<Vec<f64>>()
    };
    let pairs = bench.tracks.iter().zip(&residuals[0]);
    pairs.flat_map(of_recording).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::estimate::candidates::candidates;
    use crate::laws::Track;
    use crate::model::Values;
    use crate::random::Noise;
    use crate::recording::Recording;
    use crate::rig::Rig;
    use model_core::carriage::CarriageState;
    use std::collections::BTreeMap;

    const RIG: &str = r#"
        format = "rig/1"
        [signals]
        t = { column = "t", unit = "s" }
        x = { column = "x", unit = "m", noise = 4e-6 }
        p_a = { column = "p_a", unit = "Pa(abs)" }
        p_b = { column = "p_b", unit = "Pa(abs)" }
        [cylinder]
        area_a_m2 = 4.909e-4
        area_b_m2 = 4.909e-4
        [carriage]
        mass_kg = 2.0
        [friction]
        bristle_stiffness_N_m = 9.14e5
        bristle_damping_Ns_m = 1327.0
        coulomb_N = 20.2
        static_N = 28.9
        viscous_Ns_m = 65.9
        stribeck_velocity_m_s = 5.03e-3
        [uncertainty]
        "carriage.mass_kg" = 0.02
        "friction.coulomb_N" = 0.1
        "friction.viscous_Ns_m" = 0.1
    "#;
    const LOAD: [(&str, f64); 4] = [
        ("load_mass_kg", 0.9),
        ("stiffness_N_m", 1.5e5),
        ("damping_Ns_m", 120.0),
        ("gap_m", 2e-3),
    ];

    fn with_load(rig: &Rig, load: [(&str, f64); 4]) -> Rig {
        let number = |(name, value)| (key(name), value);
        rig.with_values(&load.map(number).into_iter().collect())
    }

    /// 6 s of a carriage with a loose load under a drive that reverses hard.
    fn recorded(rig: &Rig, pace: f64) -> Recording {
        let area_m2 = 4.909e-4;
        let values = Values::of(rig);
        let (carriage, levels) = (values.carriage(), values.friction_levels());
        let drive_n =
            |time_s: f64| 90.0 * (12.0 * pace * time_s).sin() + 40.0 * (31.0 * pace * time_s).sin();
        let mut noise = Noise::new(1, 1);
        let mut state = CarriageState::new(0.0, 0.0);
        let time_s: Vec<f64> = (0..6000).map(|row| f64::from(row) * 1e-3).collect();
        let mut position_m = Vec::new();
        for time in &time_s {
            position_m.push(state.position_m.value + 4e-6 * noise.normal());
            for step in 0..10 {
                let within_s = (f64::from(step) + 0.5) * 1e-4;
                carriage.step(&mut state, &levels, drive_n(time + within_s), 1e-4);
            }
        }
        let pressure_b = vec![5e5; time_s.len()];
        let pressure_a = time_s.iter().map(|time| 5e5 + drive_n(*time) / area_m2);
        let signals = BTreeMap::from([
            ("x".to_owned(), position_m),
            ("p_a".to_owned(), pressure_a.collect()),
            ("p_b".to_owned(), pressure_b),
        ]);
        Recording::from_signals("loose", time_s, signals)
    }

    /// The load of [`LOAD`] as a balance has it, the contact too soft, in a set.
    fn softly(bench: &Bench<'_>, baseline: &Fitted, set: &[usize]) -> Fitted {
        let mut model = bench.restricted(baseline, set);
        for (name, value) in [
            ("load_mass_kg", 0.8),
            ("stiffness_N_m", 3e4),
            ("damping_Ns_m", 600.0),
            ("gap_m", 1.8e-3),
        ] {
            let place = model.place(&key(name)).unwrap();
            model.values[place] = value;
        }
        model
    }

    fn key(name: &str) -> String {
        format!("effects.load-backlash.{name}")
    }

    /// A bench with candidates, its refit, and which is the load.
    fn searched<'a>(rig: &'a Rig, tracks: &'a [Track<'a>]) -> (Bench<'a>, Fitted, usize) {
        let mut bench = Bench::new(Law::Balance, rig, tracks);
        bench.candidates = candidates(Law::Balance, rig, tracks, 1.0);
        let baseline = bench.fit(&[], None).unwrap();
        let load = bench.candidates.iter().position(|one| one.is_rough);
        (bench, baseline, load.unwrap())
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_a_contact_that_the_balance_finds_too_soft_is_found_hard() {
        let rig = Rig::parse(RIG, "rig.toml").unwrap();
        let loose = with_load(&rig, LOAD);
        let recordings = [recorded(&loose, 1.0), recorded(&loose, 0.83)];
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline, load) = searched(&rig, &tracks);
        let refined = refined(&bench, &baseline, &softly(&bench, &baseline, &[load])).unwrap();
        assert_eq!((refined.candidate, refined.needless), (load, Vec::new()));
        assert!(refined.share > 0.8, "{}", refined.share);
        for (name, truth) in LOAD {
            let found = refined.model.value(&key(name)).unwrap();
            println!("{name}: {found} of {truth}");
            // A contact is known by its few blows: its stiffness to a third, its damping to a half.
            let part = match name {
                "damping_Ns_m" => 0.5,
                "stiffness_N_m" => 0.35,
                _ => 0.25,
            };
            assert!(
                (found / truth).ln().abs() < part,
                "{name}: {found} of {truth}"
            );
        }
    }

    /// What is there beside the load stays, what is not goes.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_an_effect_beside_a_load_is_asked_for_again() {
        const ASYMMETRY: &str = "effects.direction-dependent-friction.asymmetry";
        let given = Rig::parse(RIG, "rig.toml").unwrap();
        for asymmetry in [0.0, 0.25] {
            let numbers = BTreeMap::from([(ASYMMETRY.to_owned(), asymmetry)]);
            let loose = with_load(&given, LOAD).with_values(&numbers);
            let recordings = [recorded(&loose, 1.0), recorded(&loose, 0.83)];
            let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
            let (bench, baseline, load) = searched(&given, &tracks);
            let of_direction =
                drawn::tried(&bench, "direction-dependent-friction", "force-balance");
            let mut set = vec![load, of_direction];
            set.sort_unstable();
            let begun = bench.finished(&softly(&bench, &baseline, &set)).unwrap();
            let refined = refined(&bench, &baseline, &begun).unwrap();
            let found = refined.model.value(ASYMMETRY);
            println!("{asymmetry}: {found:?}, needless {:?}", refined.needless);
            let needless = if asymmetry > 0.0 {
                Vec::new()
            } else {
                vec![of_direction]
            };
            assert_eq!(refined.needless, needless);
        }
    }
}
