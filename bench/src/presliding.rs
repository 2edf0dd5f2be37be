//! Friction before break-away, (9) of the paper: stiffness and damping of the bristles.
//!
//! The carriage is moved through displacements of some micrometres, and through reversals; the
//! force follows the bristles' deflection. The law is the one of a force bench
//! (`grey_box::laws`): recorded displacement in, force out, with the contact's memory. Free are
//! stiffness, damping, both dry levels, and a zero of the force that drifts.

use grey_box::fit::Parameter;
use grey_box::laws::{Law, Track};
use grey_box::model::Values;
use grey_box::rig::Rig;

use crate::least_squares::{Solved, correlation_length, fitted};
use crate::outcome::{Kind, Number, Outcome, Picture, Stretch};
use crate::steady;

/// The outcome depends on numbers under these sections.
pub const DEPENDS_ON: &[&str] = &[
    "friction.viscous",
    "friction.stribeck",
    "cylinder.area",
    "carriage.mass",
];
/// The numbers that are sought, in the order of the parameters.
const KEYS: [&str; 4] = [
    "friction.bristle_stiffness_N_m",
    "friction.bristle_damping_Ns_m",
    "friction.coulomb_N",
    "friction.static_N",
];
/// Time between two knots of the force's zero, s: sensors drift over many seconds.
const KNOT_S: f64 = 5.0;
/// Starts of the stiffness, N/m: seals of small and of large cylinders.
const STIFFNESSES: [f64; 2] = [1e5, 1e6];
/// Points of a picture.
const SHOWN: usize = 4000;

/// Evaluates recordings of small displacements.
///
/// # Errors
/// If force or position are not recorded, or nothing of the contact is to be seen.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let mut rig = rig.clone();
    rig.friction.get_or_insert_default();
    let bench = Bench::of(&rig, tracks)?;
    let solved = bench.solve()?;
    let residuals = bench.residuals(&solved.values);
    let correlated = correlation_length(&residuals).sqrt();
    let mut numbers = Vec::new();
    let mut notes = Vec::new();
    for (place, key) in KEYS.iter().enumerate() {
        let (value, deviation) = solved.at(place);
        // Parameters are in units of their starts.
        let value = value * bench.units[place];
        let deviation =
            (deviation * bench.units[place] * correlated).hypot(steady::FORCE_LINEARITY * value);
        if deviation.is_finite() && deviation < value {
            numbers.push(Number::of_key(key, value, deviation));
        } else {
            notes.push(format!("{key} is not seen: it stays as it is"));
        }
    }
    if !numbers.iter().any(|one| one.key == KEYS[0]) {
        return Err("the recordings do not show the bristles: displacements of some micrometres with reversals, \
                    and a position sensor finer than a tenth of that, are needed"
            .into());
    }
    Ok(Outcome {
        title: "Presliding",
        method: "The recorded displacement drives the law of the bristles, whose force is compared with the recorded one: \
                 stiffness, damping and both dry levels are fitted to all rows, beside a zero of the force that drifts.",
        numbers,
        stretches: tracks.iter().map(whole).collect(),
        notes,
        pictures: bench.pictures(&solved),
        ..Outcome::default()
    })
}

fn whole(track: &Track<'_>) -> Stretch {
    Stretch::of(track.recording, &(0..track.len()), "displacement and force")
}

struct Bench<'a> {
    rig: &'a Rig,
    tracks: &'a [Track<'a>],
    noise_n: f64,
    /// Starts of the numbers; parameters are in units of these.
    units: [f64; 4],
    /// The first knot of each recording among the parameters.
    knots: Vec<usize>,
    parameters: usize,
}

