//! What each law needs of a rig, and what it takes for granted.
//!
//! A number without which a law has no answer is *lacking*: the law is not run,
//! and a line says which number, what it is, and what it typically is. A number
//! that has a defensible value without being stated is *assumed*, and is listed
//! with that value and its source wherever the law's results are shown.

use super::{Law, spool};
use crate::effects;
use crate::model::{Side, Values};
use crate::rig::{ChamberModel, Friction, Rig, describe};
use model_core::friction::Bristle;
use serde::Serialize;
use std::fmt;

/// A number that a law cannot do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lack {
    /// The law that is not run.
    pub law: Law,
    /// `section.key` of the rig file.
    pub key: &'static str,
}

impl fmt::Display for Lack {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (section, key) = self.key.split_once('.').unwrap_or(("", self.key));
        let title = self.law.title();
        write!(
            out,
            "the {title} cannot be modelled: [{section}] {key} is missing"
        )?;
        match describe(self.key) {
            Some(facts) => write!(
                out,
                " ({}; typically {} {})",
                facts.what, facts.typical, facts.unit
            ),
            None => Ok(()),
        }
    }
}

/// A number that the rig file does not state and a law uses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumed {
    /// `section.key` of the rig file.
    pub key: String,
    /// The value in use.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Where it comes from.
    pub why: String,
}

impl fmt::Display for Assumed {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = crate::text::plain(self.value, 4);
        let unit = match self.unit.as_str() {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        write!(out, "{} = {value}{unit} ({})", self.key, self.why)
    }
}

const STROKE: &str = "cylinder.stroke_m";
const AREAS: [&str; 2] = ["cylinder.area_a_m2", "cylinder.area_b_m2"];
const DEAD_VOLUMES: [&str; 2] = ["cylinder.dead_volume_a_m3", "cylinder.dead_volume_b_m3"];
const SUPPLY: &str = "supply.pressure_Pa";
const MASS: &str = "carriage.mass_kg";

