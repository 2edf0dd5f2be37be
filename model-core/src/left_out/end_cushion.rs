//! `end-cushion`: near its end of the stroke a chamber breathes out through a needle.
//!
//! ```text
//! 1/A^2 = 1/Av^2 + 1/An^2       valve's area Av and needle An in series
//! ```
//!
//! Within `length_m` of the end at which a chamber is smallest, the cushion's seal
//! shuts the way to the port and its gas leaves by the needle: to the exhaust or,
//! braked to more than the supply's pressure, back into the supply. A check valve lets
//! it in freely. The rule for orifices in series (that of ISO 6358-3 for conductances)
//! is exact for small pressure ratios and where one of the two is much the smaller;
//! both alike and choked, it passes 7 % too little. The edge of the spigot is blunt:
//! the seal closes over the first two tenths of a millimetre, the area smoothly with it.
//! Typical: 15-20 mm, 0.2-2 mm2; it matters wherever the needle is under the valve's
//! opening. Confused with friction that grows towards the end and with an elastic stop:
//! what separates is the pressure of the shrinking chamber, which rises with the speed,
//! and only inwards.
//!
//! With a tube the needle stands between chamber and tube and adds to its friction,
//! as the chord of the flow law between the two.

use crate::real::Real;
use crate::valve::{FlowLaw, GasState};

/// Way over which the cushion's seal closes, m.
const ENTRY_M: f64 = 2e-4;
/// A needle narrower than this counts as this, m2: the law divides by it.
const NARROWEST_NEEDLE_M2: f64 = 1e-12;

/// The cushions of both ends (two of a kind); a length of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndCushion<R> {
    /// Length of the cushion, m.
    pub length_m: R,
    /// Area of the needle, m2.
    pub needle_area_m2: R,
}

impl<R: Real> EndCushion<R> {
    /// No cushion; the needle is a usual one, ready for a fit.
    pub fn neutral() -> Self {
        Self {
            length_m: R::ZERO,
            needle_area_m2: R::from_f64(1e-6),
        }
    }

    /// Whether there is a cushion at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.length_m > R::ZERO
    }

    /// How far the seal has closed, 0 to 1, with this length of chamber left.
    pub fn closed_share(&self, chamber_length_m: R) -> R {
        let way = ((self.length_m - chamber_length_m) * R::from_f64(1.0 / ENTRY_M))
            .clamp(R::ZERO, R::ONE);
        way * way * (R::from_f64(3.0) - way - way)
    }

    /// The area of a path of the valve with the needle before it, for gas that leaves the chamber.
    pub fn outlet_area_m2(&self, valve_m2: R, chamber_length_m: R) -> R {
        let closed = self.closed_share(chamber_length_m);
        if closed <= R::ZERO {
            return valve_m2;
        }
        let series_m2 = in_series_m2(valve_m2, self.needle_m2());
        valve_m2 + closed * (series_m2 - valve_m2)
    }

    /// Resistance of the needle to a flow out of the chamber into a tube, Pa s/kg.
    pub fn resistance_pa_s_per_kg(
        &self,
        law: &FlowLaw<R>,
        chamber_length_m: R,
        chamber: GasState<R>,
        tube: GasState<R>,
    ) -> R {
        let closed = self.closed_share(chamber_length_m);
        if closed <= R::ZERO {
            return R::ZERO;
        }
        closed * outflow_resistance_pa_s_per_kg(law, self.needle_m2(), chamber, tube)
    }

    fn needle_m2(&self) -> R {
        self.needle_area_m2.max(R::from_f64(NARROWEST_NEEDLE_M2))
    }
}

/// Area of a path of the valve and a passage of over 0 one behind the other, m2.
#[inline]
fn in_series_m2<R: Real>(valve_m2: R, passage_m2: R) -> R {
    let ratio = valve_m2 / passage_m2;
    valve_m2 / (R::ONE + ratio * ratio).sqrt()
}

/// Resistance of a passage that a check valve opens to a flow into the chamber, Pa s/kg.
pub(super) fn outflow_resistance_pa_s_per_kg<R: Real>(
    law: &FlowLaw<R>,
    passage_m2: R,
    chamber: GasState<R>,
    tube: GasState<R>,
) -> R {
    if chamber.pressure_pa <= tube.pressure_pa {
        return R::ZERO;
    }
    R::ONE / law.conductance(passage_m2, chamber, tube)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    const CUSHION: EndCushion<f64> = EndCushion {
        length_m: 0.02,
        needle_area_m2: 1e-6,
    };

    #[test]
    fn prop_open_before_the_cushion_and_smooth_into_it() {
        let area = |length| CUSHION.outlet_area_m2(1e-5, length);
        assert_eq!(area(0.0201).to_bits(), 1e-5_f64.to_bits());
        assert!((area(0.02 - 1e-7) / 1e-5 - 1.0).abs() < 1e-6);
        assert!((area(0.019 + 1e-7) / area(0.01) - 1.0).abs() < 1e-6);
        assert!((area(0.01) / 1e-6 - 1.0).abs() < 6e-3, "the needle decides");
    }

    /// Two orifices in series, solved for the pressure between them.
    fn exact_flow(law: &FlowLaw<f64>, areas_m2: (f64, f64), up: GasState<f64>) -> f64 {
        let down = GasState {
            pressure_pa: 1e5,
            ..up
        };
        let (mut low, mut high) = (down.pressure_pa, up.pressure_pa);
        let mut flow = 0.0;
        for _ in 0..60 {
            let between = GasState {
                pressure_pa: 0.5 * (low + high),
                ..up
            };
            flow = law.flow(areas_m2.0, up, between).mass_flow_kg_per_s;
            if flow > law.flow(areas_m2.1, between, down).mass_flow_kg_per_s {
                low = between.pressure_pa;
            } else {
                high = between.pressure_pa;
            }
        }
        flow
    }

    #[test]
    fn val_series_rule_against_the_exact_pressure_between() {
        let law = paper::axis::<f64>().pneumatics.law;
        let mut worst = 0.0_f64;
        for pressure_pa in [1.1e5, 2e5, 6e5] {
            let up = GasState {
                pressure_pa,
                temperature_k: 293.15,
            };
            let down = GasState {
                pressure_pa: 1e5,
                ..up
            };
            for valve_m2 in [1e-7, 5e-7, 1e-6, 2e-6, 1e-5] {
                let series = CUSHION.outlet_area_m2(valve_m2, 0.0);
                let ruled = law.flow(series, up, down).mass_flow_kg_per_s;
                let exact = exact_flow(&law, (1e-6, valve_m2), up);
                worst = worst.max((ruled / exact - 1.0).abs());
            }
        }
        assert!(worst < 0.08, "off by {worst}");
    }
}
