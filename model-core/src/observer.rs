//! The observer: the axis' own laws, corrected by what the sensors say.
//!
//! Each tick the state of the last one is carried over the step by the laws of
//! [`crate::axis`], under the command that acted meanwhile, and then corrected:
//!
//! ```text
//! p <- p + lp (p_measured - p)                     both chambers, and the supply
//! x <- x + l ex                                    ex = x_measured - x
//! v <- v + w l ex / 2 + l ev / 2                   ev = v_measured - v
//! d <- d + ld M w (w ex + ev) / 2                  force that the laws do not explain
//! ```
//!
//! Two things are learned beside the state, because a nameplate does not give
//! them well enough: where the valve's edges lie (10 mV are 20 kPa), from the
//! pressures' innovation while a path is open; and the friction's level, from
//! what of the disturbance turns with the direction while the load moves. What shows behind
//! a tube was let through by the spool a transit before.
//!
//! Gas temperatures have no sensor: they follow the energy balance with the
//! observed pressures, and decay to the wall's. The disturbance is held while
//! the load stands: behind stiction no force can be seen. A carriage that is to leave and
//! does not is learned from only where the model's leaves, so that one's seal does not age:
//! what a seal has grown by is fed forward, and were it in the observer too, the load would
//! be left behind until the feedback had grown as much.

use crate::axis::{Axis, CommandState, Piston, PneumaticState, ValveDrive};
use crate::carriage::CarriageState;
use crate::feedforward::ForceRates;
use crate::friction::FrictionLevels;
use crate::left_out::{DelayLine, ValveDelay};
use crate::real::Real;
use crate::valve::{AreaTable, GasState};

/// What the sensors say at a tick, SI, absolute pressures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurements<R> {
    /// Position, m.
    pub position_m: R,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Pressure of chamber a, Pa.
    pub pressure_a_pa: R,
    /// Pressure of chamber b, Pa.
    pub pressure_b_pa: R,
    /// Supply pressure, Pa.
    pub supply_pressure_pa: R,
}

/// Bandwidths of the corrections, 1/s; each is turned into the share of the
/// innovation that one step takes over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverGains<R> {
    /// Of the pressures.
    pub pressure_per_s: R,
    /// Of position and velocity.
    pub motion_per_s: R,
    /// Of the disturbance force.
    pub disturbance_per_s: R,
    /// Of the edges of the valve.
    pub edge_per_s: R,
    /// Of the friction.
    pub friction_per_s: R,
}

/// The observer's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverState<R> {
    /// From the command to the spool.
    pub command: CommandState<R>,
    /// Pressures and temperatures.
    pub pneumatics: PneumaticState<R>,
    /// Position, velocity, bristle, friction.
    pub carriage: CarriageState<R>,
    /// Supply pressure, Pa.
    pub supply_pressure_pa: R,
    /// Force along +x that the laws do not explain, N.
    pub disturbance_n: R,
    /// What the friction levels have over those of the rig.
    pub friction_excess: FrictionLevels<R>,
    /// How far the valve's edges lie from where the rig has them, V.
    pub edges: EdgeShift<R>,
    /// Where the spool was over the step in which what now arrives in the chambers passed it, V.
    pub felt_spool_v: R,
    /// What the spool let through and is still on its way in the tubes.
    passed: DelayLine<R>,
}

impl<R: Real> ObserverState<R> {
    /// The friction levels as learned.
    #[inline]
    pub fn friction(&self, axis: &Axis<R>) -> FrictionLevels<R> {
        FrictionLevels {
            coulomb_n: axis.friction.coulomb_n + self.friction_excess.coulomb_n,
            static_n: axis.friction.static_n + self.friction_excess.static_n,
            viscous_n_s_per_m: axis.friction.viscous_n_s_per_m
                + self.friction_excess.viscous_n_s_per_m,
        }
    }

