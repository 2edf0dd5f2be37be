//! The search for the equation of fewest terms.

use super::Equation;
use super::forms::{Form, Variable};
use super::term::Term;
use crate::estimate::correlation::integrated_autocorrelation;
use crate::golden_section::least_within;
use crate::thresholds::{ERROR_OF_EQUATION, FORMS_AS_WELL, LARGER_PART, WORTH_A_FIRST_TERM};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Fewer samples tell no form (chosen).
const FEWEST_SAMPLES: usize = 30;
/// Parts of the samples that are left out in turn.
const FOLDS: usize = 5;
/// A column that differs from others by less than this part of its energy is none of its own.
const SAME: f64 = 1e-9;
/// A form's own number is refined to this part of the steps in which it was tried.
const REFINED_TO: f64 = 1e-5;

/// What is missing in samples, and how a term would show there.
pub struct Missing<'m> {
    /// What it is.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The samples, each in units of its own deviation: what the ordinary parameters leave.
    pub samples: Vec<f64>,
    /// What the ordinary parameters cost by what the engineer stated of them, in squares.
    pub strain: f64,
    /// The recording that each is of.
    pub recording: Vec<usize>,
    /// How a term with these values, row by row, shows in the samples.
    pub shows: &'m (dyn Fn(&[Vec<f64>]) -> Vec<f64> + Sync),
    /// What the ordinary parameters cannot take up of a term as it shows.
    pub reduced: &'m (dyn Fn(&[f64]) -> Vec<f64> + Sync),
    /// Terms at the most.
    pub most_terms: usize,
    /// What is tried over which variable.
    pub library: Vec<(Form, &'m Variable)>,
}

/// A form with a number of its own, as it shows.
#[derive(Clone)]
struct Shown {
    place: usize,
    shape: f64,
    columns: Vec<Vec<f64>>,
    reduced: Vec<Vec<f64>>,
}

/// A set of terms, their coefficients fitted.
#[derive(Clone)]
struct Solved {
    terms: Vec<Shown>,
    coefficients: Vec<f64>,
    inverse: DMatrix<f64>,
    left: Vec<f64>,
    squares: f64,
}

/// The equation of fewest terms that explains what is missing; `None` where none explains half of
/// what is above the noise.
pub fn best(missing: &Missing<'_>) -> Option<Equation> {
    if missing.samples.len() < FEWEST_SAMPLES {
        return None;
    }
    let search = Search { missing };
    let none = search.squares_of_none();
    let mut steps: Vec<Step> = Vec::new();
    while steps.len() < missing.most_terms {
        let so_far = steps.last().map_or(&[][..], |step| &step.solved.terms);
        let before = steps.last().map_or(none, |step| step.solved.squares);
        let Some(step) = search.step(so_far) else {
            break;
        };
        if !search.is_worth_a_term(&step.solved, before) {
            break;
        }
        steps.push(Step {
            solved: search.refined(step.solved),
            ..step
        });
    }
    search.leave_chance_out(&mut steps);
    let found = &steps.last()?.solved;
    let left = search.above_noise(found.squares);
    let share = search.share_held_out(found);
    let is_worth_it =
        left <= (1.0 - LARGER_PART) * search.above_noise(none) && share >= LARGER_PART;
    is_worth_it.then(|| Equation {
        quantity: missing.quantity,
        unit: missing.unit,
        terms: search.terms(found),
        share,
        rivals: search.rivals(&steps),
    })
}

/// A set with one term more, and the other sets that were tried beside it.
struct Step {
    solved: Solved,
    /// Where each stands in the library, with its squares and how many numbers it has.
    others: Vec<(usize, f64, usize)>,
}

struct Search<'s, 'm> {
    missing: &'s Missing<'m>,
}

impl Search<'_, '_> {
    fn squares_of_none(&self) -> f64 {
        dot(&self.missing.samples, &self.missing.samples) + self.missing.strain
    }

