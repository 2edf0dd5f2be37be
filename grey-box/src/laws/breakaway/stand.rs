//! The model of a carriage that stands, and by how much less force it leaves when the carriage did.

use super::events::{Breakaway, FIRST_WAY_M, instant};
use super::push::{KNOWN_TO_N, Push, Recorded};
use model_core::carriage::Carriage;
use model_core::friction::{Acting, FrictionLevels};
use model_core::left_out::DwellStiction;
use model_core::real::Real;

/// How well the instant at which a carriage leaves is found, s.
const INSTANT_NOISE_S: f64 = 1e-3;
/// A break-away that is off by more than this says no more than that, N: it may
/// have been none.
const MOST_TOLD_N: f64 = 12.0;
/// Events that are worse than this many times that are left out.
const WORST_EVENT: f64 = 4.0;
/// The most by which the force is changed for the model to leave when the carriage did, N ...
const MOST_MISSING_N: f64 = 128.0;
/// ... after the first look by no more than this (twice as much after every further one) ...
const FIRST_REACH_N: f64 = 4.0;
/// ... and no less than this, for the second to tell how the instant moves with the force ...
const FIRST_STEP_N: f64 = 0.1;
/// ... until it would change by less than this.
const LAST_STEP_N: f64 = 3e-3;
/// After so many looks along the line through the last two (four or five do, but where the force
/// waves and the instant leaps) it is found by halves ...
const LOOKS_ALONG_LINES: usize = 8;
/// ... in so many looks at the most.
const MOST_LOOKS: usize = 30;
/// How the instant moves with the force is told by this much more and less, N: that goes by little
/// stairs (a carriage that creeps, over a force that is known by row), and the derivatives that it
/// is set against are those of one of them.
const EITHER_WAY_N: f64 = 1e-4;
/// Step of the model, s: a quarter of it changes the force of three carriages by 0.02 to 0.05 N.
const STEP_S: f64 = 4e-4;
/// The most of them: the history, and a force that grows by more than is told.
const MOST_STEPS: usize = 1500;

/// The model of a carriage that stands.
pub struct Stand<'a, R> {
    pub carriage: &'a Carriage<R>,
    /// Without a load behind a spring, unless that is in its play and taken as rigid.
    pub mass_kg: R,
    /// Of a new seal where it stands, whichever way it is pushed.
    pub levels: FrictionLevels<R>,
    /// How stiffly the gas holds the piston.
    pub air_spring_n_per_m: R,
}

/// With so much more force, N, the model leaves so much later than the carriage, s.
#[derive(Clone, Copy)]
struct Late {
    more_n: f64,
    by_s: f64,
}

impl Late {
    fn is_late(self) -> bool {
        self.by_s > 0.0
    }

    /// How much earlier it leaves by a newton more, s/N, from one to another that is told from it.
    fn slope(self, other: Self) -> Option<f64> {
        let slope = (self.by_s - other.by_s) / (self.more_n - other.more_n);
        (slope < 0.0 && slope.is_finite()).then_some(slope)
    }
}

/// Between which of the forces that were tried the one lies that is looked for, N more.
struct Between {
    late_n: f64,
    early_n: f64,
}

impl Between {
    /// Before any was tried.
    const OPEN: Self = Self {
        late_n: f64::NEG_INFINITY,
        early_n: f64::INFINITY,
    };

    fn narrow(&mut self, tried: Late) {
        if tried.is_late() {
            self.late_n = self.late_n.max(tried.more_n);
        } else {
            self.early_n = self.early_n.min(tried.more_n);
        }
    }

    fn contains(&self, more_n: f64) -> bool {
        self.late_n < more_n && more_n < self.early_n
    }

    /// Halfway, once there are two.
    fn middle_n(&self) -> Option<f64> {
        let middle_n = 0.5 * (self.late_n + self.early_n);
        middle_n.is_finite().then_some(middle_n)
    }
}

