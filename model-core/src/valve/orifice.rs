//! Mass flow through one orifice, (1) and (2), with its slopes.
//!
//! With r = pd/pu, u upstream, d downstream, absolute pressures:
//!
//! ```text
//! m' = A Cd(r) C1 pu / sqrt(Tu) psi(r)
//! psi = 1                                              r <= b       choked
//!     = sqrt(1 - ((r - b)/(1 - b))^2)              b < r < lambda   subsonic
//!     = (1 - r)/(1 - lambda) psi(lambda)       lambda <= r <= 1     laminar
//! Cd  = 0.8153 + s r - 0.1038 r^2                      s = 0.0933 as published
//! ```
//!
//! Continuous everywhere; the slope jumps by a factor of 2 at lambda (a kink in
//! the law as published) and is continuous at b. Flow against the direction
//! 1 -> 2 is negative and takes the temperature of side 2.

use super::GasState;
use crate::real::Real;

/// Discharge coefficient (2): its constant term; a scale of the areas stands for another one.
const DISCHARGE: f64 = 0.8153;
/// Its quadratic term in r.
const DISCHARGE_CURVATURE: f64 = -0.1038;

/// Pressures below this are taken as this, so that the pressure ratio exists.
/// 1 Pa is a vacuum that no pneumatic axis sees.
const LEAST_PRESSURE_PA: f64 = 1.0;

/// A laminar ratio above this is taken as this: at 1 the law's slope is
/// infinite where the pressures are equal. 0.9999 is ten times nearer to 1 than
/// any in use.
const MOST_LAMINAR_RATIO: f64 = 0.9999;

/// Pressures nearer than this share of the higher count as this far apart where a
/// chord of the law is asked for: well inside of the laminar part, where chord and
/// slope agree to the change of Cd (1e-5), and well above the rounding of `f32`.
const CHORD_SHARE: f64 = 1e-4;

/// Parameters of the flow law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowLaw<R> {
    /// b, 0 < b < lambda: below it the flow is choked.
    pub critical_pressure_ratio: R,
    /// lambda, b < lambda < 1: above it the flow is laminar.
    pub laminar_pressure_ratio: R,
    /// s of the discharge coefficient, as other orifices have another.
    pub discharge_slope: R,
    /// C1 of the gas, s K^0.5/m.
    pub flow_coefficient: R,
}

/// Mass flow from side 1 to side 2 and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrificeFlow<R> {
    /// Mass flow from 1 to 2, kg/s.
    pub mass_flow_kg_per_s: R,
    /// Its derivative by the pressure of side 1, kg/(s Pa), never negative.
    pub slope_1_kg_per_s_pa: R,
    /// Its derivative by the pressure of side 2, kg/(s Pa), never positive.
    pub slope_2_kg_per_s_pa: R,
}

impl<R: Real> FlowLaw<R> {
    /// Flow through an orifice of `area_m2` from side 1 to side 2.
    #[inline]
    pub fn flow(&self, area_m2: R, side_1: GasState<R>, side_2: GasState<R>) -> OrificeFlow<R> {
        if side_1.pressure_pa < side_2.pressure_pa {
            let (flow, upstream, downstream) = self.forward(area_m2, side_2, side_1);
            OrificeFlow {
                mass_flow_kg_per_s: -flow,
                slope_1_kg_per_s_pa: -downstream,
                slope_2_kg_per_s_pa: -upstream,
            }
        } else {
            let (flow, upstream, downstream) = self.forward(area_m2, side_1, side_2);
            OrificeFlow {
                mass_flow_kg_per_s: flow,
                slope_1_kg_per_s_pa: upstream,
                slope_2_kg_per_s_pa: downstream,
            }
        }
    }

    /// Flow over pressure difference, kg/(s Pa): the chord of the law from equal
    /// pressures. Where the law is concave, as beyond its laminar part, the chord is
    /// steeper than the slope: an implicit step with it neither overshoots nor
    /// rings. Nearer than 1e-4 of the higher pressure it is taken as there.
    pub fn conductance(&self, area_m2: R, side_1: GasState<R>, side_2: GasState<R>) -> R {
        let least_pa = (side_1.pressure_pa.max(side_2.pressure_pa) * R::from_f64(CHORD_SHARE))
            .max(R::from_f64(LEAST_PRESSURE_PA * CHORD_SHARE));
        let apart_pa = side_1.pressure_pa - side_2.pressure_pa;
        let (side_1, apart_pa) = if apart_pa.abs() < least_pa {
            let apart_pa = if apart_pa < R::ZERO {
                -least_pa
            } else {
                least_pa
            };
            let pressure_pa = side_2.pressure_pa + apart_pa;
            (
                GasState {
                    pressure_pa,
                    ..side_1
                },
                apart_pa,
            )
        } else {
            (side_1, apart_pa)
        };
        self.flow(area_m2, side_1, side_2).mass_flow_kg_per_s / apart_pa
    }

