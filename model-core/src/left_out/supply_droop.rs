//! `supply-droop`: a tank that the regulator refills more slowly than the valve
//! empties it.
//!
//! ```text
//! V/(R T) ps' = m_feed - m_a - m_b,   m_feed = flow law (1), regulator -> tank, area A
//! ```
//!
//! Isothermal: the tank has the temperature of the supplied gas (a tank that is
//! drained cools by 5-20 K for seconds; neglected). The regulator's own pressure is
//! constant. Typical: 1-20 l, 5-20 mm2, a sag of 1-3 % (0.1-0.5 bar); it
//! matters from a sag of about 0.3 %, under which usual gauges see
//! nothing. Confused with the silencer (cosine 0.80), a leak of the chambers (-0.64),
//! the critical ratio and the area of the supply paths, which hide 77-91 % of it.
//! What separates: it follows the sum of both inflows and outlasts them by seconds;
//! or a recorded supply pressure, which drives the valve in its place
//! ([`crate::pneumatics::Pneumatics::step`]) and leaves nothing to model.
//!
//! The tank's flow to the chambers is the one that the chambers took: mass is
//! conserved to rounding. Stable for every volume and feed.

use super::volume_node::VolumeNode;
use crate::math::Compensated;
use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// The tank never leaves these, Pa: those of a chamber.
const PRESSURE_RANGE_PA: [f64; 2] = [100.0, 1e9];

/// The tank; a volume of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupplyDroop<R> {
    /// Volume, m3.
    pub tank_volume_m3: R,
    /// Area of the orifice between regulator and tank, m2.
    pub feed_area_m2: R,
}

/// The tank's pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankState<R> {
    /// `None` until the first step of a tank that begins full.
    pressure_pa: Option<Compensated<R>>,
}

impl<R: Real> TankState<R> {
    /// At the regulator's pressure, whatever that is.
    pub const FULL: Self = Self { pressure_pa: None };

    /// At a pressure, for a recording that begins within a droop.
    pub fn at(pressure_pa: R) -> Self {
        Self {
            pressure_pa: Some(Compensated::new(pressure_pa)),
        }
    }

    /// The pressure, Pa, behind a regulator of `regulator_pa`.
    pub fn pressure_pa(&self, regulator_pa: R) -> R {
        self.pressure_pa.map_or(regulator_pa, |sum| sum.value)
    }
}

impl<R: Real> SupplyDroop<R> {
    /// The regulator holds its pressure at the valve; the feed is a middling one,
    /// ready for a fit.
    pub fn neutral() -> Self {
        Self {
            tank_volume_m3: R::ZERO,
            feed_area_m2: R::from_f64(1e-5),
        }
    }

    /// Whether there is a tank at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.tank_volume_m3 > R::ZERO
    }

    /// The tank between this regulator and the valve, for one step.
    pub(crate) fn between<'a>(
        &self,
        law: &'a FlowLaw<R>,
        gas_constant_j_per_kg_k: R,
        regulator: GasState<R>,
        dt_s: R,
    ) -> FedTank<'a, R> {
        FedTank(VolumeNode {
            law,
            area_m2: self.feed_area_m2,
            outer: regulator,
            capacity_kg_per_s_pa: self.tank_volume_m3
                / (gas_constant_j_per_kg_k * regulator.temperature_k * dt_s),
        })
    }
}

/// A tank and its regulator through one step.
#[derive(Clone, Copy)]
pub(crate) struct FedTank<'a, R>(VolumeNode<'a, R>);

impl<R: Real> FedTank<'_, R> {
    /// The tank's gas now.
    pub fn now(&self, state: &TankState<R>) -> GasState<R> {
        GasState {
            pressure_pa: state.pressure_pa(self.0.outer.pressure_pa),
            ..self.0.outer
        }
    }

    /// The gas that the valve sees, from the draw at the present pressure and its
    /// slope by that pressure.
    pub fn seen(&self, state: &TankState<R>, draw: (R, R)) -> GasState<R> {
        let present = self.now(state);
        let pressure_pa = self.0.seen_pa(present.pressure_pa, (-draw.0, -draw.1));
        GasState {
            pressure_pa,
            ..present
        }
    }

    /// Accounts for what the valve drew on average, kg/s.
    pub fn step(&self, state: &mut TankState<R>, seen: GasState<R>, drawn_kg_per_s: R) {
        let present_pa = self.now(state).pressure_pa;
        let mut sum = state.pressure_pa.unwrap_or(Compensated::new(present_pa));
        sum.add(
            self.0
                .change_pa(present_pa, seen.pressure_pa, -drawn_kg_per_s),
        );
        let [least, most] = PRESSURE_RANGE_PA.map(R::from_f64);
        let limited = sum.value.clamp(least, most);
        if limited != sum.value {
            sum = Compensated::new(limited);
        }
        state.pressure_pa = Some(sum);
    }
}
