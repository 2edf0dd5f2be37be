//! What each law needs of a rig, and what it takes for granted.
//!
//! A number without which a law has no answer is *lacking*: the law is not run,
//! and a line says which number, what it is, and what it typically is. A number
//! that has a defensible value without being stated is *assumed*, and is listed
//! with that value and its source wherever the law's results are shown.

use super::Law;
use crate::model::Values;
use crate::rig::Rig;
use serde::Serialize;
use std::fmt;

/// A number that a law cannot do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lack {
    /// The law that is not run.
    pub law: Law,
    /// `section.key` of the rig file.
    pub key: &'static str,
    /// What it is.
    pub what: &'static str,
    /// A typical value.
    pub typical: &'static str,
}

impl fmt::Display for Lack {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (section, key) = self.key.split_once('.').unwrap_or(("", self.key));
        write!(
            out,
            "the {} cannot be modelled: [{section}] {key} is missing ({}; typically {})",
            self.law.title(),
            self.what,
            self.typical
        )
    }
}

/// A number that the rig file does not state and a law uses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumed {
    /// `section.key` of the rig file.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Where it comes from.
    pub why: &'static str,
}

impl fmt::Display for Assumed {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = crate::text::plain(self.value, 4);
        write!(out, "{} = {value} {}: {}", self.key, self.unit, self.why)
    }
}