    /// The levels that hold here and now for a motion of this velocity: as learned,
    /// with everything that the rig says of pressures, place, direction and rest.
    #[inline]
    pub fn friction_at(&self, axis: &Axis<R>, velocity_m_per_s: R) -> FrictionLevels<R> {
        let ambient = axis.carriage.ambient_pressure_pa;
        let [a, b] = [&self.pneumatics.a, &self.pneumatics.b].map(|gas| gas.pressure_pa.value);
        let levels = axis
            .friction_terms
            .levels(&self.friction(axis), a - ambient, b - ambient);
        if axis.carriage.effects.is_none() {
            return levels;
        }
        let moving = CarriageState {
            velocity_m_per_s,
            ..self.carriage
        };
        axis.carriage.levels(&moving, levels)
    }
}

/// Shift of the valve's opening edges, V: on the side above the null and on the
/// side below. Their mean is the error of the null, their difference that of
/// the overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeShift<R> {
    /// Above the null.
    pub above_v: R,
    /// Below the null.
    pub below_v: R,
}

impl<R: Real> EdgeShift<R> {
    /// The command that a valve with its edges where the rig has them would
    /// need for the same areas.
    #[inline]
    pub fn undone(&self, command_v: R, null_v: R) -> R {
        if command_v > null_v {
            (command_v - self.above_v).max(null_v)
        } else {
            (command_v - self.below_v).min(null_v)
        }
    }

    /// The inverse.
    #[inline]
    pub fn done(&self, command_v: R, null_v: R) -> R {
        if command_v > null_v {
            command_v + self.above_v
        } else if command_v < null_v {
            command_v + self.below_v
        } else {
            command_v + (self.above_v + self.below_v) * R::from_f64(0.5)
        }
    }
}

/// Shares of the innovations that one step takes over.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shares<R> {
    pressure: R,
    position: R,
    velocity_per_s: R,
    velocity: R,
    disturbance_n_per_m: R,
    disturbance_n_s_per_m: R,
    edge_v_per_pa: R,
    friction: R,
}

/// The load moves: below, velocity and bristle cannot be told apart, m/s.
const MOVING_M_PER_S: f64 = 3e-3;
/// Friction is learned above this speed, m/s: twice the usual Stribeck velocity.
const LEARNING_M_PER_S: f64 = 0.01;
/// Speed at which Coulomb and viscous level share what is learned, m/s.
const TYPICAL_M_PER_S: f64 = 0.15;
/// How far friction may be from the rig's, as a share of it.
const MOST_EXCESS: f64 = 0.6;
/// How far an edge may be from the rig's, V: twice the data sheet's tolerance of
/// the null.
const MOST_EDGE_SHIFT_V: f64 = 0.2;
/// A path counts as open from this share of the overlap.
const OPEN_SHARE: f64 = 0.9;
/// A force rate per volt below this is none, N/(s V): a valve that never opens.
const LEAST_FORCE_RATE_PER_V: f64 = 1.0;

/// The observer's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer<R> {
    shares: Shares<R>,
    /// From the valve through the tubes.
    transit: ValveDelay<R>,
    /// Opening from which a path counts as open, V.
    open_from_v: R,
}

impl<R: Real> Observer<R> {
    /// An observer of this axis.
    pub fn new(axis: &Axis<R>, gains: &ObserverGains<R>) -> Self {
        let c = R::from_f64;
        let dt_s = axis.dt_s;
        let share = |per_s: R| dt_s * per_s / (R::ONE + dt_s * per_s);
        let motion = gains.motion_per_s;
        let half = c(0.5);
        let disturbance = half * axis.carriage.mass_kg * motion * share(gains.disturbance_per_s);
        let force_rate_per_pa = gains.pressure_per_s * axis.carriage.area_a_m2;
        Self {
            shares: Shares {
                pressure: share(gains.pressure_per_s),
                position: share(motion),
                velocity_per_s: half * motion * share(motion),
                velocity: half * share(motion),
                disturbance_n_per_m: disturbance * motion,
                disturbance_n_s_per_m: disturbance,
                edge_v_per_pa: share(gains.edge_per_s) * force_rate_per_pa
                    / force_rate_per_v(axis).max(c(LEAST_FORCE_RATE_PER_V)),
                friction: share(gains.friction_per_s),
            },
            transit: ValveDelay {
                delay_s: axis.pneumatics.transit_s(),
            },
            open_from_v: c(OPEN_SHARE) * axis.valve.supply.edge_v(),
        }
    }

