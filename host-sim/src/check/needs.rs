//! What each law of a rig lacks of signals, sections and numbers.

use serde::Serialize;

use crate::laws::{Law, needs};
use crate::rig::{Rig, describe};

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
    let records = |signal: &str| rig.signals.contains(signal);
    if rig.valve.is_some() && (records("flow_a") || records("flow_b")) {
        let mut lacks = absent_signals(rig, &["u"]);
        if records("flow_a") && !records("flow_b") {
            lacks.extend(absent_signals(rig, &["p_a"]));
        }
        lacks.extend(absent_keys(rig, Law::ValveFlow));
        add(Law::ValveFlow, lacks);
    }
    if rig.valve.is_some() && records("spool") {
        let lacks = absent_signals(rig, &["u"]).into_iter();
        add(
            Law::Spool,
            lacks.chain(absent_keys(rig, Law::Spool)).collect(),
        );
    }
    laws
}

fn absent_signals(rig: &Rig, names: &[&str]) -> Vec<Lack> {
    let absent = names.iter().filter(|name| !rig.signals.contains(name));
    absent.map(|name| Lack::signal(name)).collect()
}

/// The numbers of a law that the rig does not state.
fn absent_keys(rig: &Rig, law: Law) -> Vec<Lack> {
    let has = |signal: &str| rig.signals.contains(signal);
    let keys = needs::keys(law, rig, &has).into_iter();
    keys.filter(|key| rig.value(key).is_none())
        .map(Lack::key)
        .collect()
}

fn chambers(rig: &Rig) -> Vec<Lack> {
    let mut lacks = Vec::new();
    if !["p_a", "p_b"].iter().any(|name| rig.signals.contains(name)) {
        lacks.push(Lack::other(
            "signals.p_a or signals.p_b",
            "a recorded chamber pressure",
        ));
    }
    if rig.vessel.is_none() {
        lacks.extend(absent_signals(rig, &["x"]));
        if rig.cylinder.is_none() {
            lacks.push(Lack::other(
                "[cylinder] or [vessel]",
                "the volumes of the chambers",
            ));
        }
    }
    if rig.valve.is_some() {
        lacks.extend(absent_signals(rig, &["u"]));
    }
    if rig.vessel.is_some() || rig.cylinder.is_some() {
        lacks.extend(absent_keys(rig, Law::Chambers));
    }
    lacks
}

fn carriage(rig: &Rig) -> Vec<Lack> {
    let mut lacks = absent_signals(rig, &["x", "p_a", "p_b"]);
    lacks.extend(absent_keys(rig, Law::Carriage));
    lacks
}

fn force(rig: &Rig) -> Vec<Lack> {
    let mut lacks = absent_signals(rig, &["x"]);
    lacks.extend(absent_keys(rig, Law::Force));
    lacks
}
