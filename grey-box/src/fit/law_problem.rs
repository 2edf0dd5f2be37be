//! A law and recordings as a least-squares problem, with exact derivatives.
//!
//! Parameters are either shared by all recordings (a dead volume) or belong to
//! one recording (its initial states, the time skew of its logger). The laws
//! are run with dual numbers over the shared ones and those of the recording at
//! hand, so the cost of derivatives does not grow with the number of recordings.

use super::both_ways::BothWays;
pub use super::free_parameter::{FreeParameter, Scope};
use super::{LeastSquares, NormalEquations, Parameter, Presence, ResidualSums};
use crate::laws::{InitialState, Law, Sink, Track, View};
use crate::model::Values;
use crate::rig::Rig;
use model_core::real::{Dual, Real};
use rayon::prelude::*;
use std::ops::Range;

/// The most parameters that act on one recording at a time.
pub const MOST_ACTIVE: usize = 32;

/// Rows that belong together when data are left out: recordings, or contiguous
/// parts of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Folds {
    /// For each recording the first row of each of its folds and the fold's number.
    starts: Vec<Vec<(usize, usize)>>,
    /// Number of folds.
    pub count: usize,
}

impl Folds {
    /// One fold per recording where there are at least three, else each
    /// recording in equal contiguous parts, six in all.
    pub fn of(lengths: &[usize]) -> Self {
        let parts = match lengths.len() {
            0..=1 => 6,
            2 => 3,
            _ => 1,
        };
        let mut count = 0;
        let mut starts = Vec::with_capacity(lengths.len());
        for &length in lengths {
            let first = count;
            count += parts;
            starts.push(
                (0..parts)
                    .map(|part| (length * part / parts, first + part))
                    .collect(),
            );
        }
        Self { starts, count }
    }

    /// Every recording cut into many contiguous parts that take turns: each fold has
    /// some of whatever any recording excites.
    pub fn interleaved(lengths: &[usize]) -> Self {
        /// Parts of a recording, and folds that they are dealt to.
        const PARTS: usize = 24;
        const FOLDS: usize = 4;
        let part = |length: usize| {
            let start = move |part| (length * part / PARTS, part % FOLDS);
            (0..PARTS).map(start).collect()
        };
        Self {
            starts: lengths.iter().map(|&length| part(length)).collect(),
            count: FOLDS,
        }
    }

    /// The second of [two](Self::apart).
    pub const SECOND: usize = 1;

    /// Two folds: by recording the first row of each stretch, and whether that is of the second.
    pub fn apart(stretches: &[Vec<(usize, bool)>]) -> Self {
        let numbered = |stretches: &Vec<(usize, bool)>| {
            let stretches = stretches.iter();
            stretches
                .map(|&(row, is_second)| (row, usize::from(is_second)))
                .collect()
        };
        Self {
            starts: stretches.iter().map(numbered).collect(),
            count: 2,
        }
    }

    /// The fold of a row.
    pub fn fold(&self, recording: usize, row: usize) -> usize {
        let starts = &self.starts[recording];
        let after = starts.partition_point(|&(start, _)| start <= row);
        starts[after.max(1) - 1].1
    }
}

/// Predictions of one recording, one column per output; NaN where a row is not
/// predicted.
pub type Columns = Vec<Vec<f64>>;

/// A residual.
#[derive(Clone, Debug)]
pub struct Row {
    /// The row of the recording.
    pub row: usize,
    /// Predicted less recorded, in units of its size.
    pub residual: f64,
    /// Its derivatives by all parameters.
    pub gradient: Vec<f64>,
}

/// The problem.
#[derive(Clone, Copy)]
pub struct LawProblem<'a> {
    /// The law.
    pub law: Law,
    /// Structure and numbers; switches of effects are set in it.
    pub rig: &'a Rig,
    /// The recordings.
    pub tracks: &'a [Track<'a>],
    /// What is free.
    pub free: &'a [FreeParameter],
    /// Size of a residual per output: it is divided by this.
    pub sigma: &'a [f64],
    /// A fold whose rows are not counted.
    pub left_out: Option<(&'a Folds, usize)>,
    /// An effect that is there for a part of the time only.
    pub presence: Option<&'a Presence>,
}

