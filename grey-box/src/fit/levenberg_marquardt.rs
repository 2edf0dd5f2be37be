//! Bounded Levenberg-Marquardt least squares with priors.
//!
//! Minimises the cost `Σ loss(r_k(x)) + ½ Σ ((x_i - mean_i) / sd_i)²` inside the box
//! `lower <= x <= upper`. Made for up to about 40 parameters and several 100 000
//! rows: the problem adds its rows to [`NormalEquations`], no Jacobian is stored.
//!
//! Method:
//! - Step: `(H + μ D) p = -g` with `H` the Gauss-Newton curvature and `D` the largest
//!   diagonal of `H` seen so far (Marquardt's scaling in the form of J. J. Moré, The
//!   Levenberg-Marquardt algorithm, 1978), solved at unit diagonal by Cholesky.
//! - Damping `μ` by the gain ratio (H. B. Nielsen, IMM-REP-1999-05).
//! - Bounds by active set: a parameter on its bound whose gradient points out of the
//!   box stands still; a step that leaves the box is cut there, and the remaining
//!   parameters are solved again with the cut ones held.
//! - Convergence by the projected gradient, the step or the cost, see [`Reason`].
//!
//! Limits: it finds the minimum of the valley it starts in. Priors and the standard
//! deviations of [`NoiseVariance::Given`]`(1.0)` mean what they say only if the
//! residuals are whitened (divided by their standard deviations).
//!
//! Trial points at which the model has no finite answer are rejected like points of
//! higher cost; only a start without a finite answer is an error.

use super::normal_equations::{NormalEquations, ResidualSums, RowWeighting};
use super::uncertainty::Uncertainty;
use nalgebra::{Cholesky, DMatrix, DVector};
use thiserror::Error;

/// Damping above which a small step says nothing about convergence: the step is
/// small because it was made small.
const DAMPING_THAT_SHORTENS: f64 = 1.0;
/// No sensible curvature needs more damping than this: the solver gives up.
const LARGEST_DAMPING: f64 = 1.0e100;
/// Damping never falls below the rounding of the unit diagonal it is added to.
const SMALLEST_DAMPING: f64 = 1.0e-18;
/// Least share of the predicted decrease for a step to be taken (Nielsen, Moré: any small number).
const LEAST_GAIN_RATIO: f64 = 1.0e-4;
/// So many steps in a row that bring less than what matters are the last. Where residuals have
/// kinks, damping goes up and down and no step is the last by itself: fits to break-aways took 30
/// to 110 such steps.
const IDLE_STEPS: usize = 5;
/// Noise moves a fit by one variance a parameter. One that stands by less than this part of it from
/// where a smooth law had its minimum has standard deviations 5 % too small.
const WITHIN_NOISE: f64 = 0.1;
/// A parameter that the data see this much less than the best-seen one (squared
/// sensitivities, each in its own scale) is damped as if they saw it that much.
const LEAST_RELATIVE_CURVATURE: f64 = 1.0e-20;

/// A least-squares problem: it knows its residuals and their derivatives.
pub trait LeastSquares {
    /// Add one row per residual.
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations);

    /// Add the residuals only. Worth writing when derivatives are dear: every
    /// trial step asks for the cost, only accepted ones for derivatives.
    fn accumulate_cost(&mut self, values: &[f64], sums: &mut ResidualSums) {
        let mut equations = NormalEquations::new(values.len(), sums.weighting());
        self.accumulate(values, &mut equations);
        sums.merge(equations.sums());
    }
}

impl<F: FnMut(&[f64], &mut NormalEquations)> LeastSquares for F {
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations) {
        self(values, equations);
    }
}

/// What was known of a parameter before the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Most probable value.
    pub mean: f64,
    /// Standard deviation.
    pub standard_deviation: f64,
}

