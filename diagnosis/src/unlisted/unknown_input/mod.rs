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
//! The fit: every window is run with the input off by nine sizes, up to the most that
//! such an input ever is (surroundings of five bar would explain what a command of 20 mV
//! does); its errors between two sizes lie on a straight line, and the best value is where
//! they are least, with r left. A dead zone is no straight line: from the slope at nought
//! alone a null that drifted by 60 mV through one of 0.2 V was taken for the valve's flow.
//! What no value explains, r and the slopes S by the ordinary parameters less their parts
//! along g, the line at hand, gives the step of these (Gauss and Newton, with the engineer's
//! uncertainties as priors and with their bounds). S is taken once, at the rig as given, for
//! all inputs and steps: taken anew it ends at the same place.
//!
//! The pressure of the surroundings is what the weather makes it, so what is missing of it comes
//! and goes: where one number for all windows explains most of what it explains, another input
//! is (areas that shrink in cold gas asked for a bar more, always).
//!
//! Limits: a window is a tenth of a second, so an input that changes faster shows
//! only in part. More air through the valve's supply side and a higher supply
//! pressure have one direction: what the needed change goes with decides.

mod inputs;
mod need;
mod step;

use crate::estimate::{Bench, Fitted};
use crate::fit::law_problem::{Columns, FreeParameter, LawProblem, windows};
use crate::laws::{Law, View, median};
use crate::locate::{self, Located};
use crate::rig::Rig;
use crate::thresholds::{AS_WELL, LARGER_PART};
use crate::unlisted::equation::Equation;
use crate::unlisted::missing_input::{self, Sample};
use inputs::{Input, inputs, shifted};
use need::{Need, Window, dot, least_for_all, need};
use rayon::prelude::*;
use std::ops::Range;
use step::{STEP, slopes, step, step_size};

/// Length of a window, s.
const WINDOW_S: f64 = 0.1;
/// Steps of the ordinary parameters.
const ROUNDS: usize = 5;
/// A window says nothing where deviation or errors are more than this many times the
/// median one's.
const WORST: f64 = 3.0;

/// Where a window begins.
struct Start {
    rows: Range<usize>,
    states: Vec<f64>,
}

/// The windows under some ordinary parameters, with an input.
struct Explained {
    /// Their errors are those with the input as they need it.
    windows: Vec<Window>,
    /// By window; none where the input does nothing.
    needed: Vec<Option<Need>>,
    /// Energy that is left, priors counted in.
    left: f64,
    /// The same with one number for the input in all windows.
    left_by_constant: f64,
}

/// The input that explains most, and what it would have had to be.
pub(crate) struct Needed {
    /// Over time and state.
    pub located: Located,
    /// As an equation, where there is one.
    pub equation: Option<Equation>,
}

/// What one input explains.
struct Found {
    /// Part of the energy above the noise.
    share: f64,
    /// It would have to be off by about the same always, which it is not.
    is_disguise: bool,
    needed: Needed,
}

