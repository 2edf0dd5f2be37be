//! What is said of an effect, once: its numbers, its words, when it can be there, and what tells
//! it from others.

use super::candidate::Candidate;
use super::scene::Scene;
use crate::rig::{Facts, facts};
use model_core::real::Real;

/// One effect of `[effects.NAME]`.
#[derive(Clone, Copy, Debug)]
pub struct Effect {
    /// The name of the verdict.
    pub name: &'static str,
    /// What it is, in a sentence of the rig file's reference.
    pub what: &'static str,
    /// Its parameters; one that a rig file leaves out is neutral.
    pub parameters: &'static [EffectParameter],
    /// What it is, to somebody who has not met its name.
    pub meaning: &'static str,
    /// The same of a form that has words of its own.
    pub meaning_of_form: &'static [(&'static str, &'static str)],
    /// The recording in which it shows best.
    pub shown_by: &'static str,
    /// Effects that imitate it and each other, and the recording that separates any two of them
    /// all. A group stands with one of its effects; the narrowest that holds two effects speaks.
    pub told_from: &'static [Group],
    /// Which of the two halves of an axis it is part of.
    pub acts_on: Half,
    /// How it is there.
    pub kind: Kind,
    /// Parameters that a board does not get, all of them if none is told, and why.
    pub off_board: Option<OffBoard>,
    /// How it is tried where a law misses something; empty where law, rig or recordings do not
    /// allow it.
    pub candidates: fn(&Scene<'_>) -> Vec<Candidate>,
}

/// Other effects, and a recording.
pub type Group = (&'static [&'static str], &'static str);

/// Parameters, and a reason.
pub type OffBoard = (&'static [&'static str], &'static str);

/// A half of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// Gas, valve and gauges.
    Gas,
    /// Motion, friction and load.
    Forces,
}

/// How an effect is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It may come and go.
    Passing,
    /// The axis is built with it.
    BuiltIn,
    /// At its smallest it does nothing but shift a signal in time. It may come and go.
    ShiftInTime,
    /// No physics with a name: a table that recordings asked for.
    Unnamed,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// The key, ending in its unit where that is fixed.
    pub key: &'static str,
    /// The unit; `signal` stands for the unit of the command (V, or 1).
    pub unit: &'static str,
    /// The value that stands for an absent key. With all parameters of an
    /// effect neutral the effect is off. `None`: an absent key leaves a number
    /// of the rig as declared.
    pub neutral: Option<f64>,
    /// The least value that the law has a meaning for.
    pub least: f64,
    /// What it is, in a few words.
    pub what: &'static str,
    /// A typical value or range.
    pub typical: &'static str,
    /// What a verdict calls it.
    pub words: &'static str,
    /// The unit of the trade in which a verdict says it.
    pub trade_unit: &'static str,
    /// Whether without it the effect is another one.
    pub is_decisive: bool,
}

impl EffectParameter {
    /// What a person needs to know of the key.
    pub fn facts(&self) -> Facts {
        let source = "`pneuma diagnose` finds it, or the part's data sheet";
        facts(self.unit, self.typical, self.what, source)
    }

    /// Said by a verdict in these words and this unit.
    pub const fn said(mut self, words: &'static str, trade_unit: &'static str) -> Self {
        self.words = words;
        self.trade_unit = trade_unit;
        self
    }

    /// Without it the effect is another one.
    pub const fn decisive(mut self) -> Self {
        self.is_decisive = true;
        self
    }

    /// What a size in the catalogue's unit is multiplied by to be said in that of the trade.
    pub fn trade_factor(&self) -> f64 {
        match self.trade_unit {
            "L" | "mm" | "ms" => 1e3,
            "cm³" | "mm²" => 1e6,
            "kPa" | "N/mm" => 1e-3,
            "N/bar" => 1e5,
            "%" | "% per m" | "% per m²" => 100.0,
            _ => 1.0,
        }
    }
}

/// A parameter with its neutral and its least value.
pub const fn parameter(
    key: &'static str,
    unit: &'static str,
    neutral: f64,
    least: f64,
    what: &'static str,
    typical: &'static str,
) -> EffectParameter {
    EffectParameter {
        key,
        unit,
        neutral: Some(neutral),
        least,
        what,
        typical,
        words: what,
        trade_unit: "",
        is_decisive: false,
    }
}

/// A parameter that adds to a declared number and may have either sign.
pub const fn signed(
    key: &'static str,
    unit: &'static str,
    what: &'static str,
    typical: &'static str,
) -> EffectParameter {
    parameter(key, unit, 0.0, f64::MIN, what, typical)
}

/// A number that stands in the place of one of the rig's, which holds where it is absent.
pub const fn in_place_of_stated(
    key: &'static str,
    unit: &'static str,
    least: f64,
    what: &'static str,
    typical: &'static str,
) -> EffectParameter {
    EffectParameter {
        neutral: None,
        ..parameter(key, unit, 0.0, least, what, typical)
    }
}

/// What most effects have in common.
pub const PLAIN: Effect = Effect {
    name: "",
    what: "",
    parameters: &[],
    meaning: "",
    meaning_of_form: &[],
    shown_by: "",
    told_from: &[],
    acts_on: Half::Gas,
    kind: Kind::Passing,
    off_board: None,
    candidates: none,
};

fn none(_: &Scene<'_>) -> Vec<Candidate> {
    Vec::new()
}

/// The numbers of a rig's effects, some of them replaced by those that a fit is trying.
pub trait Numbers<R> {
    /// The number at `effects.NAME.key`, if the rig or a fit has it.
    fn stated(&self, key: &str) -> Option<R>;

    /// Whether an effect has any parameter, if perhaps a neutral one.
    fn holds(&self, effect: &str) -> bool;
}

impl Effect {
    /// The parameter of that key.
    pub fn parameter(&self, key: &str) -> Option<&'static EffectParameter> {
        self.parameters.iter().find(|known| known.key == key)
    }

    /// Its number of that key, the neutral one where neither rig nor fit has it.
    pub fn number<R: Real>(&self, numbers: &impl Numbers<R>, key: &str) -> R {
        let known = self.parameter(key);
        debug_assert!(known.is_some(), "{} has no {key}", self.name);
        let neutral = || known.and_then(|known| known.neutral).unwrap_or(0.0);
        numbers
            .stated(&format!("effects.{}.{key}", self.name))
            .unwrap_or_else(|| R::from_f64(neutral()))
    }
}
