//! `port-throttle`: a chamber breathes out through a one-way flow control at its port.
//!
//! ```text
//! q(At, p, pm) = q(Av, pm, pd)      throttle At, valve Av, and the pressure pm between them
//! A = Av q(Av, pm, pd) / q(Av, p, pd)
//! ```
//!
//! A speed controller (meter-out): a needle beside a check valve that lets gas in freely. Gas
//! that leaves goes through the needle, whichever path of the valve it takes. Usual on standard
//! cylinders, and left there when a servo valve takes the place of a switching one. Throttles set
//! to 1-10 mm2; it matters below some three times the valve's own area. Both pass the same flow
//! (ISO 6358-3 treats components in series so), without a volume between them; the gas there is
//! as warm as before, as a throttle does no work. With s the share of the pressure that the
//! throttle takes over that of the valve, and rho the valve's chord q/(p - p') over that of the
//! throttle at these pressures, s' = rho^2 / s ends at once where both flows go with the root of
//! the difference, and s' = rho where they go with the difference, as the laminar part of the law
//! does; from s = (Av/At)^2 three steps in turn are within 0.1 % of the flow, and 1 % below
//! 1.1 bar. The rule 1/A^2 = 1/Av^2 + 1/At^2 passes up to 8 % too little.
//!
//! The downstream pressure of the exhaust is taken as that of the surroundings. With a tube the
//! throttle stands at the chamber and adds to its mouth's resistance.
//!
//! Confused with exhaust areas of the valve that are smaller than stated (those fall in
//! proportion at every opening, a throttle takes most from the widest), with a silencer (which
//! holds both chambers' exhaust up, and has a volume) and with a tube. What separates is bursts
//! from small to full opening, both ways.

use super::end_cushion::outflow_resistance_pa_s_per_kg;
use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// A path of the valve of less than this share of the throttle does not feel it.
const NEXT_TO_NONE: f64 = 1e-3;
/// Steps to the pressure between the two: each as if both flows went with the root of their
/// pressure difference, or with the difference itself, as they do where that is small.
const STEPS: [bool; 3] = [true, false, true];

/// The throttle of one port; an area of 0 is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PortThrottle<R> {
    /// Area for gas that leaves the chamber, m2.
    pub outlet_area_m2: R,
}

impl<R: Real> PortThrottle<R> {
    /// No throttle.
    pub const NEUTRAL: Self = Self {
        outlet_area_m2: R::ZERO,
    };

