//! Break-aways: what stiction is, read off the moments in which a carriage leaves its place.
//!
//! The model's own bristle is put where the carriage stood and pushed by the recorded gas
//! force. When it leaves, by how much more or less force than the carriage, is the residual of
//! an event:
//!
//! ```text
//! residual = F(recorded instant) - F(instant of the model),   F = gas force + K way
//! ```
//!
//! A carriage that moves expands the gas behind it, so the recorded force falls. K is the air
//! spring: F is the force as it would have been had the carriage not moved, and the model is
//! pushed by F - K (its own way). Both instants are read in the same way, off the first
//! millimetre: a bristle gives way little by little, and a seal that has aged forgets on the
//! way, so that neither leaves at its static level.

use super::{median_step_s, white_noise};
use model_core::carriage::Carriage;
use model_core::friction::FrictionLevels;
use model_core::left_out::DwellStiction;
use model_core::real::Real;
use std::ops::Range;

/// The carriage stands where it stays within this of its place, m: presliding
/// of metal guides is some 20 to 60 um ...
const STANDING_M: f64 = 1e-4;
/// ... or within this many times what its bristle gives way under the declared static friction:
/// from the one side to the other it gives way twice that, and a seal that has aged holds more ...
const STANDING_DEFLECTIONS: f64 = 3.0;
/// ... (that not more than this part of the first way) ...
const STANDING_OF_FIRST_WAY: f64 = 0.3;
/// ... or within this many deviations of the noise with which its position is read ...
const STANDING_DEVIATIONS: f64 = 5.0;
/// ... which is averaged down to this, m: that much of the first way does not shift an instant ...
const POSITION_KNOWN_TO_M: f64 = 1e-5;
/// ... over no more than this on either side, s: at 5 m/s2 it makes an instant 1 ms early ...
const MOST_POSITION_REACH_S: f64 = 8e-3;
/// ... for at least this long, s.
const LEAST_REST_S: f64 = 0.03;
/// The first way after break-away, m: from its parabola over time the instant
/// of the break-away is found.
const FIRST_WAY_M: f64 = 1e-3;
/// How well that instant is found, s.
const INSTANT_NOISE_S: f64 = 1e-3;
/// Rows on either side over which the force is averaged, at least and at most: until its noise
/// comes down to what a slow break-away is known to.
const FORCE_REACH: (usize, usize) = (2, 20);
/// How well the force at a slow break-away is known, N: with the true parameters of healthy
/// carriages 0.1 to 0.4 N are left. Faster events are scaled to it.
pub const KNOWN_TO_N: f64 = 0.4;
/// Less than this is not looked into, N: twice what is known. A contact whose form is not quite
/// the model's (elasto-plastic, Maxwell slip) left 1.1 to 2.5 N on four carriages.
pub const BREAKAWAY_NOISE_N: f64 = 0.8;
/// By so many deviations of its noise a force has changed surely.
const SURELY: f64 = 4.0;
/// A break-away that is off by more than this says no more than that, N: it may
/// have been none.
const MOST_TOLD_N: f64 = 12.0;
/// Events that are worse than this many times that are left out.
const WORST_EVENT: f64 = 4.0;
/// How long before it leaves the carriage is followed, s: what a bristle creeps before that
/// is less than it gives way in the end.
const HISTORY_S: f64 = 0.2;
/// A carriage that the model still holds after the recorded one has left is pushed on by a
/// force that grows at least so fast, N/s.
const LEAST_RATE_N_PER_S: f64 = 50.0;
/// Step of the model, s, and the most of them: the history, and a force that grows by more
/// than is told.
const STEP_S: f64 = 1e-4;
const MOST_STEPS: usize = 6000;

/// The instant at which a carriage leaves its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Breakaway {
    /// The row before which it left.
    pub row: usize,
    /// The instant, s.
    at_s: f64,
    /// +1 or -1.
    pub direction: f64,
    /// How long it has stood, s.
    pub rest_s: f64,
}

impl Breakaway {
    /// How long before it left the carriage is followed, s: not from the beginning of a short
    /// rest, in which it has only just arrived.
    fn history_s(&self) -> f64 {
        (0.5 * self.rest_s).min(HISTORY_S)
    }
}

