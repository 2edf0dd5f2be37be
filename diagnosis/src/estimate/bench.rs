//! What a law is fitted with: rig, recordings, parameters, noise.

use super::candidates::{Candidate, ordinary, voids};
use super::draws::Draws;
use super::fitted::Fitted;
use super::sensor_noise;
use super::sheet::Sheet;
use crate::fit::law_problem::{Folds, FreeParameter, LawProblem};
use crate::fit::{Parameter, Presence};
use crate::laws::{Law, Track, balance};
use crate::rig::Rig;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a law is fitted with: rig, recordings, ordinary parameters.
pub struct Bench<'a> {
    /// The law.
    pub law: Law,
    /// The rig as given.
    pub rig: &'a Rig,
    /// The recordings.
    pub tracks: &'a [Track<'a>],
    /// Ordinary parameters.
    pub ordinary: Vec<FreeParameter>,
    /// Candidates that may be put into the model.
    pub candidates: Vec<Candidate>,
    /// Noise of each output, SI.
    pub noise: Vec<f64>,
    /// To what break-aways are known beside the noise of what is recorded, N.
    pub(crate) break_aways_known_to_n: f64,
    /// How well the rig file kept its word of numbers that other laws determine.
    pub(crate) sheet: Sheet,
    /// What each model's own noise is made of.
    pub(crate) draws: Draws,
    /// The groups of rows that cross-validation leaves out in turn.
    pub folds: Folds,
    /// Whether it is of a search, and fits are long: see [`Bench::for_search`].
    is_long_search: bool,
    /// Rows simulated, with derivatives counted in.
    work: AtomicUsize,
}

/// Rows of a law that one core of the reference machine simulates in a second.
/// Measured once on the gas cylinder; it only turns counted work into a figure
/// that does not change from run to run as a clock's would.
const ROWS_PER_SECOND: f64 = 4.0e6;

/// Recordings of more rows than this are long; those of a whole axis always: it has twice as many
/// effects to try, and takes longer a row.
pub(super) const LONG_ROWS: usize = 15_000;

