//! Numbers of a rig fitted to recordings, law by law, with what the data say
//! about each and how much better the prediction becomes.
//!
//! * [`FreeRequest`]: what a person wants free (`free.rs`)
//! * [`fit_law`]: one law fitted and judged
//! * [`improved_rig`]: the rig with the fitted values
//! * [`SignalError`]: RMS errors before and after (`errors.rs`)
//!
//! Weights: a residual counts in units of what the law leaves unexplained (at
//! least the sensor's noise), and as many rows as hang together count as one
//! in the last pass. So a prior weighs what it should against data whose
//! residuals are not white, and standard deviations are honest about it.
//!
//! A law that is predicted in windows has windows that go wrong as a whole: one
//! in which the model breaks away and the machine does not. They are outliers
//! by nature, not by noise, and count by their size instead of its square
//! (Huber's loss). The unit is the geometric mean of RMS and median size: by
//! RMS a few windows rule the fit (Coulomb friction of three healthy practice
//! machines off by 7 to 14 %), by the median every break-away is an outlier and
//! static friction and Stribeck velocity go astray; between them Coulomb
//! friction is within 2.4 % and the held-out error is the least or near it.
//!
//! Limits: one valley is searched, the one the start lies in. Two laws that
//! share a key are fitted each on its own.

mod errors;
mod free;
mod text;

use std::collections::BTreeMap;

use serde::Serialize;

pub use errors::{
    BeforeAfter, OwnUnit, Residuals, SignalError, is_finite, own_unit, residuals_as_given, rms,
};
pub use free::{FreeRequest, free_parameters};

use crate::estimate::Bench;
use crate::estimate::correlation::correlation_length;
use crate::fit::law_problem::{FreeParameter, LawProblem, MOST_ACTIVE, Scope};
use crate::fit::{
    Fit, LeastSquares, NoiseVariance, NormalEquations, Options, Reason, ResidualSums, RowWeighting,
    solve,
};
use crate::laws::{Law, Track};
use crate::rig::{Rig, ValveTable};
use crate::text::{plain, rounded};

/// Passes in which the weights follow the residuals; the last one counts their
/// correlation in as well.
const PASSES: usize = 3;
/// A step that promises or brings less than this part of the cost is the last:
/// over 10^5 rows a tenth of a standard deviation at the most,
/// and above the kinks that stick and slip leave in the error.
const COST_TOLERANCE: f64 = 1e-7;
/// Residuals beyond this many standard deviations are outliers to Huber's loss:
/// 95 % efficient on normal noise (Huber 1981).
const OUTLIER_DEVIATIONS: f64 = 1.345;
/// Standard deviation of normal noise over its median magnitude.
const DEVIATION_PER_MEDIAN: f64 = 1.4826;
/// Correlations from this size on are worth a line.
const STRONG_CORRELATION: f64 = 0.5;
/// Correlations told.
const MOST_CORRELATIONS: usize = 8;
/// A standard deviation above this part of the prior's says that the data had
/// nothing to add.
const PRIOR_ONLY: f64 = 0.9;
/// Parameters that take part in an undetermined direction with at least this
/// part of its largest one are named.
const NAMED_PART: f64 = 0.05;

/// One law to fit.
pub struct LawTask<'a> {
    /// The law.
    pub law: Law,
    /// The rig as given.
    pub given: &'a Rig,
    /// The rig to start from: the given one, or that with what no rig file states exactly.
    pub rig: &'a Rig,
    /// What is fitted.
    pub train: &'a [Track<'a>],
    /// What is only predicted.
    pub held_out: &'a [Track<'a>],
    /// Parameters left free.
    pub free: Vec<FreeParameter>,
}

/// A law fitted.
#[derive(Clone, Debug, Serialize)]
pub struct LawFit {
    /// The law.
    #[serde(serialize_with = "law_title")]
    pub law: Law,
    /// Shared parameters, then those of each recording.
    pub parameters: Vec<FittedParameter>,
    /// Pairs of shared parameters that move together, strongest first.
    pub correlations: Vec<Correlation>,
    /// Correlations of the parameters listed, row by row.
    pub correlation_matrix: Vec<Vec<Option<f64>>>,
    /// What the data leave open, a sentence each.
    pub undetermined: Vec<String>,
    /// Errors per predicted signal.
    pub errors: Vec<SignalError>,
    /// Rows fitted, all outputs counted.
    pub rows: usize,
    /// How many rows hang together and count as one.
    pub correlated_rows: f64,
    /// Trial steps over all passes.
    pub iterations: usize,
    /// Whether the solver came to a minimum.
    pub converged: bool,
    /// Why it stopped, in words.
    pub stopped: &'static str,
    /// How the law is predicted: windows or whole recordings.
    pub prediction: String,
    /// Residuals for plots.
    #[serde(skip)]
    pub residuals: FitResiduals,
}

