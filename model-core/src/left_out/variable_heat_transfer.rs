//! `variable-heat-transfer`: a heat transfer coefficient that follows the gas.
//!
//! ```text
//! h = h_declared (rho/rho_ref)^n + h_flow q^2 / (q^2 + q0^2)^0.6,   q = |m'| / (1 g/s)
//! ```
//!
//! The first factor: n = 0.5-0.8 typically. Eichelberg's form
//! h0 sqrt(p T / (p0 T0)) is n = 0.5 but for its factor T/T0, 10 % over the
//! temperatures of a stroke. `rho_ref` is [`REFERENCE_DENSITY_KG_PER_M3`]: near the
//! working density, so that n turns h about its working value in place of scaling it.
//! The second: the jet through the port stirs the gas; q^0.8 (a turbulent Nusselt
//! law) beyond q0 = 0.1 g/s, smooth at no flow. The flow is the chamber's net one.
//! Typical `h_flow` 20-100 W/(m2 K) on 5-15 at rest; it matters where h changes by
//! about a third. Confused with the declared pair of coefficients for charging and
//! discharging (it moves by 80-110 %), with a wall that warms, with the late decay
//! by a leak. What separates: dwells after fills of different strength, at two
//! pressures; relaxation is slower after the flow than during it.

use crate::gas::Gas;
use crate::real::Real;
use crate::valve::GasState;

/// Density at which the declared coefficient holds, kg/m3: air at 5 bar absolute
/// and 293 K has 5.94.
pub const REFERENCE_DENSITY_KG_PER_M3: f64 = 6.0;
/// Unit of the flow in q, kg/s.
const FLOW_UNIT_KG_PER_S: f64 = 1e-3;
/// q0: the flow at which stirring sets in, in that unit.
const ONSET_FLOW: f64 = 0.1;

/// How h varies; all 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariableHeatTransfer<R> {
    /// n.
    pub density_exponent: R,
    /// `h_flow`: what a flow of 1 g/s adds, W/(m2 K).
    pub flow_w_per_m2_k: R,
}

impl<R: Real> VariableHeatTransfer<R> {
    /// The declared coefficient, always.
    pub const NEUTRAL: Self = Self {
        density_exponent: R::ZERO,
        flow_w_per_m2_k: R::ZERO,
    };

    /// h for a declared coefficient, W/(m2 K), in this gas.
    #[inline]
    pub fn coefficient(
        &self,
        declared_w_per_m2_k: R,
        gas: &Gas<R>,
        state: GasState<R>,
        net_flow_kg_per_s: R,
    ) -> R {
        let mut coefficient = declared_w_per_m2_k;
        if self.density_exponent != R::ZERO {
            let relative =
                gas.density_kg_per_m3(state) * R::from_f64(1.0 / REFERENCE_DENSITY_KG_PER_M3);
            coefficient = coefficient * relative.powf(self.density_exponent);
        }
        if self.flow_w_per_m2_k != R::ZERO {
            let flow = net_flow_kg_per_s * R::from_f64(1.0 / FLOW_UNIT_KG_PER_S);
            let squared = flow * flow;
            let onset = R::from_f64(ONSET_FLOW * ONSET_FLOW);
            let stirred = squared / (squared + onset).powf(R::from_f64(0.6));
            coefficient += self.flow_w_per_m2_k * stirred;
        }
        coefficient
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// h at 293.15 K, declared as 20.
    fn coefficient(heat: &VariableHeatTransfer<f64>, density: f64, flow: f64) -> f64 {
        let gas = Gas::new(1.4, 287.0);
        let state = GasState {
            pressure_pa: density * 287.0 * 293.15,
            temperature_k: 293.15,
        };
        heat.coefficient(20.0, &gas, state, flow)
    }

    #[test]
    fn val_the_two_laws_at_known_points() {
        let heat = VariableHeatTransfer {
            density_exponent: 0.5,
            flow_w_per_m2_k: 30.0,
        };
        // At rest and a quarter of the reference density: half.
        assert!((coefficient(&heat, 1.5, 0.0) - 10.0).abs() < 1e-12);
        // 10 g/s in either direction: 30 * 10^0.8, less 6e-5 of it by the onset.
        for flow in [-1e-2, 1e-2] {
            let added = coefficient(&heat, 6.0, flow) - 20.0;
            assert!((added / (30.0 * 10.0_f64.powf(0.8)) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn prop_smooth_at_no_flow() {
        let heat = VariableHeatTransfer {
            density_exponent: 0.0,
            flow_w_per_m2_k: 30.0,
        };
        let at = |flow: f64| coefficient(&heat, 6.0, flow);
        let slope = (at(1e-9) - at(-1e-9)) / 2e-9;
        assert!(slope.abs() < 1e-9 && at(1e-7) - 20.0 < 1e-3);
    }
}
