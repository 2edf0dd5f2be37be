//! `exhaust-back-pressure`: the exhaust paths end in a silencer that lets the gas
//! out no faster than its own resistance allows.
//!
//! ```text
//! V/(R T0) pe' = m_in - m_out,   m_out = flow law (1), silencer -> surroundings, area A
//! m_in = m_a + m_b               one for both paths
//! m_in = m_a, m_in = m_b         one for each, two of a kind: a 5/3 valve with ports 3 and 5
//! ```
//!
//! pe takes the place of the surroundings' pressure in the valve's exhaust paths.
//! Isothermal at the surroundings' temperature: a sintered silencer is a heat
//! exchanger. Typical: a sonic conductance of 1-3 times the valve's (17-50 mm2
//! here, less when clogged), 20 cm3; it matters where pe rises by about 2 kPa,
//! from 0.7 g/s through 17 mm2. Confused with a supply that droops (cosine 0.80),
//! a tube (0.70), a leak of the chambers (-0.82) and the area of the exhaust paths;
//! what separates is a large exhaust flow, which raises a common pe for both chambers
//! alike, also for the one that does not move much gas; behind ports of their own it
//! raises that of its chamber alone.
//!
//! The volume empties in 0.3-5 ms: its own state with an implicit step
//! ([`super::volume_node`]), not a quasi-steady pressure, as that would need
//! iterations for both chambers together and be wrong at the slow end.

use super::volume_node::VolumeNode;
use crate::math::Compensated;
use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// The silencer; an area of 0 is neutral (the valve blows into the open).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExhaustBackPressure<R> {
    /// Area of the silencer towards the surroundings, m2.
    pub silencer_area_m2: R,
    /// Volume between valve and silencer, m3.
    pub volume_m3: R,
}

/// Pressure in the silencer over that of the surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilencerState<R> {
    excess_pa: Compensated<R>,
}

impl<R: Real> SilencerState<R> {
    /// At the surroundings' pressure.
    pub fn at_rest() -> Self {
        Self::at(R::ZERO)
    }

    /// At a pressure over that of the surroundings, Pa.
    pub fn at(excess_pa: R) -> Self {
        Self {
            excess_pa: Compensated::new(excess_pa),
        }
    }

    /// Pressure over that of the surroundings, Pa.
    pub fn excess_pa(&self) -> R {
        self.excess_pa.value
    }
}

impl<R: Real> ExhaustBackPressure<R> {
    /// No silencer; the volume is that of a usual one, ready for a fit.
    pub fn neutral() -> Self {
        Self {
            silencer_area_m2: R::ZERO,
            volume_m3: R::from_f64(2e-5),
        }
    }

    /// Whether there is a silencer at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.silencer_area_m2 > R::ZERO
    }

    /// The silencer in its surroundings, for one step.
    pub(crate) fn within<'a>(
        &self,
        law: &'a FlowLaw<R>,
        gas_constant_j_per_kg_k: R,
        surroundings: GasState<R>,
        dt_s: R,
    ) -> VentedSilencer<'a, R> {
        VentedSilencer(VolumeNode {
            law,
            area_m2: self.silencer_area_m2,
            outer: surroundings,
            capacity_kg_per_s_pa: self.volume_m3
                / (gas_constant_j_per_kg_k * surroundings.temperature_k * dt_s),
        })
    }
}

/// A silencer and its surroundings through one step.
#[derive(Clone, Copy)]
pub(crate) struct VentedSilencer<'a, R>(VolumeNode<'a, R>);

impl<R: Real> VentedSilencer<'_, R> {
    /// The silencer's gas now.
    pub fn now(&self, state: &SilencerState<R>) -> GasState<R> {
        GasState {
            pressure_pa: self.0.outer.pressure_pa + state.excess_pa.value,
            ..self.0.outer
        }
    }

    /// The gas that the exhaust paths see, from the flow into the silencer at its
    /// present pressure and the slope by that pressure (never positive).
    pub fn seen(&self, state: &SilencerState<R>, inflow: (R, R)) -> GasState<R> {
        let present = self.now(state);
        let pressure_pa = self.0.seen_pa(present.pressure_pa, inflow);
        GasState {
            pressure_pa,
            ..present
        }
    }

    /// Accounts for what both exhaust paths let out on average, kg/s.
    pub fn step(&self, state: &mut SilencerState<R>, seen: GasState<R>, inflow_kg_per_s: R) {
        let present_pa = self.now(state).pressure_pa;
        let change_pa = self
            .0
            .change_pa(present_pa, seen.pressure_pa, inflow_kg_per_s);
        state.excess_pa.add(change_pa);
        // An absurd flow saturates: never a vacuum below nought.
        let least = -self.0.outer.pressure_pa.max(R::ZERO);
        if state.excess_pa.value < least {
            state.excess_pa = Compensated::new(least);
        }
    }
}