fn law_title<S: serde::Serializer>(law: &Law, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(law.title())
}

/// A held-out error that grows by less than this part is what estimating the initial states
/// moves.
const WORSE: f64 = 1.02;

impl LawFit {
    /// Why the fit is not to be trusted, a line each; none for a sound one.
    pub fn faults(&self) -> Vec<String> {
        let title = self.law.title();
        let mut faults = Vec::new();
        if !self.converged {
            faults.push(format!("{title}: {}", self.stopped));
        }
        for error in &self.errors {
            let held_out = error.held_out.map(|error| (error.before, error.after));
            let Some((Some(before), after)) = held_out else {
                continue;
            };
            // An error under the sensor's noise is none.
            let after = after.unwrap_or(f64::INFINITY);
            if after > WORSE * before.max(error.noise) {
                faults.push(format!(
                    "{title}: {} of the held-out recordings is predicted worse with the fitted numbers, {} {unit} rms, than with those given, {} {unit}",
                    error.signal,
                    plain(after, 3),
                    plain(before, 3),
                    unit = error.unit
                ));
            }
        }
        faults
    }
}

/// Residuals of a fit, by output, recording and row; `None` where there is no
/// finite answer.
#[derive(Clone, Debug, Default)]
pub struct FitResiduals {
    /// Rig as given, training recordings.
    pub train_before: Option<Residuals>,
    /// Fitted, training recordings.
    pub train_after: Option<Residuals>,
    /// Rig as given, held-out recordings.
    pub held_before: Option<Residuals>,
    /// Fitted, held-out recordings.
    pub held_after: Option<Residuals>,
}

/// A parameter before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittedParameter {
    /// `section.key`, with the recording where it belongs to one.
    pub name: String,
    /// The key.
    pub key: String,
    /// One number for all recordings.
    pub shared: bool,
    /// The value of the rig file; absent where only the start was given.
    pub given: Option<f64>,
    /// Where the search began.
    pub start: f64,
    /// Fitted.
    pub fitted: f64,
    /// One standard deviation with the residuals' correlation counted in; none
    /// at a bound or where the data leave the parameter open.
    pub standard_deviation: Option<f64>,
    /// One standard deviation of what was known before.
    pub prior_standard_deviation: Option<f64>,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Whether it stands on one of them.
    pub at_bound: bool,
    /// What a reader should know, in a few words; mostly empty.
    pub note: String,
}

/// Two estimates that move together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// One parameter.
    pub first: String,
    /// The other.
    pub second: String,
    /// Between -1 and 1.
    pub correlation: f64,
}

/// A problem that tells how often it was asked.
struct Watched<'a, 'p> {
    problem: LawProblem<'p>,
    runs: usize,
    progress: &'a dyn Fn(usize),
}

impl Watched<'_, '_> {
    fn tell(&mut self) {
        self.runs += 1;
        (self.progress)(self.runs);
    }
}

impl LeastSquares for Watched<'_, '_> {
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations) {
        self.tell();
        self.problem.accumulate(values, equations);
    }

    fn accumulate_cost(&mut self, values: &[f64], sums: &mut ResidualSums) {
        self.tell();
        self.problem.accumulate_cost(values, sums);
    }
}

/// Fits one law. `progress` hears the number of runs through the recordings.
/// The error is one line.
pub fn fit_law(task: &LawTask<'_>, progress: &dyn Fn(usize)) -> Result<LawFit, String> {
    let bench = Bench::new(task.law, task.rig, task.train);
    let before = residuals_as_given(task.law, task.given, task.train, &[]);
    let solved = solve_in_passes(task, &bench, before.as_ref(), progress)?;
    let shared = shared_values(task, &solved.fit);
    let mut residuals = FitResiduals {
        train_before: before,
        train_after: Some(solved.residuals.clone()),
        ..FitResiduals::default()
    };
    if !task.held_out.is_empty() {
        let own: Vec<FreeParameter> = own_parameters(&task.free);
        let improved = task.rig.with_values(&shared);
        residuals.held_before = residuals_as_given(task.law, task.given, task.held_out, &[]);
        residuals.held_after = residuals_as_given(task.law, &improved, task.held_out, &own);
    }
    Ok(told(task, &bench, solved, residuals))
}