/// One unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Where the search starts; moved into the box if outside.
    pub start: f64,
    /// Smallest value allowed; may be minus infinity.
    pub lower: f64,
    /// Largest value allowed; may be infinity. Equal to `lower`: the parameter is fixed.
    pub upper: f64,
    /// Knowledge from elsewhere.
    pub prior: Option<Prior>,
    /// A typical size, positive: steps are small against this or against the value.
    pub scale: f64,
}

impl Parameter {
    /// A parameter without bounds or prior; its scale is the size of `start`, or 1.
    #[must_use]
    pub fn new(start: f64) -> Self {
        let size = start.abs();
        let scale = if size > 0.0 && size.is_finite() {
            size
        } else {
            1.0
        };
        Self {
            start,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            prior: None,
            scale,
        }
    }

    /// The same inside bounds.
    #[must_use]
    pub fn bounded(self, lower: f64, upper: f64) -> Self {
        Self {
            lower,
            upper,
            ..self
        }
    }

    /// The same with a prior.
    #[must_use]
    pub fn with_prior(self, mean: f64, standard_deviation: f64) -> Self {
        Self {
            prior: Some(Prior {
                mean,
                standard_deviation,
            }),
            ..self
        }
    }

    /// The same with another typical size.
    #[must_use]
    pub fn with_scale(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    fn clip(&self, value: f64) -> f64 {
        value.max(self.lower).min(self.upper)
    }

    fn is_at_bound(&self, value: f64) -> bool {
        value <= self.lower || value >= self.upper
    }

    fn check(&self, index: usize) -> Result<(), FitError> {
        let field = |field| Err(FitError::Parameter { index, field });
        if !self.start.is_finite() {
            return field("start");
        }
        let inside = self.lower <= self.upper
            && self.lower < f64::INFINITY
            && self.upper > f64::NEG_INFINITY;
        if !inside {
            return Err(FitError::EmptyBox {
                index,
                lower: self.lower,
                upper: self.upper,
            });
        }
        if !(self.scale.is_finite() && self.scale > 0.0) {
            return field("scale");
        }
        match self.prior {
            Some(prior) if !prior.mean.is_finite() => field("prior mean"),
            Some(prior) if !is_positive(prior.standard_deviation) => {
                field("prior standard deviation")
            }
            _ => Ok(()),
        }
    }
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// Where the variance of the noise comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoiseVariance {
    /// Known; 1 for whitened residuals.
    Given(f64),
    /// Twice the cost per degree of freedom, priors counted as rows.
    Estimated,
}

/// How to fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How residuals become cost; priors are always squares.
    pub weighting: RowWeighting,
    /// Scale of the covariance.
    pub noise: NoiseVariance,
    /// Limit on trial steps, taken or not.
    pub maximum_iterations: usize,
    /// Limit on steps taken: each takes derivatives, one that is not taken none.
    pub maximum_steps: usize,
    /// Converged when the cosine between the residuals and the column of every
    /// parameter that is free to move is below this.
    pub gradient_tolerance: f64,
    /// Converged when every parameter moves less than this part of its value plus scale.
    pub step_tolerance: f64,
    /// Converged when a step neither promises nor brings more than this part of the cost.
    pub cost_tolerance: f64,
    /// First damping, relative to the curvature.
    pub initial_damping: f64,
}

impl Default for Options {
    /// Tolerances far under any standard deviation (a cost within 1e-12 of its minimum is
    /// within 1e-6 root-rows standard deviations), and above the rounding of a simulation.
    fn default() -> Self {
        Self {
            weighting: RowWeighting::Squares,
            noise: NoiseVariance::Estimated,
            maximum_iterations: 200,
            maximum_steps: usize::MAX,
            gradient_tolerance: 1.0e-10,
            step_tolerance: 1.0e-10,
            cost_tolerance: 1.0e-12,
            initial_damping: 1.0e-3,
        }
    }
}