/// The model of a recording; and the one without an effect that is not always there.
struct Models<'v, R> {
    with: Values<'v, R>,
    without: Option<Without<'v, R>>,
}

/// The model without an effect.
struct Without<'v, R> {
    values: Values<'v, R>,
    /// The rows in which the effect is there.
    there: Vec<Range<usize>>,
    /// Where its states stand among those of the model with the effect.
    places: Vec<usize>,
}

/// Rows in which one model holds.
struct Piece<'m, 'v, R> {
    rows: Range<usize>,
    values: &'m Values<'v, R>,
    /// Where its states stand among those of the model with the effect, if it is without.
    places: Option<&'m [usize]>,
}

impl<'v, R> Models<'v, R> {
    /// A stretch of rows cut where the effect comes or goes. The way to the first row that shows
    /// it is its own: a position that is late from there on has not gone back.
    fn pieces(&self, rows: &Range<usize>) -> Vec<Piece<'_, 'v, R>> {
        let with = |rows| Piece {
            rows,
            values: &self.with,
            places: None,
        };
        let Some(other) = &self.without else {
            return vec![with(rows.clone())];
        };
        let without = |rows| Piece {
            rows,
            values: &other.values,
            places: Some(&other.places),
        };
        let (mut pieces, mut done) = (Vec::new(), rows.start);
        for there in &other.there {
            let from = there.start.saturating_sub(1).clamp(done, rows.end);
            let to = there.end.clamp(from, rows.end);
            pieces.push(without(done..from));
            pieces.push(with(from..to));
            done = to;
        }
        pieces.push(without(done..rows.end));
        pieces.retain(|piece| !piece.rows.is_empty());
        pieces
    }
}

impl<R: Real> Piece<'_, '_, R> {
    /// Of the states of the model with the effect, those of this one.
    fn own(&self, states: Vec<R>) -> Vec<R> {
        match self.places {
            Some(places) => (places.iter())
                .filter_map(|&place| states.get(place).copied())
                .collect(),
            None => states,
        }
    }

    /// Its states among those of the model with the effect, of which there are so many: what it
    /// has not is no number. Only a model without the effect needs the room for them.
    fn among_all<'s>(&self, states: &'s [R], count: usize, room: &'s mut Vec<R>) -> &'s [R] {
        let Some(places) = self.places else {
            return states;
        };
        room.clear();
        room.resize(count, R::from_f64(f64::NAN));
        for (&place, &state) in places.iter().zip(states) {
            if let Some(slot) = room.get_mut(place) {
                *slot = state;
            }
        }
        room
    }
}

/// Writes a row into columns.
fn put(columns: &mut Columns, row: usize, values: &[f64]) {
    for (column, &value) in columns.iter_mut().zip(values) {
        column[row] = value;
    }
}

