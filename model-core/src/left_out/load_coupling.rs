//! `load-compliance` and `load-backlash`: part of the moving mass hangs behind
//! a spring with a damper, with or without play.
//!
//! ```text
//! r = x1 - x2,   w = v1 - v2                        carriage less load
//! F = k dz(r) + d w    while they touch, never a pull; dz: dead zone of gap/2
//! M1 v1' = ... - F,    M2 v2' = F,    M1 = M - M2
//! ```
//!
//! The declared mass M is all that moves: an engineer weighs carriage and load
//! together, and so does a slow or rigid motion. Without play the spring pulls
//! as well as it pushes. The gap is the whole play: twice what is meant by +- d.
//!
//! Source: bolted and belted payloads, 1e5-1e6 N/m (30-120 Hz); play 20-200 um,
//! in worn couplings 1 mm. It matters from a deflection M2 a/k of some 10 um or
//! a play over the bristle's 20-30 um. Compliance is confused with the
//! bristle's own resonance (108 Hz at 2 kg) and with a lag of the position
//! sensor: it stays while sliding, and a payload shifts it. Play is confused
//! with stiction and hysteresis: at a reversal the acceleration steps as M1
//! alone moves, at the same gap for every acceleration.
//!
//! # Scheme
//! Trapezoidal in r and w, linear in the carriage's change of velocity D:
//! F = a + b D. To the carriage that is a force a and an added mass b dt, which
//! goes into the closed-form friction step as it is; b dt tends to M2 for a
//! stiff spring. While they touch, spring and masses keep their energy exactly.
//! In a step in which contact is made the spring's force is that of its end,
//! and one in which it is lost does not pull: both take energy, of second order
//! in w dt, none gives any. Stable at every stiffness and step.

use crate::friction::FrictionStep;
use crate::real::Real;

/// The share of the load in the moving mass is at most this.
const MOST_SHARE: f64 = 0.95;

/// Parameters; a mass or a stiffness of 0 is neutral: the load is rigid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadCoupling<R> {
    /// M2 in kg, part of the carriage's declared mass.
    pub load_mass_kg: R,
    /// k in N/m.
    pub stiffness_n_per_m: R,
    /// d in N s/m.
    pub damping_n_s_per_m: R,
    /// Total play, m.
    pub gap_m: R,
}

/// The load as seen from the carriage: small numbers, for `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadState<R> {
    /// r, how far the carriage is ahead of the load, m.
    pub ahead_m: R,
    /// w, how much faster it is, m/s.
    pub faster_m_per_s: R,
}

impl<R: Real> LoadState<R> {
    /// In the middle of the play and moving with the carriage.
    pub const RIGID: Self = Self {
        ahead_m: R::ZERO,
        faster_m_per_s: R::ZERO,
    };
}

/// A force against +x that is linear in the change of velocity over a step:
/// `force_n` + `added_mass_kg` times the change, per step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction<R> {
    /// Mean force over the step if the velocity does not change, N.
    pub force_n: R,
    /// Its slope by the change of velocity, times the step, kg.
    pub added_mass_kg: R,
}

impl<R: Real> Reaction<R> {
    /// Nothing.
    pub const NONE: Self = Self {
        force_n: R::ZERO,
        added_mass_kg: R::ZERO,
    };

    /// Both together.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self {
            force_n: self.force_n + other.force_n,
            added_mass_kg: self.added_mass_kg + other.added_mass_kg,
        }
    }
}

impl<R: Real> LoadCoupling<R> {
    /// The load is part of the carriage.
    pub const NEUTRAL: Self = Self {
        load_mass_kg: R::ZERO,
        stiffness_n_per_m: R::ZERO,
        damping_n_s_per_m: R::ZERO,
        gap_m: R::ZERO,
    };

    /// Whether the load is part of the carriage.
    #[inline]
    pub fn is_neutral(&self) -> bool {
        self.load_mass_kg == R::ZERO || self.stiffness_n_per_m == R::ZERO
    }