impl Options {
    fn check(&self) -> Result<(), FitError> {
        let scale_is_good = match self.weighting {
            RowWeighting::Squares => true,
            RowWeighting::Huber { scale } => is_positive(scale),
        };
        let noise_is_good = match self.noise {
            NoiseVariance::Given(variance) => variance.is_finite() && variance >= 0.0,
            NoiseVariance::Estimated => true,
        };
        if !scale_is_good {
            return Err(FitError::Option("scale of Huber's loss"));
        }
        if !noise_is_good {
            return Err(FitError::Option("noise variance"));
        }
        if !is_positive(self.initial_damping) {
            return Err(FitError::Option("initial damping"));
        }
        Ok(())
    }

    /// The noise at a point to which so many parameters are determined; `None` when it is to be
    /// estimated from no degree of freedom.
    fn noise_variance(
        &self,
        point: &Point,
        parameters: &[Parameter],
        determined: usize,
    ) -> Option<f64> {
        match self.noise {
            NoiseVariance::Given(variance) => Some(variance),
            NoiseVariance::Estimated => {
                let priors = parameters.iter().filter(|one| one.prior.is_some()).count();
                let freedom = (point.sums.rows() + priors).saturating_sub(determined);
                (freedom > 0).then(|| 2.0 * point.cost / freedom as f64)
            }
        }
    }
}

/// Why a fit could not start.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FitError {
    /// A field of a parameter is not usable.
    #[error("parameter {index}: its {field} is not usable")]
    Parameter {
        /// Which parameter, from 0.
        index: usize,
        /// Which field.
        field: &'static str,
    },
    /// The bounds leave no value.
    #[error("parameter {index}: no value between {lower} and {upper}")]
    EmptyBox {
        /// Which parameter, from 0.
        index: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// An option is not usable.
    #[error("the {0} is not usable")]
    Option(&'static str),
    /// The model has no finite answer at the start.
    #[error("residuals or derivatives are not finite at the start {values:?}")]
    NonFiniteStart {
        /// The start, inside the box.
        values: Vec<f64>,
    },
}

/// Why the solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The projected gradient vanished.
    Gradient,
    /// Undamped steps became too small to matter.
    Step,
    /// The cost cannot be lowered enough to matter.
    Cost,
    /// No step lowers the cost though the gradient says one should: the rounding of
    /// the model or wrong derivatives. Not converged.
    Stalled,
    /// A limit on iterations was reached. Not converged; derivatives, and what follows
    /// from them, are those of the last point but one.
    IterationLimit,
}

impl Reason {
    /// Whether the values are a minimum within the tolerances.
    #[must_use]
    pub fn is_converged(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Cost)
    }
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The parameters at the lowest cost found.
    pub values: Vec<f64>,
    /// Cost there, priors included.
    pub cost: f64,
    /// Plain sum of squares of the data rows, without weights or priors.
    pub residual_sum_of_squares: f64,
    /// Number of data rows.
    pub rows: usize,
    /// Data rows beyond the scale of Huber's loss.
    pub outliers: usize,
    /// Trial steps, taken or not.
    pub iterations: usize,
    /// Why the solver stopped; ask [`Reason::is_converged`].
    pub converged: Reason,
    /// The cost at the start and after every step taken.
    pub cost_history: Vec<f64>,
    /// Variance of the noise; `None` when it was to be estimated from no degree of freedom.
    pub noise_variance: Option<f64>,
    /// Covariance of the free parameters, a pseudo-inverse if the rank is not full; zero
    /// rows at bounds. `None` without a noise variance.
    pub covariance: Option<DMatrix<f64>>,
    /// `None` for a parameter at its bound or not determined by the data.
    pub standard_deviations: Vec<Option<f64>>,
    /// Whether the parameter stands on a bound.
    pub at_bound: Vec<bool>,
    /// Rank and condition of the curvature, and the directions that the data leave open.
    pub uncertainty: Uncertainty,
}

impl Fit {
    /// Correlation of two parameters; `None` where one has no standard deviation.
    #[must_use]
    pub fn correlation(&self, first: usize, second: usize) -> Option<f64> {
        let covariance = self.covariance.as_ref()?;
        let spread = |index: usize| *self.standard_deviations.get(index)?;
        let product = spread(first)? * spread(second)?;
        (product > 0.0).then(|| covariance[(first, second)] / product)
    }

