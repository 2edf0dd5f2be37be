//! The least-squares solver against SciPy, against NIST's certified values, and
//! its own promises.

use grey_box::fit::{
    Fit, FitError, LeastSquares, NoiseVariance, NormalEquations, Options, Parameter, Reason,
    ResidualSums, RowWeighting, solve,
};
use proptest::prelude::*;
use serde::Deserialize;

#[derive(Deserialize)]
struct Fixture {
    problems: Vec<Problem>,
}

#[derive(Clone, Deserialize)]
struct Problem {
    name: String,
    model: String,
    x: Vec<f64>,
    y: Vec<f64>,
    parameters: Vec<Unknown>,
    weight: f64,
    huber_scale: Option<f64>,
    estimate_noise: bool,
    certified: Option<Certified>,
    scipy: Solution,
}

#[derive(Clone, Deserialize)]
struct Unknown {
    start: f64,
    lower: Option<f64>,
    upper: Option<f64>,
    prior: Option<Knowledge>,
}

#[derive(Clone, Deserialize)]
struct Knowledge {
    mean: f64,
    standard_deviation: f64,
}

#[derive(Clone, Deserialize)]
struct Certified {
    values: Vec<f64>,
    standard_deviations: Vec<Option<f64>>,
    residual_sum_of_squares: f64,
}

#[derive(Clone, Deserialize)]
struct Solution {
    values: Vec<f64>,
    cost: f64,
    residual_sum_of_squares: f64,
    standard_deviations: Vec<Option<f64>>,
    at_bound: Vec<bool>,
    rank: usize,
}

/// Value and gradient of the model called `name`; written anew, not translated from
/// the script's array formulas.
fn model(name: &str, b: &[f64], x: f64) -> (f64, Vec<f64>) {
    match name {
        "exponential_decay" => {
            let e = (-b[1] * x).exp();
            (b[0] * e + b[2], vec![e, -b[0] * x * e, 1.0])
        }
        "split_amplitude_decay" => {
            let e = (-b[2] * x).exp();
            ((b[0] + b[1]) * e, vec![e, e, -(b[0] + b[1]) * x * e])
        }
        "michaelis_menten" => {
            let share = x / (b[1] + x);
            (b[0] * share, vec![share, -b[0] * share / (b[1] + x)])
        }
        "misra1a" => {
            let e = (-b[1] * x).exp();
            (b[0] * (1.0 - e), vec![1.0 - e, b[0] * x * e])
        }
        "thurber" => {
            let top = b[0] + x * (b[1] + x * (b[2] + x * b[3]));
            let bottom = 1.0 + x * (b[4] + x * (b[5] + x * b[6]));
            let value = top / bottom;
            let up = |power| x.powi(power) / bottom;
            let down = |power| -value * up(power);
            (
                value,
                vec![up(0), up(1), up(2), up(3), down(1), down(2), down(3)],
            )
        }
        "mgh09" => {
            let bottom = x * x + x * b[2] + b[3];
            let share = (x * x + x * b[1]) / bottom;
            let value = b[0] * share;
            (
                value,
                vec![
                    share,
                    b[0] * x / bottom,
                    -value * x / bottom,
                    -value / bottom,
                ],
            )
        }
        "mgh17" => {
            let (slow, fast) = ((-x * b[3]).exp(), (-x * b[4]).exp());
            let value = b[0] + b[1] * slow + b[2] * fast;
            (
                value,
                vec![1.0, slow, fast, -b[1] * x * slow, -b[2] * x * fast],
            )
        }
        "eckerle4" => {
            let z = (x - b[2]) / b[1];
            let bell = (-0.5 * z * z).exp() / b[1];
            let value = b[0] * bell;
            (
                value,
                vec![bell, value * (z * z - 1.0) / b[1], value * z / b[1]],
            )
        }
        "rat42" => {
            let e = (b[1] - b[2] * x).exp();
            let value = b[0] / (1.0 + e);
            let slope = value * e / (1.0 + e);
            (value, vec![1.0 / (1.0 + e), -slope, slope * x])
        }
        other => panic!("no model {other}"),
    }
}