impl LawProblem<'_> {
    /// Whether the initial states are fitted (else taken from the recording, at
    /// the start of each window).
    fn fits_initial_states(&self) -> bool {
        self.law.fit_window_s().is_none()
    }

    fn scoped(&self, scope: Scope) -> impl Iterator<Item = &FreeParameter> {
        self.free.iter().filter(move |free| free.scope == scope)
    }

    /// All parameters: the shared ones, then for each recording its own and its
    /// initial states.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut all: Vec<Parameter> = self
            .scoped(Scope::Shared)
            .map(|free| free.parameter)
            .collect();
        for track in self.tracks {
            all.extend(self.scoped(Scope::PerRecording).map(|free| free.parameter));
            all.extend(self.initial_parameters(track));
        }
        all
    }

    /// Name of each of [`Self::parameters`].
    pub fn names(&self) -> Vec<String> {
        let mut all: Vec<String> = self
            .scoped(Scope::Shared)
            .map(|free| free.key.clone())
            .collect();
        for track in self.tracks {
            let recording = &track.recording.name;
            let own = self.scoped(Scope::PerRecording);
            all.extend(own.map(|free| format!("{} of {recording}", free.key)));
            if self.fits_initial_states() {
                let states = self
                    .law
                    .initial_states(self.rig, track.recording, 0, View::Centred);
                let name = |state: &crate::laws::InitialState| {
                    format!("{} at the start of {recording}", state.name)
                };
                all.extend(states.iter().map(name));
            }
        }
        all
    }

    fn initial_parameters(&self, track: &Track<'_>) -> Vec<Parameter> {
        if !self.fits_initial_states() {
            return Vec::new();
        }
        self.law
            .initial_states(self.rig, track.recording, 0, View::Centred)
            .iter()
            .map(|state| {
                Parameter::new(state.guess)
                    .bounded(state.bounds.0, state.bounds.1)
                    .with_prior(state.guess, state.standard_deviation)
                    .with_scale(state.standard_deviation)
            })
            .collect()
    }

    /// Indices into the parameter vector that act on a recording.
    pub fn active(&self, recording: usize) -> Vec<usize> {
        let shared = self.scoped(Scope::Shared).count();
        let before: usize = self.tracks[..recording]
            .iter()
            .map(|track| self.own_count(track))
            .sum();
        let own = self.own_count(&self.tracks[recording]);
        (0..shared)
            .chain(shared + before..shared + before + own)
            .collect()
    }

    /// Their values.
    fn active_values(&self, recording: usize, values: &[f64]) -> Vec<f64> {
        self.active(recording).iter().map(|&i| values[i]).collect()
    }

    fn own_count(&self, track: &Track<'_>) -> usize {
        self.scoped(Scope::PerRecording).count() + self.initial_parameters(track).len()
    }

    /// Keys of the active parameters, without the initial states.
    fn keys(&self) -> Vec<String> {
        self.scoped(Scope::Shared)
            .chain(self.scoped(Scope::PerRecording))
            .map(|free| free.key.clone())
            .collect()
    }

    /// Predicts one recording with parameters as scalars of any kind.
    fn run<R: Real>(&self, recording: usize, active: &[R], sink: &mut dyn Sink<R>) {
        let keys = self.keys();
        let (own, initial) = active.split_at(keys.len());
        let track = &self.tracks[recording];
        self.with_models(recording, &keys, own, |models| {
            let Some(window_s) = self.law.fit_window_s() else {
                return self.run_stretch(models, track, 0..track.len(), initial, sink);
            };
            for rows in windows(&track.recording.time_s, window_s) {
                let start: Vec<R> = self
                    .law
                    .initial_states(self.rig, track.recording, rows.start, View::Centred)
                    .iter()
                    .map(|state| R::from_f64(state.guess))
                    .collect();
                self.run_stretch(models, track, rows, &start, sink);
            }
        });
    }

    /// Predicts some rows of a recording from the states at their start, with
    /// numbers for the keys.
    pub fn predict_rows(
        &self,
        (recording, rows): (usize, Range<usize>),
        (keys, values): (&[String], &[f64]),
        start: &[f64],
        sink: &mut dyn Sink<f64>,
    ) {
        let track = &self.tracks[recording];
        self.with_models(recording, keys, values, |models| {
            self.run_stretch(models, track, rows, start, sink);
        });
    }

    /// Hands out the model, and the one without the effect that is not always there.
    fn with_models<R: Real, T>(
        &self,
        recording: usize,
        keys: &[String],
        values: &[R],
        work: impl FnOnce(&Models<'_, R>) -> T,
    ) -> T {
        let with = Values {
            rig: self.rig,
            keys,
            replaced: values,
        };
        let Some(presence) = self.presence else {
            return work(&Models {
                with,
                without: None,
            });
        };
        let rig = presence.rig_without(self.rig);
        let pairs = keys.iter().cloned().zip(values.iter().copied());
        let (kept, values): (Vec<String>, Vec<R>) =
            pairs.filter(|(key, _)| !presence.owns(key)).unzip();
        let without = Values {
            rig: &rig,
            keys: &kept,
            replaced: &values,
        };
        let recorded = self.tracks[recording].recording;
        let there = presence.rows(recording, &recorded.time_s);
        let names = |rig| {
            let states = self.law.initial_states(rig, recorded, 0, View::Centred);
            states.into_iter().map(|state| state.name)
        };
        let all: Vec<&str> = names(self.rig).collect();
        let place = |name: &str| all.iter().position(|one| *one == name);
        work(&Models {
            with,
            without: Some(Without {
                values: without,
                there,
                places: names(&rig).filter_map(place).collect(),
            }),
        })
    }

    /// Predicts a stretch of rows, piece after piece, each by the model that holds. The states
    /// are those of the model with the effect: what only that one has begins with the effect.
    fn run_stretch<R: Real>(
        &self,
        models: &Models<'_, R>,
        track: &Track<'_>,
        rows: Range<usize>,
        start: &[R],
        sink: &mut dyn Sink<R>,
    ) {
        if !self.law.has_states() {
            return self.run_apart(models, track, rows, sink);
        }
        let count = start.len();
        let mut state = start.to_vec();
        let mut room = Vec::new();
        let mut before: Option<&Values<'_, R>> = None;
        for piece in models.pieces(&rows) {
            if let Some(before) = before.replace(piece.values) {
                let models = (before, piece.values);
                (self.law).handed_on(models, track, piece.rows.start, &mut state);
            }
            // One row more, from which the next piece goes on.
            let end = (piece.rows.end + 1).min(rows.end);
            let begun = self.begun(track, piece.rows.start, std::mem::take(&mut state));
            let mut show = |row: usize, outputs: &[R], states: &[R]| {
                let all = piece.among_all(states, count, &mut room);
                if row > piece.rows.start || row == rows.start {
                    sink.row(row, outputs, all);
                }
                if row + 1 == end {
                    state.extend_from_slice(all);
                }
            };
            let start = piece.own(begun);
            self.law.predict(
                piece.values,
                track,
                piece.rows.start..end,
                &start,
                &mut show,
            );
        }
    }

    /// Predicts a stretch of rows by a law whose rows do not follow from one another.
    fn run_apart<R: Real>(
        &self,
        models: &Models<'_, R>,
        track: &Track<'_>,
        rows: Range<usize>,
        sink: &mut dyn Sink<R>,
    ) {
        match &models.without {
            Some(without) => self
                .both_ways_of(&models.with, without, track, &rows)
                .mixed(&without.there, |row, outputs| sink.row(row, outputs, &[])),
            None => self.law.predict(&models.with, track, rows, &[], sink),
        }
    }

    fn both_ways_of<R: Real>(
        &self,
        with: &Values<'_, R>,
        without: &Without<'_, R>,
        track: &Track<'_>,
        rows: &Range<usize>,
    ) -> BothWays<R> {
        let run = |values: &Values<'_, R>, show: &mut dyn FnMut(usize, &[R])| {
            let mut sink = |row: usize, outputs: &[R], _: &[R]| show(row, outputs);
            self.law
                .predict(values, track, rows.clone(), &[], &mut sink);
        };
        BothWays::new(
            self.law.weights(track),
            |show| run(with, show),
            |show| run(&without.values, show),
        )
    }

    /// A recording with the effect that is not always there and without it: none where there is no
    /// such effect, or rows follow from one another.
    pub fn both_ways(&self, recording: usize, values: &[f64]) -> Option<BothWays<f64>> {
        if self.law.has_states() {
            return None;
        }
        let (keys, track) = (self.keys(), &self.tracks[recording]);
        let active = self.active_values(recording, values);
        self.with_models(recording, &keys, &active[..keys.len()], |models| {
            let without = models.without.as_ref()?;
            Some(self.both_ways_of(&models.with, without, track, &(0..track.len())))
        })
    }

    /// What [`Self::predict_recording`] says by what is known of both ways, whose effect may have
    /// been elsewhere.
    pub fn predict_mixed(&self, recording: usize, both_ways: &BothWays<f64>) -> Columns {
        let track = &self.tracks[recording];
        let outputs = self.law.outputs(self.rig).len();
        let mut predicted = vec![vec![f64::NAN; track.len()]; outputs];
        let there = self.presence.map_or_else(Vec::new, |presence| {
            presence.rows(recording, &track.recording.time_s)
        });
        both_ways.mixed(&there, |row, outputs| put(&mut predicted, row, outputs));
        predicted
    }

    /// States in which those that the model before did not have are as a recording begins.
    fn begun<R: Real>(&self, track: &Track<'_>, row: usize, mut states: Vec<R>) -> Vec<R> {
        if states.iter().any(|state| state.value().is_nan()) {
            let law = self.law;
            let initial = law.initial_states(self.rig, track.recording, row, View::Centred);
            for (state, initial) in states.iter_mut().zip(&initial) {
                if state.value().is_nan() {
                    *state = R::from_f64(initial.guess);
                }
            }
        }
        states
    }

    /// Predicted outputs and states of every recording.
    pub fn predict(&self, values: &[f64]) -> Vec<(Columns, Columns)> {
        (0..self.tracks.len())
            .into_par_iter()
            .map(|recording| self.predict_one(recording, values))
            .collect()
    }

    /// Predicted outputs of one recording.
    pub fn predict_recording(&self, recording: usize, values: &[f64]) -> Columns {
        self.predict_one(recording, values).0
    }

    /// Predicted outputs of every recording in windows, each begun from what was
    /// measured: a chamber remembers for seconds what the valve let in, and a
    /// window shows what is wrong in it alone.
    pub fn predict_in_windows(&self, values: &[f64], window_s: f64) -> Vec<Columns> {
        let runs = self.predict(values);
        if !self.law.has_states() {
            return runs.into_iter().map(|(predicted, _)| predicted).collect();
        }
        let keys = self.keys();
        let in_windows = |(recording, (mut predicted, states)): (usize, (Columns, Columns))| {
            let active = self.active_values(recording, values);
            let track = &self.tracks[recording];
            for rows in windows(&track.recording.time_s, window_s) {
                let mut store = |row: usize, outputs: &[f64], _: &[f64]| {
                    put(&mut predicted, row, outputs);
                };
                let own = (keys.as_slice(), &active[..keys.len()]);
                let start = self.window_start((recording, rows.start), own, &states, View::Centred);
                self.predict_rows((recording, rows), own, &start, &mut store);
            }
            predicted
        };
        runs.into_iter().enumerate().map(in_windows).collect()
    }

    /// The states in which a window begins, those of an effect that is not there as no numbers:
    /// what was measured of them by the recording, the others from the free run's `states`. What
    /// a sensor is off by is taken as the model has it there.
    pub fn window_start(
        &self,
        (recording, row): (usize, usize),
        (keys, values): (&[String], &[f64]),
        states: &Columns,
        view: View,
    ) -> Vec<f64> {
        let rig = self.rig_at(recording, row, keys, values);
        let recording = self.tracks[recording].recording;
        let initial = self.law.initial_states(&rig, recording, row, view);
        let all = self.law.initial_states(self.rig, recording, row, view);
        let at = |index: usize| states.get(index).map(|column| column[row]);
        let now = |index: usize| at(index).filter(|state| !state.is_nan());
        let start = |(index, state): (usize, &InitialState)| {
            let Some(here) = initial.iter().find(|here| here.name == state.name) else {
                return f64::NAN;
            };
            match here.measured_by {
                Some(_) => {
                    let ahead = now(index).zip(state.read_by.and_then(now));
                    here.guess + ahead.map_or(0.0, |(it, reading)| it - reading)
                }
                None => now(index).unwrap_or(here.guess),
            }
        };
        all.iter().enumerate().map(start).collect()
    }

    /// The rig that holds at a row.
    fn rig_at(&self, recording: usize, row: usize, keys: &[String], values: &[f64]) -> Rig {
        let pairs = keys.iter().cloned().zip(values.iter().copied());
        let rig = self.rig.with_values(&pairs.collect());
        let time_s = &self.tracks[recording].recording.time_s;
        let is_there = |presence: &Presence| {
            let mut stretches = presence.rows(recording, time_s).into_iter();
            stretches.any(|rows| rows.contains(&row))
        };
        match self.presence {
            Some(presence) if !is_there(presence) => presence.rig_without(&rig),
            _ => rig,
        }
    }

    fn predict_one(&self, recording: usize, values: &[f64]) -> (Columns, Columns) {
        let rows = self.tracks[recording].len();
        let outputs = self.law.outputs(self.rig).len();
        let active = self.active_values(recording, values);
        let mut predicted = vec![vec![f64::NAN; rows]; outputs];
        let mut states: Columns = Vec::new();
        let mut store = |row: usize, out: &[f64], state: &[f64]| {
            put(&mut predicted, row, out);
            if states.len() < state.len() {
                states = vec![vec![f64::NAN; rows]; state.len()];
            }
            put(&mut states, row, state);
        };
        self.run(recording, &active, &mut store);
        (predicted, states)
    }

    /// Rows that count: not left out.
    fn counts(&self, recording: usize, row: usize) -> bool {
        self.left_out
            .is_none_or(|(folds, fold)| folds.fold(recording, row) != fold)
    }

    /// What was recorded of the outputs.
    pub fn recorded(&self, recording: usize) -> Vec<&[f64]> {
        let track = &self.tracks[recording];
        self.law
            .outputs(self.rig)
            .iter()
            .map(|output| track.recorded(output))
            .collect()
    }

    /// Hands over output, row, residual and its derivatives by all parameters.
    fn each_dual<const N: usize>(
        &self,
        recording: usize,
        active: &[usize],
        values: &[f64],
        add: &mut impl FnMut(usize, usize, f64, &[f64]),
    ) {
        let duals: Vec<Dual<N>> = active
            .iter()
            .enumerate()
            .map(|(slot, &index)| Dual::parameter(values[index], slot))
            .collect();
        let recorded = self.recorded(recording);
        let mut gradient = vec![0.0; values.len()];
        let mut show = |row: usize, outputs: &[Dual<N>], _: &[Dual<N>]| {
            if !self.counts(recording, row) {
                return;
            }
            let outputs = outputs.iter().zip(&recorded).zip(self.sigma).enumerate();
            for (place, ((output, column), sigma)) in outputs {
                if self.law.leaves_out(output.value) {
                    continue;
                }
                for (&index, derivative) in active.iter().zip(output.gradient) {
                    gradient[index] = derivative / sigma;
                }
                add(place, row, (output.value - column[row]) / sigma, &gradient);
            }
        };
        self.run(recording, &duals, &mut show);
    }

    /// The same of one recording, with as many derivatives as it has; none where it has too many.
    pub(super) fn each(
        &self,
        recording: usize,
        values: &[f64],
        add: &mut impl FnMut(usize, usize, f64, &[f64]),
    ) -> Option<()> {
        let active = self.active(recording);
        match active.len() {
            0..=4 => self.each_dual::<4>(recording, &active, values, add),
            5..=8 => self.each_dual::<8>(recording, &active, values, add),
            9..=12 => self.each_dual::<12>(recording, &active, values, add),
            13..=16 => self.each_dual::<16>(recording, &active, values, add),
            17..=20 => self.each_dual::<20>(recording, &active, values, add),
            21..=24 => self.each_dual::<24>(recording, &active, values, add),
            25..=28 => self.each_dual::<28>(recording, &active, values, add),
            29..=MOST_ACTIVE => self.each_dual::<MOST_ACTIVE>(recording, &active, values, add),
            _ => return None,
        }
        Some(())
    }

    /// The same without derivatives.
    pub(super) fn each_plain(
        &self,
        recording: usize,
        values: &[f64],
        add: &mut impl FnMut(usize, usize, f64),
    ) {
        let active = self.active_values(recording, values);
        let recorded = self.recorded(recording);
        let mut show = |row: usize, outputs: &[f64], _: &[f64]| {
            if !self.counts(recording, row) {
                return;
            }
            let outputs = outputs.iter().zip(&recorded).zip(self.sigma).enumerate();
            for (place, ((output, column), sigma)) in outputs {
                if !self.law.leaves_out(*output) {
                    add(place, row, (output - column[row]) / sigma);
                }
            }
        };
        self.run(recording, &active, &mut show);
    }

    /// The rows of one recording by output; none where it has too many parameters.
    pub fn rows(&self, recording: usize, values: &[f64]) -> Option<Vec<Vec<Row>>> {
        let mut rows = vec![Vec::new(); self.sigma.len()];
        let mut add = |output: usize, row: usize, residual: f64, gradient: &[f64]| {
            let gradient = gradient.to_vec();
            rows[output].push(Row {
                row,
                residual,
                gradient,
            });
        };
        self.each(recording, values, &mut add)?;
        Some(rows)
    }

    fn accumulate_one(&self, recording: usize, values: &[f64], equations: &mut NormalEquations) {
        let mut add = |_: usize, _: usize, residual: f64, gradient: &[f64]| {
            equations.add_row(residual, gradient);
        };
        if self.each(recording, values, &mut add).is_none() {
            equations.mark_invalid();
        }
    }

    fn accumulate_cost_of(&self, recording: usize, values: &[f64], sums: &mut ResidualSums) {
        let mut add = |_: usize, _: usize, residual: f64| sums.add(residual);
        self.each_plain(recording, values, &mut add);
    }
}

