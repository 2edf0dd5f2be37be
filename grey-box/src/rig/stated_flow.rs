//! The valve's flow as a data sheet states it, and the area tables that follow from it.
//!
//! ISO 6358 states the mass flow through a path as
//!
//! ```text
//! m' = C rho0 p1 sqrt(T0/T1) phi(r)      r = p2/p1, rho0 = 1.185 kg/m3, T0 = 293.15 K (ANR)
//! phi = 1                                     r <= b
//!     = (1 - ((r - b)/(1 - b))^2)^m           r > b
//! ```
//!
//! and the model (`model_core::valve`) as `m' = A Cd(r) C1 p1 / sqrt(T1) psi(r)`, with the same
//! `psi = phi` for m = 0.5. The fully open area follows where both are equal:
//!
//! * from C at r = b, where the flow chokes: `A = C rho0 sqrt(T0) / (Cd(b) C1)`;
//! * from the nominal flow, that of 6 to 5 bar gauge at T0, at r = 6.013/7.013.
//!
//! For another m the model's b is the one by which the flow from 6 to 5 bar stays:
//! `q = sqrt(1 - phi(r)^2)`, `b' = (r - q)/(1 - q)`.
//!
//! A data sheet does not state the area over the command. Assumed is: closed up to a dead zone,
//! then linear up to the full opening; supply and exhaust alike; a closed path leaks a share of
//! the full area. [`assumptions`](StatedFlow::assumptions) lists what was assumed.

use model_core::gas::Gas;
use model_core::paper::DISCHARGE_SLOPE;
use model_core::valve::{FlowLaw, GasState};

use super::Rig;
use super::facts::{Facts, Limits, RATIO, facts, limits, positive};
use super::valve_table::ValveTable;
use crate::units::{ANR_DENSITY_KG_M3, ANR_TEMPERATURE_K};

/// The ratio that a stated flow gives as b.
pub(super) const CRITICAL_RATIO: &str = "valve.critical_pressure_ratio";
/// Atmosphere to which the 6 and 5 bar gauge of a nominal flow add, Pa.
const NOMINAL_ATMOSPHERE_PA: f64 = 101_325.0;
/// The two pressures of a nominal flow, Pa gauge.
const NOMINAL_GAUGE_PA: [f64; 2] = [6e5, 5e5];
/// Flow of 1 l/min (ANR), kg/s.
const KG_S_PER_L_MIN: f64 = ANR_DENSITY_KG_M3 / 60_000.0;
/// Dead zone where none is stated, V: 0.2 to 0.5 are usual.
const ASSUMED_DEAD_ZONE_V: f64 = 0.3;
/// Leakage area of a closed path over the fully open area: 0.1 mm2 of 16.7 mm2 for a valve with
/// metal seals and 700 l/min.
const ASSUMED_LEAKAGE_SHARE: f64 = 0.006;
/// The subsonic index of the model.
const MODEL_INDEX: f64 = 0.5;

/// What `[valve]` states of its flow in place of area tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StatedFlow {
    /// Nominal flow from 6 to 5 bar gauge, l/min (ANR).
    pub nominal_flow_l_min: Option<f64>,
    /// Sonic conductance C, m3/(s Pa).
    pub sonic_conductance_m3_s_pa: Option<f64>,
    /// Critical pressure ratio b.
    pub critical_pressure_ratio: Option<f64>,
    /// Subsonic index m.
    pub subsonic_index: Option<f64>,
    /// Opening up to which the paths stay closed, V.
    pub dead_zone_v: Option<f64>,
    /// Opening at which they are fully open, V.
    pub full_opening_v: Option<f64>,
}

/// One key of [`StatedFlow`].
pub(super) struct StatedFlowKey {
    pub name: &'static str,
    pub facts: Facts,
    pub limits: Limits,
    pub field: fn(&mut StatedFlow) -> &mut Option<f64>,
}