/// Where a carriage is, as its break-aways are read off it.
pub(super) struct PositionReading {
    /// With the noise averaged down, m.
    position_m: Vec<f64>,
    /// Within how much of its place the carriage stands, m.
    standing_m: f64,
}

impl PositionReading {
    /// Of a recorded position. A bristle gives way by so much under the static friction.
    pub fn new(time_s: &[f64], position_m: &[f64], deflection_m: f64) -> Self {
        let noise_m = white_noise(position_m);
        let most = MOST_POSITION_REACH_S / median_step_s(time_s);
        let rows = (noise_m / POSITION_KNOWN_TO_M).powi(2);
        let reach = ((rows - 1.0) / 2.0).ceil().clamp(0.0, most.floor()) as usize;
        let averaged = |row: usize| mean(&position_m[around(row, reach, position_m.len())]);
        let noise_m = noise_m / ((2 * reach + 1) as f64).sqrt();
        Self {
            position_m: (0..position_m.len()).map(averaged).collect(),
            standing_m: standing_m(deflection_m).max(STANDING_DEVIATIONS * noise_m),
        }
    }
}

/// Within how much of its place a carriage stands, m, whose bristle gives way by so much under
/// its static friction.
fn standing_m(deflection_m: f64) -> f64 {
    let most_m = STANDING_OF_FIRST_WAY * FIRST_WAY_M;
    STANDING_M.max((STANDING_DEFLECTIONS * deflection_m).min(most_m))
}

/// The rows within reach of one.
fn around(row: usize, reach: usize, rows: usize) -> Range<usize> {
    row.saturating_sub(reach)..(row + reach + 1).min(rows)
}

/// The break-aways of a recorded position.
pub(super) fn breakaways(time_s: &[f64], reading: &PositionReading) -> Vec<Breakaway> {
    let (position_m, standing_m) = (&reading.position_m, reading.standing_m);
    let mut events = Vec::new();
    let Some(&first) = position_m.first() else {
        return events;
    };
    // The place is the mean of where it has stood so far.
    let (mut place, mut since, mut rows) = (first, 0_usize, 1.0);
    // The place before, and whether an event told of it.
    let (mut place_before, mut was_told) = (f64::INFINITY, false);
    for (row, &position) in position_m.iter().enumerate() {
        let away = position - place;
        if away.abs() <= standing_m {
            rows += 1.0;
            place += away / rows;
            continue;
        }
        let rest_s = time_s[row] - time_s[since];
        if rest_s < LEAST_REST_S {
            (place, since, rows) = (position, row, 1.0);
            continue;
        }
        // Within the first way from the place before it creeps: neither was a rest.
        let creeps = (place - place_before).abs() < FIRST_WAY_M;
        if creeps && was_told {
            events.pop();
        }
        place_before = place;
        let left = (&time_s[row..], &position_m[row..]);
        // What has left as soon as it came has not stood: it went on, slowly.
        let stood = |at_s: &f64| *at_s - time_s[since] >= LEAST_REST_S && *at_s <= time_s[row];
        let instant = instant(left, place, standing_m).filter(|at_s| !creeps && stood(at_s));
        was_told = instant.is_some();
        if let Some(at_s) = instant {
            events.push(Breakaway {
                row: time_s.partition_point(|&time| time < at_s),
                at_s,
                direction: away.signum(),
                rest_s: at_s - time_s[since],
            });
        }
        (place, since, rows) = (position, row, 1.0);
    }
    events
}

/// The instant at which a way that grows with the square of time began: the
/// root of the way is a straight line of time. `None` where the carriage does
/// not get through the first millimetre, or turns back.
fn instant<R: Real>((time_s, position_m): (&[R], &[R]), place_m: R, standing_m: f64) -> Option<R> {
    let is_first = |way: f64| way <= FIRST_WAY_M && way > 0.5 * standing_m;
    let roots: Vec<(R, R)> = time_s
        .iter()
        .zip(position_m)
        .map(|(&time, &position)| (time, (position - place_m).abs()))
        .take_while(|(_, way)| is_first(way.value()))
        .map(|(time, way)| (time, way.sqrt()))
        .collect();
    if roots.len() < 3 {
        return None;
    }
    let share = R::ONE / R::from_f64(roots.len() as f64);
    let (mut time, mut root) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        time += at * share;
        root += value * share;
    }
    let (mut covariance, mut variance) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        covariance += (at - time) * (value - root);
        variance += (at - time) * (at - time);
    }
    let slope = covariance / variance;
    (slope.value() > 0.0).then(|| time - root / slope)
}