    /// Whether there is a throttle at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.outlet_area_m2 > R::ZERO
    }

    /// The area of a path of the valve that passes what it and the throttle before it pass, from
    /// the gas inside a chamber to that beyond the valve.
    #[inline]
    pub fn outlet_area_m2(
        &self,
        law: &FlowLaw<R>,
        valve_m2: R,
        inside: GasState<R>,
        beyond: GasState<R>,
    ) -> R {
        if self.is_present() {
            self.throttled_m2(law, valve_m2, inside, beyond)
        } else {
            valve_m2
        }
    }

    /// The same of a throttle that is there; out of line, as most axes have none.
    #[inline(never)]
    fn throttled_m2(
        &self,
        law: &FlowLaw<R>,
        valve_m2: R,
        inside: GasState<R>,
        beyond: GasState<R>,
    ) -> R {
        let throttle_m2 = self.outlet_area_m2;
        let flows_out = inside.pressure_pa > beyond.pressure_pa;
        if !flows_out || valve_m2 <= throttle_m2 * R::from_f64(NEXT_TO_NONE) {
            return valve_m2;
        }
        let ratio = valve_m2 / throttle_m2;
        let fallen_pa = inside.pressure_pa - beyond.pressure_pa;
        let between = |shares: R| GasState {
            pressure_pa: beyond.pressure_pa + fallen_pa / (R::ONE + shares),
            ..inside
        };
        let valve = |gas| law.conductance(valve_m2, gas, beyond);
        let mut shares = ratio * ratio;
        for flows_with_root in STEPS {
            let gas = between(shares);
            let chords = valve(gas) / law.conductance(throttle_m2, inside, gas);
            shares = if flows_with_root {
                chords * chords / shares
            } else {
                chords
            };
        }
        // Of the two the one that takes more of the pressure says better what passes.
        let gas = between(shares);
        let passes = if shares > R::ONE {
            shares * law.conductance(throttle_m2, inside, gas)
        } else {
            valve(gas)
        };
        valve_m2 * passes / (valve(inside) * (R::ONE + shares))
    }

    /// Resistance of the throttle to a flow out of the chamber into a tube, Pa s/kg.
    pub fn resistance_pa_s_per_kg(
        &self,
        law: &FlowLaw<R>,
        chamber: GasState<R>,
        tube: GasState<R>,
    ) -> R {
        if self.is_present() {
            outflow_resistance_pa_s_per_kg(law, self.outlet_area_m2, chamber, tube)
        } else {
            R::ZERO
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const THROTTLE: PortThrottle<f64> = PortThrottle {
        outlet_area_m2: 4e-6,
    };

    const fn gas(pressure_pa: f64) -> GasState<f64> {
        GasState {
            pressure_pa,
            temperature_k: 293.15,
        }
    }

    /// Both in series, solved for the pressure between them by halves.
    fn exact_kg_per_s(law: &FlowLaw<f64>, valve_m2: f64, inside: GasState<f64>) -> f64 {
        let beyond = gas(1e5);
        let (mut low, mut high) = (beyond.pressure_pa, inside.pressure_pa);
        for _ in 0..60 {
            let between = gas(0.5 * (low + high));
            let arrives = law.flow(4e-6, inside, between).mass_flow_kg_per_s;
            if arrives > law.flow(valve_m2, between, beyond).mass_flow_kg_per_s {
                low = between.pressure_pa;
            } else {
                high = between.pressure_pa;
            }
        }
        law.flow(valve_m2, gas(low), beyond).mass_flow_kg_per_s
    }

    #[test]
    fn val_the_flow_through_both_is_that_of_the_exact_pressure_between() {
        let law = paper::axis::<f64>().pneumatics.law;
        for pressure_pa in [1.02e5, 1.1e5, 1.5e5, 2e5, 3e5, 6e5, 8e5] {
            let inside = gas(pressure_pa);
            for step in 0..40 {
                let valve_m2 = 4e-6 * 10.0_f64.powf(f64::from(step) * 0.09 - 2.0);
                let area_m2 = THROTTLE.outlet_area_m2(&law, valve_m2, inside, gas(1e5));
                assert!(area_m2 > 0.0 && area_m2 < valve_m2);
                let ruled = law.flow(area_m2, inside, gas(1e5)).mass_flow_kg_per_s;
                let exact = exact_kg_per_s(&law, valve_m2, inside);
                let off = (ruled / exact - 1.0).abs();
                assert!(
                    off < if pressure_pa > 1.4e5 { 2e-3 } else { 1.2e-2 },
                    "{off}"
                );
            }
        }
    }

    #[test]
    fn prop_it_is_nothing_to_gas_that_enters_or_where_there_is_none() {
        let law = paper::axis::<f64>().pneumatics.law;
        let same = |throttle: PortThrottle<f64>, inside_pa: f64| {
            let area_m2 = throttle.outlet_area_m2(&law, 1e-5, gas(inside_pa), gas(1e5));
            area_m2.to_bits() == 1e-5_f64.to_bits()
        };
        assert!(same(THROTTLE, 0.9e5) && same(PortThrottle::NEUTRAL, 6e5));
        assert!(!same(THROTTLE, 6e5));
    }

    /// The pressure that it takes off a flow in a tube is that which its flow law asks for.
    #[test]
    fn val_resistance_in_a_tube_is_the_chord_of_the_flow_law() {
        let law = paper::axis::<f64>().pneumatics.law;
        let (chamber, tube) = (gas(5e5), gas(4.6e5));
        let flow = law.flow(4e-6, chamber, tube).mass_flow_kg_per_s;
        let resistance = THROTTLE.resistance_pa_s_per_kg(&law, chamber, tube);
        assert!((resistance * flow / 0.4e5 - 1.0).abs() < 1e-9);
        let inwards = THROTTLE.resistance_pa_s_per_kg(&law, tube, chamber);
        assert!(inwards.abs() < f64::MIN_POSITIVE, "the check valve is open");
    }
}
