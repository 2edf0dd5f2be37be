//! `wall-temperature`: a cylinder wall that is not as warm as its surroundings, and
//! that the gas warms or cools.
//!
//! ```text
//! Tw = T0 + offset + rise,    C rise' = -Q' - G_out (offset + rise),   rise = 0 at the start
//! ```
//!
//! Q' is the heat into the gas, (5). With C = 0 the wall stays where it began: the
//! offset is constant. Each chamber has its own wall. Typical: C 1-2.5 kJ/K
//! (aluminium profile), 8 W/(m2 K) outside, so 20-60 minutes; offsets of -10 to
//! +10 K, of which about 1 K matters (0.3 % of the pressure that a chamber settles
//! at). An offset is as good as a supply that is colder by as much (cosine -1.00);
//! the critical ratio and h hide half of it. What separates: a thermocouple, a cold
//! start, a sealed chamber that settles at the wall's temperature.
//!
//! The wall gets exactly what the gas gives, and the heat of a step is softened by
//! how far it moves the wall itself, so that a wall of any capacity is stable. The
//! reduced model (6) takes the temperature at the start as its reference; what the
//! wall gains later acts on its heat only.

use crate::math::Compensated;
use crate::real::Real;

/// The wall; an offset of 0 with a capacity of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallTemperature<R> {
    /// Temperature over that of the surroundings at the start, K.
    pub offset_k: R,
    /// C of one chamber's wall, J/K; 0: the wall keeps its temperature.
    pub heat_capacity_j_per_k: R,
    /// `G_out`: conductance from that wall to the surroundings, W/K.
    pub outer_w_per_k: R,
}

impl<R: Real> WallTemperature<R> {
    /// A wall at the temperature of the surroundings.
    pub const NEUTRAL: Self = Self {
        offset_k: R::ZERO,
        heat_capacity_j_per_k: R::ZERO,
        outer_w_per_k: R::ZERO,
    };

    /// Whether the wall's temperature is a state.
    #[inline]
    pub fn is_warmed(&self) -> bool {
        self.heat_capacity_j_per_k > R::ZERO
    }

    /// The conductance between gas and wall, W/K, as it acts over a step in which
    /// the wall itself moves.
    #[inline]
    pub fn softened(&self, conductance_w_per_k: R, dt_s: R) -> R {
        if !self.is_warmed() {
            return conductance_w_per_k;
        }
        let moved = conductance_w_per_k * dt_s / self.heat_capacity_j_per_k;
        conductance_w_per_k / (R::ONE + (moved * R::from_f64(0.5)).max(moved - R::ONE))
    }

    /// The wall's rise after a step in which `heat_w` went into the gas.
    #[inline]
    pub fn step(&self, rise_k: &mut Compensated<R>, heat_w: R, dt_s: R) {
        if !self.is_warmed() {
            return;
        }
        let capacity = self.heat_capacity_j_per_k / dt_s;
        let lost_w = self.outer_w_per_k * (self.offset_k + rise_k.value);
        let implicit = (self.outer_w_per_k * R::from_f64(0.5)).max(self.outer_w_per_k - capacity);
        rise_k.add((-heat_w - lost_w) / (capacity + implicit));
    }
}
