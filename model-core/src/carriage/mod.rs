//! Motion of the carriage, (8).
//!
//! ```text
//! M x'' = pa Aa - pb Ab - p0 (Aa - Ab) - Ff - FL
//! ```
//!
//! Rodless, Aa = Ab: the ambient term vanishes. FL acts against +x. The velocity in the
//! middle of the step moves the position ([`crate::friction`]): second order, and under
//! the force of the predicted middle ([`crate::axis`]) the energy of the air spring
//! neither grows nor decays by the scheme.

mod effects;

pub use effects::CarriageEffects;

use crate::friction::{Acting, Bristle, FrictionLevels, FrictionStep};
use crate::left_out::{LoadCoupling, LoadState, Reaction};
use crate::math::Compensated;
use crate::real::Real;

/// Parameters of the carriage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carriage<R> {
    /// Moving mass, kg: all of it, a load behind a spring included.
    pub mass_kg: R,
    /// Constant load against +x, N.
    pub external_force_n: R,
    /// Piston area of chamber a, m2.
    pub area_a_m2: R,
    /// Piston area of chamber b, m2.
    pub area_b_m2: R,
    /// Ambient pressure, on the area of a rod if there is one, Pa.
    pub ambient_pressure_pa: R,
    /// The bristle of the friction law.
    pub bristle: Bristle<R>,
    /// Physics that the paper leaves out of the carriage's motion; `None`: none.
    pub effects: Option<CarriageEffects<R>>,
}

/// State of the carriage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriageState<R> {
    /// Position, m.
    pub position_m: Compensated<R>,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Bristle deflection, m.
    pub deflection_m: R,
    /// Mean friction force over the last step, N.
    pub friction_n: R,
    /// How far stiction has grown by standing, 0 to 1.
    pub contact_age: R,
    /// How far a force that trails behind the motion has come, -1 to 1.
    pub trail: R,
    /// The load behind its spring.
    pub load: LoadState<R>,
}

impl<R: Real> CarriageState<R> {
    /// A carriage with relaxed bristles that has just come to rest, its load
    /// in the middle of its play.
    pub fn new(position_m: R, velocity_m_per_s: R) -> Self {
        Self {
            position_m: Compensated::new(position_m),
            velocity_m_per_s,
            deflection_m: R::ZERO,
            friction_n: R::ZERO,
            contact_age: R::ZERO,
            trail: R::ZERO,
            load: LoadState::RIGID,
        }
    }

    /// Where the middle of a step of `dt_s` is if the velocity stays, m.
    #[inline]
    pub fn ahead_m(&self, dt_s: R) -> R {
        self.position_m.value + dt_s * R::from_f64(0.5) * self.velocity_m_per_s
    }
}

impl<R: Real> Carriage<R> {
    /// Force of the gas and the load on the carriage, without friction, N.
    #[inline]
    pub fn drive_n(&self, pressure_a_pa: R, pressure_b_pa: R) -> R {
        (pressure_a_pa - self.ambient_pressure_pa) * self.area_a_m2
            - (pressure_b_pa - self.ambient_pressure_pa) * self.area_b_m2
            - self.external_force_n
    }

    /// The force that no law explains, at a place and a velocity, against +x, N.
    #[inline]
    pub fn unknown_force_n(&self, position_m: R, velocity_m_per_s: R) -> R {
        match &self.effects {
            None => R::ZERO,
            Some(effects) => effects.unnamed_force_n(position_m, velocity_m_per_s),
        }
    }

    /// The force that trails behind the motion, against +x, N.
    #[inline]
    pub fn trailing_force_n(&self, state: &CarriageState<R>) -> R {
        match &self.effects {
            None => R::ZERO,
            Some(effects) => effects.force_equation.trailing_n * state.trail,
        }
    }

    /// One step under the levels and the drive force (see [`Self::drive_n`]) of its middle.
    #[inline]
    pub fn step(
        &self,
        state: &mut CarriageState<R>,
        levels: &FrictionLevels<R>,
        drive_n: R,
        dt_s: R,
    ) {
        self.advance(state, levels, drive_n, dt_s);
    }

    /// The step; returns the velocity in its middle, m/s.
    #[inline]
    fn advance(
        &self,
        state: &mut CarriageState<R>,
        levels: &FrictionLevels<R>,
        drive_n: R,
        dt_s: R,
    ) -> R {
        let out = match &self.effects {
            None => {
                let acting = Acting {
                    levels: *levels,
                    drive_n,
                };
                self.solve(state, |_, _| acting, self.mass_kg, dt_s)
            }
            Some(effects) => self.step_with(effects, state, levels, drive_n, dt_s),
        };
        state.velocity_m_per_s = out.velocity_m_per_s;
        state.deflection_m = out.deflection_m;
        state.friction_n = out.force_n;
        state.position_m.add(dt_s * out.middle_velocity_m_per_s);
        out.middle_velocity_m_per_s
    }

