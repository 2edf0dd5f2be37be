//! The axis: command path, valve, chambers and carriage together.
//!
//! One step: the command passes delay, slew limit and spool; the chambers are predicted
//! to the middle of the step with the carriage going on as it does; the carriage moves
//! under the pressures of there; the chambers follow its way through the whole step.
//! Second order, from the present state alone: a command that jumps needs no step to
//! be believed. Between chambers and carriage that is drift, kick and drift, which keeps
//! the energy of an air spring.
//! [`Pneumatics`] and [`CommandPath`] are also driven alone, by recorded
//! position and command: that cut is what makes a mismatch locatable.

use crate::carriage::{Carriage, CarriageState};
use crate::friction::FrictionLevels;
use crate::left_out::{
    DelayLine, FrictionTerms, SlewLimit, SpoolDynamics, SpoolState, SpoolTransition, ValveDelay,
    ValveHysteresis,
};
pub use crate::pneumatics::{Piston, PneumaticState, Pneumatics, ValveDrive};
use crate::real::Real;
use crate::valve::{GasState, Valve};

/// From the command to the spool's position, both in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandPath<R> {
    delay: ValveDelay<R>,
    hysteresis: ValveHysteresis<R>,
    /// None where there is no limit: most spools are as fast as they are asked to be.
    slew: Option<SlewLimit<R>>,
    spool: SpoolTransition<R>,
    spool_lag_s: R,
    dt_s: R,
}

/// State of the command path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandState<R> {
    line: DelayLine<R>,
    played: R,
    slewed: R,
    spool: SpoolState<R>,
}

impl<R: Real> CommandState<R> {
    /// A command that has stood since long ago.
    pub fn holding(command_v: R) -> Self {
        Self {
            line: DelayLine::holding(command_v),
            played: command_v,
            slewed: command_v,
            spool: SpoolState::at_rest(command_v),
        }
    }

    /// The command as far as the slew limit has let it come, V.
    #[inline]
    pub fn slewed_v(&self) -> R {
        self.slewed
    }
}

impl<R: Real> CommandPath<R> {
    /// A path for steps of `dt_s`.
    pub fn new(
        delay: ValveDelay<R>,
        hysteresis: ValveHysteresis<R>,
        slew: SlewLimit<R>,
        spool: &SpoolDynamics<R>,
        dt_s: R,
    ) -> Self {
        Self {
            delay,
            hysteresis,
            slew: (!slew.is_none()).then_some(slew),
            spool: spool.transition(dt_s),
            spool_lag_s: spool.lag_s(),
            dt_s,
        }
    }

    /// How far the spool is behind a command that goes in steps of this size, s.
    pub fn lag_s(&self, step_v: R) -> R {
        let slew_lag_s = self.slew.map_or(R::ZERO, |slew| slew.lag_s(step_v));
        self.delay.delay_s + slew_lag_s + self.spool_lag_s
    }

    /// How fast the spool can go at the most, if it is limited.
    #[inline]
    pub fn slew(&self) -> Option<SlewLimit<R>> {
        self.slew
    }

    /// The same path, with this spool where it has none.
    #[must_use]
    pub fn or_spool(self, spool: &SpoolDynamics<R>) -> Self {
        if self.spool.follows_at_once() {
            Self {
                spool: spool.transition(self.dt_s),
                spool_lag_s: spool.lag_s(),
                ..self
            }
        } else {
            self
        }
    }

    /// The spool's mean position over the step that begins with this command.
    #[inline]
    pub fn step(&self, state: &mut CommandState<R>, command_v: R) -> R {
        let delayed = self.delay.step(&mut state.line, command_v, self.dt_s);
        state.played = self.hysteresis.step(state.played, delayed);
        let (slewed, mean) = match &self.slew {
            Some(slew) => slew.step(state.slewed, state.played, self.dt_s),
            None => (state.played, state.played),
        };
        state.slewed = slewed;
        self.spool.step(&mut state.spool, mean)
    }
}