struct Solved {
    fit: Fit,
    names: Vec<String>,
    residuals: Residuals,
    iterations: usize,
    correlated_rows: f64,
}

fn solve_in_passes(
    task: &LawTask<'_>,
    bench: &Bench<'_>,
    before: Option<&Residuals>,
    progress: &dyn Fn(usize),
) -> Result<Solved, String> {
    let mut sigma = match before {
        Some(before) => unexplained(task.law, before, &bench.noise),
        None => bench.spread(),
    };
    let mut starts: Option<Vec<f64>> = None;
    let mut iterations = 0;
    let mut runs = 0;
    let mut correlated_rows = 1.0;
    for pass in 1.. {
        let last = pass == PASSES;
        let problem = problem(task, &sigma);
        let names = problem.names();
        let mut parameters = problem.parameters();
        check_size(&problem, task)?;
        for (parameter, start) in parameters.iter_mut().zip(starts.iter().flatten()) {
            parameter.start = *start;
        }
        let mut watched = Watched {
            problem,
            runs,
            progress,
        };
        let options = options(task.law, last, correlated_rows);
        let fit = solve(&mut watched, &parameters, &options)
            .map_err(|error| format!("{}: {error}", task.law.title()))?;
        runs = watched.runs;
        iterations += fit.iterations;
        let residuals = bench.residuals(&watched.problem, &fit.values);
        if !is_finite(task.law, &residuals) {
            return Err(format!(
                "{}: the prediction is not finite with the fitted numbers; start nearer or bound them with --free KEY=START,LOWER..UPPER",
                task.law.title()
            ));
        }
        if last {
            return Ok(Solved {
                fit,
                names,
                residuals,
                iterations,
                correlated_rows,
            });
        }
        sigma = unexplained(task.law, &residuals, &bench.noise);
        if pass + 1 == PASSES {
            correlated_rows = correlation_length(&residuals);
            let inflation = correlated_rows.sqrt();
            sigma.iter_mut().for_each(|sigma| *sigma *= inflation);
        }
        starts = Some(fit.values);
    }
    Err(String::new())
}

fn problem<'a>(task: &'a LawTask<'_>, sigma: &'a [f64]) -> LawProblem<'a> {
    LawProblem {
        law: task.law,
        rig: task.rig,
        tracks: task.train,
        free: &task.free,
        sigma,
        left_out: None,
        presence: None,
    }
}

fn options(law: Law, last: bool, correlated_rows: f64) -> Options {
    let weighting = match law.fit_window_s() {
        // In the last pass residuals are counted in inflated units.
        Some(_) => RowWeighting::Huber {
            scale: OUTLIER_DEVIATIONS / if last { correlated_rows.sqrt() } else { 1.0 },
        },
        None => RowWeighting::Squares,
    };
    Options {
        weighting,
        noise: NoiseVariance::Given(1.0),
        cost_tolerance: if last { COST_TOLERANCE } else { 1e-6 },
        ..Options::default()
    }
}

fn check_size(problem: &LawProblem<'_>, task: &LawTask<'_>) -> Result<(), String> {
    let most = (0..task.train.len())
        .map(|recording| problem.active(recording).len())
        .max()
        .unwrap_or(0);
    if most <= MOST_ACTIVE {
        return Ok(());
    }
    Err(format!(
        "{}: {most} parameters and initial states act on one recording, at most {MOST_ACTIVE} can; name fewer with --free",
        task.law.title()
    ))
}

/// The size of what is left unexplained of each output, at least its noise: RMS,
/// or less where outliers are to be expected (see the head of this module).
fn unexplained(law: Law, residuals: &Residuals, noise: &[f64]) -> Vec<f64> {
    let size = |columns: &[Vec<f64>]| match law.fit_window_s() {
        Some(_) => (DEVIATION_PER_MEDIAN * median_size(columns) * rms(columns)).sqrt(),
        None => rms(columns),
    };
    let floor = residuals.iter().zip(noise);
    floor
        .map(|(columns, noise)| size(columns).max(*noise))
        .collect()
}

