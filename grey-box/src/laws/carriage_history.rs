//! What a carriage remembers of the motion before a window: how long its seal
//! has stood, and where its load is in its play.
//!
//! Neither is recorded. Both follow from the recorded motion, by the laws
//! themselves, and both forget: the seal over a fraction of a millimetre of
//! sliding, the load with every contact. So a short run behind the recorded
//! motion stands for the whole past.

use super::{Motion, Track};
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::Bristle;
use model_core::left_out::{DwellStiction, ForceEquation, LoadCoupling, LoadState};
use model_core::real::Real;
use std::ops::Range;

/// The seal counts as sliding from this many Stribeck velocities on.
const SLIDING: f64 = 3.0;
/// A smoothed velocity below this is noise (some 0.3 mm/s): the carriage stands.
pub const STANDING_M_PER_S: f64 = 1e-3;
/// Ways of forgetting after which nothing is left of an age, or of a force that trails: exp(-10).
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
/// Share of its error that a row of contact takes off the load's place.
const PLACE_SHARE: f64 = 0.5;
/// The same for its speed, which is seen less sharply, by the force's growth.
const SPEED_SHARE: f64 = 0.2;
/// A load whose carriage stands is taken to come to rest within this time, s.
/// It may swing in its play for longer, but where it is then nobody knows, and
/// a swing at a wrong moment is worse than none.
const COMING_TO_REST_S: f64 = 3e-3;

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
    if effects.force_equation.trailing_n != R::ZERO {
        state.trail = trail(&effects.force_equation, motion, start);
    }
    if let (Some(load), mass_kg) = carriage.load() {
        let past = Past {
            time_s,
            recorded: |row: usize| slope(time_s, position_m, row, CONTACT_REACH),
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

/// Slope of a line through a row and some on each side.
pub(super) fn slope(time_s: &[f64], values: &[f64], row: usize, reach: usize) -> f64 {
    let rows = row.saturating_sub(reach)..(row + reach + 1).min(time_s.len());
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

/// The way from the row before, m; none where the carriage stands: there and back on its noise it
/// would forget.
pub(super) fn way_m(motion: &Motion, row: usize) -> f64 {
    if row == 0 || motion.velocity_m_per_s[row].abs() < STANDING_M_PER_S {
        return 0.0;
    }
    motion.position_m[row] - motion.position_m[row - 1]
}

/// How far a force that trails has come at a row: by the last ways, beyond which it remembers
/// nothing.
fn trail<R: Real>(equation: &ForceEquation<R>, motion: &Motion, row: usize) -> R {
    let remembered_m = FORGOTTEN_WAYS * equation.path_m.value();
    let mut first = row;
    let mut passed_m = 0.0;
    while first > 0 && passed_m < remembered_m {
        passed_m += way_m(motion, first).abs();
        first -= 1;
    }
    (first + 1..=row).fold(R::ZERO, |trail, row| {
        equation.trail(trail, R::from_f64(way_m(motion, row)))
    })
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
    let forgotten_m = FORGOTTEN_WAYS * stiction.forgetting_way_m.value();
    while row > 0 && slid_m < forgotten_m {
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
        let moves = mean.value().abs() > STANDING_M_PER_S;
        age = stiction.step(age, if moves { mean } else { R::ZERO }, length);
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
    /// every contact that shows there says anew where the load is, and how fast.
    fn load_state(
        &self,
        past: &Past<'_, R, impl Fn(usize) -> f64>,
        forces: Forces<'_, R>,
    ) -> LoadState<R> {
        let from_s = past.time_s[past.start] - LOAD_HISTORY_S;
        let first = past.time_s.partition_point(|&time| time < from_s);
        let has_play = self.load.gap_m > R::ZERO;
        let mut state = LoadState::RIGID;
        let mut force_before = R::ZERO;
        let mut before = past.velocity(first);
        for row in first..past.start {
            let after = past.velocity(row + 1);
            let dt_s = R::from_f64(past.length_s(&(row..row + 1)));
            if has_play && before.abs().min(after.abs()) > self.sliding_m_per_s {
                let mean = (before + after) * R::from_f64(0.5);
                let [drive, friction, coulomb] = forces(row, mean);
                let force = drive - friction - self.mass_kg * (after - before) / dt_s;
                let seen = R::from_f64(SEEN_SHARE) * coulomb;
                self.coast(&mut state, force, after - before, dt_s);
                self.correct(&mut state, [force_before, force], seen, dt_s);
                force_before = force;
            } else {
                force_before = R::ZERO;
                if has_play {
                    let rest_s = R::from_f64(COMING_TO_REST_S);
                    state.faster_m_per_s = state.faster_m_per_s * (-dt_s / rest_s).exp();
                }
                self.load.follow(&mut state, before, after, dt_s);
            }
            before = after;
        }
        state
    }

    /// One step of the load under a force that was observed.
    fn coast(&self, state: &mut LoadState<R>, force_n: R, change: R, dt_s: R) {
        let faster = state.faster_m_per_s + change - dt_s * force_n / self.load.load_mass_kg;
        let mean = (state.faster_m_per_s + faster) * R::from_f64(0.5);
        state.ahead_m += dt_s * mean;
        state.faster_m_per_s = faster;
    }

    /// Puts the load where the forces of the last two rows say that it is: at
    /// the contact that carries the force, or no farther than it allows.
    fn correct(&self, state: &mut LoadState<R>, forces_n: [R; 2], seen_n: R, dt_s: R) {
        let load = &self.load;
        let edge = R::from_f64(0.5) * load.gap_m;
        let [before_n, force_n] = forces_n;
        let side = force_n.signum();
        if force_n.abs() > seen_n {
            if before_n * side > seen_n {
                let speed = (force_n - before_n) / (load.stiffness_n_per_m * dt_s);
                let error = speed - state.faster_m_per_s;
                state.faster_m_per_s += R::from_f64(SPEED_SHARE) * error;
            }
            let pressed = force_n - load.damping_n_s_per_m * state.faster_m_per_s;
            let contact = edge * side + pressed / load.stiffness_n_per_m;
            state.ahead_m += R::from_f64(PLACE_SHARE) * (contact - state.ahead_m);
        }
        let farthest = edge + force_n.abs().max(seen_n) / load.stiffness_n_per_m;
        if state.ahead_m.abs() > farthest {
            let side = state.ahead_m.signum();
            state.ahead_m = side * farthest;
            if state.faster_m_per_s * side > R::ZERO {
                state.faster_m_per_s = state.faster_m_per_s * R::from_f64(0.5);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use model_core::carriage::CarriageEffects;
    use model_core::paper;
    use std::collections::BTreeMap;

    const PLAY_M: f64 = 2e-3;

    /// 3 s of a carriage with a loose load under a drive that reverses hard: the
    /// recording, and carriage and drive at every row.
    fn run(carriage: &Carriage<f64>) -> (Recording, Vec<CarriageState<f64>>, Vec<f64>) {
        let levels = paper::friction_levels();
        let mut state = CarriageState::new(0.0, 0.0);
        let drive_n = |time_s: f64| 90.0 * (12.0 * time_s).sin() + 40.0 * (31.0 * time_s).sin();
        let (mut states, mut drives) = (Vec::new(), Vec::new());
        let time_s: Vec<f64> = (0..3000).map(|row| f64::from(row) * 1e-3).collect();
        for time in &time_s {
            states.push(state);
            drives.push(drive_n(*time));
            for step in 0..10 {
                let within_s = (f64::from(step) + 0.5) * 1e-4;
                carriage.step(&mut state, &levels, drive_n(time + within_s), 1e-4);
            }
        }
        let positions = states.iter().map(|state| state.position_m.value).collect();
        let signals = BTreeMap::from([("x".to_owned(), positions)]);
        (
            Recording::from_signals("loose", time_s, signals),
            states,
            drives,
        )
    }

    #[test]
    fn val_a_loose_load_is_found_in_its_play() {
        let mut effects = CarriageEffects::neutral();
        effects.load = LoadCoupling {
            load_mass_kg: 0.9,
            stiffness_n_per_m: 2e5,
            damping_n_s_per_m: 120.0,
            gap_m: PLAY_M,
        };
        let carriage = Carriage {
            effects: Some(effects),
            ..paper::axis::<f64>().carriage
        };
        let (recording, states, drives) = run(&carriage);
        let levels = paper::friction_levels::<f64>();
        let forces = |row: usize, velocity: f64| {
            let friction = levels.steady_n(&carriage.bristle, velocity);
            [drives[row], friction, levels.coulomb_n]
        };
        let track = Track::new(&recording);
        let (mut squares, mut count) = (0.0, 0.0);
        for row in (1000..3000).step_by(50) {
            let truth = states[row];
            let mut state = CarriageState::new(truth.position_m.value, truth.velocity_m_per_s);
            recall(&carriage, &track, row, &forces, &mut state);
            squares += (state.load.ahead_m - truth.load.ahead_m).powi(2);
            count += 1.0;
        }
        let error_m: f64 = f64::sqrt(squares / count);
        println!("place of the load within {error_m:.1e} m");
        // Knowing nothing, it is anywhere in the play: at its edges mostly.
        assert!(error_m < 0.2 * PLAY_M, "{error_m} m");
    }

    #[test]
    fn val_age_of_a_seal_is_the_time_since_it_slid() {
        let mut effects = CarriageEffects::neutral();
        effects.dwell_stiction = DwellStiction {
            rise_n: 30.0,
            time_constant_s: 0.8,
            forgetting_way_m: 5e-5,
        };
        let carriage = Carriage {
            effects: Some(effects),
            ..paper::axis::<f64>().carriage
        };
        // Half a second of sliding, then standing.
        let time_s: Vec<f64> = (0..2000).map(|row| f64::from(row) * 1e-3).collect();
        let positions = time_s.iter().map(|time| 0.1 * time.min(0.5)).collect();
        let signals = BTreeMap::from([("x".to_owned(), positions)]);
        let recording = Recording::from_signals("stop", time_s, signals);
        let track = Track::new(&recording);
        for (row, expected) in [(400, 0.0), (1500, 1.0 - (-1.0_f64 / 0.8).exp())] {
            let mut state = CarriageState::new(0.0, if row < 500 { 0.1 } else { 0.0 });
            recall(&carriage, &track, row, &|_, _| [0.0; 3], &mut state);
            let apart = state.contact_age - expected;
            assert!(apart.abs() < 0.02, "{} at {row}", state.contact_age);
        }
    }
}
