//! A steady flow through a valve's path, with the pressures on both sides.

use model_core::valve::{FlowLaw, GasState};

/// Commands that are one, V.
const ONE_COMMAND_V: f64 = 0.01;

/// A steady flow through the path that a command opens.
#[derive(Clone, Copy, Debug)]
pub struct FlowPoint {
    /// Command, V.
    pub command_v: f64,
    /// Into port A is positive, kg/s.
    pub flow_kg_per_s: f64,
    /// One standard deviation, kg/s.
    pub deviation_kg_per_s: f64,
    /// Pressures at the supply, at port A and at the exhaust, Pa.
    pub supply_pa: f64,
    /// At port A.
    pub port_pa: f64,
    /// At the exhaust.
    pub exhaust_pa: f64,
    /// Temperatures of the gas at the supply and at port A, K.
    pub supply_k: f64,
    /// At port A.
    pub port_k: f64,
}

impl FlowPoint {
    /// Whether it flows from the supply.
    pub fn is_fed(&self) -> bool {
        self.flow_kg_per_s > 0.0
    }

    /// Flows per area from the supply into the port and from the port to the exhaust, kg/(s m2).
    pub fn per_area(&self, law: &FlowLaw<f64>) -> [f64; 2] {
        let state = |pressure_pa, temperature_k| GasState {
            pressure_pa,
            temperature_k,
        };
        let supply = state(self.supply_pa, self.supply_k);
        let port = state(self.port_pa, self.port_k);
        let exhaust = state(self.exhaust_pa, self.port_k);
        [law.flow(1.0, supply, port), law.flow(1.0, port, exhaust)]
            .map(|one| one.mass_flow_kg_per_s)
    }

    /// Pressure behind the open path over that before it.
    pub fn ratio(&self) -> f64 {
        if self.is_fed() {
            self.port_pa / self.supply_pa
        } else {
            self.exhaust_pa / self.port_pa
        }
    }
}

/// Flows of one command in one direction.
pub fn by_command(points: &[FlowPoint]) -> Vec<Vec<FlowPoint>> {
    let mut groups: Vec<Vec<FlowPoint>> = Vec::new();
    for point in points {
        let same = |group: &&mut Vec<FlowPoint>| {
            (group[0].command_v - point.command_v).abs() < ONE_COMMAND_V
                && group[0].is_fed() == point.is_fed()
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(*point),
            None => groups.push(vec![*point]),
        }
    }
    groups
}
