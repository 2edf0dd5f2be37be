//! An isothermal volume between an orifice and the valve: what a tank behind a
//! regulator and a silencer behind the exhaust have in common.
//!
//! ```text
//! V/(R T) p' = m_valve(p) - g(p) (p - p_outer),   g: chord of the flow law (1)
//! ```
//!
//! A small volume is stiff (20 cm3 behind 50 mm2: 3000 1/s), so the step is linearly
//! implicit, with the weight of its end going from 1/2 (second order) to 1 (the
//! steady state within the step). It takes two calls: [`VolumeNode::seen_pa`] is the
//! pressure that the valve works against through the step; the chambers then take
//! or give what they will; [`VolumeNode::change_pa`] accounts for exactly that flow,
//! so that no mass is lost between node and chambers. The chord in place of the
//! slope keeps the pressure on its side of the outer one however stiff the node.

use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// The node and the gas beyond its orifice.
#[derive(Clone, Copy)]
pub(super) struct VolumeNode<'a, R> {
    /// Flow law of the orifice.
    pub law: &'a FlowLaw<R>,
    /// Area of the orifice, m2.
    pub area_m2: R,
    /// The gas beyond it; the node has its temperature.
    pub outer: GasState<R>,
    /// V / (R T dt): mass flow that raises the pressure by 1 Pa in a step, kg/(s Pa).
    pub capacity_kg_per_s_pa: R,
}

impl<R: Real> VolumeNode<'_, R> {
    /// The node's pressure as the valve sees it over the step. `valve` is the flow
    /// from the valve into the node at its present pressure and its slope by that
    /// pressure (never positive).
    pub fn seen_pa(&self, present_pa: R, valve: (R, R)) -> R {
        let through = self.conductance(present_pa);
        let stiffness = through - valve.1;
        let net = valve.0 - through * (present_pa - self.outer.pressure_pa);
        let change = net / (self.capacity_kg_per_s_pa + self.implicit(stiffness));
        present_pa + self.end_weight(stiffness) * change
    }

    /// Change of the node's pressure over the step in which `valve_kg_per_s` flowed
    /// from the valve into it on average and the valve saw `seen_pa`.
    pub fn change_pa(&self, present_pa: R, seen_pa: R, valve_kg_per_s: R) -> R {
        let through = self.conductance(seen_pa);
        let net = valve_kg_per_s - through * (present_pa - self.outer.pressure_pa);
        net / (self.capacity_kg_per_s_pa + self.implicit(through))
    }

    fn conductance(&self, pressure_pa: R) -> R {
        let node = GasState {
            pressure_pa,
            ..self.outer
        };
        self.law.conductance(self.area_m2, node, self.outer)
    }

    /// Weight of the step's end: 1 - 1/z for z = stiffness / capacity over 2.
    fn end_weight(&self, stiffness: R) -> R {
        let half = R::from_f64(0.5);
        if stiffness * half > self.capacity_kg_per_s_pa {
            R::ONE - self.capacity_kg_per_s_pa / stiffness
        } else {
            half
        }
    }

    /// That weight times the stiffness, without a division by nought.
    fn implicit(&self, stiffness: R) -> R {
        (stiffness * R::from_f64(0.5)).max(stiffness - self.capacity_kg_per_s_pa)
    }
}
