//! What a carriage remembers of the motion before a window: how long its seal
//! has stood, and where its load is in its play.
//!
//! Neither is recorded. Both follow from the recorded motion, by the laws
//! themselves, and both forget: the seal over a fraction of a millimetre of
//! sliding, the load with every contact. So a short run behind the recorded
//! motion stands for the whole past.

use super::Track;
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::Bristle;
use model_core::left_out::{DwellStiction, FORGETTING_WAY_M, LoadCoupling, LoadState};
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

/// Rows on each side for the velocity that drives the load: a contact lasts a
/// few milliseconds, and the wider smoothing that the seal's age asks for would
/// wipe it out.
const CONTACT_REACH: usize = 1;

/// Sets age and load of a state at the start of a window; its velocity is that
/// of the window's start.
///
/// A smoothed velocity looks ahead by half its window. From there on it is
/// taken as linear towards that of the start, so that nothing of what is to be
/// predicted is used.
pub(super) fn recall<R: Real>(
    carriage: &Carriage<R>,
    track: &Track<'_>,
    start: usize,
    state: &mut CarriageState<R>,
) {
    let (Some(effects), Some(motion), Some(position_m)) =
        (carriage.effects, track.motion.as_ref(), track.signal("x"))
    else {
        return;
    };
    let time_s = &track.recording.time_s;
    let velocity_m_per_s = state.velocity_m_per_s;
    if !effects.dwell_stiction.is_neutral() {
        let past = Past {
            time_s,
            recorded: |row: usize| motion.velocity_m_per_s[row],
            known: start.saturating_sub(motion.half_width),
            start,
            velocity_m_per_s,
        };
        state.contact_age = contact_age(&past, &carriage.bristle, &effects.dwell_stiction);
    }
    if let (Some(load), _) = carriage.load() {
        let past = Past {
            time_s,
            recorded: |row: usize| slope(time_s, position_m, row),
            known: start.saturating_sub(CONTACT_REACH),
            start,
            velocity_m_per_s,
        };
        state.load = load_state(&past, &load);
    }
}

/// Slope of a line through a few rows.
pub(super) fn slope(time_s: &[f64], values: &[f64], row: usize) -> f64 {
    let rows = row.saturating_sub(CONTACT_REACH)..(row + CONTACT_REACH + 1).min(time_s.len());
    let middle_s = time_s[rows.clone()].iter().sum::<f64>() / rows.len() as f64;
    let (mut product, mut square) = (0.0, 0.0);
    for (time, value) in time_s[rows.clone()].iter().zip(&values[rows]) {
        product += (time - middle_s) * value;
        square += (time - middle_s) * (time - middle_s);
    }
    product / square
}

/// The recorded motion before a window.
struct Past<'a, R, V> {
    time_s: &'a [f64],
    /// Velocity at a row.
    recorded: V,
    /// The last row whose velocity holds nothing of the window.
    known: usize,
    /// The window's first row.
    start: usize,
    /// Velocity there.
    velocity_m_per_s: R,
}

impl<R: Real, V: Fn(usize) -> f64> Past<'_, R, V> {
    fn velocity(&self, row: usize) -> R {
        let from = R::from_f64((self.recorded)(row.min(self.known)));
        if row <= self.known {
            return from;
        }
        let whole = self.time_s[self.start] - self.time_s[self.known];
        let share = R::from_f64((self.time_s[row] - self.time_s[self.known]) / whole);
        from + (self.velocity_m_per_s - from) * share
    }

    fn length_s(&self, rows: &Range<usize>) -> f64 {
        self.time_s[rows.end] - self.time_s[rows.start]
    }
}

/// The age of the seal's contact. One that stands since the recording began has
/// stood since then.
fn contact_age<R: Real>(
    past: &Past<'_, R, impl Fn(usize) -> f64>,
    bristle: &Bristle<R>,
    stiction: &DwellStiction<R>,
) -> R {
    let sliding = SLIDING * bristle.stribeck_velocity_m_per_s.value();
    let mut slid_m = 0.0;
    let mut row = past.start;
    while row > 0 && slid_m < FORGOTTEN_WAYS * FORGETTING_WAY_M {
        row -= 1;
        let speed = past.velocity(row).value().abs();
        if speed > sliding {
            slid_m += speed * past.length_s(&(row..row + 1));
        }
    }
    let stride = (past.start - row).div_ceil(MOST_DWELL_STEPS).max(1);
    let mut age = R::ZERO;
    while row < past.start {
        let end = (row + stride).min(past.start);
        let length = R::from_f64(past.length_s(&(row..end)));
        let mean = (past.velocity(row) + past.velocity(end)) * R::from_f64(0.5);
        age = stiction.step(age, bristle, mean, length);
        row = end;
    }
    age
}

/// The load after a run behind the carriage's motion.
fn load_state<R: Real>(
    past: &Past<'_, R, impl Fn(usize) -> f64>,
    load: &LoadCoupling<R>,
) -> LoadState<R> {
    let from_s = past.time_s[past.start] - LOAD_HISTORY_S;
    let first = past.time_s.partition_point(|&time| time < from_s);
    let mut state = LoadState::RIGID;
    let mut before = past.velocity(first);
    for row in first..past.start {
        let after = past.velocity(row + 1);
        let length = R::from_f64(past.length_s(&(row..row + 1)));
        load.follow(&mut state, before, after, length);
        before = after;
    }
    state
}