pub(super) static STATED_FLOW: &[StatedFlowKey] = &[
    StatedFlowKey {
        name: "valve.nominal_flow_l_min",
        facts: facts(
            "l/min(ANR)",
            "100 to 2000",
            "nominal flow from 6 to 5 bar gauge",
            "data sheet: standard nominal flow",
        ),
        limits: positive(1e6, "l/min above 0 and at most 1000000"),
        field: |flow| &mut flow.nominal_flow_l_min,
    },
    StatedFlowKey {
        name: "valve.C_m3_s_Pa",
        facts: facts(
            "m3/(s Pa)",
            "3e-8 (700 l/min); 1 l/(s bar) is 1e-8",
            "sonic conductance C of ISO 6358, in place of the nominal flow",
            "data sheet: C",
        ),
        limits: positive(
            1e-4,
            "m3/(s Pa) above 0 and at most 1e-4 (1 l/(s bar) is 1e-8)",
        ),
        field: |flow| &mut flow.sonic_conductance_m3_s_pa,
    },
    StatedFlowKey {
        name: "valve.b",
        facts: facts(
            "1",
            "0.2 to 0.5",
            "critical pressure ratio b of ISO 6358, needed beside nominal_flow_l_min or C_m3_s_Pa",
            "data sheet: b; typical 0.3 where it states none",
        ),
        limits: RATIO,
        field: |flow| &mut flow.critical_pressure_ratio,
    },
    StatedFlowKey {
        name: "valve.m",
        facts: facts(
            "1",
            "0.5",
            "subsonic index m of ISO 6358; 0.5 if absent; another one is converted into b",
            "data sheet: m",
        ),
        limits: limits(0.2, 1.5, "an index from 0.2 to 1.5"),
        field: |flow| &mut flow.subsonic_index,
    },
    StatedFlowKey {
        name: "valve.dead_zone_V",
        facts: facts(
            "V",
            "0.2 to 0.5",
            "opening up to which the closed path stays closed; 0.3 is assumed if absent",
            "slow command ramp: half of the range in which the piston does not move",
        ),
        limits: limits(0.0, 1000.0, "volts from 0 to 1000"),
        field: |flow| &mut flow.dead_zone_v,
    },
    StatedFlowKey {
        name: "valve.full_opening_V",
        facts: facts(
            "V",
            "5",
            "opening at which the path is fully open; null_V is assumed if absent and null_V is above 0",
            "half of the command range: 5 for 0 to 10 V, 10 for -10 to 10 V",
        ),
        limits: positive(1000.0, "volts above 0 and at most 1000"),
        field: |flow| &mut flow.full_opening_v,
    },
];

/// Area tables and critical pressure ratio of a stated flow.
pub(super) struct Derived {
    pub critical_pressure_ratio: f64,
    pub opening_v: Vec<f64>,
    pub area_m2: Vec<f64>,
}

/// Why a stated flow gives no areas: the key, what is wrong, what was expected.
pub(super) type StatedFlowFault = (&'static str, String, String);

impl StatedFlow {
    /// The areas that follow, for a valve of this null and laminar ratio.
    pub(super) fn derive(
        &self,
        null_v: f64,
        laminar_ratio: f64,
    ) -> Result<Derived, StatedFlowFault> {
        let missing = |key, expected: &str| (key, "missing".to_owned(), expected.to_owned());
        let stated_b = self.critical_pressure_ratio.ok_or_else(|| {
            let expected = "b of the data sheet beside the flow (0.3 is typical)";
            missing("valve.b", expected)
        })?;
        let full_opening_v = self.full_opening(null_v).ok_or_else(|| {
            let expected =
                "volts from the null to the full opening, as valve.null_V is not above 0";
            missing("valve.full_opening_V", expected)
        })?;
        let dead_zone_v = self.dead_zone();
        if dead_zone_v >= full_opening_v {
            let problem = format!("{dead_zone_v} is not below the full opening {full_opening_v}");
            return Err(("valve.dead_zone_V", problem, "a smaller dead zone".into()));
        }
        let index = self.subsonic_index.unwrap_or(MODEL_INDEX);
        let critical_pressure_ratio = model_critical_ratio(stated_b, index);
        if !(0.0..laminar_ratio).contains(&critical_pressure_ratio)
            || critical_pressure_ratio <= 0.0
        {
            let problem = format!(
                "{index} beside b = {stated_b} asks for b = {critical_pressure_ratio:.3} at m = 0.5"
            );
            return Err(("valve.m", problem, "b and m of one data sheet".into()));
        }
        let law = FlowLaw {
            critical_pressure_ratio,
            laminar_pressure_ratio: laminar_ratio,
            discharge_slope: DISCHARGE_SLOPE,
            flow_coefficient: Gas::new(1.4, 287.0).flow_coefficient,
        };
        let area_m2 = self.full_area_m2(&law)?;
        let leakage_m2 = ASSUMED_LEAKAGE_SHARE * area_m2;
        let (mut opening_v, mut areas) = (vec![0.0], vec![leakage_m2]);
        if dead_zone_v > 0.0 {
            opening_v.push(dead_zone_v);
            areas.push(leakage_m2);
        }
        opening_v.push(full_opening_v);
        areas.push(area_m2);
        Ok(Derived {
            critical_pressure_ratio,
            opening_v,
            area_m2: areas,
        })
    }

    /// The area of the open path, m2.
    fn full_area_m2(&self, law: &FlowLaw<f64>) -> Result<f64, StatedFlowFault> {
        let key = "valve.nominal_flow_l_min";
        match (self.nominal_flow_l_min, self.sonic_conductance_m3_s_pa) {
            (Some(flow_l_min), None) => Ok(area_of_nominal_flow(law, flow_l_min)),
            (None, Some(conductance)) => Ok(area_of_conductance(law, conductance)),
            (Some(_), Some(_)) => {
                let problem = "stands beside valve.C_m3_s_Pa".to_owned();
                Err((key, problem, "one of the two".into()))
            }
            (None, None) => {
                let expected = "nominal_flow_l_min or C_m3_s_Pa beside b";
                Err((key, "missing".to_owned(), expected.to_owned()))
            }
        }
    }

    fn dead_zone(&self) -> f64 {
        self.dead_zone_v.unwrap_or(ASSUMED_DEAD_ZONE_V)
    }

    /// A command range that begins at 0 is taken to be symmetric about its null.
    fn full_opening(&self, null_v: f64) -> Option<f64> {
        self.full_opening_v.or((null_v > 0.0).then_some(null_v))
    }

    /// What was assumed of the shape over the opening, each a key, a value and why.
    pub fn assumptions(&self, null_v: f64) -> Vec<(&'static str, f64, &'static str)> {
        let mut assumed = vec![(
            "valve leakage over full area",
            ASSUMED_LEAKAGE_SHARE,
            "a data sheet states no leakage of the closed path; areas in between are linear over the opening, supply and exhaust alike",
        )];
        if self.dead_zone_v.is_none() {
            let why = "valve.dead_zone_V is not stated; 0.2 to 0.5 V is usual";
            assumed.push(("valve.dead_zone_V", ASSUMED_DEAD_ZONE_V, why));
        }
        if let (None, Some(full_v)) = (self.full_opening_v, self.full_opening(null_v)) {
            let why =
                "valve.full_opening_V is not stated; a command range from 0 to twice the null";
            assumed.push(("valve.full_opening_V", full_v, why));
        }
        assumed
    }
}

/// The values whose deviation an entry of `[uncertainty]` states. That of a data sheet's flow is
/// the scale of both area tables, that of its b the critical ratio's.
pub(super) fn deviates<'k>(rig: &Rig, key: &'k str) -> Vec<&'k str> {
    let valve = rig.valve.as_ref();
    let stated = valve.is_some_and(|valve| valve.stated_flow.is_some());
    match key {
        "valve.C_m3_s_Pa" | "valve.nominal_flow_l_min" if stated => {
            vec![ValveTable::SupplyArea.key(), ValveTable::ExhaustArea.key()]
        }
        "valve.b" if stated => vec![CRITICAL_RATIO],
        other => vec![other],
    }
}

