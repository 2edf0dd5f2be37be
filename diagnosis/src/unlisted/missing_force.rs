//! What the force balance misses, as a short equation.
//!
//! The balance of a window is a mean of forces over its rows, so a term shows in it as the mean of
//! its values there. Windows in which the carriage slides or creeps count; break-aways, whose
//! residuals are limited, do not.
//!
//! A term of place, speed or way goes into the model as `[effects.force-equation]`, is fitted with
//! all ordinary parameters and judged as a table is ([`crate::unlisted::unknown_term`]). One of time is said
//! and stays out: no other recording begins at the same moment.

use crate::effects::load::force_equation::EFFECT;
use crate::estimate::candidates::Candidate;
use crate::estimate::refit::Refit;
use crate::estimate::{Bench, Fitted};
use crate::fit::law_problem::{Columns, Scope};
use crate::laws::{Law, Track, balance};
use crate::unlisted::equation::{self, Equation, Form, Missing, Term, Variable};

/// The effect that holds it.
pub(crate) const NAME: &str = EFFECT.name;
/// Where it acts.
pub(crate) const PLACE: &str = "force-balance";

/// More than three terms are no short equation.
const MOST_TERMS: usize = 3;

/// Names of the variables.
const POSITION: &str = "position";
const VELOCITY: &str = "velocity";
const TIME: &str = "time";

/// A coefficient may end this many times as large as the samples say.
const LARGER: f64 = 20.0;
/// No spring rests farther from where positions are counted, m.
const FARTHEST_REST_M: f64 = 1.0;
/// A way of a term may end this much longer or shorter.
const LONGER: f64 = 3.0;

/// The equation of what the balance misses beside a model; `None` where none explains it.
pub(crate) fn equation(bench: &Bench<'_>, model: &Fitted) -> Option<Equation> {
    if bench.law != Law::Balance {
        return None;
    }
    let [position, velocity, time] = variables(bench.tracks)?;
    let refit = Refit::new(bench, model, bench.noise.clone());
    let windows = Windows::of(bench, &refit.predicted);
    let beside = refit.beside(|columns| windows.sampled(columns));
    let constant = windows.shown(&ones(bench.tracks));
    let shows = |rows: &[Vec<f64>]| windows.shown(rows);
    let left = beside.left_of(&constant);
    let without_constant = |samples: &[f64]| equation::without(samples, &left, &constant);
    let reduced = |samples: &[f64]| without_constant(&beside.left_of(samples));
    let (missed, strain) = beside.left_of_missed(&windows.missed(&refit.predicted));
    let samples = without_constant(&missed);
    let library = vec![
        (Form::Linear, &position),
        (Form::Cubic, &position),
        (Form::Wave, &position),
        (Form::Trailing, &position),
        (Form::Square, &velocity),
        (Form::Linear, &time),
        (Form::Settling, &time),
        (Form::WaveByRecording, &time),
    ];
    equation::best(&Missing {
        quantity: "force",
        unit: "N",
        samples,
        strain,
        recording: windows.recordings(),
        shows: &shows,
        reduced: &reduced,
        most_terms: MOST_TERMS,
        library,
    })
}

/// Position, velocity and time of every recording.
fn variables(tracks: &[Track<'_>]) -> Option<[Variable; 3]> {
    let motions: Option<Vec<_>> = tracks.iter().map(|track| track.motion.as_ref()).collect();
    let motions = motions?;
    let of_motion = |of: fn(&crate::laws::Motion) -> &Vec<f64>| -> Vec<Vec<f64>> {
        motions.iter().map(|motion| of(motion).clone()).collect()
    };
    let since_start = |track: &Track<'_>| {
        let time_s = &track.recording.time_s;
        time_s.iter().map(|time| time - time_s[0]).collect()
    };
    let variable = |name, unit, columns| Variable {
        name,
        unit,
        resolution: 0.0,
        columns,
    };
    Some([
        variable(POSITION, "m", of_motion(|motion| &motion.position_m)),
        variable(
            VELOCITY,
            "m/s",
            of_motion(|motion| &motion.velocity_m_per_s),
        ),
        variable(TIME, "s", tracks.iter().map(since_start).collect()),
    ])
}

fn ones(tracks: &[Track<'_>]) -> Vec<Vec<f64>> {
    tracks.iter().map(|track| vec![1.0; track.len()]).collect()
}

/// A window of the balance.
struct Window {
    recording: usize,
    output: usize,
    row: usize,
    noise_n: f64,
}

/// The windows in which the carriage slides or creeps.
struct Windows {
    windows: Vec<Window>,
    weights: Vec<Vec<f64>>,
}

impl Windows {
    fn of(bench: &Bench<'_>, predicted: &[Columns]) -> Self {
        let mut windows = Vec::new();
        for (recording, columns) in predicted.iter().enumerate() {
            for output in (0..columns.len()).filter(|&output| !bench.is_of_events(output)) {
                let told = columns[output].iter().enumerate();
                let told = told.filter(|(_, balance)| balance.is_finite());
                windows.extend(told.map(|(row, _)| Window {
                    recording,
                    output,
                    row,
                    noise_n: bench.noise[output],
                }));
            }
        }
        windows.sort_by_key(|window| (window.recording, window.row));
        Self {
            windows,
            weights: bench.tracks.iter().map(balance::weights).collect(),
        }
    }

    fn recordings(&self) -> Vec<usize> {
        self.windows.iter().map(|window| window.recording).collect()
    }

    /// Columns at the windows, in units of their noise.
    fn sampled(&self, columns: &[Columns]) -> Vec<f64> {
        let at =
            |window: &Window| columns[window.recording][window.output][window.row] / window.noise_n;
        self.windows.iter().map(at).collect()
    }

    /// What the balance lacks where a model predicts this.
    fn missed(&self, predicted: &[Columns]) -> Vec<f64> {
        let mut samples = self.sampled(predicted);
        samples.iter_mut().for_each(|sample| *sample = -*sample);
        samples
    }

    /// How a force against +x shows, in units of the noise.
    fn shown(&self, force_n: &[Vec<f64>]) -> Vec<f64> {
        let of = |window: &Window| {
            let weights = &self.weights[window.recording];
            let first = window.row - weights.len() / 2;
            let rows = &force_n[window.recording][first..first + weights.len()];
            let mean_n: f64 = weights
                .iter()
                .zip(rows)
                .map(|(w, force_n)| w * force_n)
                .sum();
            -mean_n / window.noise_n
        };
        self.windows.iter().map(of).collect()
    }
}

/// The keys of a term's numbers; `None` where the law has no place for it.
fn keys(term: &Term) -> Option<&'static [&'static str]> {
    Some(match (term.form, term.variable) {
        (Form::Linear, POSITION) => &["spring_N_m", "rest_m"],
        (Form::Cubic, POSITION) => &["spring_N_m", "stiffening_N_m3", "rest_m"],
        (Form::Wave, POSITION) => &["sine_N", "cosine_N", "pitch_m"],
        (Form::Trailing, POSITION) => &["trailing_N", "path_m"],
        // Drag drives nothing.
        (Form::Square, VELOCITY) if term.coefficients[0].0 > 0.0 => &["drag_Ns2_m2"],
        _ => return None,
    })
}

