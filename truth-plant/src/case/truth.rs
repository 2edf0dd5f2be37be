//! What is true about a case.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::kind::{Kind, Planned};
use super::nature::Nature;
use crate::effects::{Applied, Form, Strength, verdict_name};
use crate::plant::Window;
use crate::plant::friction::Presliding;

/// What is true about a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The effects that the rig file does not know, in the order drawn.
    pub effects: Vec<TrueEffect>,
    /// What kind of case it is.
    pub kind: Kind,
    /// Where the rig stands.
    #[serde(default)]
    pub nature: Nature,
    /// Whether an effect is among them that no verdict has a name for.
    pub off_list: bool,
    /// False if the recordings were driven so that they cannot show the effects.
    pub observable: bool,
    /// Multiplier of the sensors' noise.
    pub noise: f64,
    /// The law of presliding; rig files say LuGre.
    pub presliding: Presliding,
    /// The plant's values, named as in the practice rigs' `truth.json`.
    pub plant: BTreeMap<String, f64>,
}

/// One effect of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueEffect {
    /// Its name: a verdict's, or one of its own if it is on no list.
    pub name: String,
    /// Whether a verdict has this name.
    pub on_list: bool,
    /// Where it acts, in the words of a verdict.
    pub places: Vec<String>,
    /// How large it is.
    pub strength: Strength,
    /// Whether it has the textbook's form.
    pub form: Form,
    /// Its form in words.
    pub law: String,
    /// Its sizes, keys ending in their units; those of `[effects.NAME]` in a rig
    /// file where that knows the form.
    pub parameters: BTreeMap<String, f64>,
    /// When it is present, if not always.
    pub onset: Option<Onset>,
}

/// When an effect is present.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Onset {
    /// Share of each recording's time.
    pub present_share: f64,
    /// The times, by file.
    pub windows: BTreeMap<String, Window>,
}

impl TrueEffect {
    pub(super) fn new(planned: &Planned, applied: Applied, onset: Option<Onset>) -> Self {
        Self {
            name: verdict_name(planned.effect.name).to_owned(),
            on_list: planned.effect.on_list,
            places: applied.places.into_iter().map(str::to_owned).collect(),
            strength: planned.strength,
            form: planned.form,
            law: applied.form.to_owned(),
            parameters: applied.parameters,
            onset,
        }
    }
}

/// `truth.json` as the practice rigs have it, the rest of the truth beside it.
#[derive(Serialize)]
struct PracticeForm<'a> {
    effects: Vec<&'a str>,
    places: Vec<String>,
    strength: Option<Strength>,
    plant: &'a BTreeMap<String, f64>,
    truth: &'a Truth,
}

impl Truth {
    /// The text of `truth.json`: names, places, strength and plant as in the
    /// practice rigs, and all of this under `truth`.
    ///
    /// # Errors
    /// If a number is not finite; JSON has no such.
    pub fn practice_json(&self) -> serde_json::Result<String> {
        let named = PracticeForm {
            effects: self
                .effects
                .iter()
                .map(|effect| effect.name.as_str())
                .collect(),
            places: self
                .effects
                .iter()
                .map(|effect| effect.places.join("+"))
                .collect(),
            strength: self.effects.iter().map(|effect| effect.strength).max(),
            plant: &self.plant,
            truth: self,
        };
        serde_json::to_string_pretty(&named)
    }
}