impl Stand<'_, f64> {
    /// By how much less force the model leaves when the carriage did: looked for from where the
    /// force at that instant is the static level's, along the line through the last two looks.
    fn missing_n(&self, event: &Breakaway, push: &Push<f64>, standing_m: f64) -> f64 {
        let late = |more_n: f64| self.late(event, push, more_n, standing_m);
        let mut last = late(self.held_at_rest_n(event) - push.at(push.left_s));
        let mut slope = None;
        let mut between = Between::OPEN;
        let mut reach_n = FIRST_REACH_N;
        for look in 0..MOST_LOOKS {
            between.narrow(last);
            let step_n = slope.map_or_else(
                || first_step_n(last.by_s * push.growth_n_per_s()),
                |slope: f64| -last.by_s / slope,
            );
            let along_n = last.more_n + step_n.clamp(-reach_n, reach_n);
            let is_along = look < LOOKS_ALONG_LINES && between.contains(along_n);
            let middle_n = between.middle_n().filter(|_| !is_along);
            let next_n = middle_n.unwrap_or(along_n);
            if (next_n - last.more_n).abs() < LAST_STEP_N {
                return -next_n;
            }
            if next_n.abs() > MOST_MISSING_N {
                break;
            }
            let next = late(next_n);
            slope = next.slope(last).or(slope);
            reach_n *= 2.0;
            last = next;
        }
        // What no such force was found for says no more than that, and by which sign.
        MOST_MISSING_N.copysign(if last.is_late() { -1.0 } else { 1.0 })
    }

    /// How much earlier it leaves by a newton more, s/N; without bound where it leaps.
    fn instant_s_per_n(
        &self,
        event: &Breakaway,
        push: &Push<f64>,
        more_n: f64,
        standing_m: f64,
    ) -> f64 {
        let late = |more_n: f64| self.late(event, push, more_n, standing_m);
        let [less, more] = [-EITHER_WAY_N, EITHER_WAY_N].map(|by_n| late(more_n + by_n));
        more.slope(less).unwrap_or(f64::NEG_INFINITY)
    }

    fn late(&self, event: &Breakaway, push: &Push<f64>, more_n: f64, standing_m: f64) -> Late {
        let at_s = self.leaves_at_s(event, push, more_n, standing_m);
        let by_s = at_s.map_or(f64::INFINITY, |at_s| at_s - push.left_s);
        Late { more_n, by_s }
    }
}

/// A first step of at least [`FIRST_STEP_N`].
fn first_step_n(step_n: f64) -> f64 {
    step_n.abs().max(FIRST_STEP_N).copysign(step_n)
}