/// Upstream and downstream pressure of a nominal flow; their ratio is 0.857.
fn nominal_pressures_pa() -> [f64; 2] {
    NOMINAL_GAUGE_PA.map(|gauge_pa| gauge_pa + NOMINAL_ATMOSPHERE_PA)
}

/// b of the model (m = 0.5) that gives the stated flow from 6 to 5 bar.
fn model_critical_ratio(b: f64, index: f64) -> f64 {
    let [up_pa, down_pa] = nominal_pressures_pa();
    let ratio = down_pa / up_pa;
    if (index - MODEL_INDEX).abs() < f64::EPSILON || ratio <= b {
        return b;
    }
    let share = 1.0 - ((ratio - b) / (1.0 - b)).powi(2);
    let q = (1.0 - share.powf(2.0 * index)).sqrt();
    (ratio - q) / (1.0 - q)
}

fn unit_area_flow(law: &FlowLaw<f64>, up_pa: f64, down_pa: f64) -> f64 {
    let state = |pressure_pa| GasState {
        pressure_pa,
        temperature_k: ANR_TEMPERATURE_K,
    };
    law.flow(1.0, state(up_pa), state(down_pa))
        .mass_flow_kg_per_s
}

/// The fully open area by which the model passes a nominal flow, m2.
fn area_of_nominal_flow(law: &FlowLaw<f64>, flow_l_min: f64) -> f64 {
    let [up_pa, down_pa] = nominal_pressures_pa();
    flow_l_min * KG_S_PER_L_MIN / unit_area_flow(law, up_pa, down_pa)
}

fn area_of_conductance(law: &FlowLaw<f64>, conductance_m3_s_pa: f64) -> f64 {
    let up_pa = nominal_pressures_pa()[0];
    let choked = unit_area_flow(law, up_pa, law.critical_pressure_ratio * up_pa);
    conductance_m3_s_pa * ANR_DENSITY_KG_M3 * up_pa / choked
}