impl<'a> Bench<'a> {
    /// Puts law, rig and recordings on the bench.
    pub fn new(law: Law, rig: &'a Rig, tracks: &'a [Track<'a>]) -> Self {
        let lengths: Vec<usize> = tracks.iter().map(Track::len).collect();
        let mut ordinary = ordinary(law, rig);
        for free in &mut ordinary {
            if let Some(start) = law.start_of(&free.key, rig, tracks) {
                free.parameter.start = start;
            }
        }
        Self {
            law,
            rig,
            tracks,
            ordinary,
            candidates: Vec::new(),
            noise: sensor_noise::of_outputs(law, rig, tracks),
            break_aways_known_to_n: balance::BREAKAWAY_NOISE_N,
            sheet: Sheet::default(),
            draws: Draws::default(),
            folds: Folds::of(&lengths),
            is_long_search: false,
            work: AtomicUsize::new(0),
        }
    }

    /// Takes noise and candidates from a bench of the same recordings.
    pub(crate) fn learn_from(&mut self, other: &Bench<'_>) {
        self.candidates.clone_from(&other.candidates);
        self.noise.clone_from(&other.noise);
        self.break_aways_known_to_n = other.break_aways_known_to_n;
        self.draws.clone_from(&other.draws);
        self.sheet.clone_from(&other.sheet);
    }

    /// The same for a search, which tells sets apart by tens of per cent: where fits are
    /// long they end early, and whoever reports a number [fits it](Self::fit) once more
    /// on a bench that is none. (Fits of forces are short, but where a load has play; that one
    /// is fitted anew otherwise, in `loose_load`.)
    #[must_use]
    pub fn for_search(self) -> Self {
        Self {
            is_long_search: self.is_long(),
            ..self
        }
    }

    /// Whether what it fits wants fitting once more.
    pub fn is_coarse(&self) -> bool {
        self.is_long_search && self.law != Law::Balance
    }

    /// Whether a fit of a set ends early.
    pub(super) fn ends_early(&self, set: &[usize]) -> bool {
        let mut effects = set.iter().map(|&index| &self.candidates[index]);
        self.is_coarse() || self.is_long_search && effects.any(|effect| effect.is_rough)
    }

    /// Whether an output is told by single events and not by rows.
    pub fn is_of_events(&self, output: usize) -> bool {
        self.law == Law::Balance && output == balance::BREAKAWAY
    }

    /// Rows of all recordings.
    pub fn rows(&self) -> usize {
        self.tracks.iter().map(Track::len).sum()
    }

    /// Whether a fit takes seconds.
    pub fn is_long(&self) -> bool {
        let is_axis = self.rig.valve.is_some();
        (is_axis || self.rows() > LONG_ROWS) && self.law.is_dear()
    }

    /// The rig with the switches of a set of effects.
    pub fn switched(&self, set: &[usize]) -> Rig {
        let switches: BTreeMap<String, f64> = set
            .iter()
            .flat_map(|&index| self.candidates[index].switches.iter().cloned())
            .collect();
        self.rig.with_values(&switches)
    }

    /// A number of a model, or else of the rig.
    pub(crate) fn value_in(&self, model: &Fitted, key: &str) -> Option<f64> {
        model.value(key).or_else(|| self.rig.value(key))
    }

    /// Ordinary parameters and those of the set.
    pub fn free(&self, set: &[usize]) -> Vec<FreeParameter> {
        let added = set
            .iter()
            .flat_map(|&index| self.candidates[index].free.iter().cloned());
        let ordinary = self.ordinary.iter().map(|free| {
            let mut free = free.clone();
            if self.is_void(set, &free.key) {
                free.parameter.prior = None;
            }
            free
        });
        ordinary.chain(added).collect()
    }

    /// Whether what the rig states of a number does not bind a model with these effects.
    pub(crate) fn is_void(&self, set: &[usize], key: &str) -> bool {
        voids(&self.candidates, set).any(|void| void == key)
    }

    /// All parameters of a fit of a set.
    pub(crate) fn parameters_of(&self, set: &[usize]) -> Vec<Parameter> {
        self.with_problem(set, self.tracks, None, |problem| problem.parameters())
    }

    /// When the effects of a set are there, as the model knows that it is built on.
    pub(super) fn presence_in<'p>(&self, set: &[usize], model: &'p Fitted) -> Option<&'p Presence> {
        let presence = model.presence.as_ref()?;
        let mut effects = set.iter().map(|&index| self.candidates[index].effect);
        effects
            .any(|effect| effect == presence.effect)
            .then_some(presence)
    }

    pub(super) fn count_work(&self, iterations: usize, parameters: usize) {
        let rows: usize = self.tracks.iter().map(Track::len).sum();
        let work = iterations * rows * (2 + parameters / 4);
        self.work.fetch_add(work, Ordering::Relaxed);
    }

    /// The work done so far as seconds of a reference core: a figure of cost
    /// that is the same in every run.
    pub fn seconds(&self) -> f64 {
        let seconds = self.work.load(Ordering::Relaxed) as f64 / ROWS_PER_SECOND;
        (10.0 * seconds).round() / 10.0
    }

    /// The size of a residual: what the parent left unexplained, at least the noise.
    pub(crate) fn sigma(&self, parent: Option<&Fitted>) -> Vec<f64> {
        match parent {
            Some(parent) => (parent.mean_square.iter().zip(&self.noise))
                .enumerate()
                .map(|(output, (square, noise))| {
                    // A residual that is limited by itself keeps its weight: else a fit
                    // that begins off all break-aways stays off them.
                    if self.is_of_events(output) {
                        let known_to_n = self.break_aways_known_to_n;
                        let of_inputs = noise.powi(2) - known_to_n.powi(2);
                        let known_to_n = known_to_n.min(balance::KNOWN_TO_N);
                        return known_to_n.hypot(of_inputs.max(0.0).sqrt());
                    }
                    square.sqrt().max(*noise)
                })
                .collect(),
            None => self.spread(),
        }
    }

    /// Standard deviation of each recorded output.
    pub fn spread(&self) -> Vec<f64> {
        self.law
            .outputs(self.rig)
            .iter()
            .map(|output| {
                if output.signal == balance::SIGNAL {
                    return self.typical_force_n();
                }
                let all: Vec<f64> = self
                    .tracks
                    .iter()
                    .flat_map(|track| track.recorded(output))
                    .copied()
                    .collect();
                let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
                let square = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                (square / all.len().max(1) as f64).sqrt().max(1e-12)
            })
            .collect()
    }

    /// A tenth of the declared friction: how far off a force may well be.
    pub(super) fn typical_force_n(&self) -> f64 {
        0.1 * self.largest_force_n()
    }

    /// The declared friction: no force that was left out is much larger.
    pub(crate) fn largest_force_n(&self) -> f64 {
        let declared = self.rig.value("friction.static_N");
        declared.unwrap_or(10.0).max(1.0)
    }

    /// Hands out the law with the effects of a model.
    pub(crate) fn with_model<T>(
        &self,
        model: &Fitted,
        work: impl FnOnce(&LawProblem<'_>) -> T,
    ) -> T {
        self.with_problem(&model.set, self.tracks, model.presence.as_ref(), work)
    }

    /// Hands out the law with a set of effects, on some tracks, unfitted.
    pub(super) fn with_problem<T>(
        &self,
        set: &[usize],
        tracks: &[Track<'_>],
        presence: Option<&Presence>,
        work: impl FnOnce(&LawProblem<'_>) -> T,
    ) -> T {
        let (rig, free, sigma) = (self.switched(set), self.free(set), self.spread());
        work(&LawProblem {
            law: self.law,
            rig: &rig,
            tracks,
            free: &free,
            sigma: &sigma,
            left_out: None,
            presence,
        })
    }

    /// How far a model is from the priors of its shared parameters: squares of deviations, summed.
    pub fn contradiction(&self, fitted: &Fitted) -> f64 {
        let square = |free: &FreeParameter| {
            let prior = free.parameter.prior?;
            let value = fitted.value(&free.key)?;
            Some(((value - prior.mean) / prior.standard_deviation).powi(2))
        };
        self.free(&fitted.set).iter().filter_map(square).sum()
    }
}
