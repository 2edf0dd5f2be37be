//! The position controller: one call a tick.

use crate::axis::Axis;
use crate::real::Real;
use crate::reference::Reference;
use crate::valve::{GasState, Port};

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

/// What the observer believes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<R> {
    /// Position, m.
    pub position_m: R,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Friction against +x, N.
    pub friction_n: R,
    /// Force that the model does not explain, along +x, N.
    pub disturbance_n: R,
}

impl<R: Copy> Estimate<R> {
    /// The four in the order of the link.
    pub fn to_array(&self) -> [R; 4] {
        [
            self.position_m,
            self.velocity_m_per_s,
            self.friction_n,
            self.disturbance_n,
        ]
    }
}

/// What the controller decides at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action<R> {
    /// Valve command, V.
    pub command_v: R,
    /// The observer's belief.
    pub estimate: Estimate<R>,
}

/// The controller's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<R> {
    axis: Axis<R>,
}

/// The controller's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerState<R> {
    estimate: Estimate<R>,
}

impl<R: Real> Controller<R> {
    /// A controller for this axis; the tick is the axis' step.
    pub fn new(axis: Axis<R>) -> Self {
        Self { axis }
    }

    /// The axis that is controlled.
    pub fn axis(&self) -> &Axis<R> {
        &self.axis
    }

    /// The command at which the valve is centred, V.
    pub fn null_v(&self) -> R {
        self.axis.valve.null_v
    }

    /// Memory for an axis that is at rest where the sensors say.
    pub fn begin(&self, measured: &Measurements<R>) -> ControllerState<R> {
        ControllerState {
            estimate: Estimate {
                position_m: measured.position_m,
                velocity_m_per_s: R::ZERO,
                friction_n: R::ZERO,
                disturbance_n: R::ZERO,
            },
        }
    }

    /// One tick without a task: the observer goes on, the valve is at its null.
    pub fn idle(&self, state: &mut ControllerState<R>, measured: &Measurements<R>) -> Action<R> {
        state.estimate.position_m = measured.position_m;
        state.estimate.velocity_m_per_s = measured.velocity_m_per_s;
        Action {
            command_v: self.null_v(),
            estimate: state.estimate,
        }
    }

    /// One tick of following a reference.
    pub fn track(
        &self,
        state: &mut ControllerState<R>,
        measured: &Measurements<R>,
        reference: &Reference<R>,
    ) -> Action<R> {
        self.idle(state, measured);
        let c = R::from_f64;
        let axis = &self.axis;
        let error = reference.position_m - measured.position_m;
        let error_rate = reference.velocity_m_per_s - measured.velocity_m_per_s;
        let acceleration =
            reference.acceleration_m_per_s2 + c(2500.0) * error + c(80.0) * error_rate;
        let friction = axis
            .friction
            .steady_n(&axis.carriage.bristle, reference.velocity_m_per_s);
        let wanted_n = axis.carriage.mass_kg * acceleration + friction;
        let force_n = axis
            .carriage
            .drive_n(measured.pressure_a_pa, measured.pressure_b_pa);
        let rate_pa_s = c(75.0) * (wanted_n - force_n) / axis.carriage.area_a_m2;
        let gas = &axis.pneumatics.gas;
        let wall_k = axis.pneumatics.ambient.temperature_k;
        let volume = axis
            .pneumatics
            .chamber_a
            .geometry
            .volume_m3(measured.position_m);
        let per_kg = gas.heat_capacity_ratio * gas.gas_constant_j_per_kg_k * wall_k / volume;
        let flow = (rate_pa_s
            + gas.heat_capacity_ratio
                * measured.pressure_a_pa
                * axis.carriage.area_a_m2
                * reference.velocity_m_per_s
                / volume)
            / per_kg;
        let at = |pressure_pa| GasState {
            pressure_pa,
            temperature_k: wall_k,
        };
        let inverse = axis.valve.command_for_flow(
            Port::A,
            flow,
            at(measured.pressure_a_pa),
            at(measured.supply_pressure_pa),
            axis.pneumatics.ambient,
        );
        Action {
            command_v: inverse.command_v,
            estimate: state.estimate,
        }
    }
}