    /// Flow and its slopes by the upstream and downstream pressure.
    fn forward(&self, area_m2: R, up: GasState<R>, down: GasState<R>) -> (R, R, R) {
        let upstream_pa = up.pressure_pa.max(R::from_f64(LEAST_PRESSURE_PA));
        let ratio = down.pressure_pa.max(R::ZERO) / upstream_pa;
        let (shape, shape_slope) = self.shape(ratio, up.temperature_k);
        let conductance = area_m2 * self.flow_coefficient;
        (
            conductance * upstream_pa * shape,
            (conductance * (shape - ratio * shape_slope)).max(R::ZERO),
            (conductance * shape_slope).min(R::ZERO),
        )
    }

    /// Discharge coefficient (2) at a pressure ratio.
    #[inline]
    pub fn discharge(&self, ratio: R) -> R {
        let [constant, quadratic] = [DISCHARGE, DISCHARGE_CURVATURE].map(R::from_f64);
        constant + ratio * (self.discharge_slope + ratio * quadratic)
    }

    /// The discharge coefficient at the pressure ratio where it is largest.
    pub fn most_discharge(&self) -> R {
        let quadratic = R::from_f64(DISCHARGE_CURVATURE);
        let ratio = -self.discharge_slope / (quadratic + quadratic);
        self.discharge(ratio.max(R::ZERO).min(R::ONE))
    }

    /// Cd where the flow chokes, at r = b.
    pub fn choked_discharge(&self) -> R {
        self.discharge(self.critical_pressure_ratio)
    }

    /// Cd(r) psi(r) / sqrt(T) and its derivative by r.
    #[inline]
    fn shape(&self, ratio: R, upstream_k: R) -> (R, R) {
        let (psi, psi_slope) = self.psi(ratio, upstream_k);
        let discharge = self.discharge(ratio);
        let quadratic = R::from_f64(DISCHARGE_CURVATURE);
        let discharge_slope = self.discharge_slope + (quadratic + quadratic) * ratio;
        (
            discharge * psi,
            discharge_slope * psi + discharge * psi_slope,
        )
    }