    /// All correlations, row by row.
    #[must_use]
    pub fn correlations(&self) -> Vec<Vec<Option<f64>>> {
        let size = self.values.len();
        let row = |first| {
            (0..size)
                .map(|second| self.correlation(first, second))
                .collect()
        };
        (0..size).map(row).collect()
    }
}

/// Fit `parameters` to `problem`.
///
/// ```
/// use grey_box::fit::{NormalEquations, Options, Parameter, solve};
///
/// // A line through four points, its slope bounded.
/// let mut line = |b: &[f64], equations: &mut NormalEquations| {
///     for (x, y) in [(0.0, 1.0), (1.0, 3.1), (2.0, 4.9), (3.0, 7.0)] {
///         equations.add_row(b[0] + b[1] * x - y, &[1.0, x]);
///     }
/// };
/// let parameters = [Parameter::new(0.0), Parameter::new(1.0).bounded(0.0, 5.0)];
/// let fit = solve(&mut line, &parameters, &Options::default())?;
/// assert!(fit.converged.is_converged());
/// assert!((fit.values[1] - 1.98).abs() < 1.0e-6);
/// # Ok::<(), grey_box::fit::FitError>(())
/// ```
///
/// # Errors
/// If a parameter or option is not usable, or the model has no finite answer at the start.
pub fn solve<P: LeastSquares + ?Sized>(
    problem: &mut P,
    parameters: &[Parameter],
    options: &Options,
) -> Result<Fit, FitError> {
    options.check()?;
    for (index, parameter) in parameters.iter().enumerate() {
        parameter.check(index)?;
    }
    let mut solver = Solver::start(problem, parameters, options)?;
    let reason = solver.run();
    let reason = solver.at_a_kink(reason);
    Ok(solver.finish(reason))
}

/// A place in the box and what is known of the cost there.
struct Point {
    values: Vec<f64>,
    cost: f64,
    /// The rows at these values; derivatives are older where [`Point::moved`] says so.
    sums: ResidualSums,
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
    equations: NormalEquations,
}

impl Point {
    /// The cost at other values, and the derivatives that were taken here: where no
    /// further step is made, new ones would only be thrown away.
    fn moved(&self, values: Vec<f64>, sums: ResidualSums) -> Self {
        Self {
            values,
            cost: sums.cost(),
            sums,
            gradient: self.gradient.clone(),
            curvature: self.curvature.clone(),
            equations: self.equations.clone(),
        }
    }
}

/// A step that was proposed.
struct Trial {
    values: Vec<f64>,
    displacement: DVector<f64>,
    predicted_decrease: f64,
}

struct Solver<'a, P: ?Sized> {
    problem: &'a mut P,
    parameters: &'a [Parameter],
    options: &'a Options,
    point: Point,
    /// Largest diagonal of the curvature so far.
    scaling: Vec<f64>,
    damping: f64,
    /// Factor on the damping at the next rejection; doubles with each.
    damping_growth: f64,
    iterations: usize,
    /// Steps taken in a row that brought less than what matters.
    idle_steps: usize,
    cost_history: Vec<f64>,
}

impl<'a, P: LeastSquares + ?Sized> Solver<'a, P> {
    fn start(
        problem: &'a mut P,
        parameters: &'a [Parameter],
        options: &'a Options,
    ) -> Result<Self, FitError> {
        let values: Vec<f64> = parameters.iter().map(|p| p.clip(p.start)).collect();
        let sums = sums_at(problem, parameters, options, &values);
        let point = point_at(problem, parameters, options, values.clone(), sums)
            .ok_or(FitError::NonFiniteStart { values })?;
        let mut solver = Self {
            problem,
            parameters,
            options,
            scaling: vec![0.0; parameters.len()],
            damping: options.initial_damping,
            damping_growth: 2.0,
            iterations: 0,
            idle_steps: 0,
            cost_history: vec![point.cost],
            point,
        };
        solver.update_scaling();
        Ok(solver)
    }