impl<R: Real> Stand<'_, R> {
    /// By how much less force than was recorded the model leaves when the carriage did, N, scaled
    /// to events of a slow rise; `still` is the same without derivatives. None where the event
    /// says too little.
    pub fn residual(
        &self,
        still: &Stand<'_, f64>,
        event: &Breakaway,
        recorded: &Recorded<'_, R>,
    ) -> Option<R> {
        let push = Push::of(event, recorded, self.air_spring_n_per_m)?;
        let noise_n = KNOWN_TO_N.hypot(push.rate_n_per_s * INSTANT_NOISE_S);
        let scale = KNOWN_TO_N / noise_n;
        if scale * WORST_EVENT <= 1.0 {
            return None;
        }
        let missing_n = self.missing(still, event, &push, recorded.position.standing_m);
        Some(limited(missing_n * R::from_f64(scale)))
    }

    /// The same without derivatives, of a carriage without them.
    pub fn still<'c>(&self, carriage: &'c Carriage<f64>) -> Stand<'c, f64> {
        Stand {
            carriage,
            mass_kg: self.mass_kg.value(),
            levels: FrictionLevels {
                coulomb_n: self.levels.coulomb_n.value(),
                static_n: self.levels.static_n.value(),
                viscous_n_s_per_m: self.levels.viscous_n_s_per_m.value(),
            },
            air_spring_n_per_m: self.air_spring_n_per_m.value(),
        }
    }

    /// The force found without derivatives, with those that it has as the instant is to stay.
    fn missing(
        &self,
        still: &Stand<'_, f64>,
        event: &Breakaway,
        push: &Push<R>,
        standing_m: f64,
    ) -> R {
        let still_push = push.still();
        let still_n = still.missing_n(event, &still_push, standing_m);
        let force_n = R::from_f64(still_n);
        if !R::HAS_DERIVATIVES {
            return force_n;
        }
        let Some(at_s) = self.leaves_at_s(event, push, -force_n, standing_m) else {
            return force_n;
        };
        let moved_s = at_s - R::from_f64(at_s.value());
        let slope = still.instant_s_per_n(event, &still_push, -still_n, standing_m);
        force_n + moved_s / R::from_f64(slope)
    }

    /// When the model leaves that is pushed with so much more force, s since the first row; none
    /// where it does not.
    fn leaves_at_s(
        &self,
        event: &Breakaway,
        push: &Push<R>,
        more_n: R,
        standing_m: f64,
    ) -> Option<R> {
        let (bristle, dwell) = (self.carriage.bristle, self.dwell());
        let stood_s = R::from_f64(event.rest_s - event.history_s());
        let mut age = dwell.step(R::ZERO, R::ZERO, stood_s);
        let step_s = R::from_f64(STEP_S);
        let pushed_n = push.at(R::ZERO) + more_n;
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
            let ahead_m = way + step_s * R::from_f64(0.5) * velocity;
            let drive_n = push.at(at_s) + more_n - self.air_spring_n_per_m * ahead_m;
            let acting = |velocity, deflection| Acting {
                levels: self.held(event, velocity, deflection, age),
                drive_n,
            };
            let out = bristle.step_with_mass(acting, self.mass_kg, velocity, deflection, step_s);
            (velocity, deflection) = (out.velocity_m_per_s, out.deflection_m);
            let middle = out.middle_velocity_m_per_s;
            age = dwell.step(age, middle, step_s);
            way += step_s * middle;
        }
        instant_of_way(&way_m, standing_m)
    }

    /// How the level grows at rest.
    fn dwell(&self) -> DwellStiction<R> {
        let effects = &self.carriage.effects;
        effects.map_or_else(DwellStiction::neutral, |effects| effects.dwell_stiction)
    }

    /// The static level of a bristle that is bent the way it leaves, after the whole rest, N.
    fn held_at_rest_n(&self, event: &Breakaway) -> R {
        let age = self
            .dwell()
            .step(R::ZERO, R::ZERO, R::from_f64(event.rest_s));
        let deflection = self.levels.static_n / self.carriage.bristle.stiffness_n_per_m;
        self.held(event, R::ZERO, deflection, age).static_n
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

/// A residual that grows ever less towards [`MOST_TOLD_N`].
fn limited<R: Real>(residual: R) -> R {
    let ratio = residual / R::from_f64(MOST_TOLD_N);
    residual / (R::ONE + ratio * ratio).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::events::STANDING_M;
    use super::*;
    use model_core::carriage::CarriageEffects;
    use model_core::paper;
    use model_core::real::Dual;

    const LEFT_S: f64 = 0.2;

    fn carriage<R: Real>(effects: CarriageEffects<R>) -> Carriage<R> {
        Carriage {
            effects: Some(effects),
            ..paper::axis::<R>().carriage
        }
    }

    fn stand<R: Real>(carriage: &Carriage<R>, static_n: R) -> Stand<'_, R> {
        Stand {
            carriage,
            mass_kg: carriage.mass_kg,
            levels: FrictionLevels {
                static_n,
                ..paper::friction_levels::<R>()
            },
            air_spring_n_per_m: R::from_f64(3e3),
        }
    }

    const EVENT: Breakaway = Breakaway {
        row: 200,
        at_s: LEFT_S,
        direction: 1.0,
        rest_s: 0.5,
    };

    /// A push that is this at each millisecond.
    fn push<R: Real>(rate_n_per_s: f64, force_n: impl Fn(f64) -> f64) -> Push<R> {
        let time_s: Vec<f64> = (0..400).map(|row| f64::from(row) * 1e-3).collect();
        Push {
            force_n: time_s.iter().map(|&at| R::from_f64(force_n(at))).collect(),
            time_s,
            left_s: LEFT_S,
            rate_n_per_s,
        }
    }

    /// Force at [`LEFT_S`] under which a carriage leaves then that is pushed ever harder.
    fn leaves_under_n<R: Real>(
        stand: &Stand<'_, R>,
        still: &Stand<'_, f64>,
        (start_n, rate_n_per_s): (f64, f64),
    ) -> R {
        let push_n = |time: f64| start_n + rate_n_per_s * time;
        let push = push(rate_n_per_s, push_n);
        R::from_f64(push_n(LEFT_S)) - stand.missing(still, &EVENT, &push, STANDING_M)
    }

    /// The effects of a seal that ages, by static level, rise and forgetting way.
    fn ageing<R: Real>([_, rise_n, forgetting_way_m]: [R; 3]) -> CarriageEffects<R> {
        let mut effects = CarriageEffects::neutral();
        effects.dwell_stiction = DwellStiction {
            rise_n,
            time_constant_s: R::ONE,
            forgetting_way_m,
        };
        effects
    }

    /// The same by these.
    fn aged_leaves_under_n<R: Real>(at: [R; 3], push: (f64, f64)) -> R {
        let values = at.map(|number| number.value());
        let (carriage, still) = (carriage(ageing(at)), carriage(ageing(values)));
        leaves_under_n(&stand(&carriage, at[0]), &stand(&still, values[0]), push)
    }

    /// It stood under a force that one way would have moved it, and which its friction held the
    /// other way: followed with the friction of one way, it left 40 N late.
    #[test]
    fn regress_a_carriage_held_the_other_way_leaves_by_the_friction_of_its_way() {
        let mut effects = CarriageEffects::<f64>::neutral();
        effects.direction_friction.asymmetry = -0.4;
        let carriage = carriage(effects);
        let stand = stand(&carriage, 45.0);
        let leaves_n = |start_n| leaves_under_n(&stand, &stand, (start_n, 500.0));
        let unloaded_n = leaves_n(0.0);
        for start_n in [-40.0, -60.0] {
            let loaded_n = leaves_n(start_n);
            println!("pushed from {start_n} N: {loaded_n:.2} N, from nought {unloaded_n:.2}");
            assert!((loaded_n - unloaded_n).abs() < 3.0);
        }
    }

    /// Forces that wave as they rise, on carriages that hold less or as much.
    #[test]
    fn prop_with_the_missing_force_less_it_leaves_when_the_carriage_did() {
        let carriage = carriage(CarriageEffects::neutral());
        for (rate, wave_n) in [(30.0, 0.02), (100.0, 0.1), (400.0, 0.5), (2000.0, 2.0)] {
            let rises_n = |at_s: f64| 60.0 + rate * (at_s - LEFT_S);
            let push = push(rate, |at_s| rises_n(at_s) + wave_n * (700.0 * at_s).sin());
            for static_n in [40.0, 50.0, 60.0] {
                let stand = stand(&carriage, static_n);
                let force_n = stand.missing_n(&EVENT, &push, STANDING_M);
                let at_s = |less_n: f64| {
                    let at_s = stand.leaves_at_s(&EVENT, &push, -less_n, STANDING_M);
                    at_s.unwrap_or(f64::INFINITY)
                };
                // A wave may hold it back until its next crest, from one force to the next.
                let (before, after) = (at_s(force_n - 0.02), at_s(force_n + 0.02));
                println!("{rate} N/s, {static_n} N: {force_n:.3}, {before:.4} to {after:.4} s");
                assert!(before <= LEFT_S && after >= LEFT_S);
            }
        }
    }

    #[test]
    fn val_derivatives_of_a_break_away_are_its_differences() {
        for (rate, rise) in [(30.0, 15.0), (400.0, 0.0), (400.0, 10.0), (2000.0, 25.0)] {
            let at = [45.0, rise, 2e-4];
            let dual: [Dual<3>; 3] = std::array::from_fn(|i| Dual::parameter(at[i], i));
            let push = (60.0 - LEFT_S * rate, rate);
            let slopes = aged_leaves_under_n(dual, push).gradient;
            for (index, step) in [0.5, 0.5, 1e-5].into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut at = at;
                    at[index] += by;
                    aged_leaves_under_n(at, push)
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
}