    /// Follows the measured pressures more slowly, by this share: for gauges that are later than
    /// anybody knew, whose innovations are their lag.
    pub fn follow_pressures_slower(&mut self, share: R) {
        self.shares.pressure = share * self.shares.pressure;
        self.shares.edge_v_per_pa = share * self.shares.edge_v_per_pa;
    }

    /// Memory for an axis at rest where the sensors say, the valve at its null.
    pub fn begin(&self, axis: &Axis<R>, measured: &Measurements<R>) -> ObserverState<R> {
        let wall_k = axis.pneumatics.ambient.temperature_k;
        let gas = |pressure_pa| GasState {
            pressure_pa,
            temperature_k: wall_k,
        };
        ObserverState {
            command: CommandState::holding(axis.valve.null_v),
            pneumatics: PneumaticState::at_rest(
                gas(measured.pressure_a_pa),
                gas(measured.pressure_b_pa),
            ),
            carriage: CarriageState::new(measured.position_m, R::ZERO),
            supply_pressure_pa: measured.supply_pressure_pa,
            disturbance_n: R::ZERO,
            friction_excess: FrictionLevels {
                coulomb_n: R::ZERO,
                static_n: R::ZERO,
                viscous_n_s_per_m: R::ZERO,
            },
            edges: EdgeShift {
                above_v: R::ZERO,
                below_v: R::ZERO,
            },
            felt_spool_v: axis.valve.null_v,
            passed: DelayLine::holding(axis.valve.null_v),
        }
    }

    /// One step: `command_v` acted since the last tick.
    pub fn step(
        &self,
        axis: &Axis<R>,
        state: &mut ObserverState<R>,
        command_v: R,
        measured: &Measurements<R>,
    ) {
        let spool_v = self.predict(axis, state, command_v);
        self.correct(axis, state, spool_v, measured);
    }

    /// Carries the state over the step; returns the spool's mean position.
    fn predict(&self, axis: &Axis<R>, state: &mut ObserverState<R>, command_v: R) -> R {
        let spool_v = axis.command_path.step(&mut state.command, command_v);
        let drive = ValveDrive {
            areas: axis
                .valve
                .areas(state.edges.undone(spool_v, axis.valve.null_v)),
            supply: GasState {
                pressure_pa: state.supply_pressure_pa,
                temperature_k: axis.supply_temperature_k,
            },
        };
        let learned = state.friction(axis);
        let (carriage, disturbance_n) = (&mut state.carriage, state.disturbance_n);
        let ambient = axis.carriage.ambient_pressure_pa;
        let piston = Piston {
            from_m: carriage.position_m.value,
            middle_m: carriage.ahead_m(axis.dt_s),
            end_m: |a, b| {
                let levels = axis
                    .friction_terms
                    .levels(&learned, a - ambient, b - ambient);
                let drive_n = axis.carriage.drive_n(a, b) - axis.friction_terms.constant_force_n
                    + disturbance_n;
                axis.carriage
                    .step_unaged(carriage, &levels, drive_n, axis.dt_s);
                carriage.position_m.value
            },
        };
        axis.pneumatics
            .step_driven(&mut state.pneumatics, &drive, piston, axis.dt_s);
        spool_v
    }