    fn run(&mut self) -> Reason {
        loop {
            if self.projected_gradient() <= self.options.gradient_tolerance {
                return Reason::Gradient;
            }
            if self.is_at_limit(self.steps()) {
                return Reason::IterationLimit;
            }
            self.iterations += 1;
            if let Some(reason) = self.iterate() {
                return reason;
            }
        }
    }

    /// Where no step lowers the cost a law has a kink, as a table has at its points. That is as good
    /// as a minimum if the noise leaves far more open than an undamped step promises.
    fn at_a_kink(&mut self, reason: Reason) -> Reason {
        if reason != Reason::Stalled {
            return reason;
        }
        self.damping = 0.0;
        let promised = self.propose().map(|trial| 2.0 * trial.predicted_decrease);
        let (point, parameters) = (&self.point, self.parameters);
        let noise_variance = self
            .options
            .noise_variance(point, parameters, parameters.len());
        match promised.zip(noise_variance) {
            Some((promised, noise_variance))
                if promised <= WITHIN_NOISE * self.movable().len() as f64 * noise_variance =>
            {
                Reason::Cost
            }
            _ => reason,
        }
    }

    /// Steps taken so far.
    fn steps(&self) -> usize {
        self.cost_history.len() - 1
    }

    fn is_at_limit(&self, steps: usize) -> bool {
        self.iterations >= self.options.maximum_iterations || steps >= self.options.maximum_steps
    }

    /// One trial step, taken or not.
    fn iterate(&mut self) -> Option<Reason> {
        let Some(trial) = self.propose() else {
            return self.reject();
        };
        let sums = sums_at(self.problem, self.parameters, self.options, &trial.values);
        let decrease = self.point.cost - sums.cost();
        let gain_ratio = decrease / trial.predicted_decrease;
        let accepted = decrease > 0.0 && gain_ratio > LEAST_GAIN_RATIO;
        let verdict = self.convergence(&trial, decrease, accepted);
        let is_last = verdict.is_none() && self.is_at_limit(self.steps() + 1);
        let next = if !accepted {
            None
        } else if is_last {
            Some(self.point.moved(trial.values, sums))
        } else {
            point_at(
                self.problem,
                self.parameters,
                self.options,
                trial.values,
                sums,
            )
        };
        match next {
            Some(point) => {
                let is_idle = decrease <= self.options.cost_tolerance * self.point.cost;
                self.idle_steps = if is_idle { self.idle_steps + 1 } else { 0 };
                self.accept(point, gain_ratio);
                if self.idle_steps == IDLE_STEPS {
                    return Some(Reason::Stalled);
                }
            }
            None => {
                if let Some(reason) = self.reject() {
                    return Some(reason);
                }
            }
        }
        verdict
    }

    /// Whether this trial shows that there is nothing left to gain.
    fn convergence(&self, trial: &Trial, decrease: f64, accepted: bool) -> Option<Reason> {
        let enough = self.options.cost_tolerance * self.point.cost;
        let promises_enough = trial.predicted_decrease > enough;
        let reason = if !promises_enough && decrease.abs() <= enough {
            Reason::Cost
        } else if !promises_enough && !accepted && self.damping > DAMPING_THAT_SHORTENS {
            // Steps that are shorter still promise less.
            return Some(Reason::Stalled);
        } else if self.is_small(&trial.displacement) {
            Reason::Step
        } else {
            return None;
        };
        if self.damping <= DAMPING_THAT_SHORTENS {
            Some(reason)
        } else {
            // A strongly damped step is small anyway: go on if it helped.
            (!accepted).then_some(Reason::Stalled)
        }
    }

    fn is_small(&self, displacement: &DVector<f64>) -> bool {
        displacement.iter().enumerate().all(|(index, step)| {
            let size = self.point.values[index].abs() + self.parameters[index].scale;
            step.abs() <= self.options.step_tolerance * size
        })
    }