impl<'a> Bench<'a> {
    fn of(rig: &'a Rig, tracks: &'a [Track<'a>]) -> Result<Self, String> {
        let mut largest_n: f64 = 0.0;
        let mut noise_n: f64 = 0.0;
        let mut knots = Vec::new();
        let mut parameters = KEYS.len();
        for track in tracks {
            let force = track.recording.signal("force").ok_or(format!(
                "{}: no force is recorded: the bristles are seen by it",
                track.recording.name
            ))?;
            if track.motion.is_none() {
                return Err(format!("{}: no position is recorded", track.recording.name));
            }
            let middle = steady::mean(force);
            largest_n = force
                .iter()
                .map(|one| (one - middle).abs())
                .fold(largest_n, f64::max);
            noise_n = noise_n.max(steady::signal_noise(rig, "force", force));
            knots.push(parameters);
            parameters += 2 + (track.recording.duration_s() / KNOT_S) as usize;
        }
        let damping = rig
            .value(KEYS[1])
            .filter(|one| *one > 0.0)
            .unwrap_or(1000.0);
        Ok(Self {
            rig,
            tracks,
            noise_n,
            units: [STIFFNESSES[0], damping, 0.8 * largest_n, largest_n],
            knots,
            parameters,
        })
    }

    fn solve(&self) -> Result<Solved, String> {
        let residuals = |numbers: &[f64]| self.residuals(numbers);
        let mut best: Option<Solved> = None;
        for stiffness in STIFFNESSES {
            let mut parameters = vec![
                Parameter::new(stiffness / self.units[0]).bounded(1e-3, 1e4),
                Parameter::new(1.0).bounded(0.0, 100.0),
                Parameter::new(1.0).bounded(0.01, 10.0),
                Parameter::new(1.0).bounded(0.01, 10.0),
            ];
            parameters.resize(self.parameters, Parameter::new(0.0));
            let solved = fitted(&parameters, &residuals)?;
            if best
                .as_ref()
                .is_none_or(|best| solved.squares < best.squares)
            {
                best = Some(solved);
            }
        }
        best.ok_or_else(|| "nothing to fit".into())
    }

    /// Force by the law with these numbers, N, without the zero.
    fn law_n(&self, numbers: &[f64], track: &Track<'_>) -> Vec<f64> {
        let keys = KEYS.map(String::from);
        let replaced: Vec<f64> = (0..KEYS.len())
            .map(|place| numbers[place] * self.units[place])
            .collect();
        let values = Values {
            rig: self.rig,
            keys: &keys,
            replaced: &replaced,
        };
        let mut force_n = vec![0.0; track.len()];
        let mut sink = |row: usize, outputs: &[f64], _: &[f64]| force_n[row] = outputs[0];
        Law::Force.predict(&values, track, 0..track.len(), &[], &mut sink);
        force_n
    }

    /// The zero of the force at a row, between knots.
    fn zero_n(&self, numbers: &[f64], recording: usize, row: usize) -> f64 {
        let time_s = &self.tracks[recording].recording.time_s;
        let last = self
            .knots
            .get(recording + 1)
            .copied()
            .unwrap_or(self.parameters);
        let knots = &numbers[self.knots[recording]..last];
        let along = (time_s[row] - time_s[0]) / KNOT_S;
        let before = (along as usize).min(knots.len() - 2);
        knots[before] + (along - before as f64) * (knots[before + 1] - knots[before])
    }

    fn residuals(&self, numbers: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        for (recording, track) in self.tracks.iter().enumerate() {
            let force = track.recording.signal("force").unwrap_or(&[]);
            for (row, law_n) in self.law_n(numbers, track).into_iter().enumerate() {
                all.push(
                    (force[row] - law_n - self.zero_n(numbers, recording, row)) / self.noise_n,
                );
            }
        }
        all
    }

    fn pictures(&self, solved: &Solved) -> Vec<Picture> {
        let mut loops = Picture::new(
            "Friction over the displacement",
            ("position", "µm"),
            ("force along the motion", "N"),
        );
        let mut times = Picture::new(
            "Force over time",
            ("time", "s"),
            ("force along the motion", "N"),
        );
        for (recording, track) in self.tracks.iter().enumerate() {
            let (Some(force), Some(motion)) = (track.recording.signal("force"), &track.motion)
            else {
                continue;
            };
            let law_n = self.law_n(&solved.values, track);
            let every = track.len().div_ceil(SHOWN).max(1);
            let rows: Vec<usize> = (0..track.len()).step_by(every).collect();
            let middle_m = steady::mean(&motion.position_m);
            let at_um = |row: usize| 1e6 * (motion.position_m[row] - middle_m);
            // Against +x in the file; along it a push is positive.
            let zero_n = |row: usize| self.zero_n(&solved.values, recording, row);
            let measured = |row: &usize| zero_n(*row) - force[*row];
            let name = &track.recording.name;
            let over = |of: &dyn Fn(&usize) -> (f64, f64)| rows.iter().map(of).collect::<Vec<_>>();
            loops = loops
                .with(
                    format!("{name}, recorded"),
                    Kind::Recorded,
                    over(&|row| (at_um(*row), measured(row))),
                )
                .with(
                    format!("{name}, law"),
                    Kind::Law,
                    over(&|row| (at_um(*row), -law_n[*row])),
                );
            let time_s = &track.recording.time_s;
            times = times
                .with(
                    format!("{name}, recorded"),
                    Kind::Recorded,
                    over(&|row| (time_s[*row], measured(row))),
                )
                .with(
                    format!("{name}, law"),
                    Kind::Law,
                    over(&|row| (time_s[*row], -law_n[*row])),
                );
        }
        vec![loops, times]
    }
}
