//! What a case may hold beyond the laws of its rig file, by name.
//!
//! Names on the list are those of a verdict (`format = "verdict/1"`). Sizes
//! follow the ranges of the literature on such axes; *weak* is about the least
//! that an engineer would care about.

mod forces;
mod gas;
mod off_list;
mod sensing;
mod valve;

use std::collections::BTreeMap;

pub(crate) use forces::FRICTION_ZONE;
pub(crate) use gas::GAS_TEMPERATURE;
pub(crate) use off_list::SUPPLY_RIPPLE;
use serde::{Deserialize, Serialize};

use crate::plant::Physics;
use crate::random::Random;

/// How large an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strength {
    /// About a tenth of weak: nobody should care.
    Immaterial,
    /// About the least that an engineer would care about.
    Weak,
    /// Plainly there.
    Medium,
    /// Spoils the model.
    Strong,
}

/// In which form an effect appears.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// The textbook's form.
    Usual,
    /// Another form of the same physics.
    Other,
}

/// One entry of the catalogue.
pub(crate) struct Effect {
    pub(crate) name: &'static str,
    /// Whether a verdict has this name.
    pub(crate) on_list: bool,
    /// Whether it may begin or end in the middle of a recording.
    pub(crate) may_begin: bool,
    /// Whether it has a form besides the usual one.
    pub(crate) has_other_form: bool,
    /// Whether it makes sense at an immaterial size.
    pub(crate) may_be_immaterial: bool,
    pub(crate) apply: fn(&mut Draw<'_>) -> Applied,
}

/// What an effect is drawn with, and the physics that it changes.
pub(crate) struct Draw<'a> {
    pub(crate) physics: &'a mut Physics,
    pub(crate) random: &'a mut Random,
    pub(crate) strength: Strength,
    pub(crate) form: Form,
}

impl Draw<'_> {
    /// The size for the strength, within a fifth: immaterial, weak, medium,
    /// strong.
    fn size(&mut self, sizes: [f64; 4]) -> f64 {
        self.random.around(sizes[self.strength as usize], 1.2)
    }
}

/// What an effect has done.
#[derive(Debug, Default)]
pub(crate) struct Applied {
    pub(crate) places: Vec<&'static str>,
    pub(crate) parameters: BTreeMap<String, f64>,
    pub(crate) form: &'static str,
}

impl Applied {
    fn new<const N: usize, const M: usize>(
        places: [&'static str; N],
        form: &'static str,
        parameters: [(&str, f64); M],
    ) -> Self {
        Self {
            places: places.to_vec(),
            form,
            parameters: parameters
                .map(|(key, value)| (key.to_owned(), value))
                .into(),
        }
    }
}

/// All effects: those of a verdict, then those that are on no list.
pub(crate) fn catalogue() -> impl Iterator<Item = &'static Effect> {
    [
        gas::EFFECTS,
        valve::EFFECTS,
        forces::EFFECTS,
        sensing::EFFECTS,
        off_list::EFFECTS,
    ]
    .into_iter()
    .flatten()
}

/// The effect of that name.
pub(crate) fn named(name: &str) -> Option<&'static Effect> {
    catalogue().find(|effect| effect.name == name)
}

/// What a verdict calls an effect of the catalogue.
pub fn verdict_name(name: &str) -> &str {
    match name {
        FRICTION_ZONE => "position-dependent-friction",
        named => named,
    }
}

/// The names of all effects, on the list and off it.
pub fn names() -> Vec<&'static str> {
    catalogue().map(|effect| effect.name).collect()
}

/// Both chambers.
const CHAMBERS: [&str; 2] = ["chamber-a", "chamber-b"];
const FORCE: [&str; 1] = ["force-balance"];
const COMMAND: [&str; 1] = ["valve-command"];
const FLOW: [&str; 1] = ["valve-flow"];
/// Which chambers an effect may concern: a, b, or both.
const SIDES: [&[usize]; 3] = [&[0], &[1], &[0, 1]];