impl LeastSquares for Problem {
    fn accumulate(&mut self, b: &[f64], equations: &mut NormalEquations) {
        if self.model == "rosenbrock" {
            equations.add_row(10.0 * (b[1] - b[0] * b[0]), &[-20.0 * b[0], 10.0]);
            equations.add_row(1.0 - b[0], &[-1.0, 0.0]);
            return;
        }
        for (&x, &y) in self.x.iter().zip(&self.y) {
            let (value, mut gradient) = model(&self.model, b, x);
            gradient.iter_mut().for_each(|slope| *slope *= self.weight);
            equations.add_row((value - y) * self.weight, &gradient);
        }
    }
}

impl Problem {
    fn parameters(&self) -> Vec<Parameter> {
        let parameter = |unknown: &Unknown| {
            let lower = unknown.lower.unwrap_or(f64::NEG_INFINITY);
            let upper = unknown.upper.unwrap_or(f64::INFINITY);
            let free = Parameter::new(unknown.start).bounded(lower, upper);
            match &unknown.prior {
                Some(prior) => free.with_prior(prior.mean, prior.standard_deviation),
                None => free,
            }
        };
        self.parameters.iter().map(parameter).collect()
    }

    /// Tolerances just above the rounding of these closed-form models: a residual a
    /// thousandth of the data carries 1e-13, and a cost cannot be known better.
    fn options(&self) -> Options {
        Options {
            weighting: self
                .huber_scale
                .map_or(RowWeighting::Squares, |scale| RowWeighting::Huber { scale }),
            noise: if self.estimate_noise {
                NoiseVariance::Estimated
            } else {
                NoiseVariance::Given(1.0)
            },
            maximum_iterations: 1000,
            gradient_tolerance: 1.0e-13,
            step_tolerance: 1.0e-13,
            cost_tolerance: 1.0e-13,
            ..Options::default()
        }
    }

    fn fit(&self) -> Fit {
        let mut problem = self.clone();
        solve(&mut problem, &self.parameters(), &self.options()).expect("a fit")
    }
}

fn fixture() -> Vec<Problem> {
    let text = include_str!("data/scipy_least_squares.json");
    serde_json::from_str::<Fixture>(text)
        .expect("a readable fixture")
        .problems
}

fn named(name: &str) -> Problem {
    fixture()
        .into_iter()
        .find(|problem| problem.name == name)
        .expect("a problem of the fixture")
}

/// Largest disagreement with SciPy: both stop within rounding of the minimum, where
/// the cost is flat to the square root of it (1e-8) times the condition of the problem.
const VALUE_TOLERANCE: f64 = 1.0e-6;
/// Costs are flat at the minimum, so they agree far better than values.
const COST_TOLERANCE: f64 = 1.0e-12;
/// NIST prints 11 digits; values found from both starts scatter like SciPy's.
const CERTIFIED_TOLERANCE: f64 = 1.0e-6;

fn distance(found: f64, expected: f64) -> f64 {
    (found - expected).abs() / expected.abs().max(f64::MIN_POSITIVE)
}

#[track_caller]
fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = distance(found, expected);
    assert!(
        error <= tolerance,
        "{what}: {found} against {expected}, relative {error:.2e}"
    );
}

#[track_caller]
fn assert_optional_near(what: &str, found: Option<f64>, expected: Option<f64>, tolerance: f64) {
    match (found, expected) {
        (Some(found), Some(expected)) => assert_near(what, found, expected, tolerance),
        (None, None) => {}
        other => panic!("{what}: {other:?}"),
    }
}