/// A number that a law may lack: key, what it is, a typical value.
type Need = (&'static str, &'static str, &'static str);

const STROKE: Need = ("cylinder.stroke_m", "the stroke", "0.5");
const AREAS: [Need; 2] = [
    (
        "cylinder.area_a_m2",
        "the piston area on the side of chamber A",
        "4.909e-4 for a bore of 25 mm",
    ),
    (
        "cylinder.area_b_m2",
        "the piston area on the side of chamber B",
        "4.909e-4 for a bore of 25 mm without a rod",
    ),
];
const DEAD_VOLUMES: [Need; 2] = [
    (
        "cylinder.dead_volume_a_m3",
        "the volume of chamber A at its end stop, fittings and tubes included",
        "2e-5",
    ),
    (
        "cylinder.dead_volume_b_m3",
        "the volume of chamber B at its end stop, fittings and tubes included",
        "2e-5",
    ),
];
const SUPPLY: Need = (
    "supply.pressure_Pa",
    "the absolute supply pressure, where no signal p_s records it",
    "7e5",
);

/// What the laws that a rig describes and these signals drive lack.
pub fn lacks(rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Lack> {
    let laws = Law::described(rig, has).into_iter();
    laws.flat_map(|law| lacks_of(law, rig, has)).collect()
}

pub(super) fn lacks_of(law: Law, rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Lack> {
    needs(law, rig, has)
        .into_iter()
        .filter(|(key, ..)| rig.value(key).is_none())
        .map(|(key, what, typical)| Lack {
            law,
            key,
            what,
            typical,
        })
        .collect()
}

fn needs(law: Law, rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Need> {
    let mut needs = Vec::new();
    let recorded = ["p_a", "p_b"].map(has);
    match law {
        Law::Chambers => {
            if rig.vessel.is_none() {
                needs.push(STROKE);
                // A valve joins both chambers to the same supply.
                for side in (0..2).filter(|side| recorded[*side] || rig.valve.is_some()) {
                    needs.extend([AREAS[side], DEAD_VOLUMES[side]]);
                }
            }
            if rig.valve.is_some() && !has("p_s") {
                needs.push(SUPPLY);
            }
        }
        Law::Carriage | Law::Balance => needs.extend(AREAS),
        Law::Force => needs.extend(
            (0..2)
                .filter(|side| recorded[*side])
                .map(|side| AREAS[side]),
        ),
        Law::Actuator => {}
    }
    needs
}

/// What the laws that run take for granted, each number once.
pub fn assumed(rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Assumed> {
    let laws = Law::of(rig, has);
    let runs = |law: Law| laws.contains(&law);
    let mechanics = runs(Law::Force) || runs(Law::Carriage);
    let mut all: Vec<Assumed> = Vec::new();
    let mut assume = |is_used: bool, key: &'static str, value: f64, unit, why| {
        if is_used && rig.value(key).is_none() {
            all.push(Assumed {
                key,
                value,
                unit,
                why,
            });
        }
    };
    let values = Values::<f64> {
        rig,
        keys: &[],
        replaced: &[],
    };
    let (gas, ambient) = (values.gas(), values.ambient());
    let gas_matters = runs(Law::Chambers);
    assume(
        gas_matters,
        "gas.gamma",
        gas.heat_capacity_ratio,
        "1",
        "air",
    );
    assume(
        gas_matters,
        "gas.gas_constant_J_kgK",
        gas.gas_constant_j_per_kg_k,
        "J/(kg K)",
        "air",
    );
    let is_gauge = rig.signals.iter().any(|(_, signal)| signal.unit.is_gauge());
    let ambient_matters = gas_matters || runs(Law::Carriage) || is_gauge;
    assume(
        ambient_matters,
        "environment.pressure_Pa",
        ambient.pressure_pa,
        "Pa",
        "standard atmosphere",
    );
    assume(
        gas_matters,
        "environment.temperature_K",
        ambient.temperature_k,
        "K",
        "the paper's laboratory; wall, supply and surroundings alike",
    );
    if gas_matters
        && rig.cylinder.is_some()
        && let Some(geometry) = values.geometry(crate::model::Side::A)
    {
        let why = "from the piston area, for the heat-exchange surface";
        assume(true, "cylinder.bore_m", geometry.bore_m, "m", why);
    }
    let levels = values.friction_levels();
    assume(
        mechanics,
        "friction.coulomb_N",
        levels.coulomb_n,
        "N",
        "no dry friction is modelled",
    );
    assume(
        mechanics,
        "friction.static_N",
        levels.static_n,
        "N",
        "as the Coulomb friction: no stiction beyond it is modelled",
    );
    assume(
        mechanics,
        "friction.viscous_Ns_m",
        levels.viscous_n_s_per_m,
        "N s/m",
        "no viscous friction is modelled",
    );
    let has_dry = mechanics && levels.coulomb_n > 0.0;
    let bristle = values.bristle();
    assume(
        has_dry,
        "friction.bristle_stiffness_N_m",
        bristle.stiffness_n_per_m,
        "N/m",
        "the paper's seal, its equation (9)",
    );
    let has_stribeck = has_dry && levels.static_n > levels.coulomb_n;
    assume(
        has_stribeck,
        "friction.stribeck_velocity_m_s",
        bristle.stribeck_velocity_m_per_s,
        "m/s",
        "the paper's seal, its equation (11)",
    );
    assume(
        runs(Law::Force),
        "carriage.mass_kg",
        0.0,
        "kg",
        "no inertia is modelled on the bench",
    );
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../rigs/paper.toml");

    fn paper_without(dropped: &[&str]) -> Rig {
        let kept = PAPER.lines().filter(|line| {
            let is_dropped = |key: &&str| {
                let uncertainty = format!(".{key}\"");
                line.starts_with(&format!("{key} ")) || line.contains(&uncertainty)
            };
            !dropped.iter().any(is_dropped)
        });
        let text: Vec<&str> = kept.collect();
        Rig::parse(&text.join("\n"), "rig.toml").expect("a rig")
    }

    fn is_recorded(signal: &str) -> bool {
        matches!(signal, "t" | "u" | "x" | "p_a" | "p_b" | "p_s")
    }

    #[test]
    fn val_a_whole_axis_lacks_and_assumes_nothing() {
        let rig = paper_without(&[]);
        assert_eq!(lacks(&rig, &is_recorded), []);
        assert_eq!(assumed(&rig, &is_recorded), []);
        assert_eq!(Law::of(&rig, &is_recorded), [Law::Chambers, Law::Carriage]);
    }

    /// A rig without its stroke was fitted perfectly, with an error of 0.00.
    #[test]
    fn regress_a_law_without_a_number_is_not_run_and_says_which() {
        let rig = paper_without(&["stroke_m", "position_zero"]);
        assert_eq!(Law::of(&rig, &is_recorded), [Law::Carriage]);
        let said = lacks(&rig, &is_recorded)[0].to_string();
        assert_eq!(
            said,
            "the chambers cannot be modelled: [cylinder] stroke_m is missing (the stroke; typically 0.5)"
        );
        for key in ["area_a_m2", "area_b_m2"] {
            assert_eq!(Law::of(&paper_without(&[key]), &is_recorded), [], "{key}");
        }
        for key in ["dead_volume_a_m3", "dead_volume_b_m3"] {
            let laws = Law::of(&paper_without(&[key]), &is_recorded);
            assert_eq!(laws, [Law::Carriage], "{key}");
        }
    }

    /// Seven bar of supply were taken for granted in silence.
    #[test]
    fn regress_a_supply_is_recorded_or_declared() {
        let mut rig = paper_without(&[]);
        rig.supply = None;
        assert_eq!(Law::of(&rig, &is_recorded).len(), 2);
        let unrecorded = |signal: &str| signal != "p_s" && is_recorded(signal);
        assert_eq!(Law::of(&rig, &unrecorded), [Law::Carriage]);
    }

    #[test]
    fn val_what_is_not_stated_is_listed_with_its_source() {
        let mut rig = paper_without(&["viscous_Ns_m", "bore_m"]);
        (rig.gas, rig.environment) = (None, None);
        let keys: Vec<&str> = assumed(&rig, &is_recorded)
            .iter()
            .map(|one| one.key)
            .collect();
        assert_eq!(
            keys,
            [
                "gas.gamma",
                "gas.gas_constant_J_kgK",
                "environment.pressure_Pa",
                "environment.temperature_K",
                "cylinder.bore_m",
                "friction.viscous_Ns_m",
            ]
        );
    }
}