/// The nominal flow of a path of this sonic conductance, l/min.
pub fn nominal_flow_of_conductance(conductance_m3_s_pa: f64, b: f64) -> f64 {
    let [up_pa, down_pa] = nominal_pressures_pa();
    let q = ((down_pa / up_pa - b) / (1.0 - b)).max(0.0);
    conductance_m3_s_pa * ANR_DENSITY_KG_M3 * up_pa * (1.0 - q * q).sqrt() / KG_S_PER_L_MIN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derived(flow: &StatedFlow) -> Derived {
        flow.derive(5.0, 0.98)
            .unwrap_or_else(|fault| panic!("{fault:?}"))
    }

    fn nominal(flow_l_min: f64, b: f64) -> StatedFlow {
        StatedFlow {
            nominal_flow_l_min: Some(flow_l_min),
            critical_pressure_ratio: Some(b),
            ..StatedFlow::default()
        }
    }

    #[test]
    fn val_conductances_of_700_l_min_give_the_areas_computed_by_hand() {
        // C in 1e-8 m3/(s Pa), area in mm2, both worked by hand from the two flow laws.
        for (b, conductance, area_mm2) in
            [(0.21, 2.9, 17.6), (0.29, 2.77, 16.7), (0.35, 2.66, 16.0)]
        {
            let flow = StatedFlow {
                sonic_conductance_m3_s_pa: Some(conductance * 1e-8),
                critical_pressure_ratio: Some(b),
                ..StatedFlow::default()
            };
            let area_m2 = derived(&flow).area_m2[2];
            assert!((area_m2 * 1e6 - area_mm2).abs() < 0.1, "{b}: {area_m2}");
            let flow_l_min = nominal_flow_of_conductance(conductance * 1e-8, b);
            assert!((flow_l_min / 700.0 - 1.0).abs() < 0.01, "{b}: {flow_l_min}");
        }
    }

    #[test]
    fn prop_the_stated_nominal_flow_flows_from_6_to_5_bar() {
        let found = derived(&nominal(700.0, 0.3));
        let law = FlowLaw {
            critical_pressure_ratio: 0.3,
            laminar_pressure_ratio: 0.98,
            discharge_slope: DISCHARGE_SLOPE,
            flow_coefficient: Gas::new(1.4, 287.0).flow_coefficient,
        };
        let flow_kg_s = found.area_m2[2] * unit_area_flow(&law, 701_325.0, 601_325.0);
        assert!(
            (flow_kg_s * 60_000.0 / 1.185 - 700.0).abs() < 1e-9,
            "{flow_kg_s}"
        );
    }

    #[test]
    fn prop_the_stated_conductance_flows_where_it_chokes() {
        let flow = StatedFlow {
            sonic_conductance_m3_s_pa: Some(2.5e-8),
            critical_pressure_ratio: Some(0.31),
            ..StatedFlow::default()
        };
        let found = derived(&flow);
        let law = FlowLaw {
            critical_pressure_ratio: found.critical_pressure_ratio,
            laminar_pressure_ratio: 0.98,
            discharge_slope: DISCHARGE_SLOPE,
            flow_coefficient: Gas::new(1.4, 287.0).flow_coefficient,
        };
        let mass_flow = found.area_m2[2] * unit_area_flow(&law, 8e5, 0.31 * 8e5);
        let stated = 2.5e-8 * ANR_DENSITY_KG_M3 * 8e5;
        assert!((mass_flow / stated - 1.0).abs() < 1e-12);
    }

    #[test]
    fn prop_another_index_keeps_the_nominal_flow() {
        for (b, index) in [(0.2, 0.5), (0.3, 0.55), (0.35, 0.6), (0.3, 0.48)] {
            let ratio = nominal_pressures_pa()[1] / nominal_pressures_pa()[0];
            let phi = |b: f64, m: f64| (1.0 - ((ratio - b) / (1.0 - b)).powi(2)).powf(m);
            let found = model_critical_ratio(b, index);
            assert!(
                (phi(found, 0.5) - phi(b, index)).abs() < 1e-12,
                "{b} {index}: {found}"
            );
        }
    }

    #[test]
    fn val_a_range_without_a_positive_null_asks_for_the_full_opening() {
        let flow = nominal(700.0, 0.3);
        assert_eq!(derived(&flow).opening_v, [0.0, 0.3, 5.0]);
        let fault = flow.derive(0.0, 0.98).err().expect("unknown range");
        assert_eq!(fault.0, "valve.full_opening_V");
        let assumed = StatedFlow {
            full_opening_v: Some(10.0),
            ..flow
        };
        assert_eq!(
            assumed.derive(0.0, 0.98).expect("areas").opening_v,
            [0.0, 0.3, 10.0]
        );
        assert_eq!(assumed.assumptions(0.0).len(), 2);
    }
}
