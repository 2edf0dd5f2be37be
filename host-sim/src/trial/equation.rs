//! Whether the equation of a verdict is that of the truth: its variables and its forms.
//!
//! What an effect of no list would read as stands here, in the words of a verdict's
//! `unknown_term.equation.parameters`. One whose variables no recording holds has none, and an
//! equation of it is wrong.

use super::said::Said;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use truth_plant::TrueEffect;

/// What became of an effect of no list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EquationJudgement {
    /// An equation is given.
    pub given: bool,
    /// It is of the right variables, and of no other.
    pub variables_right: bool,
    /// Every term has the right form, and none is too many.
    pub form_right: bool,
}

/// The numbers that tell the form of each term of an effect's equation; none where no recording
/// holds its variables.
pub fn forms(effect: &str) -> &'static [&'static str] {
    match effect {
        "cable-drag" => &["position.path"],
        "quadratic-friction" => &["velocity.square"],
        "null-drift" => &["time.slope"],
        "discharge-by-opening" => &["opening.constant"],
        "periodic-force" | "supply-ripple" => &["time.period"],
        "stiffening-spring" => &["position.stiffening"],
        "cogging" | "position-sensor-wave" => &["position.length"],
        "cogging-and-drift" => &["position.length", "time.slope"],
        _ => &[],
    }
}

/// The number that tells the form of a term, of all the numbers that it has.
const TELLING: [&str; 8] = [
    "path",
    "square",
    "slope",
    "constant",
    "period",
    "stiffening",
    "length",
    "threshold",
];

impl EquationJudgement {
    /// Judges the equation of a verdict on an effect of no list.
    pub(super) fn of(effect: &TrueEffect, said: &Said) -> Self {
        let term = said.unknown_term.as_ref();
        let equation = term.and_then(|term| term.equation.as_ref());
        let numbers = equation
            .iter()
            .flat_map(|equation| equation.parameters.keys());
        let is_telling = |number: &&str| {
            let name = number.rsplit('.').next();
            name.is_some_and(|name| TELLING.contains(&name))
        };
        // A threshold has a slope of its own.
        let told: BTreeSet<&str> = numbers.map(String::as_str).filter(is_telling).collect();
        let right: BTreeSet<&str> = forms(&effect.name).iter().copied().collect();
        let is_there = !right.is_empty();
        Self {
            given: equation.is_some(),
            variables_right: is_there && variables(&told) == variables(&right),
            form_right: is_there && told == right,
        }
    }
}

fn variables<'n>(numbers: &BTreeSet<&'n str>) -> BTreeSet<&'n str> {
    let of = |number: &&'n str| {
        number
            .rsplit_once('.')
            .map_or(*number, |(variable, _)| variable)
    };
    numbers.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::super::said::{SaidEquation, Size, UnknownTerm};
    use super::*;
    use truth_plant::{Kind, Request};

    fn judged(effect: &str, numbers: &[&str]) -> EquationJudgement {
        let request = Request::new(5, Kind::OffList).with_effect(effect).unwrap();
        let truth = request.draw().truth.effects.remove(0);
        let parameters = numbers
            .iter()
            .map(|name| ((*name).to_owned(), Size::default()));
        let equation = (!numbers.is_empty()).then(|| SaidEquation {
            parameters: parameters.collect(),
        });
        let said = Said {
            unknown_term: Some(UnknownTerm {
                equation,
                ..UnknownTerm::default()
            }),
            ..Said::default()
        };
        EquationJudgement::of(&truth, &said)
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_forms_and_variables_are_judged_apart() {
        let cable = judged("cable-drag", &["position.size", "position.path"]);
        assert!(cable.given && cable.form_right && cable.variables_right);
        let other = judged("cable-drag", &["position.amplitude", "position.length"]);
        assert!(!other.form_right && other.variables_right);
        let too_much = judged("cable-drag", &["position.path", "time.slope"]);
        assert!(!too_much.form_right && !too_much.variables_right);
        let half = judged("cogging-and-drift", &["position.length"]);
        assert!(!half.form_right && !half.variables_right);
        let none = judged("cable-drag", &[]);
        assert!(!none.given && !none.form_right && !none.variables_right);
    }

    /// No recording has the gas temperature.
    #[test]
    fn prop_what_is_not_recorded_has_no_right_equation() {
        let said = judged("area-by-temperature", &["time.slope"]);
        assert!(said.given && !said.form_right && !said.variables_right);
        assert!(!judged("area-by-temperature", &[]).variables_right);
    }
}
