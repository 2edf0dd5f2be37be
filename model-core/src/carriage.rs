//! Motion of the carriage, (8).
//!
//! ```text
//! M x'' = pa Aa - pb Ab - p0 (Aa - Ab) - Ff - FL
//! ```
//!
//! Rodless, Aa = Ab: the ambient term vanishes. FL acts against +x. Semi-implicit:
//! the new velocity moves the position, so that the energy of the air spring
//! neither grows nor decays by the scheme.

use crate::friction::{Bristle, FrictionLevels};
use crate::math::Compensated;
use crate::real::Real;

/// Parameters of the carriage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carriage<R> {
    /// Moving mass, kg.
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
}

impl<R: Real> CarriageState<R> {
    /// A carriage with relaxed bristles.
    pub fn new(position_m: R, velocity_m_per_s: R) -> Self {
        Self {
            position_m: Compensated::new(position_m),
            velocity_m_per_s,
            deflection_m: R::ZERO,
            friction_n: R::ZERO,
        }
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

    /// One step under a drive force (see [`Self::drive_n`]).
    #[inline]
    pub fn step(
        &self,
        state: &mut CarriageState<R>,
        levels: &FrictionLevels<R>,
        drive_n: R,
        dt_s: R,
    ) {
        let out = self.bristle.step_with_mass(
            levels,
            self.mass_kg,
            state.velocity_m_per_s,
            state.deflection_m,
            drive_n,
            dt_s,
        );
        state.velocity_m_per_s = out.velocity_m_per_s;
        state.deflection_m = out.deflection_m;
        state.friction_n = out.force_n;
        state.position_m.add(dt_s * out.velocity_m_per_s);
    }
}
