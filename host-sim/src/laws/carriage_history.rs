//! What a carriage remembers of the motion before a window: how long its seal
//! has stood, and where its load is in its play.
//!
//! Neither is recorded. Both follow from the recorded motion, by the laws
//! themselves, and both forget: the seal over a fraction of a millimetre of
//! sliding, the load with every contact. So a short run behind the recorded
//! motion stands for the whole past.

use super::Track;
use super::motion::Motion;
use model_core::carriage::{Carriage, CarriageState};
use model_core::left_out::{DwellStiction, FORGETTING_WAY_M, LoadCoupling};
use model_core::real::Real;
use std::ops::Range;

/// The seal counts as sliding from this many Stribeck velocities on.
const SLIDING: f64 = 3.0;
/// Ways of forgetting after which nothing of the age is left: exp(-10).
const FORGOTTEN_WAYS: f64 = 10.0;
/// A longer stand is followed in this many steps.
const MOST_DWELL_STEPS: usize = 2000;
/// How far back the load's motion is followed, s: some 30 periods of a soft
/// coupling (30 Hz), which its damping has long ended.
const LOAD_HISTORY_S: f64 = 1.0;

/// Sets age and load of a state at the start of a window; its velocity is that
/// of the window's start.
///
/// The smoothed motion looks ahead by half its window. From there on the
/// velocity is taken as linear towards that of the start, so that nothing of
/// what is to be predicted is used.
pub(super) fn recall<R: Real>(
    carriage: &Carriage<R>,
    track: &Track<'_>,
    start: usize,
    state: &mut CarriageState<R>,
) {
    let (Some(effects), Some(motion)) = (carriage.effects, track.motion.as_ref()) else {
        return;
    };
    let past = Past {
        time_s: &track.recording.time_s,
        motion,
        known: start.saturating_sub(motion.half_width),
        start,
        velocity_m_per_s: state.velocity_m_per_s,
    };
    if !effects.dwell_stiction.is_neutral() {
        state.contact_age = past.contact_age(carriage, &effects.dwell_stiction);
    }
    if let (Some(load), _) = carriage.load() {
        past.follow_load(&load, state);
    }
}

/// The recorded motion before a window.
struct Past<'a, R> {
    time_s: &'a [f64],
    motion: &'a Motion,
    /// The last row whose smoothed motion holds nothing of the window.
    known: usize,
    /// The window's first row.
    start: usize,
    /// Velocity there.
    velocity_m_per_s: R,
}

impl<R: Real> Past<'_, R> {
    fn velocity(&self, row: usize) -> R {
        let recorded = |row: usize| R::from_f64(self.motion.velocity_m_per_s[row]);
        if row <= self.known {
            return recorded(row);
        }
        let whole = self.time_s[self.start] - self.time_s[self.known];
        let share = R::from_f64((self.time_s[row] - self.time_s[self.known]) / whole);
        let from = recorded(self.known);
        from + (self.velocity_m_per_s - from) * share
    }

    /// Mean speed and length of a span of rows.
    fn span(&self, rows: &Range<usize>) -> (R, R) {
        let half = R::from_f64(0.5);
        let mean = (self.velocity(rows.start) + self.velocity(rows.end)) * half;
        let length_s = self.time_s[rows.end] - self.time_s[rows.start];
        (mean, R::from_f64(length_s))
    }

    /// The age of the seal's contact. One that stands since the recording began
    /// has stood since then.
    fn contact_age(&self, carriage: &Carriage<R>, stiction: &DwellStiction<R>) -> R {
        let sliding = SLIDING * carriage.bristle.stribeck_velocity_m_per_s.value();
        let mut slid_m = 0.0;
        let mut row = self.start;
        while row > 0 && slid_m < FORGOTTEN_WAYS * FORGETTING_WAY_M {
            row -= 1;
            let (velocity, length) = self.span(&(row..row + 1));
            if velocity.value().abs() > sliding {
                slid_m += velocity.value().abs() * length.value();
            }
        }
        let stride = (self.start - row).div_ceil(MOST_DWELL_STEPS).max(1);
        let mut age = R::ZERO;
        while row < self.start {
            let end = (row + stride).min(self.start);
            let (velocity, length) = self.span(&(row..end));
            age = stiction.step(age, &carriage.bristle, velocity, length);
            row = end;
        }
        age
    }

    /// Runs the load behind the carriage's motion.
    fn follow_load(&self, load: &LoadCoupling<R>, state: &mut CarriageState<R>) {
        let from_s = self.time_s[self.start] - LOAD_HISTORY_S;
        let first = self.time_s.partition_point(|&time| time < from_s);
        for row in first..self.start {
            let (before, after) = (self.velocity(row), self.velocity(row + 1));
            let (_, length) = self.span(&(row..row + 1));
            load.follow(&mut state.load, before, after, length);
        }
    }
}