    /// The same with a seal that holds as one that has just come to rest. It ages all the
    /// same.
    #[inline]
    pub fn step_unaged(
        &self,
        state: &mut CarriageState<R>,
        levels: &FrictionLevels<R>,
        drive_n: R,
        dt_s: R,
    ) {
        let age = core::mem::replace(&mut state.contact_age, R::ZERO);
        let middle_m_per_s = self.advance(state, levels, drive_n, dt_s);
        if let Some(effects) = &self.effects {
            state.contact_age = effects.contact_age(age, middle_m_per_s, dt_s);
        }
    }

    /// The levels at this state: those given, changed by the carriage's effects.
    #[inline]
    pub fn levels(&self, state: &CarriageState<R>, levels: FrictionLevels<R>) -> FrictionLevels<R> {
        match &self.effects {
            None => levels,
            Some(effects) => effects.levels(levels, &self.bristle, state),
        }
    }

    /// The load, if there is one behind a spring, and the mass without it, kg.
    pub fn load(&self) -> (Option<LoadCoupling<R>>, R) {
        let declared = self.effects.as_ref().map(|effects| effects.load);
        match declared.filter(|load| !load.is_neutral()) {
            None => (None, self.mass_kg),
            Some(load) => {
                let load = load.within(self.mass_kg);
                (Some(load), self.mass_kg - load.load_mass_kg)
            }
        }
    }

    /// Velocity of the centre of mass of carriage and load, m/s.
    #[inline]
    pub fn common_velocity_m_per_s(&self, state: &CarriageState<R>) -> R {
        let (load, _) = self.load();
        let lag = load.map_or(R::ZERO, |load| {
            load.load_mass_kg / self.mass_kg * state.load.faster_m_per_s
        });
        state.velocity_m_per_s - lag
    }

    /// Friction and inertia together, for a mass and what acts on it.
    #[inline]
    fn solve(
        &self,
        state: &CarriageState<R>,
        acting: impl Fn(R, R) -> Acting<R>,
        mass_kg: R,
        dt_s: R,
    ) -> FrictionStep<R> {
        self.bristle.step_with_mass(
            acting,
            mass_kg,
            state.velocity_m_per_s,
            state.deflection_m,
            dt_s,
        )
    }

    fn step_with(
        &self,
        effects: &CarriageEffects<R>,
        state: &mut CarriageState<R>,
        levels: &FrictionLevels<R>,
        drive_n: R,
        dt_s: R,
    ) -> FrictionStep<R> {
        let before = *state;
        let half_s = dt_s * R::from_f64(0.5);
        let (position, velocity) = (before.position_m.value, before.velocity_m_per_s);
        let ahead_m = before.ahead_m(dt_s);
        let equation = &effects.force_equation;
        let acting = |velocity_m_per_s, deflection_m| {
            let middle = CarriageState {
                position_m: Compensated::new(ahead_m),
                velocity_m_per_s,
                deflection_m,
                contact_age: effects.contact_age(before.contact_age, velocity_m_per_s, half_s),
                ..before
            };
            let mut levels = effects.levels(*levels, &self.bristle, &middle);
            levels.viscous_n_s_per_m += equation.drag_n_s_per_m(velocity_m_per_s);
            Acting {
                levels,
                drive_n: drive_n
                    - effects.unknown_force.force_n(ahead_m, velocity_m_per_s)
                    - equation.of_place_n(ahead_m)
                    - equation.trailing_n * equation.trail(before.trail, half_s * velocity_m_per_s),
            }
        };
        let buffer = effects.elastic_buffer.reaction(position, velocity, dt_s);
        let (load, mass_kg) = self.load();
        let solve = |reaction: Reaction<R>| {
            let all = reaction.with(buffer);
            let acting = |velocity, deflection| {
                let body = acting(velocity, deflection);
                Acting {
                    drive_n: body.drive_n - all.force_n,
                    ..body
                }
            };
            self.solve(&before, acting, mass_kg + all.added_mass_kg, dt_s)
        };
        let out = match load {
            None => solve(Reaction::NONE),
            Some(load) => load.step(&mut state.load, velocity, dt_s, solve),
        };
        let middle_m_per_s = out.middle_velocity_m_per_s;
        state.contact_age = effects.contact_age(before.contact_age, middle_m_per_s, dt_s);
        state.trail = equation.trail(before.trail, dt_s * middle_m_per_s);
        out
    }
}