    /// This load, no more than most of a moving mass.
    #[must_use]
    pub fn within(self, moving_mass_kg: R) -> Self {
        let most = moving_mass_kg * R::from_f64(MOST_SHARE);
        Self {
            load_mass_kg: self.load_mass_kg.min(most),
            ..self
        }
    }

    /// One step of load and carriage. `solve` gives the carriage's step under
    /// a reaction; it is asked once in contact or in the play, twice or three
    /// times where that changes.
    #[inline]
    pub fn step(
        &self,
        state: &mut LoadState<R>,
        velocity_m_per_s: R,
        dt_s: R,
        solve: impl Fn(Reaction<R>) -> FrictionStep<R>,
    ) -> FrictionStep<R> {
        let before = *state;
        let attempt = |reaction: Reaction<R>| {
            let out = solve(reaction);
            let change = out.velocity_m_per_s - velocity_m_per_s;
            let force = reaction.force_n + reaction.added_mass_kg * change / dt_s;
            (out, force, self.moved(&before, force, change, dt_s))
        };
        let touching = self.side(before.ahead_m);
        if let Some(side) = touching {
            let half = R::from_f64(0.5);
            let (out, force, next) = attempt(self.contact(&before, side, half, dt_s));
            if self.is_without_play() || force * side >= R::ZERO {
                *state = next;
                return out;
            }
        }
        let (mut out, _, mut next) = attempt(Reaction::NONE);
        let reached = self.side(next.ahead_m);
        if let Some(side) = reached.filter(|_| reached != touching) {
            (out, _, next) = attempt(self.contact(&before, side, R::ONE, dt_s));
        }
        *state = next;
        out
    }

    /// One step behind a carriage whose motion is given; returns the mean force
    /// that the load takes from it, N.
    pub fn follow(&self, state: &mut LoadState<R>, from_m_per_s: R, to_m_per_s: R, dt_s: R) -> R {
        let before = *state;
        self.step(state, from_m_per_s, dt_s, |_| FrictionStep {
            middle_velocity_m_per_s: (from_m_per_s + to_m_per_s) * R::from_f64(0.5),
            velocity_m_per_s: to_m_per_s,
            deflection_m: R::ZERO,
            force_n: R::ZERO,
        });
        let change = to_m_per_s - from_m_per_s - (state.faster_m_per_s - before.faster_m_per_s);
        self.load_mass_kg * change / dt_s
    }

    fn is_without_play(&self) -> bool {
        self.gap_m <= R::ZERO
    }

    /// On which side they touch: 1 where the carriage pushes towards +x.
    fn side(&self, ahead_m: R) -> Option<R> {
        let touches = self.is_without_play() || ahead_m.abs() > self.gap_m * R::from_f64(0.5);
        let sign = if ahead_m < R::ZERO { -R::ONE } else { R::ONE };
        touches.then_some(sign)
    }

    /// Contact through the step, the spring's force being that of the moment
    /// `when` of it: 1/2 for its mean, 1 for its end.
    fn contact(&self, state: &LoadState<R>, side: R, when: R, dt_s: R) -> Reaction<R> {
        let half = R::from_f64(0.5);
        let resistance = self.stiffness_n_per_m * when * dt_s + self.damping_n_s_per_m;
        let yielding = R::ONE + half * resistance * dt_s / self.load_mass_kg;
        let pressed = state.ahead_m - side * half * self.gap_m;
        let force = self.stiffness_n_per_m * pressed + resistance * state.faster_m_per_s;
        Reaction {
            force_n: force / yielding,
            added_mass_kg: half * resistance * dt_s / yielding,
        }
    }

    /// The load after a step under a mean force.
    fn moved(&self, state: &LoadState<R>, force_n: R, change: R, dt_s: R) -> LoadState<R> {
        let faster = state.faster_m_per_s + change - dt_s * force_n / self.load_mass_kg;
        let mean = (state.faster_m_per_s + faster) * R::from_f64(0.5);
        LoadState {
            ahead_m: state.ahead_m + dt_s * mean,
            faster_m_per_s: faster,
        }
    }
}
