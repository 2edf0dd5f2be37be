//! Which one input of the chambers, if it were not what the model takes it for,
//! would explain what they miss.
//!
//! An effect of no list has no parameters to fit, but it has a place: a command
//! that is off shows in both chambers, with the signs and sizes of the valve's
//! slopes; a supply that is off shows in the one that is fed; a leak in one alone.
//! So the law is run in short windows that each begin from what was measured. In
//! every window one input may be off by what explains most (one number for all rows
//! and both chambers), while the ordinary parameters are refitted for all windows
//! together, from the rig as given: a refit without the input has bent them around
//! what is missing. The input that leaves least is the place. What it would have had
//! to be, window by window, is then looked at over time and state like any misfit.
//!
//! The fit: with errors r, their slopes S by the ordinary parameters and g by the
//! input, the best value in a window is a = -g (r + S d) / g g; what it cannot
//! explain, r and S less their parts along g, gives the step d (Gauss and Newton,
//! with the engineer's uncertainties as priors). No input is let further off than such
//! an input ever is: surroundings of five bar would explain what a command of 20 mV does.
//! S is taken once, at the rig as given, for all inputs and steps: it is most of the
//! work, and the errors are always those of the rig at hand.
//!
//! Limits: a window is a tenth of a second, so an input that changes faster shows
//! only in part. More air through the valve's supply side and a higher supply
//! pressure have one direction: what the needed change goes with decides.

use super::fitted::{Bench, Fitted};
use super::locate::{self, Located};
use crate::fit::Parameter;
use crate::fit::law_problem::{Columns, FreeParameter, LawProblem, windows};
use crate::laws::{Law, View, median};
use crate::rig::Rig;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Length of a window, s.
const WINDOW_S: f64 = 0.1;
/// An input that explains less than this of the energy above the noise is not the
/// place: half, or another part is missing as well.
const LEAST_SHARE: f64 = 0.5;
/// Inputs that explain this part of what the best does are not told apart by it.
const AS_GOOD: f64 = 0.95;
/// Steps of the ordinary parameters.
const ROUNDS: usize = 8;
/// The slope by an ordinary parameter is taken over this part of its uncertainty.
const STEP: f64 = 0.1;
/// A value with a larger deviation than this many times the median one says
/// nothing: the valve was shut, say. Nor does one at the end of its range.
const WORST_DEVIATION: f64 = 3.0;

