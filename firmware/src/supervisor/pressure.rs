//! A chamber pressure whose code stands still: should it?
//!
//! ```text
//! V p' / gamma = R T m' - p A v
//! ```
//!
//! Both terms are summed up, with a memory of 30 ms, while the code stays the
//! same. Their sum is the work that a pressure change takes; a sound sensor
//! stays at its code only while it is about nought. What the valve's flow is
//! known badly by (a share of either term; near the null a share of the open
//! valve's flow) is granted. At rest nothing is predicted, and a quiet sensor
//! may stand still as long as it likes.

use super::step::Step;
use crate::codes::AdcCode;
use crate::fault::{Channel, Fault, Finding};
use model_core::axis::Axis;
use model_core::chamber::ChamberGeometry;
use model_core::real::Real;
use model_core::valve::GasState;

/// Memory, s: an axis' change of pressure in earnest takes about so long.
const MEMORY_S: f32 = 30e-3;
/// Error of the flow and of the piston's work: two deviations of 5 % for the
/// areas, of 6 % for the critical ratio, and heat.
const SHARE_OF_TERMS: f32 = 0.3;
/// Error of the flow near the null in terms of the open valve's: a null wrong
/// by two deviations of 25 mV, and as much hysteresis, of 5 V.
const SHARE_OF_OPEN_FLOW: f32 = 0.02;
/// Ticks that a code must have stood before its chamber is reckoned: noise of
/// one quantum seldom leaves so many alike, and reckoning costs.
const LEAST_TICKS: u8 = 4;

/// One chamber's sums since its code last changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PressureState {
    ticks: u8,
    work_j: f32,
    terms_j: f32,
}

/// What belongs to one chamber.
pub(super) struct Side<'a> {
    pub(super) channel: Channel,
    pub(super) chamber: &'a ChamberGeometry<f32>,
    pub(super) supply_area_m2: f32,
    pub(super) exhaust_area_m2: f32,
    pub(super) pressure_pa: f32,
}

impl PressureState {
    /// Counts the ticks that the code stands.
    #[inline]
    pub(super) fn count(&mut self, (before, now): (AdcCode, AdcCode)) {
        if before == now {
            self.ticks = self.ticks.saturating_add(1);
        } else {
            *self = Self::default();
        }
    }

    /// Whether the chamber must be reckoned.
    pub(super) fn stands(&self) -> bool {
        self.ticks >= LEAST_TICKS
    }

    /// Reckons `ticks` ticks; `open_flow_m3_per_s` is the open valve's flow.
    #[inline]
    pub(super) fn check(
        &mut self,
        axis: &Axis<f32>,
        side: &Side<'_>,
        step: &Step<'_>,
        (open_flow_m3_per_s, time_s): (f32, f32),
    ) -> Option<Finding> {
        let flow_w = flow_w(axis, side, step);
        let motion_w = side.chamber.area_m2
            * side.chamber.length_per_position
            * step.now.velocity_m_per_s
            * side.pressure_pa;
        let share = Real::min(time_s * (1.0 / MEMORY_S), 1.0);
        self.work_j += time_s * (flow_w - motion_w) - share * self.work_j;
        self.terms_j += time_s * (flow_w.abs() + motion_w.abs()) - share * self.terms_j;
        let near_null_j =
            SHARE_OF_OPEN_FLOW * MEMORY_S * open_flow_m3_per_s * step.now.supply_pressure_pa;
        let granted_j = near_null_j + SHARE_OF_TERMS * self.terms_j;
        (self.work_j.abs() > granted_j).then(|| Fault::FrozenSensor.of(side.channel))
    }
}

/// R T m' through both paths of a port, W.
fn flow_w(axis: &Axis<f32>, side: &Side<'_>, step: &Step<'_>) -> f32 {
    let temperature_k = axis.supply_temperature_k;
    let at = |pressure_pa| GasState {
        pressure_pa,
        temperature_k,
    };
    let chamber = at(side.pressure_pa);
    let law = &axis.valve.law;
    let filling = law.flow(
        side.supply_area_m2,
        at(step.now.supply_pressure_pa),
        chamber,
    );
    let emptying = law.flow(side.exhaust_area_m2, chamber, axis.pneumatics.ambient);
    axis.pneumatics.gas.gas_constant_j_per_kg_k
        * temperature_k
        * (filling.mass_flow_kg_per_s - emptying.mass_flow_kg_per_s)
}
