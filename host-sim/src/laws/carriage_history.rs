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
const CONTACT_REACH: usize = 4;
/// A force on the load counts as contact from this share of the Coulomb level
/// on: below, an error of the friction may be taken for it.
const SEEN_SHARE: f64 = 0.2;
/// Share of the error that a row of contact takes off the load's place, and off
/// its speed where it would be in a stop that carries nothing.
const CORRECTED_SHARE: f64 = 0.5;

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
    forces: Forces<'_, R>,
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
    if let (Some(load), mass_kg) = carriage.load() {
        let past = Past {
            time_s,
            recorded: |row: usize| slope(time_s, position_m, row),
            known: start.saturating_sub(CONTACT_REACH),
            start,
            velocity_m_per_s,
        };
        let body = Body {
            load,
            mass_kg,
            sliding_m_per_s: carriage.bristle.stribeck_velocity_m_per_s * R::from_f64(SLIDING),
        };
        state.load = body.load_state(&past, forces);
    }
}

/// Slope of a line through a few rows.
fn slope(time_s: &[f64], values: &[f64], row: usize) -> f64 {
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

/// Drive and steady friction of the carriage at a row and a velocity, and the
/// Coulomb level there, N.
pub(super) type Forces<'a, R> = &'a dyn Fn(usize, R) -> [R; 3];

/// Load and carriage as two bodies.
struct Body<R> {
    load: LoadCoupling<R>,
    /// Of the carriage alone.
    mass_kg: R,
    /// From this speed on friction is known.
    sliding_m_per_s: R,
}

impl<R: Real> Body<R> {
    /// The load after a run behind the carriage's recorded motion.
    ///
    /// A load without play is held by its spring, and the motion says all. In
    /// its play it coasts: an error of its place makes it meet the carriage at
    /// a wrong time, and the next error is larger. So while the carriage slides
    /// the force on the load is taken from the carriage's own balance, and
    /// every contact that shows there says anew where the load is.
    fn load_state(
        &self,
        past: &Past<'_, R, impl Fn(usize) -> f64>,
        forces: Forces<'_, R>,
    ) -> LoadState<R> {
        let from_s = past.time_s[past.start] - LOAD_HISTORY_S;
        let first = past.time_s.partition_point(|&time| time < from_s);
        let has_play = self.load.gap_m > R::ZERO;
        let mut state = LoadState::RIGID;
        let mut before = past.velocity(first);
        for row in first..past.start {
            let after = past.velocity(row + 1);
            let dt_s = R::from_f64(past.length_s(&(row..row + 1)));
            if has_play && before.abs().min(after.abs()) > self.sliding_m_per_s {
                let mean = (before + after) * R::from_f64(0.5);
                let [drive, friction, coulomb] = forces(row, mean);
                let force = drive - friction - self.mass_kg * (after - before) / dt_s;
                let seen = R::from_f64(SEEN_SHARE) * coulomb;
                self.observe(&mut state, force, after - before, seen, dt_s);
            } else {
                self.load.follow(&mut state, before, after, dt_s);
            }
            before = after;
        }
        state
    }

    /// One step of the load under a force that was observed.
    fn observe(&self, state: &mut LoadState<R>, force_n: R, change: R, seen_n: R, dt_s: R) {
        let load = &self.load;
        let half = R::from_f64(0.5);
        let faster = state.faster_m_per_s + change - dt_s * force_n / load.load_mass_kg;
        state.ahead_m += dt_s * half * (state.faster_m_per_s + faster);
        state.faster_m_per_s = faster;
        let share = R::from_f64(CORRECTED_SHARE);
        let edge = half * load.gap_m;
        if force_n.abs() > seen_n {
            let pressed = force_n - load.damping_n_s_per_m * faster;
            let contact = edge * force_n.signum() + pressed / load.stiffness_n_per_m;
            state.ahead_m += share * (contact - state.ahead_m);
        }
        let farthest = edge + force_n.abs().max(seen_n) / load.stiffness_n_per_m;
        if state.ahead_m.abs() > farthest {
            let side = state.ahead_m.signum();
            state.ahead_m = side * farthest;
            if faster * side > R::ZERO {
                state.faster_m_per_s = faster * (R::ONE - share);
            }
        }
    }
}
