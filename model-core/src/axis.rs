//! The axis: command path, valve, chambers and carriage together.
//!
//! One step: the command passes delay, slew limit and spool; the carriage moves
//! under the present pressures; the chambers follow its way through the step.
//! [`Pneumatics`] and [`CommandPath`] are also driven alone, by recorded
//! position and command: that cut is what makes a mismatch locatable.

use crate::carriage::{Carriage, CarriageState};
use crate::chamber::{Chamber, ChamberFlow, ChamberState};
use crate::friction::FrictionLevels;
use crate::gas::Gas;
use crate::left_out::{
    ChamberLeakage, DelayLine, FrictionTerms, SlewLimit, SpoolDynamics, SpoolState,
    SpoolTransition, TubeLine, TubeState, ValveDelay, ValveHysteresis,
};
use crate::real::Real;
use crate::valve::{FlowLaw, GasState, PathAreas, Valve};

/// From the command to the spool's position, both in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandPath<R> {
    delay: ValveDelay<R>,
    hysteresis: ValveHysteresis<R>,
    slew: SlewLimit<R>,
    spool: SpoolTransition<R>,
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
            slew,
            spool: spool.transition(dt_s),
            dt_s,
        }
    }

    /// The same path, with this spool where it has none.
    #[must_use]
    pub fn or_spool(self, spool: &SpoolDynamics<R>) -> Self {
        if self.spool.follows_at_once() {
            Self {
                spool: spool.transition(self.dt_s),
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
        state.slewed = self.slew.step(state.slewed, state.played, self.dt_s);
        self.spool.step(&mut state.spool, state.slewed)
    }
}

/// Both chambers with what lies between them and the valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pneumatics<R> {
    /// The gas.
    pub gas: Gas<R>,
    /// Flow law of every orifice.
    pub law: FlowLaw<R>,
    /// The surroundings.
    pub ambient: GasState<R>,
    /// Chamber a, which +x enlarges.
    pub chamber_a: Chamber<R>,
    /// Chamber b.
    pub chamber_b: Chamber<R>,
    /// Leak of chamber a.
    pub leak_a: ChamberLeakage<R>,
    /// Leak of chamber b.
    pub leak_b: ChamberLeakage<R>,
    /// Tube between each port and its chamber (two of a kind).
    pub tube: TubeLine<R>,
}

/// State of both chambers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PneumaticState<R> {
    /// Chamber a.
    pub a: ChamberState<R>,
    /// Chamber b.
    pub b: ChamberState<R>,
    /// Tube to chamber a.
    pub tube_a: TubeState<R>,
    /// Tube to chamber b.
    pub tube_b: TubeState<R>,
}

impl<R: Real> PneumaticState<R> {
    /// Gas at rest in tubes and chambers.
    pub fn at_rest(a: GasState<R>, b: GasState<R>) -> Self {
        Self {
            a: ChamberState::new(a.pressure_pa, a.temperature_k),
            b: ChamberState::new(b.pressure_pa, b.temperature_k),
            tube_a: TubeState::at_rest(a.pressure_pa),
            tube_b: TubeState::at_rest(b.pressure_pa),
        }
    }
}

/// The valve as the chambers see it through one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveDrive<R> {
    /// Areas of the four paths.
    pub areas: PathAreas<R>,
    /// The supplied gas.
    pub supply: GasState<R>,
}

/// The two paths that end at one port.
#[derive(Clone, Copy)]
struct PortPaths<R> {
    supply_area_m2: R,
    exhaust_area_m2: R,
    supply: GasState<R>,
}

impl<R: Real> Pneumatics<R> {
    /// One step with the piston moving from `from_m` to `to_m`; without a valve
    /// the chambers are closed.
    #[inline]
    pub fn step(
        &self,
        state: &mut PneumaticState<R>,
        valve: Option<&ValveDrive<R>>,
        from_m: R,
        to_m: R,
        dt_s: R,
    ) {
        let paths_a = valve.map(|drive| PortPaths {
            supply_area_m2: drive.areas.supply_a_m2,
            exhaust_area_m2: drive.areas.exhaust_a_m2,
            supply: drive.supply,
        });
        let paths_b = valve.map(|drive| PortPaths {
            supply_area_m2: drive.areas.supply_b_m2,
            exhaust_area_m2: drive.areas.exhaust_b_m2,
            supply: drive.supply,
        });
        let way = (from_m, to_m);
        let side_a = (&self.chamber_a, &self.leak_a);
        let side_b = (&self.chamber_b, &self.leak_b);
        self.step_side(
            side_a,
            (&mut state.a, &mut state.tube_a),
            paths_a,
            way,
            dt_s,
        );
        self.step_side(
            side_b,
            (&mut state.b, &mut state.tube_b),
            paths_b,
            way,
            dt_s,
        );
    }