fn median_size(columns: &[Vec<f64>]) -> f64 {
    let sizes = columns.iter().flatten().map(|residual| residual.abs());
    let mut sizes: Vec<f64> = sizes.filter(|size| size.is_finite()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn own_parameters(free: &[FreeParameter]) -> Vec<FreeParameter> {
    let own = free.iter().filter(|free| free.scope == Scope::PerRecording);
    own.cloned().collect()
}

/// Values of the shared parameters by key.
fn shared_values(task: &LawTask<'_>, fit: &Fit) -> BTreeMap<String, f64> {
    let shared = task.free.iter().filter(|free| free.scope == Scope::Shared);
    let keys = shared.map(|free| free.key.clone());
    keys.zip(fit.values.iter().copied()).collect()
}

/// The outcome in the terms of a reader.
fn told(task: &LawTask<'_>, bench: &Bench<'_>, solved: Solved, residuals: FitResiduals) -> LawFit {
    let listed: Vec<usize> = (0..solved.names.len())
        .filter(|&index| parameter_of(task, &solved.names[index]).is_some())
        .collect();
    let parameters: Vec<FittedParameter> = listed
        .iter()
        .filter_map(|&index| fitted_parameter(task, &solved, index))
        .collect();
    let fit = &solved.fit;
    let matrix: Vec<Vec<Option<f64>>> = listed
        .iter()
        .map(|&row| {
            listed
                .iter()
                .map(|&column| fit.correlation(row, column))
                .collect()
        })
        .collect();
    LawFit {
        law: task.law,
        correlations: strongest(&parameters, &matrix),
        correlation_matrix: matrix,
        undetermined: open_directions(&solved),
        errors: signal_errors(task, bench, &residuals),
        rows: fit.rows,
        correlated_rows: solved.correlated_rows,
        iterations: solved.iterations,
        converged: fit.converged.is_converged(),
        stopped: stopped(fit.converged),
        prediction: prediction(task.law),
        parameters,
        residuals,
    }
}

/// How a law is predicted, in words.
pub fn prediction(law: Law) -> String {
    match law.fit_window_s() {
        Some(window_s) => format!("windows of {window_s} s, each starting at the recorded motion"),
        None => "the whole recording from estimated initial states".into(),
    }
}

fn stopped(reason: Reason) -> &'static str {
    match reason {
        Reason::Gradient => "minimum of the error reached",
        Reason::Step => "steps below the tolerance",
        Reason::Cost => "reduction of the error below the tolerance",
        Reason::Stalled => {
            "NOT CONVERGED: no step reduces the error although the gradient is not zero"
        }
        Reason::IterationLimit => "NOT CONVERGED: iteration limit reached",
    }
}

/// The free parameter that a name of the problem stands for; an initial state
/// has none.
fn parameter_of<'t>(task: &'t LawTask<'_>, name: &str) -> Option<&'t FreeParameter> {
    task.free.iter().find(|free| {
        let rest = name.strip_prefix(free.key.as_str());
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(" of "))
    })
}

fn fitted_parameter(task: &LawTask<'_>, solved: &Solved, index: usize) -> Option<FittedParameter> {
    let free = parameter_of(task, &solved.names[index])?;
    let fit = &solved.fit;
    let prior = free.parameter.prior.map(|prior| prior.standard_deviation);
    let mut parameter = FittedParameter {
        name: solved.names[index].clone(),
        key: free.key.clone(),
        shared: free.scope == Scope::Shared,
        given: task.given.value(&free.key),
        start: free.parameter.start,
        fitted: fit.values[index],
        standard_deviation: fit.standard_deviations[index].filter(|_| !fit.at_bound[index]),
        prior_standard_deviation: prior,
        lower: free.parameter.lower,
        upper: free.parameter.upper,
        at_bound: fit.at_bound[index],
        note: String::new(),
    };
    parameter.note = note(&parameter, fit.uncertainty.determined[index]);
    Some(parameter)
}

fn note(parameter: &FittedParameter, determined: bool) -> String {
    let scaled = ValveTable::from_key(&parameter.key).is_some();
    let told = if parameter.at_bound {
        let low = parameter.fitted <= parameter.lower;
        if low {
            "AT ITS LOWER BOUND"
        } else {
            "AT ITS UPPER BOUND"
        }
    } else if !determined {
        "not determined by the data"
    } else if prior_only(parameter) {
        "determined by the prior"
    } else {
        ""
    };
    match (scaled, told) {
        (true, "") => "scale factor of the table".into(),
        (true, told) => format!("scale factor of the table; {told}"),
        (false, told) => told.into(),
    }
}