fn compare_with_scipy(problem: &Problem, fit: &Fit) {
    let (name, scipy) = (&problem.name, &problem.scipy);
    assert!(fit.converged.is_converged(), "{name}: {:?}", fit.converged);
    for (index, (found, expected)) in fit.values.iter().zip(&scipy.values).enumerate() {
        assert_near(
            &format!("{name} value {index}"),
            *found,
            *expected,
            VALUE_TOLERANCE,
        );
        assert_optional_near(
            &format!("{name} standard deviation {index}"),
            fit.standard_deviations[index],
            scipy.standard_deviations[index],
            VALUE_TOLERANCE,
        );
    }
    if scipy.cost > 0.0 {
        assert_near(
            &format!("{name} cost"),
            fit.cost,
            scipy.cost,
            COST_TOLERANCE,
        );
    } else {
        assert!(fit.cost < 1.0e-20, "{name}: {}", fit.cost);
    }
    assert_eq!(fit.at_bound, scipy.at_bound, "{name}");
    assert_eq!(fit.uncertainty.rank, scipy.rank, "{name}");
}

#[test]
fn val_scipy_every_full_rank_problem() {
    let problems = fixture();
    assert_eq!(problems.len(), 26, "the fixture is complete");
    for problem in problems
        .iter()
        .filter(|p| p.name != "split_amplitude_rank_deficient")
    {
        let fit = problem.fit();
        println!(
            "{:32} {:4} iterations {:?} condition {:.1e}",
            problem.name, fit.iterations, fit.converged, fit.uncertainty.condition
        );
        compare_with_scipy(problem, &fit);
    }
}

#[test]
fn val_nist_certified_values() {
    let mut seen = 0;
    for problem in fixture() {
        let Some(certified) = &problem.certified else {
            continue;
        };
        let (name, fit) = (&problem.name, problem.fit());
        for (index, expected) in certified.values.iter().enumerate() {
            let what = format!("{name} value {index}");
            assert_near(&what, fit.values[index], *expected, CERTIFIED_TOLERANCE);
            if let Some(expected) = certified.standard_deviations[index] {
                let found = fit.standard_deviations[index].unwrap();
                assert_near(
                    &format!("{what} deviation"),
                    found,
                    expected,
                    CERTIFIED_TOLERANCE,
                );
            }
        }
        let (found, expected) = (
            fit.residual_sum_of_squares,
            certified.residual_sum_of_squares,
        );
        assert_near(name, found, expected, 1.0e-10);
        seen += 1;
    }
    assert_eq!(seen, 10);
}

#[test]
fn val_scipy_rank_deficiency_is_reported() {
    let problem = named("split_amplitude_rank_deficient");
    let (fit, scipy) = (problem.fit(), &problem.scipy);
    assert!(fit.converged.is_converged());
    assert_eq!(fit.uncertainty.rank, scipy.rank);
    assert_near("cost", fit.cost, scipy.cost, COST_TOLERANCE);
    // Only the sum of the amplitudes is determined, and the time constant.
    let sum = |values: &[f64]| values[0] + values[1];
    assert_near("sum", sum(&fit.values), sum(&scipy.values), VALUE_TOLERANCE);
    assert_near("rate", fit.values[2], scipy.values[2], VALUE_TOLERANCE);
    assert_eq!(fit.standard_deviations[..2], [None, None]);
    let (found, expected) = (fit.standard_deviations[2], scipy.standard_deviations[2]);
    assert_optional_near("rate deviation", found, expected, VALUE_TOLERANCE);
    let open = &fit.uncertainty.undetermined;
    assert_eq!(open.len(), 1);
    assert!((open[0][0] + open[0][1]).abs() < 1.0e-9 && open[0][2].abs() < 1.0e-9);
    assert!(fit.uncertainty.condition.is_infinite());
    assert_eq!(fit.correlation(0, 2), None);
}