    /// psi(r) / sqrt(T) and its derivative by r. Both roots are taken as one: on a
    /// chip they are the dearest part of the law.
    #[inline]
    fn psi(&self, ratio: R, upstream_k: R) -> (R, R) {
        let critical = self.critical_pressure_ratio;
        if ratio <= critical {
            return ((R::ONE / upstream_k).sqrt(), R::ZERO);
        }
        let laminar = self
            .laminar_pressure_ratio
            .min(R::from_f64(MOST_LAMINAR_RATIO));
        let span = R::ONE - critical;
        let q = (ratio.min(laminar) - critical) / span;
        let psi = ((R::ONE - q * q).max(R::ZERO) / upstream_k).sqrt();
        if ratio < laminar {
            (psi, -q / (span * upstream_k * psi))
        } else {
            let slope = -psi / (R::ONE - laminar);
            (slope * (ratio - R::ONE), slope)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gas::Gas;

    fn law() -> FlowLaw<f64> {
        FlowLaw {
            critical_pressure_ratio: 0.29,
            laminar_pressure_ratio: 0.98,
            discharge_slope: crate::paper::DISCHARGE_SLOPE,
            flow_coefficient: Gas::new(1.4, 287.0).flow_coefficient,
        }
    }

    fn side(pressure_pa: f64, temperature_k: f64) -> GasState<f64> {
        GasState {
            pressure_pa,
            temperature_k,
        }
    }

    fn at_ratio(ratio: f64) -> f64 {
        law()
            .flow(1e-5, side(6e5, 293.15), side(6e5 * ratio, 293.15))
            .mass_flow_kg_per_s
    }

    #[test]
    fn prop_flow_is_continuous_where_the_branches_meet() {
        for ratio in [0.29, 0.98, 1.0] {
            let gap = at_ratio(ratio + 1e-12) - at_ratio(ratio - 1e-12);
            assert!(gap.abs() < 1e-9 * at_ratio(0.0), "gap {gap} at {ratio}");
        }
        assert_eq!(at_ratio(1.0).abs().to_bits(), 0.0_f64.to_bits());
    }

    #[test]
    fn prop_flow_falls_with_the_pressure_ratio_once_subsonic() {
        let mut before = at_ratio(0.45);
        for step in 1..=110 {
            let now = at_ratio(0.45 + 0.005 * f64::from(step));
            assert!(now < before, "at {step}");
            before = now;
        }
    }

    #[test]
    fn prop_reverse_flow_is_the_mirror_image_with_the_other_temperature() {
        let forward = law().flow(1e-5, side(6e5, 300.0), side(4e5, 280.0));
        let reverse = law().flow(1e-5, side(4e5, 280.0), side(6e5, 300.0));
        let same = |a: f64, b: f64| assert_eq!(a.to_bits(), (-b).to_bits());
        same(forward.mass_flow_kg_per_s, reverse.mass_flow_kg_per_s);
        same(forward.slope_1_kg_per_s_pa, reverse.slope_2_kg_per_s_pa);
        same(forward.slope_2_kg_per_s_pa, reverse.slope_1_kg_per_s_pa);
    }

    #[test]
    fn prop_slopes_agree_with_differences_in_every_branch() {
        for (p1, p2) in [
            (6e5, 1e5),
            (6e5, 4e5),
            (6e5, 5.95e5),
            (5.95e5, 6e5),
            (3e5, 6e5),
        ] {
            let flow = |p1, p2| law().flow(1e-5, side(p1, 290.0), side(p2, 280.0));
            let here = flow(p1, p2);
            let by_1 =
                flow(p1 + 1.0, p2).mass_flow_kg_per_s - flow(p1 - 1.0, p2).mass_flow_kg_per_s;
            let by_2 =
                flow(p1, p2 + 1.0).mass_flow_kg_per_s - flow(p1, p2 - 1.0).mass_flow_kg_per_s;
            // 9 % of the full slope: the limit at nought hides the weak rise of
            // the choked flow with the downstream pressure that (2) implies
            // (Cd' / Cd = 0.0933 / 0.8153 = 11 % per unit of r at the most).
            let scale = 0.09
                * here
                    .slope_1_kg_per_s_pa
                    .abs()
                    .max(here.slope_2_kg_per_s_pa.abs());
            assert!((here.slope_1_kg_per_s_pa - by_1 / 2.0).abs() <= scale);
            assert!((here.slope_2_kg_per_s_pa - by_2 / 2.0).abs() <= scale);
        }
    }

    #[test]
    fn prop_conductance_times_difference_is_the_flow_and_meets_the_slope() {
        for p2 in [1e5, 5.9e5, 6.1e5, 9e5] {
            let (one, two) = (side(6e5, 290.0), side(p2, 290.0));
            let flow = law().flow(1e-5, one, two).mass_flow_kg_per_s;
            let chord = law().conductance(1e-5, one, two);
            assert!((chord * (6e5 - p2) / flow - 1.0).abs() < 1e-12);
        }
        for p2 in [6e5, 6e5 - 1.0, 6e5 + 1.0] {
            let (one, two) = (side(6e5, 290.0), side(p2, 290.0));
            let slope = law().flow(1e-5, one, two).slope_1_kg_per_s_pa;
            let chord = law().conductance(1e-5, one, two);
            assert!((chord / slope - 1.0).abs() < 1e-3, "{chord} for {slope}");
        }
    }

    #[test]
    fn val_choked_flow_of_the_nominal_valve() {
        // 16.7 mm2 at 6 bar abs, 293.15 K: 19.7 g/s by the textbook formula with
        // Cd(0) = 0.8153 (C = 2.77e-8 for b = 0.29).
        let flow = law()
            .flow(16.7e-6, side(6e5, 293.15), side(0.0, 293.15))
            .mass_flow_kg_per_s;
        let by_hand = 16.7e-6 * 0.8153 * 0.040_418_4 * 6e5 / 293.15_f64.sqrt();
        assert!((flow - by_hand).abs() < 1e-6 * by_hand);
        assert!((flow - 0.0193).abs() < 0.0005);
    }

    #[test]
    fn regress_a_laminar_ratio_of_one_passes_nothing_at_equal_pressures() {
        let law = FlowLaw {
            laminar_pressure_ratio: 1.0,
            ..law()
        };
        for ratio in [1.0 - 1e-16, 1.0] {
            let flow = law.flow(1e-5, side(6e5, 293.0), side(6e5 * ratio, 293.0));
            assert!(flow.mass_flow_kg_per_s.abs() < 1e-12);
            assert!(flow.slope_1_kg_per_s_pa.is_finite());
        }
    }

    #[test]
    fn prop_vacuum_and_nan_do_not_panic() {
        assert!(
            law()
                .flow(1e-5, side(0.0, 293.0), side(0.0, 293.0))
                .mass_flow_kg_per_s
                .is_finite()
        );
        assert!(
            law()
                .flow(1e-5, side(f64::NAN, 293.0), side(1e5, 293.0))
                .mass_flow_kg_per_s
                .is_nan()
        );
    }
}