/// The whole axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis<R> {
    /// From command to spool.
    pub command_path: CommandPath<R>,
    /// The valve.
    pub valve: Valve<R>,
    /// The chambers.
    pub pneumatics: Pneumatics<R>,
    /// The carriage.
    pub carriage: Carriage<R>,
    /// Declared friction levels.
    pub friction: FrictionLevels<R>,
    /// Friction and load terms that the paper leaves out.
    pub friction_terms: FrictionTerms<R>,
    /// Temperature of the supplied gas, K.
    pub supply_temperature_k: R,
    /// Time step, s.
    pub dt_s: R,
}

/// State of the whole axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisState<R> {
    /// Command path.
    pub command: CommandState<R>,
    /// Chambers.
    pub pneumatics: PneumaticState<R>,
    /// Carriage.
    pub carriage: CarriageState<R>,
}

/// What drives the axis through one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisInputs<R> {
    /// Valve command, held over the step, V.
    pub command_v: R,
    /// Supply pressure, Pa absolute: at the valve, or at the regulator where the
    /// axis has a tank behind it.
    pub supply_pressure_pa: R,
}

impl<R: Real> AxisState<R> {
    /// At rest at a position, with these pressures and the gas at `temperature_k`.
    pub fn at_rest(
        position_m: R,
        pressure_a_pa: R,
        pressure_b_pa: R,
        temperature_k: R,
        command_v: R,
    ) -> Self {
        let gas = |pressure_pa| GasState {
            pressure_pa,
            temperature_k,
        };
        Self {
            command: CommandState::holding(command_v),
            pneumatics: PneumaticState::at_rest(gas(pressure_a_pa), gas(pressure_b_pa)),
            carriage: CarriageState::new(position_m, R::ZERO),
        }
    }

    /// Whether no state has become infinite or NaN.
    pub fn is_finite(&self) -> bool {
        [
            self.pneumatics.a.pressure_pa.value,
            self.pneumatics.a.temperature_k.value,
            self.pneumatics.b.pressure_pa.value,
            self.pneumatics.b.temperature_k.value,
            self.carriage.position_m.value,
            self.carriage.velocity_m_per_s,
            self.carriage.deflection_m,
        ]
        .into_iter()
        .all(R::is_finite)
    }
}

impl<R: Real> Axis<R> {
    /// One step.
    #[inline]
    pub fn step(&self, state: &mut AxisState<R>, inputs: &AxisInputs<R>) {
        let spool_v = self.command_path.step(&mut state.command, inputs.command_v);
        let drive = ValveDrive {
            areas: self.valve.areas(spool_v),
            supply: GasState {
                pressure_pa: inputs.supply_pressure_pa,
                temperature_k: self.supply_temperature_k,
            },
        };
        let carriage = &mut state.carriage;
        let piston = Piston {
            from_m: carriage.position_m.value,
            middle_m: carriage.ahead_m(self.dt_s),
            end_m: |pressure_a_pa, pressure_b_pa| {
                self.step_carriage(carriage, pressure_a_pa, pressure_b_pa);
                carriage.position_m.value
            },
        };
        self.pneumatics.step_driven_behind_regulator(
            &mut state.pneumatics,
            &drive,
            piston,
            self.dt_s,
        );
    }

    /// The carriage alone, under given pressures: those of the middle of the step.
    #[inline]
    pub fn step_carriage(&self, state: &mut CarriageState<R>, pressure_a_pa: R, pressure_b_pa: R) {
        let ambient = self.carriage.ambient_pressure_pa;
        let levels = self.friction_terms.levels(
            &self.friction,
            pressure_a_pa - ambient,
            pressure_b_pa - ambient,
        );
        let drive = self.carriage.drive_n(pressure_a_pa, pressure_b_pa)
            - self.friction_terms.constant_force_n;
        self.carriage.step(state, &levels, drive, self.dt_s);
    }
}