    /// Squares beyond those of the noise, of which each sample has one, and those by which no form
    /// is quite the one that is there.
    fn above_noise(&self, squares: f64) -> f64 {
        let explained = (self.squares_of_none() - squares).max(0.0);
        let of_form = ERROR_OF_EQUATION.powi(2) * explained;
        (squares - self.missing.samples.len() as f64 - of_form).max(0.0)
    }

    /// Squares over those of the noise; what is below it is no gain.
    fn left_over_noise(&self, squares: f64) -> f64 {
        (squares / self.missing.samples.len() as f64).max(1.0)
    }

    /// Whether the last of these terms takes away enough of what was left before it.
    fn is_worth_a_term(&self, solved: &Solved, before: f64) -> bool {
        let worth = if solved.terms.len() == 1 {
            WORTH_A_FIRST_TERM
        } else {
            LARGER_PART
        };
        self.above_noise(solved.squares) <= (1.0 - worth) * self.above_noise(before)
    }

    /// Leaves out last terms that take away no more than chance gives the best of all forms. What
    /// all terms leave says how many samples are independent: beside what a later one takes away,
    /// an earlier one cannot be judged.
    fn leave_chance_out(&self, steps: &mut Vec<Step>) {
        let Some(last) = steps.last() else { return };
        let independent = self.independent(&last.solved.left);
        while let Some(last) = steps.last() {
            let before = steps.len().checked_sub(2).map(|place| &steps[place].solved);
            let before = before.map_or(self.squares_of_none(), |before| before.squares);
            let numbers = last
                .solved
                .terms
                .last()
                .map_or(0, |term| self.numbers(term));
            let gain = self.criterion(before, 0, independent)
                - self.criterion(last.solved.squares, numbers, independent);
            if gain > FORMS_AS_WELL {
                return;
            }
            steps.pop();
        }
    }

    /// The Bayesian information criterion.
    fn criterion(&self, squares: f64, numbers: usize, independent: f64) -> f64 {
        independent * self.left_over_noise(squares).ln() + numbers as f64 * independent.ln()
    }

