//! Laws driven by recorded signals, each predicting what was recorded of it.
//!
//! The loop of the axis is cut where signals were recorded: the chambers are
//! driven by recorded position and command and predict the pressures; the
//! carriage is driven by recorded pressures and predicts the position (or, on a
//! bench, the force). An error of one law cannot hide in another, and a rig
//! with half of the sensors can still be used.

mod actuator;
pub mod balance;
mod breakaway;
mod carriage;
mod carriage_history;
mod chambers;
mod command;
mod force;
mod motion;
pub mod needs;
mod pressure_reading;
mod spool;
mod valve_flow;

pub use crate::law::Law;
use crate::model::Values;
use crate::recording::Recording;
use crate::rig::Rig;
use model_core::real::Real;
use std::ops::Range;

pub use carriage_history::STANDING_M_PER_S;
pub use motion::Motion;
pub use motion::{median, median_step_s, white_noise};
pub use pressure_reading::read_pressures_pa;

/// Which rows an initial state may be estimated from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Both sides of the row: for fits.
    Centred,
    /// The row and those before it: for predictions that could be made live.
    UpToNow,
}

impl View {
    /// The value of a signal at a row, by a local fit over a few rows.
    fn value(self, time_s: &[f64], signal: &[f64], row: usize) -> f64 {
        self.value_and_slope(time_s, signal, row).0
    }

    /// Value and slope of a signal at a row.
    fn value_and_slope(self, time_s: &[f64], signal: &[f64], row: usize) -> (f64, f64) {
        /// Rows on each side, or before.
        const REACH: usize = 4;
        let from = row.saturating_sub(if self == Self::Centred {
            REACH
        } else {
            2 * REACH
        });
        let to = match self {
            Self::Centred => (row + REACH + 1).min(signal.len()),
            Self::UpToNow => (row + 1).min(signal.len()),
        };
        let [value, slope, _] =
            motion::local_quadratic(&time_s[from..to], &signal[from..to], time_s[row]);
        (value, slope)
    }
}

/// A signal that a law predicts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The signal's name in the rig file.
    pub signal: &'static str,
    /// The place in a verdict.
    pub place: &'static str,
    /// SI unit.
    pub unit: &'static str,
}

/// A state that a recording begins with: one noisy sample at best, so that it
/// is estimated with the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialState {
    /// What it is.
    pub name: &'static str,
    /// Best guess from the recording.
    pub guess: f64,
    /// How far it may be from the guess, one standard deviation.
    pub standard_deviation: f64,
    /// Least and greatest possible value; equal where it cannot matter.
    pub bounds: (f64, f64),
    /// Which output is its measurement, if one is.
    pub measured_by: Option<usize>,
    /// Which state is what a sensor that lags shows of it: a window begins it as far
    /// from its measurement as it then is from this in the free run.
    pub read_by: Option<usize>,
}

/// What a law reports of each row.
pub trait Sink<R> {
    /// The predicted outputs and the states at a row. NaN marks an output that
    /// is not predicted at this row.
    fn row(&mut self, row: usize, outputs: &[R], states: &[R]);
}

impl<R, F: FnMut(usize, &[R], &[R])> Sink<R> for F {
    fn row(&mut self, row: usize, outputs: &[R], states: &[R]) {
        self(row, outputs, states);
    }
}