    fn accept(&mut self, point: Point, gain_ratio: f64) {
        self.point = point;
        self.cost_history.push(self.point.cost);
        self.update_scaling();
        // Nielsen's rule: a smooth curve from 1/3 at a good prediction to a rise at a poor one.
        let factor = (1.0 - (2.0 * gain_ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0);
        self.damping = (self.damping * factor).max(SMALLEST_DAMPING);
        self.damping_growth = 2.0;
    }

    fn reject(&mut self) -> Option<Reason> {
        self.damping *= self.damping_growth;
        self.damping_growth *= 2.0;
        (self.damping > LARGEST_DAMPING).then_some(Reason::Stalled)
    }

    fn update_scaling(&mut self) {
        let diagonal = self.point.curvature.diagonal();
        let sensitivity = |index: usize| diagonal[index] * self.parameters[index].scale.powi(2);
        let best_seen = (0..self.scaling.len()).map(sensitivity).fold(0.0, f64::max);
        for (index, scaling) in self.scaling.iter_mut().enumerate() {
            let least = LEAST_RELATIVE_CURVATURE * best_seen / self.parameters[index].scale.powi(2);
            *scaling = scaling.max(diagonal[index]).max(least);
        }
    }

    /// A parameter on its bound whose cost falls outwards cannot move.
    fn is_held(&self, index: usize) -> bool {
        let (parameter, value) = (&self.parameters[index], self.point.values[index]);
        let slope = self.point.gradient[index];
        (value <= parameter.lower && slope >= 0.0) || (value >= parameter.upper && slope <= 0.0)
    }

    fn movable(&self) -> Vec<usize> {
        (0..self.parameters.len())
            .filter(|&index| !self.is_held(index))
            .collect()
    }

    /// Largest cosine between the residuals and the column of a movable parameter.
    fn projected_gradient(&self) -> f64 {
        let cosine = |index: usize| {
            let slope = self.point.gradient[index].abs();
            let column = self.point.curvature[(index, index)].sqrt();
            let residual = (2.0 * self.point.cost).sqrt();
            if slope > 0.0 {
                slope / (column * residual)
            } else {
                0.0
            }
        };
        self.movable().into_iter().map(cosine).fold(0.0, f64::max)
    }

    /// The damped step inside the box; `None` if the equations cannot be solved or the
    /// cut step promises nothing.
    fn propose(&self) -> Option<Trial> {
        let point = &self.point;
        let values = self.cut_step()?;
        let displacement =
            DVector::from_fn(values.len(), |index, _| values[index] - point.values[index]);
        let bend = displacement.dot(&(&point.curvature * &displacement));
        let predicted_decrease = -(point.gradient.dot(&displacement) + 0.5 * bend);
        let promising = predicted_decrease > 0.0 && predicted_decrease.is_finite();
        promising.then_some(Trial {
            values,
            displacement,
            predicted_decrease,
        })
    }

    /// Solve; put what leaves the box on its bound; solve the rest again.
    fn cut_step(&self) -> Option<Vec<f64>> {
        let mut values = self.point.values.clone();
        let mut open = self.movable();
        loop {
            let step = self.damped_step(&open, &values)?;
            let target = |place: usize| self.point.values[open[place]] + step[place];
            let leaves = |place: usize| {
                let parameter = &self.parameters[open[place]];
                target(place) < parameter.lower || target(place) > parameter.upper
            };
            let any_leaves = (0..open.len()).any(leaves);
            let mut still_open = Vec::new();
            for (place, &index) in open.iter().enumerate() {
                if leaves(place) {
                    values[index] = self.parameters[index].clip(target(place));
                } else if any_leaves {
                    still_open.push(index);
                } else {
                    values[index] = target(place);
                }
            }
            if still_open.is_empty() {
                return Some(values);
            }
            open = still_open;
        }
    }

    /// Solve the damped equations for the `open` parameters, the others displaced to `values`.
    fn damped_step(&self, open: &[usize], values: &[f64]) -> Option<DVector<f64>> {
        let (point, size) = (&self.point, open.len());
        let displaced =
            DVector::from_fn(values.len(), |index, _| values[index] - point.values[index]);
        let slope = &point.gradient + &point.curvature * displaced;
        let diagonal =
            |index: usize| point.curvature[(index, index)] + self.damping * self.scaling[index];
        let unit: Vec<f64> = open.iter().map(|&index| diagonal(index).sqrt()).collect();
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            if row == column {
                return 1.0;
            }
            point.curvature[(open[row], open[column])] / (unit[row] * unit[column])
        });
        let right = DVector::from_fn(size, |row, _| -slope[open[row]] / unit[row]);
        let solution = Cholesky::new(scaled)?.solve(&right);
        let step = DVector::from_fn(size, |row, _| solution[row] / unit[row]);
        step.iter().all(|value| value.is_finite()).then_some(step)
    }

    fn finish(self, reason: Reason) -> Fit {
        let (point, parameters) = (self.point, self.parameters);
        let at_bound: Vec<bool> = parameters
            .iter()
            .zip(&point.values)
            .map(|(p, &value)| p.is_at_bound(value))
            .collect();
        let free: Vec<usize> = (0..parameters.len())
            .filter(|&index| !at_bound[index])
            .collect();
        let scales: Vec<f64> = parameters.iter().map(|parameter| parameter.scale).collect();
        let sums = &point.sums;
        let uncertainty = Uncertainty::new(
            &point.equations.cost_curvature(),
            &free,
            &scales,
            sums.rows(),
        );
        let noise_variance = (self.options).noise_variance(&point, parameters, uncertainty.rank);
        let covariance = noise_variance.map(|variance| &uncertainty.inverse_curvature * variance);
        let spread = |index: usize| {
            let variance = covariance.as_ref()?[(index, index)];
            uncertainty.determined[index].then(|| variance.sqrt())
        };
        Fit {
            standard_deviations: (0..parameters.len()).map(spread).collect(),
            cost: point.cost,
            residual_sum_of_squares: sums.squares(),
            rows: sums.rows(),
            outliers: sums.outliers(),
            iterations: self.iterations,
            converged: reason,
            cost_history: self.cost_history,
            noise_variance,
            covariance,
            at_bound,
            uncertainty,
            values: point.values,
        }
    }
}

