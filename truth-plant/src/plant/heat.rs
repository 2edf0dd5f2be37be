//! Heat between the gas of a chamber and its wall.

use super::gas::Node;

/// How the coefficient depends on the flow and the state of the gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heat {
    /// Coefficient while the chamber gains mass.
    pub charging_w_per_m2_k: f64,
    /// Coefficient while it loses mass.
    pub discharging_w_per_m2_k: f64,
    /// Further coefficient at a net flow of 1 g/s; grows as its power 0.8.
    pub per_flow_w_per_m2_k: f64,
    /// Exponent of the density over that of the reference.
    pub density_exponent: f64,
    /// Exponent of pressure times temperature over that of the reference
    /// (Eichelberg: 0.5).
    pub eichelberg_exponent: f64,
}

/// State at which the exponents change nothing: the middle of a servo axis.
const REFERENCE: Node = Node {
    pressure_pa: 450e3,
    temperature_k: 293.15,
};
/// The change between charging and discharging is spread over this net flow,
/// 0.1 mg/s, in place of a jump: 80 Pa/s in a chamber at mid-stroke.
const CHANGE_KG_PER_S: f64 = 1e-7;
const GRAM_PER_SECOND: f64 = 1e-3;

impl Heat {
    /// The coefficient for a gas state and a net flow into the chamber.
    pub fn coefficient_w_per_m2_k(&self, gas: Node, net_kg_per_s: f64) -> f64 {
        let charging = (0.5 + 0.5 * net_kg_per_s / CHANGE_KG_PER_S).clamp(0.0, 1.0);
        let mut coefficient = self.discharging_w_per_m2_k
            + charging * (self.charging_w_per_m2_k - self.discharging_w_per_m2_k);
        if self.density_exponent > 0.0 {
            let density = gas.density_kg_per_m3() / REFERENCE.density_kg_per_m3();
            coefficient *= libm::pow(density, self.density_exponent);
        }
        if self.eichelberg_exponent > 0.0 {
            let product = gas.pressure_pa * gas.temperature_k
                / (REFERENCE.pressure_pa * REFERENCE.temperature_k);
            coefficient *= libm::pow(product, self.eichelberg_exponent);
        }
        if self.per_flow_w_per_m2_k > 0.0 {
            coefficient +=
                self.per_flow_w_per_m2_k * libm::pow(net_kg_per_s.abs() / GRAM_PER_SECOND, 0.8);
        }
        coefficient
    }
}

/// A wall with a heat capacity, one for each chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Heat capacity of the wall of one chamber.
    pub capacity_j_per_k: f64,
    /// Conductance from the wall to the surroundings.
    pub outward_w_per_k: f64,
    /// How much warmer than the surroundings it is at the start.
    pub warmer_k: f64,
}