    /// What would do as well as the first term, and is none of the others.
    fn rivals(&self, steps: &[Step]) -> Vec<String> {
        let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
            return Vec::new();
        };
        let independent = self.independent(&last.solved.left);
        let numbers = first
            .solved
            .terms
            .first()
            .map_or(0, |term| self.numbers(term));
        let least = self.criterion(first.solved.squares, numbers, independent);
        let is_term = |place: usize| last.solved.terms.iter().any(|term| term.place == place);
        let as_well = first.others.iter().filter(|(place, squares, numbers)| {
            !is_term(*place)
                && self.criterion(*squares, *numbers, independent) < least + FORMS_AS_WELL
        });
        as_well.map(|(place, _, _)| self.phrase(*place)).collect()
    }

    fn shown(&self, place: usize, shape: f64) -> Shown {
        let (form, variable) = self.missing.library[place];
        let columns = form.columns(variable, shape);
        let shown = columns.iter().map(|column| (self.missing.shows)(column));
        let columns: Vec<Vec<f64>> = if form.is_by_recording() {
            shown
                .flat_map(|column| self.by_recording(&column))
                .collect()
        } else {
            shown.collect()
        };
        let reduced = columns
            .iter()
            .map(|column| (self.missing.reduced)(column))
            .collect();
        Shown {
            place,
            shape,
            columns,
            reduced,
        }
    }

    /// A column for each recording, nothing of the others in it.
    fn by_recording(&self, column: &[f64]) -> Vec<Vec<f64>> {
        let of = &self.missing.recording;
        let recordings = of.iter().max().map_or(0, |last| last + 1);
        let alone = |kept: usize| {
            let pairs = column.iter().zip(of);
            pairs
                .map(|(value, &recording)| if recording == kept { *value } else { 0.0 })
                .collect()
        };
        (0..recordings).map(alone).collect()
    }

    /// Every form beside some terms, each with the number of its own that leaves least.
    fn next(&self, so_far: &[Shown]) -> Vec<Solved> {
        let of_place = |place: usize| {
            let (form, variable) = self.missing.library[place];
            let with = |shape: f64| {
                let mut terms = so_far.to_vec();
                terms.push(self.shown(place, shape));
                self.solved(terms)
            };
            let tried = form.shapes(variable).into_iter().filter_map(with);
            let best = tried.min_by(|one, other| one.squares.total_cmp(&other.squares))?;
            let shape = best.terms.last()?.shape;
            (!form.is_at_its_limit(variable, shape)).then_some(best)
        };
        let is_new = |place: &usize| so_far.iter().all(|term| term.place != *place);
        let places: Vec<usize> = (0..self.missing.library.len()).filter(is_new).collect();
        places.into_par_iter().filter_map(of_place).collect()
    }

    /// The best set with a term more, by its criterion.
    fn step(&self, so_far: &[Shown]) -> Option<Step> {
        let mut tried = self.next(so_far);
        let squares = |one: &Solved| one.squares;
        let least = tried
            .iter()
            .min_by(|one, other| squares(one).total_cmp(&squares(other)))?;
        let independent = self.independent(&least.left);
        let last = |one: &Solved| {
            let term = &one.terms[so_far.len()];
            (term.place, one.squares, self.numbers(term))
        };
        let criterion = |one: &Solved| {
            let (_, squares, numbers) = last(one);
            self.criterion(squares, numbers, independent)
        };
        tried.sort_by(|one, other| criterion(one).total_cmp(&criterion(other)));
        let others = tried[1..].iter().map(last).collect();
        Some(Step {
            solved: tried.swap_remove(0),
            others,
        })
    }

    fn numbers(&self, term: &Shown) -> usize {
        let has_shape = self.missing.library[term.place].0.has_shape();
        term.columns.len() + usize::from(has_shape)
    }

    /// Samples that count for themselves.
    fn independent(&self, left: &[f64]) -> f64 {
        (left.len() as f64 / integrated_autocorrelation(left).max(1.0)).max(2.0)
    }

    fn solved(&self, terms: Vec<Shown>) -> Option<Solved> {
        let columns: Vec<&Vec<f64>> = terms.iter().flat_map(|term| &term.columns).collect();
        let reduced: Vec<&Vec<f64>> = terms.iter().flat_map(|term| &term.reduced).collect();
        let count = columns.len();
        let alike = DMatrix::from_fn(count, count, |row, column| {
            dot(columns[row], reduced[column])
        });
        let scale = alike.diagonal().map(|square| square.max(0.0).sqrt());
        // What the ordinary parameters take up whole is no term.
        let is_taken_up =
            (0..count).any(|at| scale[at].powi(2) <= SAME * dot(columns[at], columns[at]));
        if is_taken_up {
            return None;
        }
        let scaled = DMatrix::from_fn(count, count, |row, column| {
            alike[(row, column)] / (scale[row] * scale[column])
        });
        let inverse = scaled.pseudo_inverse(SAME).ok()?;
        let inverse = DMatrix::from_fn(count, count, |row, column| {
            inverse[(row, column)] / (scale[row] * scale[column])
        });
        let pull = DVector::from_iterator(
            count,
            columns
                .iter()
                .map(|column| dot(column, &self.missing.samples)),
        );
        let solution = &inverse * &pull;
        let mut left = self.missing.samples.clone();
        for (column, coefficient) in reduced.iter().zip(&solution) {
            for (left, value) in left.iter_mut().zip(column.iter()) {
                *left -= coefficient * value;
            }
        }
        let explained = pull.dot(&solution);
        Some(Solved {
            coefficients: solution.iter().copied().collect(),
            inverse,
            squares: self.squares_of_none() - explained,
            left,
            terms,
        })
    }

    /// The numbers of each form refined within the steps in which they were tried.
    fn refined(&self, mut solved: Solved) -> Solved {
        for at in 0..solved.terms.len() {
            let (form, variable) = self.missing.library[solved.terms[at].place];
            if !form.has_shape() {
                continue;
            }
            let centre = solved.terms[at].shape;
            let step = form.step_at(variable, centre);
            let with = |shape: f64| self.reshaped(&solved, at, shape);
            let squares = |shape: f64| with(shape).map_or(f64::INFINITY, |one| one.squares);
            let tried = form.shapes(variable).into_iter();
            let (least, most) = tried.fold((centre, centre), |(least, most), one| {
                (one.min(least), one.max(most))
            });
            let (from, to) = ((centre - step).max(least), (centre + step).min(most));
            let shape = least_within((from, to), REFINED_TO, squares);
            if let Some(better) = with(shape).filter(|one| one.squares <= solved.squares) {
                solved = better;
            }
        }
        solved
    }

    fn reshaped(&self, solved: &Solved, at: usize, shape: f64) -> Option<Solved> {
        let mut terms = solved.terms.clone();
        terms[at] = self.shown(terms[at].place, shape);
        self.solved(terms)
    }

    /// The terms with their numbers and deviations.
    fn terms(&self, solved: &Solved) -> Vec<Term> {
        let variance = self.variance(solved);
        let mut first = 0;
        let term = |(at, shown): (usize, &Shown)| {
            let (form, variable) = self.missing.library[shown.place];
            let places = first..first + shown.columns.len();
            first = places.end;
            let coefficient = |place: usize| {
                let deviation = (variance * solved.inverse[(place, place)].max(0.0)).sqrt();
                (solved.coefficients[place], deviation)
            };
            Term {
                form,
                variable: variable.name,
                variable_unit: variable.unit,
                range: variable.range(),
                shape: form
                    .has_shape()
                    .then(|| (shown.shape, self.deviation_of_shape(solved, at, variance))),
                coefficients: places.map(coefficient).collect(),
            }
        };
        solved.terms.iter().enumerate().map(term).collect()
    }

    /// What a squared deviation of a sample counts, correlation counted in.
    fn variance(&self, solved: &Solved) -> f64 {
        let independent = self.independent(&solved.left);
        (solved.squares / independent).max(1.0)
    }

    /// By the curvature of the profile: a change by one deviation leaves one variance more.
    fn deviation_of_shape(&self, solved: &Solved, at: usize, variance: f64) -> f64 {
        let shown = &solved.terms[at];
        let (form, variable) = self.missing.library[shown.place];
        let step = 0.2 * form.step_at(variable, shown.shape);
        let more = |shape: f64| {
            let moved = self.reshaped(solved, at, shape);
            moved.map_or(0.0, |moved| moved.squares - solved.squares)
        };
        let curvature = (more(shown.shape + step) + more(shown.shape - step)) / step.powi(2);
        if curvature <= 0.0 {
            return f64::INFINITY;
        }
        (2.0 * variance / curvature).sqrt()
    }

    /// Part of the energy above the noise that is explained of samples that were left out.
    fn share_held_out(&self, solved: &Solved) -> f64 {
        let reduced: Vec<&Vec<f64>> = solved.terms.iter().flat_map(|term| &term.reduced).collect();
        let (mut left, mut all) = (0.0, 0.0);
        let block = self.missing.samples.len().div_ceil(4 * FOLDS).max(1);
        let fold_of = |sample: usize| sample / block % FOLDS;
        for fold in 0..FOLDS {
            let fitted = |sample: &usize| fold_of(*sample) != fold;
            let product = |one: &[f64], other: &[f64]| -> f64 {
                let samples = (0..one.len()).filter(fitted);
                samples.map(|sample| one[sample] * other[sample]).sum()
            };
            let alike = DMatrix::from_fn(reduced.len(), reduced.len(), |row, column| {
                product(reduced[row], reduced[column])
            });
            let pull = DVector::from_iterator(
                reduced.len(),
                reduced
                    .iter()
                    .map(|column| product(column, &self.missing.samples)),
            );
            let largest = alike.diagonal().max();
            let Ok(inverse) = alike.pseudo_inverse(SAME * largest.max(f64::MIN_POSITIVE)) else {
                return 0.0;
            };
            let coefficients = inverse * pull;
            for sample in (0..self.missing.samples.len()).filter(|sample| fold_of(*sample) == fold)
            {
                let terms = reduced.iter().zip(&coefficients);
                let told: f64 = terms.map(|(column, c)| c * column[sample]).sum();
                left += (self.missing.samples[sample] - told).powi(2);
                all += self.missing.samples[sample].powi(2);
            }
        }
        let above = self.above_noise(all);
        if above <= 0.0 {
            return 0.0;
        }
        1.0 - self.above_noise(left) / above
    }

    fn phrase(&self, place: usize) -> String {
        let (form, variable) = self.missing.library[place];
        form.phrase(variable.name)
    }
}