impl Law {
    /// The laws that run: this rig describes them, these signals drive them, and no number
    /// that they need is missing (see [`needs::lacks`]).
    pub fn of(rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Self> {
        let described = Self::described(rig, has).into_iter();
        described
            .filter(|law| needs::lacks_of(*law, rig, has).is_empty())
            .collect()
    }

    /// The laws that this rig has the sections of and these signals drive.
    pub fn described(rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Self> {
        let pressures = has("p_a") || has("p_b");
        let chambers = rig.chambers.is_some()
            && pressures
            && (rig.vessel.is_some() || (rig.cylinder.is_some() && has("x")))
            && (rig.valve.is_none() || has("u"));
        let mechanics = rig.carriage.is_some() || rig.friction.is_some();
        let force = mechanics && has("force") && has("x");
        let carriage =
            rig.carriage.is_some() && !has("force") && has("x") && has("p_a") && has("p_b");
        let actuator = rig.actuator.is_some() && has("u") && has("x");
        let valve_flow = rig.valve.is_some() && valve_flow::is_recorded(has);
        let spool = rig.valve.is_some() && has("u") && has("spool");
        [
            (chambers, Self::Chambers),
            (force, Self::Force),
            (carriage, Self::Carriage),
            (actuator, Self::Actuator),
            (valve_flow, Self::ValveFlow),
            (spool, Self::Spool),
        ]
        .into_iter()
        .filter_map(|(usable, law)| usable.then_some(law))
        .collect()
    }

    /// What it is called in reports.
    pub fn title(self) -> &'static str {
        match self {
            Self::Chambers => "chambers",
            Self::Force => "force balance",
            Self::Carriage => "carriage",
            Self::Actuator => "actuator",
            Self::ValveFlow => "valve flow",
            Self::Spool => "spool",
            Self::Balance => "forces on the carriage",
        }
    }

    /// The signals it predicts from this rig's recordings.
    pub fn outputs(self, rig: &Rig) -> Vec<Output> {
        match self {
            Self::Chambers => chambers::outputs(rig),
            Self::Force => vec![force::OUTPUT],
            Self::Carriage => vec![carriage::OUTPUT],
            Self::Actuator => vec![actuator::OUTPUT],
            Self::ValveFlow => valve_flow::outputs(rig),
            Self::Spool => vec![spool::output(rig)],
            Self::Balance => balance::OUTPUTS.to_vec(),
        }
    }

    /// The states that a recording (or a window of it) begins with.
    pub fn initial_states(
        self,
        rig: &Rig,
        recording: &Recording,
        row: usize,
        view: View,
    ) -> Vec<InitialState> {
        match self {
            Self::Chambers => chambers::initial_states(rig, recording, row, view),
            Self::Force | Self::Balance | Self::ValveFlow | Self::Spool => Vec::new(),
            Self::Carriage => carriage::initial_states(recording, row, view),
            Self::Actuator => actuator::initial_states(recording, row),
        }
    }

    /// The law by which this one is searched and its parameters are estimated.
    pub fn searched_by(self) -> Self {
        match self {
            Self::Carriage => Self::Balance,
            other => other,
        }
    }

    /// Predicts the rows of a range from the states at its start.
    pub fn predict<R: Real>(
        self,
        values: &Values<'_, R>,
        track: &Track<'_>,
        rows: Range<usize>,
        initial: &[R],
        sink: &mut dyn Sink<R>,
    ) {
        match self {
            Self::Chambers => chambers::predict(values, track, rows, initial, sink),
            Self::Force => force::predict(values, track, rows, sink),
            Self::Carriage => carriage::predict(values, track, rows, initial, sink),
            Self::Actuator => actuator::predict(values, track, rows, initial, sink),
            Self::ValveFlow => valve_flow::predict(values, track, rows, sink),
            Self::Spool => spool::predict(values, track, rows, sink),
            Self::Balance => balance::predict(values, track, sink),
        }
    }

    /// States at a row, to which one model led, for another that goes on from there.
    pub fn handed_on<R: Real>(
        self,
        models: (&Values<'_, R>, &Values<'_, R>),
        track: &Track<'_>,
        row: usize,
        states: &mut [R],
    ) {
        if self == Self::Chambers {
            chambers::handed_on(models, track, row, states);
        }
    }

    /// A start for a number that the recordings show of themselves. From a static level far
    /// above the true one the fit of a carriage ends in another minimum: a model that holds for
    /// too long says little of by how much.
    pub fn start_of(self, key: &str, rig: &Rig, tracks: &[Track<'_>]) -> Option<f64> {
        if (self, key) != (Self::Balance, "friction.static_N") {
            return None;
        }
        let forces = tracks
            .iter()
            .flat_map(|track| balance::break_away_forces_n(rig, track));
        let level_n = median(forces.collect())?;
        (level_n > rig.value("friction.coulomb_N")?).then_some(level_n)
    }

    /// Whether an output of this value was left out on purpose. In the other
    /// laws NaN is a model that failed, which must not pass for a good one.
    pub fn leaves_out(self, output: f64) -> bool {
        self == Self::Balance && output.is_nan()
    }

    /// Whether a row depends on the rows before it by more than was recorded.
    pub fn has_states(self) -> bool {
        matches!(self, Self::Chambers | Self::Carriage | Self::Actuator)
    }

    /// How rows weigh, in order and in all 1, in what is predicted at the middle one of them.
    pub fn weights(self, track: &Track<'_>) -> Vec<f64> {
        match self {
            Self::Balance => balance::weights(track),
            _ => vec![1.0],
        }
    }

    /// Whether a fit of it takes seconds on long recordings.
    pub fn is_dear(self) -> bool {
        matches!(self, Self::Chambers | Self::Balance)
    }

    /// Whether its recordings may be thinned for the search: a closed chamber is
    /// slow, and an algebraic or stiff law is not.
    pub fn may_be_thinned(self, rig: &Rig) -> bool {
        self == Self::Chambers && rig.valve.is_none()
    }

    /// The window in which it is fitted, s; `None`: the whole recording at once.
    ///
    /// A carriage without a spring to hold it integrates every error of force
    /// twice: over seconds its position says little of the law.
    pub fn fit_window_s(self) -> Option<f64> {
        match self {
            Self::Carriage => Some(0.25),
            _ => None,
        }
    }
}

/// A recording made ready to drive laws: with the motion that it implies.
#[derive(Clone, Debug)]
pub struct Track<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Smoothed position, velocity and acceleration.
    pub motion: Option<Motion>,
    /// What a balance amounts to at every row.
    nought: Vec<f64>,
    /// Half the width of the windows in which forces are balanced, s.
    balanced_over_s: f64,
}

impl<'a> Track<'a> {
    /// Prepares a recording.
    pub fn new(recording: &'a Recording) -> Self {
        let motion = recording
            .signal("x")
            .map(|position| Motion::from_position(&recording.time_s, position));
        Self::with_motion(recording, motion)
    }