/// The equation as something to put into the model; `None` where the law has no place for it.
pub(crate) fn candidate(equation: &Equation) -> Option<Candidate> {
    let begun = Candidate::new(NAME, &[PLACE]);
    equation.terms.iter().try_fold(begun, with_term)
}

fn with_term(candidate: Candidate, term: &Term) -> Option<Candidate> {
    let keys = keys(term)?;
    let begun = begun(term)?;
    let numbers = keys.iter().zip(begun);
    Some(
        numbers.fold(candidate, |candidate, (key, (start, bounds))| {
            candidate.free_as(key, Scope::Shared, bounds, None, &[start])
        }),
    )
}

/// Where each number of a term begins, in the order of its keys, and between which bounds it is
/// free.
fn begun(term: &Term) -> Option<Vec<(f64, (f64, f64))>> {
    let about = |value: f64, size: f64| (value, (-LARGER * size, LARGER * size));
    let rest = |value: f64| (value, (-FARTHEST_REST_M, FARTHEST_REST_M));
    let way = |value: f64| (value, (value / LONGER, value * LONGER));
    let first = term.coefficients[0].0;
    let shape = term.shape.map(|(value, _)| value);
    let force = about(first, first.abs());
    Some(match term.form {
        Form::Linear => vec![force, rest(0.0)],
        Form::Cubic => {
            let [stiffness, stiffening, rest_m] = term.spring()?;
            let size = stiffness.abs() + first.abs();
            vec![
                about(stiffness, size),
                about(stiffening, stiffening.abs()),
                rest(rest_m),
            ]
        }
        Form::Wave => {
            let (amplitude, _) = term.amplitude()?;
            let cosine = term.coefficients[1].0;
            vec![
                about(first, amplitude),
                about(cosine, amplitude),
                way(shape?),
            ]
        }
        Form::Square => vec![(first, (0.0, LARGER * first))],
        Form::Trailing => vec![force, way(shape?)],
        _ => return None,
    })
}

/// The equation with the numbers of a model that holds it.
pub(crate) fn as_fitted(mut equation: Equation, model: &Fitted) -> Equation {
    let number = |key: &str| {
        let place = model.place(&format!("effects.{NAME}.{key}"))?;
        let deviation = model.standard_deviations[place].unwrap_or(f64::INFINITY);
        Some((model.values[place], deviation))
    };
    for term in &mut equation.terms {
        let Some(keys) = keys(term) else { continue };
        let numbers: Vec<(f64, f64)> = keys.iter().filter_map(|key| number(key)).collect();
        term.refit(&numbers);
    }
    equation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::search;
    use truth_plant::Strength;

    /// The equation of an axis of the other plant with an effect of no list, of one term.
    fn found(seed: u64, effect: &str) -> Term {
        let (rig, recordings) = drawn::off_list(seed, Strength::Medium, effect);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(Law::Balance, &rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        bench.learn_noise(&baseline, &[]);
        let mut equation = equation(&bench, &baseline).unwrap();
        println!("{}; {}", equation.text(), equation.share);
        assert!(equation.share > 0.9, "{}", equation.share);
        assert_eq!(equation.terms.len(), 1);
        equation.terms.remove(0)
    }

    fn assert_near(value: f64, truth: f64, part: f64) {
        assert!((value / truth - 1.0).abs() < part, "{value} for {truth}");
    }

    /// Drawn were 7.062 N over 35.36 mm.
    #[test]
    fn val_a_dragged_cable_trails_over_its_path() {
        let term = found(78, "cable-drag");
        assert_eq!((term.form, term.variable), (Form::Trailing, POSITION));
        assert_near(term.coefficients[0].0, 7.062, 0.1);
        assert_near(term.shape.unwrap().0, 35.36e-3, 0.1);
    }

    /// Drawn were 6.053 N at 6.918 Hz.
    #[test]
    fn val_a_force_that_swings_with_time_is_a_sine_of_its_period() {
        let term = found(78, "periodic-force");
        assert_eq!((term.form, term.variable), (Form::WaveByRecording, TIME));
        assert_near(term.amplitude().unwrap().0, 6.053, 0.1);
        assert_near(1.0 / term.shape.unwrap().0, 6.918, 0.01);
    }
}