/// What is left of samples without the part along a direction, so that they have nothing in common
/// with what `shows` as it.
pub fn without(samples: &[f64], direction: &[f64], shows: &[f64]) -> Vec<f64> {
    let square = dot(direction, shows);
    if square <= 0.0 {
        return samples.to_vec();
    }
    let part = dot(samples, shows) / square;
    let pairs = samples.iter().zip(direction);
    pairs.map(|(sample, along)| sample - part * along).collect()
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;
    use std::f64::consts::TAU;

    const ROWS: usize = 600;

    /// Three recordings of a place that swings with two frequencies, and its velocity.
    fn motion() -> [Variable; 3] {
        let time = |row: usize| row as f64 * 10e-3;
        let each = |of: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
            let recording = |phase: f64| {
                (0..ROWS)
                    .map(|row| of(time(row), phase))
                    .collect::<Vec<f64>>()
            };
            [0.0, 1.1, 2.3].map(recording).to_vec()
        };
        let position = each(&|t, p| 0.12 * (2.1 * t + p).sin() + 0.05 * (5.3 * t + 2.0 * p).cos());
        let velocity =
            each(&|t, p| 0.252 * (2.1 * t + p).cos() - 0.265 * (5.3 * t + 2.0 * p).sin());
        let variable = |name, unit, columns| Variable {
            name,
            unit,
            resolution: 0.0,
            columns,
        };
        [
            variable("position", "m", position),
            variable("velocity", "m/s", velocity),
            variable("time", "s", each(&|t, _| t)),
        ]
    }

    /// What the search finds of a force that is known to 0.3 N, where a constant and a viscous
    /// force are taken up by ordinary parameters.
    fn found(
        force_n: impl Fn(f64, f64, f64) -> f64,
        trailing: Option<(f64, f64)>,
    ) -> Option<Equation> {
        let [position, velocity, time] = motion();
        let trail = trailing.map(|(force_n, path_m)| {
            let mut columns = Form::Trailing.columns(&position, path_m).remove(0);
            columns.iter_mut().flatten().for_each(|z| *z *= force_n);
            columns
        });
        let mut noise = Noise::new(11, 0);
        let mut samples = Vec::new();
        for recording in 0..3 {
            for row in 0..ROWS {
                let [x, v, t] = [&position, &velocity, &time].map(|of| of.columns[recording][row]);
                let trailing = trail.as_ref().map_or(0.0, |trail| trail[recording][row]);
                samples.push((force_n(x, v, t) + trailing) / 0.3 + noise.normal());
            }
        }
        let shows = |rows: &[Vec<f64>]| rows.iter().flatten().map(|z| z / 0.3).collect();
        let nuisance = [vec![1.0; samples.len()], velocity.columns.concat()];
        let recording = (0..samples.len()).map(|sample| sample / ROWS).collect();
        let reduced = |values: &[f64]| beside(values, &nuisance);
        let samples = reduced(&samples);
        best(&Missing {
            quantity: "force",
            unit: "N",
            samples,
            strain: 0.0,
            recording,
            shows: &shows,
            reduced: &reduced,
            most_terms: 3,
            library: vec![
                (Form::Linear, &position),
                (Form::Cubic, &position),
                (Form::Wave, &position),
                (Form::Trailing, &position),
                (Form::Square, &velocity),
                (Form::Linear, &time),
                (Form::Settling, &time),
                (Form::WaveByRecording, &time),
            ],
        })
    }

    /// What is left of values beside some columns, by least squares.
    fn beside(values: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
        let matrix = DMatrix::from_fn(values.len(), columns.len(), |row, at| columns[at][row]);
        let right = DVector::from_column_slice(values);
        let solution = (matrix.transpose() * &matrix)
            .cholesky()
            .unwrap()
            .solve(&(matrix.transpose() * &right));
        (right - matrix * solution).iter().copied().collect()
    }

    fn only(equation: Option<Equation>) -> Term {
        let equation = equation.unwrap();
        println!(
            "{}; {}; {:?}",
            equation.text(),
            equation.share,
            equation.rivals
        );
        assert_eq!(equation.terms.len(), 1);
        assert!(equation.share > 0.9 && equation.rivals.is_empty());
        equation.terms[0].clone()
    }

    fn is_near((value, deviation): (f64, f64), truth: f64) {
        assert!(
            (value - truth).abs() < 4.0 * deviation,
            "{value} ± {deviation} for {truth}"
        );
        assert!(deviation < 0.1 * truth.abs(), "{value} ± {deviation}");
    }

    #[test]
    fn val_drag_is_found_beside_viscous_friction() {
        let term = only(found(|_, v, _| 12.0 * v * v.abs() + 3.0 * v, None));
        assert_eq!((term.form, term.variable), (Form::Square, "velocity"));
        is_near(term.coefficients[0], 12.0);
    }

    #[test]
    fn val_a_stiffening_spring_is_found_with_its_rest() {
        let force_n = |x: f64| 20.0 * (x - 0.04) + 2e3 * (x - 0.04).powi(3);
        let term = only(found(|x, _, _| force_n(x), None));
        assert_eq!((term.form, term.variable), (Form::Cubic, "position"));
        let [stiffness, stiffening, rest] = term.spring().unwrap();
        assert!((stiffness - 20.0).abs() < 2.0, "{stiffness}");
        assert!((stiffening / 2e3 - 1.0).abs() < 0.1 && (rest - 0.04).abs() < 0.004);
    }

    #[test]
    fn val_a_wave_along_the_way_is_found_with_its_pitch() {
        let term = only(found(|x, _, _| 2.0 * (TAU * x / 0.013 + 0.4).sin(), None));
        assert_eq!((term.form, term.variable), (Form::Wave, "position"));
        is_near(term.shape.unwrap(), 0.013);
        is_near(term.amplitude().unwrap(), 2.0);
    }

    #[test]
    fn val_a_force_that_trails_is_found_with_its_path() {
        let term = only(found(|_, _, _| 0.0, Some((3.0, 0.02))));
        assert_eq!((term.form, term.variable), (Form::Trailing, "position"));
        is_near(term.coefficients[0], 3.0);
        is_near(term.shape.unwrap(), 0.02);
    }

    #[test]
    fn val_two_terms_are_found_one_after_the_other() {
        let force_n = |x: f64, t: f64| 2.0 * (TAU * x / 0.03).sin() + 0.7 * t;
        let equation = found(|x, _, t| force_n(x, t), None).unwrap();
        println!("{}", equation.text());
        let forms: Vec<(Form, &str)> = equation
            .terms
            .iter()
            .map(|term| (term.form, term.variable))
            .collect();
        assert_eq!(forms.len(), 2);
        assert!(forms.contains(&(Form::Wave, "position")));
        assert!(forms.contains(&(Form::Linear, "time")));
    }

    /// A phase of its own in every recording.
    #[test]
    fn val_a_swing_over_time_is_found_with_its_period() {
        let term = only(found(|_, _, t| 1.5 * (TAU * t / 0.37 + 1.0).sin(), None));
        assert_eq!((term.form, term.variable), (Form::WaveByRecording, "time"));
        is_near(term.shape.unwrap(), 0.37);
    }

    #[test]
    fn prop_noise_and_what_is_taken_up_are_no_equation() {
        assert_eq!(found(|_, _, _| 0.0, None), None);
        assert_eq!(found(|_, v, _| 4.0 * v - 3.0, None), None);
    }
}