#[test]
fn val_scipy_plain_sum_of_squares_beside_a_robust_cost() {
    for name in ["decay_outliers_huber", "decay_priors", "puromycin"] {
        let problem = named(name);
        let found = problem.fit().residual_sum_of_squares;
        assert_near(
            name,
            found,
            problem.scipy.residual_sum_of_squares,
            VALUE_TOLERANCE,
        );
    }
}

#[test]
fn val_scipy_agrees_at_the_default_tolerances() {
    for problem in fixture()
        .iter()
        .filter(|p| p.scipy.rank == p.parameters.len())
    {
        let options = Options {
            maximum_iterations: 1000,
            weighting: problem.options().weighting,
            noise: problem.options().noise,
            ..Options::default()
        };
        let fit = solve(&mut problem.clone(), &problem.parameters(), &options).unwrap();
        assert!(fit.converged.is_converged(), "{}", problem.name);
        for (index, deviation) in fit.standard_deviations.iter().enumerate() {
            let off = (fit.values[index] - problem.scipy.values[index]).abs();
            let allowed = 1.0e-4 * deviation.unwrap();
            assert!(
                off <= allowed,
                "{} value {index}: off by {off}",
                problem.name
            );
        }
    }
}

#[test]
fn a_start_without_an_answer_is_an_error() {
    let mut broken = |_: &[f64], equations: &mut NormalEquations| {
        equations.add_row(f64::NAN, &[1.0]);
    };
    let error = solve(&mut broken, &[Parameter::new(2.0)], &Options::default()).unwrap_err();
    assert_eq!(error, FitError::NonFiniteStart { values: vec![2.0] });
    let mut wrong_length = |_: &[f64], equations: &mut NormalEquations| {
        equations.add_row(1.0, &[1.0, 2.0]);
    };
    assert!(
        solve(
            &mut wrong_length,
            &[Parameter::new(2.0)],
            &Options::default()
        )
        .is_err()
    );
}

#[test]
fn unusable_parameters_and_options_are_errors() {
    let mut problem = |_: &[f64], _: &mut NormalEquations| {};
    let mut refuses = |parameter: Parameter, options: Options| {
        assert!(
            solve(&mut problem, &[parameter], &options).is_err(),
            "{parameter:?} {options:?}"
        );
    };
    let good = Parameter::new(1.0);
    refuses(Parameter::new(f64::NAN), Options::default());
    refuses(good.bounded(2.0, 1.0), Options::default());
    refuses(good.bounded(f64::NAN, 1.0), Options::default());
    refuses(
        good.bounded(f64::INFINITY, f64::INFINITY),
        Options::default(),
    );
    refuses(good.with_prior(0.0, 0.0), Options::default());
    refuses(good.with_prior(f64::NAN, 1.0), Options::default());
    refuses(good.with_scale(0.0), Options::default());
    let huber = RowWeighting::Huber { scale: 0.0 };
    refuses(
        good,
        Options {
            weighting: huber,
            ..Options::default()
        },
    );
    let noise = NoiseVariance::Given(f64::NAN);
    refuses(
        good,
        Options {
            noise,
            ..Options::default()
        },
    );
}

#[test]
fn a_trial_without_an_answer_is_rejected() {
    // ln x from 3 with a target at 1e-3: a full Gauss-Newton step lands below zero.
    let mut logarithm = |x: &[f64], equations: &mut NormalEquations| {
        equations.add_row(x[0].ln() - 1.0e-3_f64.ln(), &[1.0 / x[0]]);
    };
    let fit = solve(&mut logarithm, &[Parameter::new(3.0)], &Options::default()).unwrap();
    assert!(fit.converged.is_converged());
    assert!((fit.values[0] - 1.0e-3).abs() < 1.0e-9);
}