/// Sums of the data and the priors; their cost is infinite where the model has no answer.
fn sums_at<P: LeastSquares + ?Sized>(
    problem: &mut P,
    parameters: &[Parameter],
    options: &Options,
    values: &[f64],
) -> ResidualSums {
    let mut sums = ResidualSums::new(options.weighting);
    problem.accumulate_cost(values, &mut sums);
    for (parameter, value) in parameters.iter().zip(values) {
        if let Some(prior) = parameter.prior {
            sums.add_penalty((value - prior.mean) / prior.standard_deviation);
        }
    }
    sums
}

/// Everything known at `values`; `None` if any of it is not finite.
///
/// `sums` are handed on instead of taken with the derivatives: costs are compared with
/// each other, so all must come from the same sum.
fn point_at<P: LeastSquares + ?Sized>(
    problem: &mut P,
    parameters: &[Parameter],
    options: &Options,
    values: Vec<f64>,
    sums: ResidualSums,
) -> Option<Point> {
    let mut equations = NormalEquations::new(parameters.len(), options.weighting);
    problem.accumulate(&values, &mut equations);
    for (index, (parameter, value)) in parameters.iter().zip(&values).enumerate() {
        if let Some(prior) = parameter.prior {
            let slope = 1.0 / prior.standard_deviation;
            equations.add_penalty(index, (value - prior.mean) * slope, slope);
        }
    }
    let cost = sums.cost();
    (cost.is_finite() && equations.is_finite()).then(|| Point {
        cost,
        sums,
        gradient: equations.gradient(),
        curvature: equations.step_curvature(),
        equations,
        values,
    })
}
