//! What each law needs of a rig and its signals, what of it is absent, and which values stand in
//! for what a rig does not state.

use serde::Serialize;

use crate::effects;
use crate::laws::Law;
use crate::model::{Side, Values};
use crate::rig::{ChamberModel, Rig, describe};

/// Something that a law lacks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Lack {
    /// `section.key`, `signals.NAME` or a section.
    pub key: String,
    /// What it is.
    pub what: String,
    /// A typical value, where there is one.
    pub typical: Option<String>,
}

impl Lack {
    fn key(key: &str) -> Self {
        let facts = describe(key);
        Self {
            key: key.into(),
            what: facts.map_or_else(String::new, |facts| {
                format!("{} [{}]", facts.what, facts.unit)
            }),
            typical: facts.map(|facts| facts.typical.to_owned()),
        }
    }

    fn signal(name: &str) -> Self {
        Self::other(format!("signals.{name}"), "a recorded column")
    }

    fn other(key: impl Into<String>, what: &str) -> Self {
        Self {
            key: key.into(),
            what: what.into(),
            typical: None,
        }
    }
}

/// One law that the rig describes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LawCheck {
    /// Its name in reports.
    pub law: &'static str,
    /// The signals that it predicts.
    pub predicts: Vec<&'static str>,
    /// What it lacks; it runs where this is empty.
    pub lacks: Vec<Lack>,
}

/// A value that stands in for one that the rig does not state.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumed {
    /// `section.key`.
    pub key: String,
    /// The value in use.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Where it comes from.
    pub why: String,
}

/// The laws that the rig's sections describe, with what each lacks.
pub(super) fn laws(rig: &Rig) -> Vec<LawCheck> {
    let mut laws = Vec::new();
    let mut add = |law: Law, lacks: Vec<Lack>| {
        let predicts = law
            .outputs(rig)
            .iter()
            .map(|output| output.signal)
            .collect();
        laws.push(LawCheck {
            law: law.title(),
            predicts: if lacks.is_empty() {
                predicts
            } else {
                Vec::new()
            },
            lacks,
        });
    };
    if rig.chambers.is_some() {
        add(Law::Chambers, chambers(rig));
    }
    if rig.carriage.is_some() || rig.friction.is_some() {
        if rig.signals.contains("force") {
            add(Law::Force, force(rig));
        } else {
            add(Law::Carriage, carriage(rig));
        }
    }
    if rig.actuator.is_some() {
        add(Law::Actuator, absent_signals(rig, &["u", "x"]));
    }
    laws
}

fn absent_signals(rig: &Rig, names: &[&str]) -> Vec<Lack> {
    let absent = names.iter().filter(|name| !rig.signals.contains(name));
    absent.map(|name| Lack::signal(name)).collect()
}

fn absent_keys(rig: &Rig, keys: &[String]) -> Vec<Lack> {
    let absent = keys.iter().filter(|key| rig.value(key).is_none());
    absent.map(|key| Lack::key(key)).collect()
}

fn recorded_sides(rig: &Rig) -> impl Iterator<Item = Side> {
    Side::BOTH
        .into_iter()
        .filter(|side| rig.signals.contains(side.pressure_signal()))
}

fn chambers(rig: &Rig) -> Vec<Lack> {
    let mut lacks = Vec::new();
    if recorded_sides(rig).next().is_none() {
        lacks.push(Lack::other(
            "signals.p_a or signals.p_b",
            "a recorded chamber pressure",
        ));
    }
    if rig.vessel.is_none() {
        if rig.cylinder.is_none() {
            lacks.push(Lack::other(
                "[cylinder] or [vessel]",
                "the volumes of the chambers",
            ));
        }
        lacks.extend(absent_signals(rig, &["x"]));
        let of_side = |side: Side| {
            let letter = side.letter();
            [
                format!("cylinder.area_{letter}_m2"),
                format!("cylinder.dead_volume_{letter}_m3"),
            ]
        };
        let keys = recorded_sides(rig).flat_map(of_side);
        let keys: Vec<String> = std::iter::once("cylinder.stroke_m".to_owned())
            .chain(keys)
            .collect();
        if rig.cylinder.is_some() {
            lacks.extend(absent_keys(rig, &keys));
        }
    }
    if rig.valve.is_some() {
        lacks.extend(absent_signals(rig, &["u"]));
        if !rig.signals.contains("p_s") {
            lacks.extend(absent_keys(rig, &["supply.pressure_Pa".to_owned()]));
        }
    }
    lacks
}

fn carriage(rig: &Rig) -> Vec<Lack> {
    let mut lacks = absent_signals(rig, &["x", "p_a", "p_b"]);
    let keys = [
        "carriage.mass_kg",
        "cylinder.area_a_m2",
        "cylinder.area_b_m2",
    ];
    lacks.extend(absent_keys(rig, &keys.map(String::from)));
    lacks
}

fn force(rig: &Rig) -> Vec<Lack> {
    let mut lacks = absent_signals(rig, &["x"]);
    let areas = recorded_sides(rig).map(|side| format!("cylinder.area_{}_m2", side.letter()));
    lacks.extend(absent_keys(rig, &areas.collect::<Vec<_>>()));
    lacks
}

/// The values that laws of this rig use though the rig does not state them.
pub(super) fn assumed(rig: &Rig) -> Vec<Assumed> {
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
    bore(rig, &values, &mut add);
    friction(rig, &values, &mut add);
    if let Some(valve) = &rig.valve {
        for (key, value, why) in valve
            .stated_flow
            .iter()
            .flat_map(|flow| flow.assumptions(valve.null_v))
        {
            add(key, value, why);
        }
    }
    of_effects(rig, &mut add);
    all
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
    let (levels, bristle) = (values.friction_levels(), values.bristle());
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
    let is_dry = levels.coulomb_n > 0.0 || levels.static_n > 0.0;
    let shown = stated
        .into_iter()
        .chain(of_bristle.into_iter().filter(|_| is_dry));
    for (given, key, value, why) in shown {
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