/// What the laws that a rig describes and these signals drive lack.
pub fn lacks(rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Lack> {
    let laws = Law::described(rig, has).into_iter();
    laws.flat_map(|law| lacks_of(law, rig, has)).collect()
}

pub(super) fn lacks_of(law: Law, rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<Lack> {
    keys(law, rig, has)
        .into_iter()
        .filter(|key| rig.value(key).is_none())
        .map(|key| Lack { law, key })
        .collect()
}

/// The numbers that a law needs of this rig with these signals.
pub fn keys(law: Law, rig: &Rig, has: &dyn Fn(&str) -> bool) -> Vec<&'static str> {
    let mut keys = Vec::new();
    let recorded = ["p_a", "p_b"].map(has);
    match law {
        Law::Chambers => {
            if rig.vessel.is_none() {
                keys.push(STROKE);
                // A valve joins both chambers to the same supply.
                for side in (0..2).filter(|side| recorded[*side] || rig.valve.is_some()) {
                    keys.extend([AREAS[side], DEAD_VOLUMES[side]]);
                }
            }
            if rig.valve.is_some() && !has("p_s") {
                keys.push(SUPPLY);
            }
        }
        Law::Carriage | Law::Balance => {
            keys.push(MASS);
            keys.extend(AREAS);
        }
        Law::Force => keys.extend(
            (0..2)
                .filter(|side| recorded[*side])
                .map(|side| AREAS[side]),
        ),
        Law::Actuator => {}
        Law::ValveFlow => keys.extend((!has("p_s")).then_some(SUPPLY)),
        Law::Spool => keys.extend(spool::is_length(rig).then_some(spool::GAIN)),
    }
    keys
}

/// The values that laws of this rig use though the rig does not state them.
pub fn assumed(rig: &Rig) -> Vec<Assumed> {
    let mut all = Vec::new();
    let values = Values::<f64> {
        rig,
        keys: &[],
        replaced: &[],
    };
    let mut add = |key: &str, value: f64, why: &str| {
        let unit = describe(key).map_or("1", |facts| facts.unit);
        all.push(Assumed {
            key: key.into(),
            value,
            unit: unit.into(),
            why: why.into(),
        });
    };
    surroundings(rig, &values, &mut add);
    bore(rig, &values, &mut add);
    friction(rig, &values, &mut add);
    if let Some(valve) = &rig.valve {
        let flows = valve.stated_flow.iter();
        for (key, value, why) in flows.flat_map(|flow| flow.assumptions(valve.null_v)) {
            add(key, value, why);
        }
    }
    of_effects(rig, &mut add);
    all
}

/// Gas, ambient and reference pressure.
fn surroundings(rig: &Rig, values: &Values<'_, f64>, add: &mut impl FnMut(&str, f64, &str)) {
    if rig.gas.is_none() && rig.chambers.is_some() {
        add(
            "gas.gamma",
            values.gas().heat_capacity_ratio,
            "no [gas]: dry air",
        );
        add(
            "gas.gas_constant_J_kgK",
            values.gas().gas_constant_j_per_kg_k,
            "no [gas]: dry air",
        );
    }
    if rig.environment.is_none() {
        let ambient = values.ambient();
        add(
            "environment.pressure_Pa",
            ambient.pressure_pa,
            "no [environment]: standard atmosphere",
        );
        if rig.chambers.is_some() {
            add(
                "environment.temperature_K",
                ambient.temperature_k,
                "no [environment]: a room at 20 degC",
            );
        }
    }
    let polytropic = rig
        .chambers
        .as_ref()
        .is_some_and(|one| one.model == ChamberModel::Polytropic);
    if polytropic && rig.supply.is_none() {
        let why =
            "no [supply]: the reference pressure of the polytropic model is that of the paper";
        add(
            "supply.pressure_Pa",
            model_core::paper::SUPPLY_PRESSURE_PA,
            why,
        );
    }
}

fn bore(rig: &Rig, values: &Values<'_, f64>, add: &mut impl FnMut(&str, f64, &str)) {
    let exchanges_heat = rig
        .chambers
        .as_ref()
        .is_some_and(|one| one.model != ChamberModel::PolytropicProcess);
    if !exchanges_heat || rig.value("cylinder.bore_m").is_some() {
        return;
    }
    let geometry = Side::BOTH
        .into_iter()
        .find_map(|side| values.geometry(side));
    if let Some(geometry) = geometry.filter(|_| rig.cylinder.is_some()) {
        add(
            "cylinder.bore_m",
            geometry.bore_m,
            "not stated: from the piston area",
        );
    }
}

fn friction(rig: &Rig, values: &Values<'_, f64>, add: &mut impl FnMut(&str, f64, &str)) {
    let Some(friction) = &rig.friction else {
        if rig.carriage.is_some() {
            add(
                "friction.coulomb_N",
                0.0,
                "no [friction]: the carriage slides freely",
            );
        }
        return;
    };
    let levels = values.friction_levels();
    let stated = [
        (
            friction.viscous_ns_m,
            "friction.viscous_Ns_m",
            levels.viscous_n_s_per_m,
            "not stated: none",
        ),
        (
            friction.coulomb_n,
            "friction.coulomb_N",
            levels.coulomb_n,
            "not stated: none",
        ),
        (
            friction.static_n,
            "friction.static_N",
            levels.static_n,
            "not stated: as coulomb_N",
        ),
    ];
    for (given, key, value, why) in stated {
        if given.is_none() {
            add(key, value, why);
        }
    }
    if levels.coulomb_n > 0.0 || levels.static_n > 0.0 {
        bristle(friction, &values.bristle(), add);
    }
}

/// The bristle of a dry friction.
fn bristle(friction: &Friction, bristle: &Bristle<f64>, add: &mut impl FnMut(&str, f64, &str)) {
    let of_bristle = [
        (
            friction.bristle_stiffness_n_m,
            "friction.bristle_stiffness_N_m",
            bristle.stiffness_n_per_m,
            "not stated: that of Meng et al. (2011)",
        ),
        (
            friction.bristle_damping_ns_m,
            "friction.bristle_damping_Ns_m",
            bristle.damping_n_s_per_m,
            "not stated: none",
        ),
        (
            friction.stribeck_velocity_m_s,
            "friction.stribeck_velocity_m_s",
            bristle.stribeck_velocity_m_per_s,
            "not stated: that of Meng et al. (2011)",
        ),
    ];
    for (given, key, value, why) in of_bristle {
        if given.is_none() {
            add(key, value, why);
        }
    }
}

/// Companions of an effect that the rig leaves out, such as the diameter of a tube.
fn of_effects(rig: &Rig, add: &mut impl FnMut(&str, f64, &str)) {
    for (name, parameters) in &rig.effects {
        let catalogued = effects::effect(name).map_or(&[][..], |effect| effect.parameters);
        for one in catalogued
            .iter()
            .filter(|one| !parameters.contains_key(one.key))
        {
            if let Some(value) = one
                .neutral
                .filter(|value| value.is_finite() && *value != 0.0)
            {
                let key = format!("effects.{name}.{}", one.key);
                add(&key, value, "not stated: the usual value of this effect");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../../host-sim/rigs/paper.toml");

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
        assert_eq!(assumed(&rig), []);
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
            "the chambers cannot be modelled: [cylinder] stroke_m is missing (stroke; typically 0.05 to 2 m)"
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
        let keys: Vec<String> = assumed(&rig).iter().map(|one| one.key.clone()).collect();
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