/// Recordings on all cores; their sums are added in the order of the recordings,
/// so that the number of cores does not show in the result.
impl LeastSquares for LawProblem<'_> {
    fn accumulate(&mut self, values: &[f64], equations: &mut NormalEquations) {
        let empty = equations.empty_copy();
        let of_one = |recording: usize| {
            let mut sums = empty.clone();
            self.accumulate_one(recording, values, &mut sums);
            sums
        };
        let recordings = (0..self.tracks.len()).into_par_iter();
        for sums in recordings.map(of_one).collect::<Vec<_>>() {
            equations.merge(&sums);
        }
    }

    fn accumulate_cost(&mut self, values: &[f64], sums: &mut ResidualSums) {
        let empty = ResidualSums::new(sums.weighting());
        let of_one = |recording: usize| {
            let mut sums = empty.clone();
            self.accumulate_cost_of(recording, values, &mut sums);
            sums
        };
        let recordings = (0..self.tracks.len()).into_par_iter();
        for one in recordings.map(of_one).collect::<Vec<_>>() {
            sums.merge(&one);
        }
    }
}

/// Contiguous windows of about this length; a rest shorter than half a window
/// is left out.
pub fn windows(time_s: &[f64], window_s: f64) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut start = 0;
    while start < time_s.len() {
        let end = time_s.partition_point(|&time| time < time_s[start] + window_s);
        let whole = end < time_s.len() || time_s[end - 1] - time_s[start] > 0.5 * window_s;
        if whole && end > start + 1 {
            all.push(start..end);
        }
        start = end.max(start + 1);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_folds_are_recordings_or_contiguous_parts() {
        let single = Folds::of(&[60]);
        assert_eq!(single.count, 6);
        assert_eq!(single.fold(0, 0), 0);
        assert_eq!(single.fold(0, 59), 5);
        let many = Folds::of(&[10, 20, 30]);
        assert_eq!((many.count, many.fold(2, 29)), (3, 2));
    }

    #[test]
    fn prop_windows_cover_without_overlap() {
        let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let all = windows(&time, 0.25);
        assert_eq!(all.len(), 4);
        assert!(all.windows(2).all(|pair| pair[0].end == pair[1].start));
        assert_eq!(all[0].len(), 250);
    }
}