/// The input that explains most of what the chambers' baseline misses, with what it
/// goes with; `None` where no single one explains it.
pub(crate) fn find(bench: &Bench<'_>, baseline: &Fitted) -> Option<Needed> {
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
    let found: Vec<Found> = known
        .par_iter()
        .filter_map(|input| {
            let explained = windowed.explained(Some(input))?;
            let share = (without.left - explained.left - chance) / above_noise;
            let by_constant = (without.left - explained.left_by_constant) / above_noise;
            Some(Found {
                share,
                is_disguise: input.varies && by_constant > LARGER_PART * share,
                needed: windowed.needed(input, &explained, share),
            })
        })
        .filter(|found| found.share >= LARGER_PART)
        .collect();
    if above_noise <= 0.0 {
        return None;
    }
    let are_all_disguises = found.iter().all(|one| one.is_disguise);
    let mut found: Vec<(f64, Needed)> = found
        .into_iter()
        .filter(|one| are_all_disguises || !one.is_disguise)
        .map(|one| (one.share, one.needed))
        .collect();
    let best = found.iter().map(|(share, _)| *share).reduce(f64::max)?;
    found.retain(|(share, _)| *share > (1.0 - AS_WELL) * best);
    // A disguise needs other values from window to window; what is off goes with
    // something.
    let law = |needed: &Needed| {
        let leading = needed.located.leading();
        leading.map_or(0.0, |one| one.eta_squared)
    };
    found.sort_by(|a, b| law(&b.1).total_cmp(&law(&a.1)));
    let natural = found.iter().position(|(_, needed)| {
        are_one_direction(&found[0].1.located, &needed.located)
            && goes_with_its_own(&needed.located)
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
            let mut windows = self.windows(&rig, &starts);
            let (needed, by_constant) = match input {
                Some(input) => self.need(&mut windows, &rig, &starts, input),
                None => (vec![None; windows.len()], f64::INFINITY),
            };
            let penalty = |(free, value): (&FreeParameter, &f64)| {
                let prior = free.parameter.prior;
                prior.map_or(0.0, |prior| (value - prior.mean) / prior.standard_deviation)
            };
            let penalties: Vec<f64> = ordinary.iter().zip(&values).map(penalty).collect();
            let now = Explained::new(windows, (needed, by_constant), &penalties);
            if round < ROUNDS {
                let step = step(&now, &self.by_ordinary, ordinary, &values, &penalties)?;
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

    /// What each window needs of an input, whose errors become those with that; and the energy
    /// left by one number for all.
    fn need(
        &self,
        windows: &mut [Window],
        rig: &Rig,
        starts: &[Vec<Start>],
        input: &Input,
    ) -> (Vec<Option<Need>>, f64) {
        let sizes = input.sizes();
        let tried: Vec<Vec<Window>> = sizes
            .iter()
            .map(|&size| self.windows(&shifted(rig, input, size), starts))
            .collect();
        let of_window = |(index, window): (usize, &mut Window)| {
            let errors: Vec<&[f64]> = tried.iter().map(|all| &all[index].errors[..]).collect();
            let (need, left) = need(&sizes, &errors)?;
            window.errors = left;
            Some(need)
        };
        let needed = windows.iter_mut().enumerate().map(of_window).collect();
        (needed, least_for_all(&tried))
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
            // What came before the first row nobody has recorded: it shows in the first window.
            let known = windows(time_s, WINDOW_S).into_iter().skip(1);
            known.map(start).collect()
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
    fn needed(&self, input: &Input, explained: &Explained, share: f64) -> Needed {
        let bench = self.bench;
        let tracks = bench.tracks.iter();
        let mut columns: Vec<Vec<f64>> = tracks.map(|track| vec![f64::NAN; track.len()]).collect();
        let told = explained.told(input);
        // A constant error is an ordinary parameter's, where there is one.
        let is_ordinary = |key: &str| bench.ordinary.iter().any(|free| free.key == key);
        let constant = if input.shifts.iter().any(|(key, _)| is_ordinary(key)) {
            weighted_mean(told.iter().flatten().copied())
        } else {
            0.0
        };
        let values: Vec<Option<f64>> = told
            .iter()
            .map(|need| need.map(|need| need.value - constant))
            .collect();
        let usual = Usual::of(values.iter().flatten().copied().collect());
        let windows = explained.windows.iter().zip(values).zip(told);
        let sample = |((window, value), need): ((&Window, Option<f64>), Option<&Need>)| {
            Some(Sample {
                recording: window.recording,
                rows: window.rows.clone(),
                value: usual.kept_to(value?),
                deviation: need?.deviation,
            })
        };
        let samples: Vec<Sample> = windows.filter_map(sample).collect();
        for sample in &samples {
            columns[sample.recording][sample.rows.clone()].fill(sample.value);
        }
        let located = locate::of_input(bench.law, bench.rig, bench.tracks, input.what, columns);
        Needed {
            located: Located { share, ..located },
            equation: missing_input::equation(
                bench.rig,
                bench.tracks,
                input.what,
                (&samples, WINDOW_S),
            ),
        }
    }
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

/// Mean of what is needed, each by its deviation.
fn weighted_mean<'n>(needs: impl Iterator<Item = &'n Need>) -> f64 {
    let (sum, weights) = needs.fold((0.0, 0.0), |(sum, weights), need| {
        let weight = need.deviation.powi(-2);
        (sum + weight * need.value, weights + weight)
    });
    if weights > 0.0 { sum / weights } else { 0.0 }
}

impl Explained {
    fn new(
        windows: Vec<Window>,
        (needed, by_constant): (Vec<Option<Need>>, f64),
        penalties: &[f64],
    ) -> Self {
        let energy = |window: &Window| dot(&window.errors, &window.errors);
        let penalty = dot(penalties, penalties);
        Self {
            left: penalty + windows.iter().map(energy).sum::<f64>(),
            left_by_constant: penalty + by_constant,
            windows,
            needed,
        }
    }

    /// What the windows need, where they say something of it: no value at the end of its
    /// range, none known much worse than usual (the valve was shut, say), none of a window
    /// that the input leaves much less explained than usual.
    fn told(&self, input: &Input) -> Vec<Option<&Need>> {
        let energy = |window: &Window| dot(&window.errors, &window.errors);
        let needs = self.needed.iter().flatten();
        let deviations = needs.map(|need| need.deviation).collect();
        let worst_deviation = WORST * median(deviations).unwrap_or(0.0);
        let energies = self.windows.iter().map(energy).collect();
        let worst_energy = WORST * WORST * median(energies).unwrap_or(0.0);
        let (lower, upper) = input.range;
        let is_told = |(need, window): &(&Need, &Window)| {
            need.deviation <= worst_deviation
                && need.value > lower
                && need.value < upper
                && energy(window) <= worst_energy
        };
        let pairs = self.needed.iter().zip(&self.windows);
        pairs
            .map(|(need, window)| Some((need.as_ref()?, window)).filter(is_told))
            .map(|told| told.map(|(need, _)| need))
            .collect()
    }
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
    use crate::drawn;
    use crate::fit::Parameter;
    use crate::laws::Track;
    use crate::search;
    use truth_plant::Strength;

    /// The input that is found on a case of the truth plant with an effect of no list.
    fn found(seed: u64, strength: Strength, effect: &str) -> Located {
        let (rig, recordings) = drawn::off_list(seed, strength, effect);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let bench = Bench::new(Law::Chambers, &rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        find(&bench, &baseline).unwrap().located
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
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

    /// Through a dead zone of 0.17 V: it was taken for the valve's flow.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_a_null_that_drifts_in_a_wide_dead_zone_is_a_command_that_drifts() {
        let input = found(3_436_553_271, Strength::Strong, "null-drift");
        assert_eq!(input.place, "valve-command");
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_supply_that_ripples_is_a_supply_that_is_off() {
        let input = found(3_904_658_665, Strength::Weak, "supply-ripple");
        assert_eq!(input.place, "supply");
    }

    /// Areas that shrink in cold gas: surroundings that are a bar higher, always, explain more.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_surroundings_that_are_always_off_are_another_input() {
        let input = found(3_285_119_949, Strength::Strong, "area-by-temperature");
        assert_eq!(input.place, "valve-flow");
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
        let mut windows = vec![window([5.0, 6.0, 7.0]), window([-3.0, -2.0, -1.0])];
        let slope = vec![vec![vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 2.0]]];
        let sizes = [-10.0, 0.0, 10.0];
        let needed: Vec<Option<Need>> = windows
            .iter_mut()
            .map(|window| {
                let at =
                    |size: f64| -> Vec<f64> { window.errors.iter().map(|e| e + size).collect() };
                let errors = sizes.map(at);
                let errors: Vec<&[f64]> = errors.iter().map(|one| &one[..]).collect();
                let (need, left) = need(&sizes, &errors).unwrap();
                window.errors = left;
                Some(need)
            })
            .collect();
        let explained = Explained::new(windows, (needed, 0.0), &[0.0]);
        let free = |lower: f64| FreeParameter {
            key: "valve.null_V".into(),
            scope: crate::fit::law_problem::Scope::Shared,
            parameter: Parameter::new(0.0).bounded(lower, 9.0),
        };
        let moved = step(&explained, &slope, &[free(-9.0)], &[0.0], &[0.0]).unwrap();
        assert!((moved[0] + 1.0).abs() < 1e-12, "{moved:?}");
        let held = step(&explained, &slope, &[free(0.0)], &[0.0], &[0.0]).unwrap();
        assert!(held[0].abs() < 1e-12, "on its bound: {held:?}");
        // Left are (-1, 0, 1) of each window; the inputs are less their means.
        assert!((explained.left - 4.0).abs() < 1e-12, "{}", explained.left);
        let needed = explained.needed.iter().flatten();
        let needed: Vec<f64> = needed.map(|need| need.value).collect();
        assert!((needed[0] + 6.0).abs() < 1e-12 && (needed[1] - 2.0).abs() < 1e-12);
    }
}
