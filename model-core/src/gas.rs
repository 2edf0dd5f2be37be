//! The working gas as an ideal gas.
//!
//! Valid for air and nitrogen up to about 10 bar (compressibility 0.998 at
//! 7 bar, 293 K). Humidity changes R by under 1 % and is neglected.

use crate::real::Real;
use crate::valve::GasState;

/// An ideal gas with constant heat capacities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas<R> {
    /// gamma = cp / cv.
    pub heat_capacity_ratio: R,
    /// Specific gas constant R in J/(kg K).
    pub gas_constant_j_per_kg_k: R,
    /// C1 = sqrt( gamma/R (2/(gamma+1))^((gamma+1)/(gamma-1)) ) in s K^0.5/m, of (1).
    pub flow_coefficient: R,
}

impl<R: Real> Gas<R> {
    /// A gas from its heat capacity ratio (over 1) and specific gas constant.
    pub fn new(heat_capacity_ratio: R, gas_constant_j_per_kg_k: R) -> Self {
        let plus = heat_capacity_ratio + R::ONE;
        let minus = heat_capacity_ratio - R::ONE;
        let two = R::from_f64(2.0);
        let critical = (two / plus).powf(plus / minus);
        let flow_coefficient = (heat_capacity_ratio / gas_constant_j_per_kg_k * critical).sqrt();
        Self {
            heat_capacity_ratio,
            gas_constant_j_per_kg_k,
            flow_coefficient,
        }
    }

    /// rho = p / (R T), kg/m3.
    #[inline]
    pub fn density_kg_per_m3(&self, gas: GasState<R>) -> R {
        gas.pressure_pa / (self.gas_constant_j_per_kg_k * gas.temperature_k)
    }

    /// cp = gamma R / (gamma - 1) in J/(kg K).
    #[inline]
    pub fn heat_capacity_at_constant_pressure(&self) -> R {
        self.heat_capacity_ratio * self.gas_constant_j_per_kg_k
            / (self.heat_capacity_ratio - R::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_flow_coefficient_of_air() {
        // 0.0404184 s K^0.5/m for gamma 1.4, R 287: the textbook figure.
        assert!((Gas::new(1.4_f64, 287.0).flow_coefficient - 0.040_418_4).abs() < 1e-7);
    }
}