    fn correct(
        &self,
        axis: &Axis<R>,
        state: &mut ObserverState<R>,
        spool_v: R,
        measured: &Measurements<R>,
    ) {
        let shares = &self.shares;
        let error_a = measured.pressure_a_pa - state.pneumatics.a.pressure_pa.value;
        let error_b = measured.pressure_b_pa - state.pneumatics.b.pressure_pa.value;
        state
            .pneumatics
            .a
            .pressure_pa
            .add(shares.pressure * error_a);
        state
            .pneumatics
            .b
            .pressure_pa
            .add(shares.pressure * error_b);
        state.supply_pressure_pa +=
            shares.pressure * (measured.supply_pressure_pa - state.supply_pressure_pa);
        let position_error = measured.position_m - state.carriage.position_m.value;
        let velocity_error = measured.velocity_m_per_s - state.carriage.velocity_m_per_s;
        state
            .carriage
            .position_m
            .add(shares.position * position_error);
        state.carriage.velocity_m_per_s +=
            shares.velocity_per_s * position_error + shares.velocity * velocity_error;
        if state.carriage.velocity_m_per_s.abs() > R::from_f64(MOVING_M_PER_S) {
            state.disturbance_n += shares.disturbance_n_per_m * position_error
                + shares.disturbance_n_s_per_m * velocity_error;
        }
        state.felt_spool_v = if axis.pneumatics.tube.is_present() {
            self.transit.step(&mut state.passed, spool_v, axis.dt_s)
        } else {
            spool_v
        };
        self.learn_edges(axis, state, error_a - error_b);
        self.learn_friction(axis, state);
    }

    /// A force that stays unexplained and turns with the direction is friction: a
    /// gradient step on Coulomb and viscous level together, normalised by the
    /// squared regressor `1 + (v / v0)^2`.
    fn learn_friction(&self, axis: &Axis<R>, state: &mut ObserverState<R>) {
        let velocity = state.carriage.velocity_m_per_s;
        if velocity.abs() < R::from_f64(LEARNING_M_PER_S) {
            return;
        }
        let braking_n = -state.disturbance_n * velocity.signum();
        let typical = R::from_f64(TYPICAL_M_PER_S);
        let ratio = velocity.abs() / typical;
        let step_n = self.shares.friction * braking_n / (R::ONE + ratio * ratio);
        let most = R::from_f64(MOST_EXCESS);
        let (rig, excess) = (&axis.friction, &mut state.friction_excess);
        let most_n = most * rig.coulomb_n;
        let most_viscous = most * rig.viscous_n_s_per_m;
        excess.coulomb_n = (excess.coulomb_n + step_n).clamp(-most_n, most_n);
        excess.static_n = excess.coulomb_n;
        excess.viscous_n_s_per_m = (excess.viscous_n_s_per_m + step_n * ratio / typical)
            .clamp(-most_viscous, most_viscous);
    }

    /// A force that grows faster than the laws say, while a path is open, means an
    /// edge that lies nearer.
    fn learn_edges(&self, axis: &Axis<R>, state: &mut ObserverState<R>, difference_error_pa: R) {
        let (valve, spool_v) = (&axis.valve, state.felt_spool_v);
        let opening_v = valve.opening_towards_a_v(spool_v);
        if opening_v.abs() < self.open_from_v {
            return;
        }
        let wider_towards_a_v = self.shares.edge_v_per_pa * difference_error_pa;
        let shift_v = if valve.feeds_a_above_null {
            -wider_towards_a_v
        } else {
            wider_towards_a_v
        };
        let most_v = R::from_f64(MOST_EDGE_SHIFT_V);
        let edge_v = if spool_v > valve.null_v {
            &mut state.edges.above_v
        } else {
            &mut state.edges.below_v
        };
        *edge_v = (*edge_v + shift_v).clamp(-most_v, most_v);
    }
}

/// How much faster the force grows for each volt beyond the edge, N/(s V): with
/// the piston in the middle, both chambers at three quarters of the usual
/// supply of 6 bar, and as the mean over the first 0.4 V.
fn force_rate_per_v<R: Real>(axis: &Axis<R>) -> R {
    let c = R::from_f64;
    let supply_pa = c(6e5);
    let chamber = GasState {
        pressure_pa: c(0.75) * supply_pa,
        temperature_k: axis.pneumatics.ambient.temperature_k,
    };
    let gas = PneumaticState::at_rest(chamber, chamber);
    let rates = ForceRates::at(axis, &gas, supply_pa, R::ZERO, R::ZERO);
    let (edge_v, beyond_v) = (axis.valve.supply.edge_v(), c(0.4));
    let rise = |table: &AreaTable<R>| {
        (table.area_m2(edge_v + beyond_v) - table.area_m2(edge_v)) / beyond_v
    };
    rates.supply_a * rise(&axis.valve.supply) + rates.exhaust_b * rise(&axis.valve.exhaust)
}