/// Its first trials are not taken.
#[test]
fn prop_a_limit_on_steps_counts_those_that_are_taken() {
    let mut logarithm = |x: &[f64], equations: &mut NormalEquations| {
        equations.add_row(x[0].ln() - 1.0e-3_f64.ln(), &[1.0 / x[0]]);
    };
    for maximum_steps in 1..4 {
        let options = Options {
            maximum_steps,
            ..Options::default()
        };
        let fit = solve(&mut logarithm, &[Parameter::new(3.0)], &options).unwrap();
        assert_eq!(fit.converged, Reason::IterationLimit);
        assert_eq!(fit.cost_history.len(), 1 + maximum_steps);
        assert!(fit.iterations > maximum_steps);
    }
}

#[test]
fn wrong_derivatives_are_not_called_converged() {
    let mut uphill = |x: &[f64], equations: &mut NormalEquations| {
        equations.add_row(x[0] - 1.0, &[-1.0]);
    };
    let fit = solve(&mut uphill, &[Parameter::new(3.0)], &Options::default()).unwrap();
    assert_eq!(fit.converged, Reason::Stalled);
}

/// Rows of plus and minus one about `mean` by a law with a kink at its best place: what stands
/// between the kink and the minimum of a smooth law is that mean, in deviations of it.
#[test]
fn val_a_kink_within_the_noise_is_a_minimum_and_one_beyond_it_is_not() {
    const ROWS: usize = 400;
    let fitted = |deviations: f64| {
        let mean = -deviations / (ROWS as f64).sqrt();
        let mut problem = |values: &[f64], equations: &mut NormalEquations| {
            for row in 0..ROWS {
                let noise = if row % 2 == 0 { 1.0 } else { -1.0 };
                let slope = if values[0] < 0.0 { -1.0 } else { 1.0 };
                equations.add_row(slope * values[0] - (mean + noise), &[slope]);
            }
        };
        let parameters = [Parameter::new(0.7).with_scale(1.0)];
        solve(&mut problem, &parameters, &Options::default()).expect("it starts")
    };
    for (deviations, reason) in [(0.2, Reason::Cost), (1.0, Reason::Stalled)] {
        let fit = fitted(deviations);
        assert_eq!(fit.converged, reason, "{deviations}");
        assert!(fit.values[0].abs() < 1e-3, "{}", fit.values[0]);
    }
}

#[test]
fn a_prior_alone_gives_itself_back() {
    let mut nothing = |_: &[f64], _: &mut NormalEquations| {};
    let options = Options {
        noise: NoiseVariance::Given(1.0),
        ..Options::default()
    };
    let parameter = Parameter::new(0.0).with_prior(4.0, 0.5);
    let fit = solve(&mut nothing, &[parameter], &options).unwrap();
    assert_near("mean", fit.values[0], 4.0, 1.0e-9);
    assert_near(
        "deviation",
        fit.standard_deviations[0].unwrap(),
        0.5,
        1.0e-12,
    );
}

#[test]
fn an_unseen_parameter_stays_and_is_reported() {
    let mut line = |x: &[f64], equations: &mut NormalEquations| {
        for place in 0..5 {
            let at = f64::from(place);
            equations.add_row(x[0] * at - 2.0 * at - (at - 2.0).powi(2), &[at, 0.0]);
        }
    };
    let parameters = [Parameter::new(1.0), Parameter::new(7.0)];
    let fit = solve(&mut line, &parameters, &Options::default()).unwrap();
    assert!(fit.converged.is_converged());
    assert_near("unseen", fit.values[1], 7.0, 0.0);
    assert!(fit.standard_deviations[0].is_some() && fit.standard_deviations[1].is_none());
    assert_eq!(fit.uncertainty.rank, 1);
}