    fn step_side(
        &self,
        (chamber, leak): (&Chamber<R>, &ChamberLeakage<R>),
        (state, tube): (&mut ChamberState<R>, &mut TubeState<R>),
        paths: Option<PortPaths<R>>,
        way_m: (R, R),
        dt_s: R,
    ) {
        let stroke = chamber.stroke(way_m.0, way_m.1);
        match paths {
            None => {
                let flow = |gas| ChamberFlow::NONE.with_leak(self, leak, gas);
                chamber.step(state, &stroke, flow, dt_s);
            }
            Some(paths) if self.tube.is_present() => {
                let line = self.step_tube(chamber, state, tube, &paths, way_m.1, dt_s);
                let flow = |gas| line.with_leak(self, leak, gas);
                chamber.step(state, &stroke, flow, dt_s);
            }
            Some(paths) => {
                let flow = |gas| self.port_flow(&paths, gas).with_leak(self, leak, gas);
                chamber.step(state, &stroke, flow, dt_s);
            }
        }
    }

    /// Steps the tube and returns the flow from it into the chamber.
    fn step_tube(
        &self,
        chamber: &Chamber<R>,
        state: &ChamberState<R>,
        tube: &mut TubeState<R>,
        paths: &PortPaths<R>,
        position_m: R,
        dt_s: R,
    ) -> ChamberFlow<R> {
        let wall_k = chamber.wall_temperature_k;
        let node = GasState {
            pressure_pa: tube.pressure_pa,
            temperature_k: wall_k,
        };
        let valve = self.port_flow(paths, node);
        let gas = state.gas_state();
        let per_kg =
            self.gas.heat_capacity_ratio * self.gas.gas_constant_j_per_kg_k * gas.temperature_k
                / chamber.geometry.volume_m3(position_m);
        self.tube.step(
            tube,
            &self.gas,
            wall_k,
            (valve.mass_kg_per_s, valve.mass_slope),
            (gas.pressure_pa, per_kg),
            dt_s,
        );
        ChamberFlow::NONE.with(tube.mass_flow_kg_per_s, R::ZERO, wall_k, gas.temperature_k)
    }

    /// Flow through the valve's two paths into a volume with this gas.
    #[inline]
    fn port_flow(&self, paths: &PortPaths<R>, gas: GasState<R>) -> ChamberFlow<R> {
        let filling = self.law.flow(paths.supply_area_m2, paths.supply, gas);
        let emptying = self.law.flow(paths.exhaust_area_m2, gas, self.ambient);
        ChamberFlow::NONE
            .with(
                filling.mass_flow_kg_per_s,
                filling.slope_2_kg_per_s_pa,
                paths.supply.temperature_k,
                gas.temperature_k,
            )
            .with(
                -emptying.mass_flow_kg_per_s,
                -emptying.slope_1_kg_per_s_pa,
                self.ambient.temperature_k,
                gas.temperature_k,
            )
    }
}

impl<R: Real> ChamberFlow<R> {
    /// Adds a chamber's leak to the surroundings.
    #[inline]
    fn with_leak(
        self,
        pneumatics: &Pneumatics<R>,
        leak: &ChamberLeakage<R>,
        gas: GasState<R>,
    ) -> Self {
        let (out, slope) = leak.outflow(&pneumatics.law, gas, pneumatics.ambient);
        self.with(
            -out,
            -slope,
            pneumatics.ambient.temperature_k,
            gas.temperature_k,
        )
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
    /// Supply pressure, Pa absolute.
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
        let from_m = state.carriage.position_m.value;
        let (a, b) = (
            state.pneumatics.a.pressure_pa.value,
            state.pneumatics.b.pressure_pa.value,
        );
        self.step_carriage(&mut state.carriage, a, b);
        let drive = ValveDrive {
            areas: self.valve.areas(spool_v),
            supply: GasState {
                pressure_pa: inputs.supply_pressure_pa,
                temperature_k: self.supply_temperature_k,
            },
        };
        let to_m = state.carriage.position_m.value;
        self.pneumatics
            .step(&mut state.pneumatics, Some(&drive), from_m, to_m, self.dt_s);
    }

    /// The carriage alone, under given pressures.
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