/// When a way that never turns back, known at equal steps, reaches a length.
fn reached<R: Real>(way_m: &[R], length_m: f64) -> Option<R> {
    let after = way_m.partition_point(|way| way.value() <= length_m);
    let before = after.checked_sub(1)?;
    let (from, to) = (*way_m.get(before)?, *way_m.get(after)?);
    let share = (R::from_f64(length_m) - from) / (to - from);
    Some((R::from_f64(before as f64) + share) * R::from_f64(STEP_S))
}

/// The instant of [`instant`] as rows would show it, taken between the same two
/// lengths whatever the parameters: rows that enter and leave would hide how the
/// instant moves with them.
fn instant_of_way<R: Real>(way_m: &[R], standing_m: f64) -> Option<R> {
    const ROWS: usize = 20;
    let first_s = reached(way_m, standing_m)?;
    let last_s = reached(way_m, FIRST_WAY_M)?;
    let (mut time_s, mut position_m) = (Vec::with_capacity(ROWS), Vec::with_capacity(ROWS));
    for row in 0..ROWS {
        let share = R::from_f64(row as f64 / ROWS as f64);
        let at_s = first_s + (last_s - first_s) * share;
        let before = ((at_s.value() / STEP_S) as usize).min(way_m.len() - 2);
        let (from, to) = (way_m[before], way_m[before + 1]);
        let part = at_s / R::from_f64(STEP_S) - R::from_f64(before as f64);
        time_s.push(at_s);
        position_m.push(from + (to - from) * part);
    }
    instant((&time_s, &position_m), R::ZERO, standing_m)
}

/// What was recorded of a carriage.
pub(super) struct Recorded<'a, R> {
    time_s: &'a [f64],
    position: &'a PositionReading,
    /// Force of the gas alone, N. Which events tell something is read off it: read off what a
    /// model drives the carriage with, a model could make those events silent that it misses.
    gas_n: &'a [f64],
    /// Force of the gas less that of a load behind its spring and all else that is no
    /// friction, N.
    driving_n: &'a [R],
    /// Rows on either side over which a force is averaged.
    reach: usize,
    /// Noise of such an average, N.
    noise_n: f64,
}

impl<'a, R: Real> Recorded<'a, R> {
    /// Of columns of one length.
    pub fn new(
        time_s: &'a [f64],
        position: &'a PositionReading,
        gas_n: &'a [f64],
        driving_n: &'a [R],
    ) -> Self {
        let row_noise_n = white_noise(gas_n);
        let rows = (row_noise_n / KNOWN_TO_N).powi(2);
        let (least, most) = FORCE_REACH;
        let reach = ((rows / 2.0).ceil() as usize).clamp(least, most);
        Self {
            time_s,
            position,
            gas_n,
            driving_n,
            reach,
            noise_n: row_noise_n / ((2 * reach + 1) as f64).sqrt(),
        }
    }

    /// The rows that are averaged around one.
    fn around(&self, row: usize) -> Range<usize> {
        around(row, self.reach, self.time_s.len())
    }
}

/// The force on a carriage had it not moved, in the direction in which it left.
struct Push<R> {
    /// Times since the first row, s, and the force there.
    time_s: Vec<f64>,
    force_n: Vec<R>,
    /// When the recorded carriage left, s since the first row.
    left_s: f64,
    /// How fast it grows at the break-away, N/s.
    rate_n_per_s: f64,
}