    /// A recording whose motion was found before.
    pub fn with_motion(recording: &'a Recording, motion: Option<Motion>) -> Self {
        Self {
            motion,
            ..Self::still(recording)
        }
    }

    /// The recording alone, its motion not looked at.
    pub fn still(recording: &'a Recording) -> Self {
        Self {
            recording,
            motion: None,
            nought: vec![0.0; recording.len()],
            balanced_over_s: balance::HALF_WIDTH_S,
        }
    }

    /// The same with forces balanced in windows of another half width, s.
    #[must_use]
    pub fn balanced_over(self, half_width_s: f64) -> Self {
        Self {
            balanced_over_s: half_width_s,
            ..self
        }
    }

    /// Half the width of the windows in which forces are balanced, s.
    pub fn balanced_over_s(&self) -> f64 {
        self.balanced_over_s
    }

    /// What an output was recorded as: a signal, or nought for a balance.
    pub fn recorded(&self, output: &Output) -> &[f64] {
        if output.signal == balance::SIGNAL {
            return &self.nought;
        }
        self.recording.signal(output.signal).unwrap_or(&[])
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.recording.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.recording.is_empty()
    }

    fn signal(&self, name: &str) -> Option<&'a [f64]> {
        self.recording.signal(name)
    }

    /// Time from a row to the next, s.
    pub fn dt_s(&self, row: usize) -> f64 {
        self.recording.time_s[row + 1] - self.recording.time_s[row]
    }
}

/// A recorded signal read `delay_s` later than its row says, linear between
/// rows and level beyond the ends.
fn delayed<R: Real>(time_s: &[f64], signal: &[f64], row: usize, delay_s: R) -> R {
    let at = R::from_f64(time_s[row]) + delay_s;
    let last = time_s.len() - 1;
    let target = at.value();
    if target <= time_s[0] {
        return R::from_f64(signal[0]);
    }
    if target >= time_s[last] {
        return R::from_f64(signal[last]);
    }
    // A delay is a few rows at the most: from the row itself it is nearer than by halves.
    let mut above = (row + 1).min(last);
    while above > 1 && time_s[above - 1] > target {
        above -= 1;
    }
    while above < last && time_s[above] <= target {
        above += 1;
    }
    let (t0, t1) = (time_s[above - 1], time_s[above]);
    let slope = (signal[above] - signal[above - 1]) / (t1 - t0);
    R::from_f64(signal[above - 1]) + (at - R::from_f64(t0)) * R::from_f64(slope)
}