#[test]
fn merged_halves_equal_the_whole() {
    let weighting = RowWeighting::Huber { scale: 1.0 };
    let mut whole = NormalEquations::new(2, weighting);
    let (mut first, mut second) = (whole.empty_copy(), whole.empty_copy());
    for place in 0..100 {
        let x = f64::from(place) * 0.1;
        let (residual, gradient) = (3.0 * (x * 7.0).sin(), [x, 1.0]);
        whole.add_row(residual, &gradient);
        if place % 2 == 0 {
            &mut first
        } else {
            &mut second
        }
        .add_row(residual, &gradient);
    }
    first.merge(&second);
    assert_eq!(first.sums().outliers(), whole.sums().outliers());
    assert_near("cost", first.sums().cost(), whole.sums().cost(), 1.0e-15);
    assert!((first.step_curvature() - whole.step_curvature()).norm() < 1.0e-9);
    assert!((first.cost_curvature() - whole.cost_curvature()).norm() < 1.0e-9);
    assert!((first.gradient() - whole.gradient()).norm() < 1.0e-9);
}

/// A family of smooth, sometimes nasty problems: sums of sines, exponentials and
/// products of the parameters, chosen by `shape`.
#[derive(Clone, Debug)]
struct Nasty {
    shape: Vec<f64>,
    poison: bool,
    visited: Vec<Vec<f64>>,
}

impl LeastSquares for Nasty {
    fn accumulate(&mut self, x: &[f64], equations: &mut NormalEquations) {
        self.visited.push(x.to_vec());
        for (row, &c) in self.shape.iter().enumerate() {
            let (i, j) = (row % x.len(), (row / 2) % x.len());
            let phase = c * x[i] + x[j];
            let grown = (0.3 * x[j]).exp();
            let residual = phase.sin() + 0.1 * c * x[i] * grown - c;
            let mut gradient = vec![0.0; x.len()];
            gradient[i] += c * phase.cos() + 0.1 * c * grown;
            gradient[j] += phase.cos() + 0.03 * c * x[i] * grown;
            // A model that fails in part of the space, and one that returns infinities.
            let failed = self.poison && phase > 3.0;
            equations.add_row(if failed { f64::NAN } else { residual }, &gradient);
        }
    }
}

fn nasty_problem() -> impl Strategy<Value = (Nasty, Vec<Parameter>)> {
    let unknown = (
        -5.0..5.0f64,
        0.0..3.0f64,
        0.0..3.0f64,
        any::<bool>(),
        any::<bool>(),
    );
    let parameter = unknown.prop_map(|(start, below, above, bounded, prior)| {
        let free = Parameter::new(start);
        let free = if bounded {
            free.bounded(start - below, start + above)
        } else {
            free
        };
        if prior {
            free.with_prior(start + 1.0, 0.5 + below)
        } else {
            free
        }
    });
    let shape = prop::collection::vec(-4.0..4.0f64, 0..25);
    (shape, any::<bool>(), prop::collection::vec(parameter, 1..6)).prop_map(
        |(shape, poison, parameters)| {
            (
                Nasty {
                    shape,
                    poison,
                    visited: Vec::new(),
                },
                parameters,
            )
        },
    )
}