impl<R: Real> Push<R> {
    /// From a while before an event to where the carriage has gone its first way.
    fn of(event: &Breakaway, recorded: &Recorded<'_, R>, air_spring_n_per_m: R) -> Option<Self> {
        let time_s = recorded.time_s;
        let (position_m, standing_m) =
            (&recorded.position.position_m, recorded.position.standing_m);
        let from_s = event.at_s - event.history_s();
        let first = time_s
            .partition_point(|&time| time < from_s)
            .max(recorded.reach);
        let place_m = mean(&position_m[recorded.around(first)]);
        let way = |row: usize| event.direction * (position_m[row] - place_m);
        let last = (event.row..time_s.len()).find(|&row| way(row) > FIRST_WAY_M)?;
        let begun = (event.row..last).find(|&row| way(row) > standing_m)?;
        let left = (&time_s[begun..last], &position_m[begun..last]);
        let left_s = instant(left, place_m, standing_m)?;
        let expanded_m = |rows: Range<usize>| {
            let ways: Vec<f64> = rows.map(|row| way(row).max(0.0)).collect();
            mean(&ways)
        };
        let unmoved = |row: usize| -> R {
            let rows = recorded.around(row);
            let share = R::from_f64(event.direction / rows.len() as f64);
            let mut force = air_spring_n_per_m * R::from_f64(expanded_m(rows.clone()));
            for &driving_n in &recorded.driving_n[rows] {
                force += share * driving_n;
            }
            force
        };
        let force_n: Vec<R> = (first..=last).map(unmoved).collect();
        let gas_n = |row: usize, reach: usize| {
            let rows = around(row, reach, time_s.len());
            let unmoved = air_spring_n_per_m.value() * expanded_m(rows.clone());
            unmoved + event.direction * mean(&recorded.gas_n[rows])
        };
        let level_n = gas_n(event.row, recorded.reach);
        // A force that is taken away again before the first way is done has moved a carriage
        // that crept: one that is held a little more firmly would not have left at all.
        let least_n = BREAKAWAY_NOISE_N.hypot(SURELY * recorded.noise_n);
        let is_taken_away = |row: usize| gas_n(row, recorded.reach) < level_n - least_n;
        if (event.row..=last).any(is_taken_away) {
            return None;
        }
        // Over as few rows whatever the noise: a hard stroke would else seem a slow one.
        let (reach, _) = FORCE_REACH;
        let before = event.row.checked_sub(2 * reach);
        let before = before.filter(|&row| row >= first)?;
        let rise_n = gas_n(event.row, reach) - gas_n(before, reach);
        Some(Self {
            left_s: left_s - time_s[first],
            rate_n_per_s: rise_n / (time_s[event.row] - time_s[before]),
            time_s: time_s[first..=last]
                .iter()
                .map(|time| time - time_s[first])
                .collect(),
            force_n,
        })
    }

    /// The force at a time since the first row. Beyond the last it grows on.
    fn at(&self, time_s: R) -> R {
        let last = self.time_s.len() - 1;
        let beyond_s = time_s - R::from_f64(self.time_s[last]);
        if beyond_s.value() >= 0.0 {
            let rate = self.rate_n_per_s.max(LEAST_RATE_N_PER_S);
            return self.force_n[last] + beyond_s * R::from_f64(rate);
        }
        let after = self.time_s.partition_point(|&time| time <= time_s.value());
        let before = after.clamp(1, last) - 1;
        let (from_s, to_s) = (self.time_s[before], self.time_s[before + 1]);
        let share = (time_s - R::from_f64(from_s)) / R::from_f64(to_s - from_s);
        self.force_n[before] + (self.force_n[before + 1] - self.force_n[before]) * share
    }
}

/// The model of a carriage that stands.
pub(super) struct Stand<'a, R> {
    pub carriage: &'a Carriage<R>,
    /// Without a load behind a spring, unless that is in its play and taken as rigid.
    pub mass_kg: R,
    /// Of a new seal where it stands, whichever way it is pushed.
    pub levels: FrictionLevels<R>,
    /// How stiffly the gas holds the piston.
    pub air_spring_n_per_m: R,
}