/// An input and the small shift with which its direction is found.
struct Input {
    what: locate::Input,
    /// Numbers of the rig that shift together, each by this much.
    shifts: Vec<(&'static str, f64)>,
    /// The shift in the input's unit.
    size: f64,
    /// No such input is ever further off; chosen.
    most: f64,
}

/// What there is, with shifts that matter little.
fn inputs() -> Vec<Input> {
    let input = |place, quantity, unit, shifts: &[(&'static str, f64)], size, most| Input {
        what: locate::Input {
            place,
            quantity,
            unit,
        },
        shifts: shifts.to_vec(),
        size,
        most,
    };
    let leak = 1e-17;
    let mut all = vec![
        input(
            "valve-command",
            "command",
            "V",
            &[("valve.null_V", -0.005)],
            0.005,
            0.5,
        ),
        input(
            "supply",
            "supply pressure",
            "Pa",
            &[("supply.pressure_Pa", 1e3)],
            1e3,
            1.5e5,
        ),
        input(
            "exhaust",
            "pressure of the surroundings",
            "Pa",
            &[("environment.pressure_Pa", 200.0)],
            200.0,
            5e4,
        ),
    ];
    let (supply, exhaust) = (
        ("valve.supply_area_m2", 0.01),
        ("valve.exhaust_area_m2", 0.01),
    );
    for shifts in [&[supply, exhaust][..], &[supply], &[exhaust]] {
        all.push(input(
            "valve-flow",
            "share of the valve's flow",
            "1",
            shifts,
            0.01,
            0.7,
        ));
    }
    for (place, key) in [
        ("chamber-a", "effects.chamber-leakage.laminar_a_kg_s_Pa2"),
        ("chamber-b", "effects.chamber-leakage.laminar_b_kg_s_Pa2"),
    ] {
        // At 6 bar 5e-15 is some 130 l/min: a fifth of what the valve passes.
        let shifts = &[(key, leak)];
        all.push(input(place, "leak", "kg/(s Pa2)", shifts, leak, 5e-15));
    }
    all
}

/// Where a window begins.
struct Start {
    rows: Range<usize>,
    states: Vec<f64>,
}

/// One window: its rows and what the prediction is too high by, in units of the
/// noise, all outputs after each other.
struct Window {
    recording: usize,
    rows: Range<usize>,
    errors: Vec<f64>,
}

/// What an input does to the errors.
struct Direction {
    /// Slopes of every window's errors.
    slopes: Vec<Vec<f64>>,
    /// How far the input may be off.
    most: f64,
}

/// The windows under some ordinary parameters, with an input.
struct Explained {
    windows: Vec<Window>,
    /// By window: what the input would have to be, and its deviation.
    needed: Vec<Option<(f64, f64)>>,
    /// Energy that is left, priors counted in.
    left: f64,
}

/// The input that explains most of what the chambers' baseline misses, with what it
/// goes with; `None` where no single one explains it.
pub(super) fn find(bench: &Bench<'_>, baseline: &Fitted) -> Option<Located> {
    if bench.law != Law::Chambers || bench.rig.valve.is_none() {
        return None;
    }
    let windowed = Windowed::new(bench, baseline);
    let without = windowed.explained(None)?;
    let dimensions: usize = without
        .windows
        .iter()
        .map(|window| window.errors.len())
        .sum();
    let above_noise = without.left - dimensions as f64;
    let chance = without.windows.len() as f64;
    let known: Vec<Input> = inputs()
        .into_iter()
        .filter(|input| windowed.has(input))
        .collect();
    let mut found: Vec<(f64, Located)> = known
        .par_iter()
        .filter_map(|input| {
            let explained = windowed.explained(Some(input))?;
            let share = (without.left - explained.left - chance) / above_noise;
            Some((share, windowed.located(input, &explained, share)))
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = found.first()?.0;
    if above_noise <= 0.0 || best < LEAST_SHARE {
        return None;
    }
    found.retain(|(share, _)| *share > AS_GOOD * best);
    // A disguise needs other values from window to window; what is off goes with
    // something.
    let law = |located: &Located| located.leading().map_or(0.0, |one| one.eta_squared);
    found.sort_by(|a, b| law(&b.1).total_cmp(&law(&a.1)));
    let natural = found.iter().position(|(_, located)| {
        are_one_direction(&found[0].1, located) && goes_with_its_own(located)
    });
    Some(found.swap_remove(natural.unwrap_or(0)).1)
}

/// Whether two inputs do much the same to the chambers.
fn are_one_direction(one: &Located, other: &Located) -> bool {
    let is_supply_side = |place| ["supply", "valve-flow"].contains(&place);
    one.place == other.place || (is_supply_side(one.place) && is_supply_side(other.place))
}

/// Whether what a valve's flow would need goes with the valve's opening or the
/// pressures at it, or that of another place does not.
fn goes_with_its_own(located: &Located) -> bool {
    let of_valve = located.leading().is_some_and(|variable| {
        ["command", "pressure", "pressure ratio to supply"].contains(&variable.name)
    });
    (located.place == "valve-flow") == of_valve
}

/// The law run in windows.
struct Windowed<'a> {
    bench: &'a Bench<'a>,
    baseline: &'a Fitted,
    /// Slopes of every window's errors by each ordinary parameter, at the rig as given.
    by_ordinary: Vec<Vec<Vec<f64>>>,
}

impl<'a> Windowed<'a> {
    fn new(bench: &'a Bench<'a>, baseline: &'a Fitted) -> Self {
        let mut windowed = Self {
            bench,
            baseline,
            by_ordinary: Vec::new(),
        };
        let values = windowed.as_given();
        let rig = windowed.rig(&values);
        let starts = windowed.starts(&rig);
        let windows = windowed.windows(&rig, &starts);
        windowed.by_ordinary = windowed.by_ordinary(&values, &windows, &starts);
        windowed
    }

    /// The ordinary parameters as given.
    fn as_given(&self) -> Vec<f64> {
        let ordinary = self.bench.ordinary.iter();
        ordinary.map(|free| free.parameter.start).collect()
    }

    /// Whether the rig has the numbers that stand for an input.
    fn has(&self, input: &Input) -> bool {
        let rig = self.bench.rig;
        let is_there = |key: &str| key.starts_with("effects.") || rig.value(key).is_some();
        input.shifts.iter().all(|(key, _)| is_there(key))
    }

    /// The windows with an input that may be off, ordinary parameters refitted.
    fn explained(&self, input: Option<&Input>) -> Option<Explained> {
        let ordinary = &self.bench.ordinary;
        let mut values = self.as_given();
        let mut best: Option<Explained> = None;
        for round in 1..=ROUNDS {
            let rig = self.rig(&values);
            let starts = self.starts(&rig);
            let windows = self.windows(&rig, &starts);
            let along = input.map(|input| {
                let rig = shifted(&rig, input);
                Direction {
                    slopes: slopes(&windows, &self.windows(&rig, &starts), input.size),
                    most: input.most,
                }
            });
            let penalty = |(free, value): (&FreeParameter, &f64)| {
                let prior = free.parameter.prior;
                prior.map_or(0.0, |prior| (value - prior.mean) / prior.standard_deviation)
            };
            let penalties: Vec<f64> = ordinary.iter().zip(&values).map(penalty).collect();
            let now = judged(windows, along.as_ref(), &penalties);
            if round < ROUNDS {
                let (along, by_ordinary) = (along.as_ref(), &self.by_ordinary);
                let step = step(&now.windows, along, by_ordinary, ordinary, &penalties)?;
                for ((value, free), step) in values.iter_mut().zip(ordinary).zip(step) {
                    *value = (*value + step).clamp(free.parameter.lower, free.parameter.upper);
                }
            }
            if best.as_ref().is_none_or(|best| now.left < best.left) {
                best = Some(now);
            }
        }
        best
    }

    /// Slopes of the windows' errors by each ordinary parameter.
    fn by_ordinary(
        &self,
        values: &[f64],
        windows: &[Window],
        starts: &[Vec<Start>],
    ) -> Vec<Vec<Vec<f64>>> {
        let slope = |(index, free): (usize, &FreeParameter)| {
            let size = STEP * step_size(&free.parameter);
            let mut moved = values.to_vec();
            moved[index] += size;
            slopes(windows, &self.windows(&self.rig(&moved), starts), size)
        };
        self.bench.ordinary.iter().enumerate().map(slope).collect()
    }

    /// The rig with values of the ordinary parameters.
    fn rig(&self, values: &[f64]) -> Rig {
        let keys = self.bench.ordinary.iter().map(|free| free.key.clone());
        self.bench
            .rig
            .with_values(&keys.zip(values.iter().copied()).collect())
    }

    /// The states in which the windows begin, by recording.
    fn starts(&self, rig: &Rig) -> Vec<Vec<Start>> {
        let problem = problem(self.bench, rig);
        let initial: Vec<f64> = problem
            .names()
            .iter()
            .zip(problem.parameters())
            .map(|(name, guess)| self.baseline.value(name).unwrap_or(guess.start))
            .collect();
        let runs = problem.predict(&initial);
        let of_recording = |(recording, (_, states)): (usize, &(Columns, Columns))| {
            let time_s = &self.bench.tracks[recording].recording.time_s;
            let start = |rows: Range<usize>| {
                let first = rows.start;
                Start {
                    rows,
                    states: problem.window_start(
                        (recording, first),
                        (&[], &[]),
                        states,
                        View::Centred,
                    ),
                }
            };
            windows(time_s, WINDOW_S).into_iter().map(start).collect()
        };
        runs.iter().enumerate().map(of_recording).collect()
    }

    /// Every window predicted from its start.
    fn windows(&self, rig: &Rig, starts: &[Vec<Start>]) -> Vec<Window> {
        let problem = problem(self.bench, rig);
        let of_recording = |(recording, starts): (usize, &Vec<Start>)| {
            let recorded = problem.recorded(recording);
            let window = |Start { rows, states }: &Start| {
                let mut errors = Vec::with_capacity(rows.len() * recorded.len());
                let mut store = |row: usize, outputs: &[f64], _: &[f64]| {
                    let outputs = outputs.iter().zip(&recorded).zip(&self.bench.noise);
                    errors.extend(outputs.map(|((p, r), noise)| (p - r[row]) / noise));
                };
                let none: (&[String], &[f64]) = (&[], &[]);
                problem.predict_rows((recording, rows.clone()), none, states, &mut store);
                Window {
                    recording,
                    rows: rows.clone(),
                    errors,
                }
            };
            starts.iter().map(window).collect::<Vec<Window>>()
        };
        let recordings: Vec<Vec<Window>> =
            starts.par_iter().enumerate().map(of_recording).collect();
        recordings.into_iter().flatten().collect()
    }

    /// What the input would have had to be, over time and state.
    fn located(&self, input: &Input, explained: &Explained, share: f64) -> Located {
        let bench = self.bench;
        let tracks = bench.tracks.iter();
        let mut columns: Vec<Vec<f64>> = tracks.map(|track| vec![f64::NAN; track.len()]).collect();
        let known = explained.needed.iter().flatten();
        let deviations = known.map(|(_, deviation)| *deviation).collect();
        let usual = median(deviations).unwrap_or(0.0);
        // A constant error is an ordinary parameter's, where there is one.
        let is_ordinary = |key: &str| bench.ordinary.iter().any(|free| free.key == key);
        let constant = if input.shifts.iter().any(|(key, _)| is_ordinary(key)) {
            weighted_mean(explained.needed.iter().flatten())
        } else {
            0.0
        };
        let told = |needed: &Option<(f64, f64)>| {
            let (value, deviation) = (*needed)?;
            let is_told = deviation <= WORST_DEVIATION * usual && value.abs() < input.most;
            is_told.then_some(value - constant)
        };
        let usual = Usual::of(explained.needed.iter().filter_map(told).collect());
        for (window, needed) in explained.windows.iter().zip(&explained.needed) {
            if let Some(value) = told(needed) {
                columns[window.recording][window.rows.clone()].fill(usual.kept_to(value));
            }
        }
        Located {
            share,
            ..locate::of_input(bench.law, bench.rig, bench.tracks, input.what, columns)
        }
    }
}

/// The rig with an input shifted.
fn shifted(rig: &Rig, input: &Input) -> Rig {
    let shifts = input.shifts.iter().map(|&(key, shift)| {
        let value = rig.value(key).unwrap_or(0.0);
        (key.to_owned(), value + shift)
    });
    rig.with_values(&shifts.collect())
}

/// The size of a parameter's uncertainty.
fn step_size(parameter: &Parameter) -> f64 {
    parameter
        .prior
        .map_or(parameter.scale, |prior| prior.standard_deviation)
}

/// Slopes of every window's errors.
fn slopes(base: &[Window], moved: &[Window], size: f64) -> Vec<Vec<f64>> {
    let pairs = base.iter().zip(moved);
    pairs
        .map(|(base, moved)| {
            let errors = base.errors.iter().zip(&moved.errors);
            errors.map(|(base, moved)| (moved - base) / size).collect()
        })
        .collect()
}

/// Where values usually lie. In a few windows another input than the one that is off, or
/// the valve's edge, asks for anything.
struct Usual {
    centre: f64,
    reach: f64,
}

impl Usual {
    /// The median, and four deviations (1.48 medians of the distance from it) about it.
    fn of(values: Vec<f64>) -> Self {
        let centre = median(values.clone()).unwrap_or(0.0);
        let apart = values.iter().map(|value| (value - centre).abs()).collect();
        let reach = 4.0 * 1.48 * median(apart).unwrap_or(0.0);
        Self { centre, reach }
    }

    fn kept_to(&self, value: f64) -> f64 {
        value.clamp(self.centre - self.reach, self.centre + self.reach)
    }
}

/// Mean of values, each by its deviation.
fn weighted_mean<'v>(values: impl Iterator<Item = &'v (f64, f64)>) -> f64 {
    let (sum, weights) = values.fold((0.0, 0.0), |(sum, weights), (value, deviation)| {
        let weight = deviation.powi(-2);
        (sum + weight * value, weights + weight)
    });
    if weights > 0.0 { sum / weights } else { 0.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What the input explains in every window, and what is left.
fn judged(windows: Vec<Window>, along: Option<&Direction>, penalties: &[f64]) -> Explained {
    let mut left = dot(penalties, penalties);
    let mut needed = Vec::with_capacity(windows.len());
    for (index, window) in windows.iter().enumerate() {
        left += dot(&window.errors, &window.errors);
        needed.push(along.and_then(|along| {
            let direction = &along.slopes[index];
            let (product, square) = (dot(&window.errors, direction), dot(direction, direction));
            (square > 0.0 && product.is_finite()).then(|| {
                let value = (-product / square).clamp(-along.most, along.most);
                left += value * (2.0 * product + value * square);
                (value, 1.0 / square.sqrt())
            })
        }));
    }
    Explained {
        windows,
        needed,
        left,
    }
}

/// The step of the ordinary parameters; the input follows in every window.
fn step(
    windows: &[Window],
    along: Option<&Direction>,
    by_ordinary: &[Vec<Vec<f64>>],
    ordinary: &[FreeParameter],
    penalties: &[f64],
) -> Option<Vec<f64>> {
    let count = by_ordinary.len();
    let sizes: Vec<f64> = ordinary
        .iter()
        .map(|free| step_size(&free.parameter))
        .collect();
    let mut curvature = DMatrix::<f64>::zeros(count, count);
    let mut pull = DVector::<f64>::zeros(count);
    for (i, free) in ordinary.iter().enumerate() {
        if free.parameter.prior.is_some() {
            curvature[(i, i)] = 1.0;
            pull[i] = -penalties[i];
        }
    }
    for (index, window) in windows.iter().enumerate() {
        // An input at the end of its range takes nothing more.
        let free = along.and_then(|along| {
            let g = along.slopes[index].as_slice();
            let square = dot(g, g);
            let is_free = dot(&window.errors, g).abs() < along.most * square;
            is_free.then_some((g, square))
        });
        // Products of what is left when the parts along the input are taken out.
        let product = |a: &[f64], b: &[f64]| match free {
            Some((g, square)) => dot(a, b) - dot(a, g) * dot(b, g) / square,
            None => dot(a, b),
        };
        for i in 0..count {
            let slope = &by_ordinary[i][index];
            pull[i] -= sizes[i] * product(slope, &window.errors);
            for j in 0..=i {
                let value = sizes[i] * sizes[j] * product(slope, &by_ordinary[j][index]);
                curvature[(i, j)] += value;
                if i != j {
                    curvature[(j, i)] += value;
                }
            }
        }
    }
    let steps = curvature.cholesky()?.solve(&pull);
    Some(
        steps
            .iter()
            .zip(&sizes)
            .map(|(step, size)| step * size)
            .collect(),
    )
}

/// The law with a rig whose numbers are all set.
fn problem<'p>(bench: &'p Bench<'_>, rig: &'p Rig) -> LawProblem<'p> {
    LawProblem {
        law: bench.law,
        rig,
        tracks: bench.tracks,
        free: &[],
        sigma: &bench.noise,
        left_out: None,
        presence: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{drawn, search};
    use crate::laws::Track;
    use truth_plant::Strength;

    /// The input that is found on a case of the truth plant with an effect of no list.
    fn found(seed: u64, strength: Strength, effect: &str) -> Located {
        let (rig, recordings) = drawn::off_list(seed, strength, effect);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let bench = Bench::new(Law::Chambers, &rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        find(&bench, &baseline).unwrap()
    }

    #[test]
    fn val_a_null_that_drifts_is_a_command_that_drifts() {
        let input = found(2_564_860_095, Strength::Strong, "null-drift");
        assert_eq!(input.place, "valve-command");
        let leading = input.leading().unwrap();
        assert_eq!(leading.name, "time since start");
        // The drawn drift is -9.3 mV/s; ordinary parameters take a part of it.
        let (first, last) = (leading.bins[0], leading.bins[leading.bins.len() - 1]);
        let drift_v_per_s = (last.mean - first.mean) / (last.x - first.x);
        println!("{drift_v_per_s} V/s");
        assert!(drift_v_per_s.abs() > 3e-3 && drift_v_per_s.abs() < 12e-3);
    }

    #[test]
    fn val_a_supply_that_ripples_is_a_supply_that_is_off() {
        let input = found(3_904_658_665, Strength::Weak, "supply-ripple");
        assert_eq!(input.place, "supply");
    }

    #[test]
    fn prop_the_step_is_that_of_the_whole_least_squares_problem() {
        // Two windows of three errors, one ordinary parameter with slope 1 and no prior,
        // an input along (1, 1, 1): only what is not constant moves the parameter.
        let window = |errors: [f64; 3]| Window {
            recording: 0,
            rows: 0..3,
            errors: errors.to_vec(),
        };
        let windows = vec![window([5.0, 6.0, 7.0]), window([-3.0, -2.0, -1.0])];
        let slope = vec![vec![vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 2.0]]];
        let along = Direction {
            slopes: vec![vec![1.0; 3], vec![1.0; 3]],
            most: 100.0,
        };
        let free = FreeParameter {
            key: "valve.null_V".into(),
            scope: crate::fit::law_problem::Scope::Shared,
            parameter: Parameter::new(0.0),
        };
        let step = step(&windows, Some(&along), &slope, &[free], &[0.0]).unwrap();
        assert!((step[0] + 1.0).abs() < 1e-12, "{step:?}");
        let judged = judged(windows, Some(&along), &[0.0]);
        // Left are (-1, 0, 1) of each window; the inputs are less their means.
        assert!((judged.left - 4.0).abs() < 1e-12, "{}", judged.left);
        let needed: Vec<f64> = judged.needed.iter().map(|one| one.unwrap().0).collect();
        assert!((needed[0] + 6.0).abs() < 1e-12 && (needed[1] - 2.0).abs() < 1e-12);
    }
}