fn nasty_options(huber: bool) -> Options {
    let weighting = if huber {
        RowWeighting::Huber { scale: 0.7 }
    } else {
        RowWeighting::Squares
    };
    Options {
        weighting,
        ..Options::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn prop_stays_in_the_box_and_goes_down(
        (mut problem, parameters) in nasty_problem(), huber: bool
    ) {
        let result = solve(&mut problem, &parameters, &nasty_options(huber));
        for values in &problem.visited {
            for (value, parameter) in values.iter().zip(&parameters) {
                prop_assert!(parameter.lower <= *value && *value <= parameter.upper);
            }
        }
        match result {
            Ok(fit) => {
                prop_assert!(fit.cost_history.windows(2).all(|pair| pair[1] <= pair[0]));
                prop_assert!(fit.cost.is_finite());
                prop_assert_eq!(fit.cost_history.last().copied(), Some(fit.cost));
            }
            Err(error) => {
                prop_assert!(matches!(error, FitError::NonFiniteStart { .. }), "{error}");
            }
        }
    }

    #[test]
    fn prop_converged_means_no_downhill_direction(
        (mut problem, parameters) in nasty_problem()
    ) {
        problem.poison = false;
        let options = nasty_options(false);
        let fit = solve(&mut problem, &parameters, &options).unwrap();
        prop_assume!(fit.converged.is_converged());
        let mut cost_of = |values: &[f64]| {
            let mut sums = ResidualSums::new(options.weighting);
            problem.accumulate_cost(values, &mut sums);
            let prior = |(p, value): (&Parameter, &f64)| {
                p.prior.map_or(0.0, |q| ((value - q.mean) / q.standard_deviation).powi(2) / 2.0)
            };
            sums.cost() + parameters.iter().zip(values).map(prior).sum::<f64>()
        };
        // A ten-thousandth of a unit off, no neighbour in the box may be lower by more
        // than what the slope left by the tolerances can bring.
        for index in 0..parameters.len() {
            for step in [-1.0e-4, 1.0e-4] {
                let mut neighbour = fit.values.clone();
                neighbour[index] = (neighbour[index] + step)
                    .clamp(parameters[index].lower, parameters[index].upper);
                let gain = fit.cost - cost_of(&neighbour);
                prop_assert!(gain <= 1.0e-8 * (1.0 + fit.cost), "gain {gain} at {index} {fit:?}");
            }
        }
    }

    #[test]
    fn prop_permuted_parameters_give_the_permuted_fit(
        order in Just(vec![0usize, 1, 2, 3]).prop_shuffle(),
        slopes in prop::collection::vec(0.2..3.0f64, 4),
        starts in prop::collection::vec(-1.0..1.0f64, 4),
        bounded: bool,
    ) {
        // Well conditioned: a damped chain of mildly bent rows.
        let rows = |x: [f64; 4], mut add: Box<dyn FnMut(f64, [f64; 4]) + '_>| {
            for (index, slope) in slopes.iter().enumerate() {
                let mut gradient = [0.0; 4];
                gradient[index] = slope + 0.1 * x[index].cos();
                gradient[(index + 1) % 4] += 0.1;
                add(slope * x[index] + 0.1 * x[index].sin() + 0.1 * x[(index + 1) % 4] - 1.0,
                    gradient);
            }
        };
        let parameter = |index: usize| {
            let free = Parameter::new(starts[index]).with_prior(0.5, 2.0).with_scale(1.0);
            if bounded { free.bounded(-1.0, 1.0) } else { free }
        };
        let straight: Vec<Parameter> = (0..4).map(parameter).collect();
        let permuted: Vec<Parameter> = order.iter().map(|&index| straight[index]).collect();
        let mut plain = |x: &[f64], equations: &mut NormalEquations| {
            rows([x[0], x[1], x[2], x[3]], Box::new(|r, g| equations.add_row(r, &g)));
        };
        let mut shuffled = |x: &[f64], equations: &mut NormalEquations| {
            let mut back = [0.0; 4];
            for (place, &index) in order.iter().enumerate() {
                back[index] = x[place];
            }
            rows(back, Box::new(|r, g| {
                let gradient: Vec<f64> = order.iter().map(|&index| g[index]).collect();
                equations.add_row(r, &gradient);
            }));
        };
        let options = Options { noise: NoiseVariance::Given(1.0), ..Options::default() };
        let first = solve(&mut plain, &straight, &options).unwrap();
        let second = solve(&mut shuffled, &permuted, &options).unwrap();
        for (place, &index) in order.iter().enumerate() {
            prop_assert!((first.values[index] - second.values[place]).abs() < 1.0e-7);
            prop_assert_eq!(first.at_bound[index], second.at_bound[place]);
            let spreads = (first.standard_deviations[index], second.standard_deviations[place]);
            match spreads {
                (Some(one), Some(other)) => prop_assert!((one - other).abs() < 1.0e-7 * one),
                (None, None) => {}
                _ => prop_assert!(false, "{spreads:?}"),
            }
        }
    }
}