impl<R: Real> Stand<'_, R> {
    /// By how much the force at which the carriage left was above that at which the model
    /// leaves, N, scaled to events of a slow rise. None where the event says too little.
    pub fn residual(&self, event: &Breakaway, recorded: &Recorded<'_, R>) -> Option<R> {
        let push = Push::of(event, recorded, self.air_spring_n_per_m)?;
        let noise_n = KNOWN_TO_N.hypot(push.rate_n_per_s * INSTANT_NOISE_S);
        let scale = KNOWN_TO_N / noise_n;
        if scale * WORST_EVENT <= 1.0 {
            return None;
        }
        let leaves_at_n = self.leaves_at_n(event, &push, recorded.position.standing_m);
        let apart_n = push.at(R::from_f64(push.left_s)) - leaves_at_n;
        Some(limited(apart_n * R::from_f64(scale)))
    }

    /// The force at which the model leaves.
    fn leaves_at_n(&self, event: &Breakaway, push: &Push<R>, standing_m: f64) -> R {
        let bristle = self.carriage.bristle;
        let dwell = self
            .carriage
            .effects
            .map_or_else(DwellStiction::neutral, |effects| effects.dwell_stiction);
        let stood_s = R::from_f64(event.rest_s - event.history_s());
        let mut age = dwell.step(R::ZERO, R::ZERO, stood_s);
        let step_s = R::from_f64(STEP_S);
        let pushed_n = push.at(R::ZERO);
        let mut velocity = R::ZERO;
        let mut deflection = pushed_n / bristle.stiffness_n_per_m;
        let held_n = self.held(event, velocity, deflection, age).static_n;
        deflection = pushed_n.clamp(-held_n, held_n) / bristle.stiffness_n_per_m;
        let (mut way_m, mut way) = (Vec::with_capacity(MOST_STEPS), R::ZERO);
        for step in 0..MOST_STEPS {
            way_m.push(way);
            if way.value() > FIRST_WAY_M {
                break;
            }
            let at_s = R::from_f64((step as f64 + 0.5) * STEP_S);
            let out = bristle.step_with_mass(
                &self.held(event, velocity, deflection, age),
                self.mass_kg,
                velocity,
                deflection,
                push.at(at_s) - self.air_spring_n_per_m * way,
                step_s,
            );
            (velocity, deflection) = (out.velocity_m_per_s, out.deflection_m);
            age = dwell.step(age, velocity, step_s);
            way += step_s * velocity;
        }
        let at_s = instant_of_way(&way_m, standing_m);
        push.at(at_s.unwrap_or_else(|| R::from_f64(way_m.len() as f64 * STEP_S)))
    }

    /// The levels at a velocity and a deflection over the direction in which it leaves: before
    /// that it may have been pushed the other way, where friction is not the same.
    fn held(
        &self,
        event: &Breakaway,
        velocity_m_per_s: R,
        deflection_m: R,
        age: R,
    ) -> FrictionLevels<R> {
        let Some(effects) = &self.carriage.effects else {
            return self.levels;
        };
        let direction = R::from_f64(event.direction);
        let levels = effects.direction_friction.levels(
            self.levels,
            &self.carriage.bristle,
            direction * velocity_m_per_s,
            direction * deflection_m,
        );
        effects.dwell_stiction.levels(levels, age)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A residual that grows ever less towards [`MOST_TOLD_N`].
fn limited<R: Real>(residual: R) -> R {
    let ratio = residual / R::from_f64(MOST_TOLD_N);
    residual / (R::ONE + ratio * ratio).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::left_out::CarriageEffects;
    use model_core::paper;
    use model_core::real::Dual;

    /// Force at which a carriage leaves that is pushed from `start_n` ever harder.
    fn pushed_leaves_at_n<R: Real>(
        effects: CarriageEffects<R>,
        static_n: R,
        (start_n, rate_n_per_s): (f64, f64),
    ) -> R {
        let carriage = Carriage {
            effects: Some(effects),
            ..paper::axis::<R>().carriage
        };
        let stand = Stand {
            carriage: &carriage,
            mass_kg: carriage.mass_kg,
            levels: FrictionLevels {
                static_n,
                ..paper::friction_levels::<R>()
            },
            air_spring_n_per_m: R::from_f64(3e3),
        };
        let times = (0..400).map(|row| f64::from(row) * 1e-3);
        let push = Push {
            force_n: times
                .clone()
                .map(|time| R::from_f64(start_n + rate_n_per_s * time))
                .collect(),
            time_s: times.collect(),
            left_s: 0.2,
            rate_n_per_s,
        };
        let event = Breakaway {
            row: 200,
            at_s: 0.2,
            direction: 1.0,
            rest_s: 0.5,
        };
        stand.leaves_at_n(&event, &push, STANDING_M)
    }

    /// The same by static level, age and forgetting way.
    fn leaves_at_n<R: Real>([static_n, rise_n, way_m]: [R; 3], rate_n_per_s: f64) -> R {
        let mut effects = CarriageEffects::neutral();
        effects.dwell_stiction = DwellStiction {
            rise_n,
            time_constant_s: R::ONE,
            forgetting_way_m: way_m,
        };
        let start_n = 60.0 - 0.2 * rate_n_per_s;
        pushed_leaves_at_n(effects, static_n, (start_n, rate_n_per_s))
    }

    /// It stood under a force that one way would have moved it, and which its friction held the
    /// other way: followed with the friction of one way, it left 40 N late.
    #[test]
    fn regress_a_carriage_held_the_other_way_leaves_by_the_friction_of_its_way() {
        let mut effects = CarriageEffects::<f64>::neutral();
        effects.direction_friction.asymmetry = -0.4;
        let leaves_n = |start_n| pushed_leaves_at_n(effects, 45.0, (start_n, 500.0));
        let unloaded_n = leaves_n(0.0);
        for start_n in [-40.0, -60.0] {
            let loaded_n = leaves_n(start_n);
            println!("pushed from {start_n} N: {loaded_n:.2} N, from nought {unloaded_n:.2}");
            assert!((loaded_n - unloaded_n).abs() < 3.0);
        }
    }

    #[test]
    fn val_derivatives_of_a_break_away_are_its_differences() {
        for (rate, rise) in [(30.0, 15.0), (400.0, 0.0), (400.0, 10.0), (2000.0, 25.0)] {
            let at = [45.0, rise, 2e-4];
            let dual: [Dual<3>; 3] = std::array::from_fn(|i| Dual::parameter(at[i], i));
            let slopes = leaves_at_n(dual, rate).gradient;
            for (index, step) in [0.5, 0.5, 1e-5].into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut at = at;
                    at[index] += by;
                    leaves_at_n(at, rate)
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                println!(
                    "{rate} N/s, rise {rise}: {index} {:.4} {difference:.4}",
                    slopes[index]
                );
                let scale = [1.0, 1.0, 30.0 / 2e-4][index];
                assert!((slopes[index] - difference).abs() < 0.03 * scale);
            }
        }
    }

    const ROWS_PER_S: f64 = 1000.0;

    /// A carriage that gives way by so much over a second and a half, then leaves at 10 m/s2.
    fn leaves(gives_way_m: f64) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..1700).map(|row| f64::from(row) / ROWS_PER_S).collect();
        let place = |&time: &f64| {
            let gone_s = (time - 1.5).max(0.0);
            gives_way_m * (time / 1.5).min(1.0).powi(3) + 5.0 * gone_s * gone_s
        };
        let positions = times.iter().map(place).collect();
        (times, positions)
    }

    #[test]
    fn regress_a_bristle_that_gives_way_far_leaves_all_the_same() {
        // 50 N at 1 N/um.
        for gives_way_m in [0.0, 5e-5, 1.5e-4] {
            let (times, positions) = leaves(gives_way_m);
            let reading = PositionReading::new(&times, &positions, 5e-5);
            let events = breakaways(&times, &reading);
            assert_eq!(events.len(), 1, "{gives_way_m}: {events:?}");
            assert!((events[0].rest_s - 1.5).abs() < 0.02, "{events:?}");
        }
    }

    /// It slows down, nearly stops and goes on: nothing has broken away.
    #[test]
    fn regress_a_carriage_that_creeps_on_has_not_left() {
        let times: Vec<f64> = (0..400).map(|row| f64::from(row) / ROWS_PER_S).collect();
        let place = |&time: &f64| 20.0 * (time - 0.2).powi(3) + 2e-3 * (time - 0.2);
        let positions: Vec<f64> = times.iter().map(place).collect();
        let reading = PositionReading::new(&times, &positions, 0.0);
        assert_eq!(breakaways(&times, &reading), []);
    }
}