fn prior_only(parameter: &FittedParameter) -> bool {
    let both = parameter
        .standard_deviation
        .zip(parameter.prior_standard_deviation);
    both.is_some_and(|(fitted, prior)| fitted > PRIOR_ONLY * prior)
}

fn strongest(parameters: &[FittedParameter], matrix: &[Vec<Option<f64>>]) -> Vec<Correlation> {
    let mut all: Vec<Correlation> = Vec::new();
    for (row, first) in parameters.iter().enumerate() {
        for (column, second) in parameters.iter().enumerate().skip(row + 1) {
            if let Some(correlation) = matrix[row][column] {
                all.push(Correlation {
                    first: first.name.clone(),
                    second: second.name.clone(),
                    correlation,
                });
            }
        }
    }
    all.retain(|pair| pair.correlation.abs() >= STRONG_CORRELATION);
    all.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    all.truncate(MOST_CORRELATIONS);
    all
}

/// Directions in which the cost is flat, each as a sentence.
fn open_directions(solved: &Solved) -> Vec<String> {
    let directions = solved.fit.uncertainty.undetermined.iter();
    directions
        .map(|direction| {
            let largest = direction.amax();
            let mut parts: Vec<(usize, f64)> = direction
                .iter()
                .copied()
                .enumerate()
                .filter(|(_, part)| part.abs() >= NAMED_PART * largest)
                .collect();
            parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            sentence(&parts, &solved.names)
        })
        .collect()
}

fn sentence(parts: &[(usize, f64)], names: &[String]) -> String {
    let Some(((first, lead), others)) = parts.split_first() else {
        return String::new();
    };
    if others.is_empty() {
        return format!("the recordings do not determine {}", names[*first]);
    }
    let moved: Vec<String> = others
        .iter()
        .map(|(index, part)| {
            let sense = if part.signum() * lead.signum() > 0.0 {
                "raised"
            } else {
                "lowered"
            };
            format!("{} {sense}", names[*index])
        })
        .collect();
    format!(
        "not separable: {} raised with {} gives the same prediction",
        names[*first],
        moved.join(" and ")
    )
}

fn signal_errors(
    task: &LawTask<'_>,
    bench: &Bench<'_>,
    residuals: &FitResiduals,
) -> Vec<SignalError> {
    let spread = bench.spread();
    let outputs = task.law.outputs(task.rig);
    let held = !task.held_out.is_empty();
    outputs
        .iter()
        .enumerate()
        .map(|(place, output)| SignalError {
            signal: output.signal,
            unit: output.unit,
            own: own_unit(task.rig, output.signal),
            noise: bench.noise[place],
            spread: spread[place],
            train: BeforeAfter::of(
                residuals.train_before.as_ref(),
                residuals.train_after.as_ref(),
                place,
            ),
            held_out: held.then(|| {
                BeforeAfter::of(
                    residuals.held_before.as_ref(),
                    residuals.held_after.as_ref(),
                    place,
                )
            }),
        })
        .collect()
}

/// The rig with the fitted values of all laws, and a line for each key that
/// two laws fitted differently: the one with the smaller standard deviation is
/// taken.
pub fn improved_rig(rig: &Rig, fits: &[LawFit]) -> (Rig, Vec<String>) {
    let mut taken: BTreeMap<String, (f64, f64, Law)> = BTreeMap::new();
    let mut notes = Vec::new();
    for fit in fits {
        for parameter in fit.parameters.iter().filter(|parameter| parameter.shared) {
            let deviation = parameter.standard_deviation.unwrap_or(f64::INFINITY);
            if let Some((_, known, law)) = taken.get(&parameter.key) {
                let better = if deviation < *known { fit.law } else { *law };
                notes.push(format!(
                    "{} was fitted by two laws; the value of the {} is taken",
                    parameter.key,
                    better.title()
                ));
                if better == *law {
                    continue;
                }
            }
            let entry = (parameter.fitted, deviation, fit.law);
            taken.insert(parameter.key.clone(), entry);
        }
    }
    let values = taken
        .into_iter()
        .map(|(key, entry)| (key, rounded(entry.0)))
        .collect();
    (rig.with_values(&values), notes)
}
