//! The rules by which a verdict is judged, once the truth is open.
//!
//! - An effect counts as missing if it is *material* (see
//!   [`super::materiality`]). If none is, the right verdict is that nothing is
//!   missing; to name what is truly there, if too small to matter, is no false
//!   alarm, and is told apart.
//! - *Named right first*: the first effect named is one that is missing.
//! - *Complete*: every missing effect is named.
//! - *Within the set*: one that is missing is named, or stands among the
//!   alternatives that the tool says it cannot tell apart.
//! - *Place right*: a place of what is named first (of the nameless term, of
//!   most of the misfit) is a place of something missing.
//! - *Confidently wrong*: an effect that is not there has a probability above
//!   [`CONFIDENT`].
//! - A *size* is covered if it is off by at most two of its standard deviations
//!   or by at most [`COVERED`].

use super::equation::EquationJudgement;
use super::materiality::Materiality;
use super::said::{FitFigures, Named, Said, Word};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use truth_plant::{TrueEffect, Truth};

/// From this stated probability on a wrong name is confident.
pub const CONFIDENT: f64 = 0.9;
/// Relative size error that is right whatever the stated deviation.
pub const COVERED: f64 = 0.15;
/// A held-out error may exceed the refitted baseline's by this before it is
/// worse: estimating the initial states moves it by as much.
pub const NOT_WORSE: f64 = 1.02;

/// What the right verdict would be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "verdict")]
pub enum Expected {
    /// Nothing material is missing.
    NothingMissing,
    /// These effects of the list.
    Named {
        /// Their names.
        effects: Vec<String>,
    },
    /// Something that no verdict has a name for.
    Unknown {
        /// What the generator calls it.
        effects: Vec<String>,
    },
}

/// One parameter of a rightly named effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeError {
    /// `effect.parameter`, in the truth's words.
    pub parameter: String,
    /// True value, SI.
    pub truth: f64,
    /// Stated value, SI.
    pub value: f64,
    /// Stated standard deviation.
    pub std: Option<f64>,
    /// |value - truth| / |truth|.
    pub relative: f64,
    /// Within two deviations or [`COVERED`].
    pub covered: bool,
}

impl SizeError {
    /// Whether it is within two of its stated deviations, which 95 % of sound ones are; `None`
    /// where none is stated.
    pub fn is_within_two_deviations(&self) -> Option<bool> {
        let std = self.std?;
        Some((self.value - self.truth).abs() <= 2.0 * std)
    }
}

/// Held-out errors, normalised over the horizon, root mean square over signals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// The rig as given.
    pub given: f64,
    /// Ordinary parameters refitted.
    pub refitted: f64,
    /// With what was found.
    pub improved: f64,
    /// What noise alone would leave; absent where the tool does not say.
    pub noise_floor: Option<f64>,
    /// Some signal is predicted worse than by the refitted baseline.
    pub worse: bool,
}

/// A verdict judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// What would have been right.
    pub expected: Expected,
    /// The verdict is right in its main point.
    pub right: bool,
    /// The first effect named is missing.
    pub named_first: bool,
    /// Every missing effect is named.
    pub complete: bool,
    /// A missing effect is named or among the alternatives.
    pub within_set: bool,
    /// The place is one where something is missing.
    pub place_right: bool,
    /// Something is claimed that is not there, where nothing material is missing.
    pub false_alarm: bool,
    /// Something true but immaterial is named.
    pub named_immaterial: bool,
    /// Wrong names with a high probability.
    pub confidently_wrong: Vec<String>,
    /// Sizes of rightly named effects.
    pub sizes: Vec<SizeError>,
    /// Held-out errors, where the tool proves its verdict by them.
    pub held_out: Option<HeldOut>,
    /// The equation, where one effect of no list is missing.
    #[serde(default)]
    pub equation: Option<EquationJudgement>,
}

/// Judges a verdict; none is right in nothing.
pub fn judge(truth: &Truth, materiality: &[Materiality], said: Option<&Said>) -> Judgement {
    let has_answered = said.is_some();
    let silence = Said::default();
    let said = said.unwrap_or(&silence);
    let missing: Vec<&TrueEffect> = truth
        .effects
        .iter()
        .filter(|effect| is_material(materiality, &effect.name))
        .collect();
    let expected = expected(&missing);
    let names: BTreeSet<&str> = missing.iter().map(|effect| effect.name.as_str()).collect();
    let there: BTreeSet<&str> = truth.effects.iter().map(|one| one.name.as_str()).collect();
    let named: Vec<&str> = said.named().iter().map(|one| one.effect.as_str()).collect();
    let named_first = named.first().is_some_and(|first| names.contains(first));
    let alternatives = said.alternatives.iter().flatten().map(String::as_str);
    let ambiguous = said.verdict == Word::Ambiguous;
    let within_set = named.iter().any(|name| names.contains(name))
        || (ambiguous && alternatives.into_iter().any(|name| names.contains(name)));
    let place_right = said
        .places()
        .iter()
        .any(|place| missing.iter().any(|effect| acts_at(effect, place)));
    let only_true = !named.is_empty() && named.iter().all(|name| there.contains(name));
    let false_alarm = missing.is_empty() && said.claims() && !only_true;
    let right = match &expected {
        Expected::NothingMissing => !false_alarm,
        Expected::Named { .. } => named_first,
        Expected::Unknown { .. } => said.verdict == Word::Unknown && place_right,
    };
    Judgement {
        right: has_answered && right,
        named_first,
        complete: !names.is_empty() && names.iter().all(|name| named.contains(name)),
        within_set,
        place_right,
        false_alarm,
        named_immaterial: missing.is_empty() && only_true,
        confidently_wrong: confidently_wrong(said, &there),
        sizes: missing
            .iter()
            .flat_map(|effect| sizes(effect, said))
            .collect(),
        held_out: held_out(said),
        equation: equation(&missing, said),
        expected,
    }
}

fn equation(missing: &[&TrueEffect], said: &Said) -> Option<EquationJudgement> {
    match missing {
        [effect] if !effect.on_list => Some(EquationJudgement::of(effect, said)),
        _ => None,
    }
}

fn is_material(materiality: &[Materiality], name: &str) -> bool {
    materiality
        .iter()
        .any(|one| one.effect == name && one.material)
}

fn expected(missing: &[&TrueEffect]) -> Expected {
    let effects: Vec<String> = missing.iter().map(|effect| effect.name.clone()).collect();
    if missing.is_empty() {
        Expected::NothingMissing
    } else if missing.iter().all(|effect| effect.on_list) {
        Expected::Named { effects }
    } else {
        Expected::Unknown { effects }
    }
}

fn acts_at(effect: &TrueEffect, place: &str) -> bool {
    effect.places.iter().any(|known| known == place)
}

fn confidently_wrong(said: &Said, there: &BTreeSet<&str>) -> Vec<String> {
    let wrong = |one: &&Named| {
        !there.contains(one.effect.as_str()) && one.probability.is_some_and(|p| p > CONFIDENT)
    };
    let named = said.named().iter().filter(wrong);
    named.map(|one| one.effect.clone()).collect()
}

fn sizes(effect: &TrueEffect, said: &Said) -> Vec<SizeError> {
    let Some(named) = said.named().iter().find(|one| one.effect == effect.name) else {
        return Vec::new();
    };
    let plain = effect
        .parameters
        .iter()
        .filter(|(key, _)| !WAVE.contains(&key.as_str()))
        .filter_map(|(key, &truth)| Some((key.as_str(), truth, stated(named, key)?)));
    let size = |(key, truth, (value, std)): (&str, f64, (f64, Option<f64>))| {
        let off = (value - truth).abs();
        let covered = off <= COVERED * truth.abs() || std.is_some_and(|std| off <= 2.0 * std);
        (truth.abs() > 0.0).then(|| SizeError {
            parameter: format!("{}.{key}", effect.name),
            truth,
            value,
            std,
            relative: off / truth.abs(),
            covered,
        })
    };
    plain.chain(wave(effect, named)).filter_map(size).collect()
}

/// The stated value and deviation of a parameter in the truth's words.
fn stated(named: &Named, key: &str) -> Option<(f64, Option<f64>)> {
    // A play of several widths is stated as the one that it amounts to.
    let key = if key == "mean_width" { "width" } else { key };
    let size = named.parameters.get(key)?;
    Some((size.value?, size.std))
}

/// A wave given as cosine and sine is judged by its amplitude: which of the two
/// it is hangs on the wavelength.
const WAVE: [&str; 2] = ["cosine", "sine"];

type Stated = (f64, Option<f64>);

fn wave(effect: &TrueEffect, named: &Named) -> Option<(&'static str, f64, Stated)> {
    let [truth_c, truth_s] = WAVE.map(|key| effect.parameters.get(key).copied());
    let [cosine, sine] = WAVE.map(|key| named.parameters.get(key).copied());
    let (cosine, sine) = (cosine?, sine?);
    let (c, s) = (cosine.value?, sine.value?);
    let amplitude = c.hypot(s);
    let std = cosine.std.zip(sine.std).filter(|_| amplitude > 0.0);
    let std = std.map(|(of_c, of_s)| (c * of_c).hypot(s * of_s) / amplitude);
    Some(("amplitude", truth_c?.hypot(truth_s?), (amplitude, std)))
}

fn held_out(said: &Said) -> Option<HeldOut> {
    let fit = &said.fit;
    let pairs: Vec<(f64, f64)> = fit
        .improved
        .held_out
        .iter()
        .filter_map(|(signal, improved)| {
            let refitted = fit.refitted.held_out.get(signal)?;
            Some(((*refitted)?, (*improved)?))
        })
        .collect();
    Some(HeldOut {
        given: overall(&fit.as_given)?,
        refitted: overall(&fit.refitted)?,
        improved: overall(&fit.improved)?,
        noise_floor: overall(&fit.noise_floor),
        worse: pairs
            .iter()
            .any(|(refitted, improved)| *improved > NOT_WORSE * refitted),
    })
}

fn overall(figures: &FitFigures) -> Option<f64> {
    let known: Vec<f64> = figures
        .held_out
        .values()
        .filter_map(|value| *value)
        .collect();
    let square: f64 = known.iter().map(|value| value * value).sum();
    (!known.is_empty()).then(|| (square / known.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::said::{Located, Size, UnknownTerm};
    use super::*;
    use std::collections::BTreeMap;
    use truth_plant::{Kind, Request};

    /// A valve delay with its place and size.
    fn truth() -> Truth {
        let request = Request::new(3, Kind::Single).with_effect("valve-delay");
        request.unwrap().truth()
    }

    fn weighed(effect: &str, material: bool) -> Vec<Materiality> {
        vec![Materiality {
            effect: effect.into(),
            material,
            output: String::new(),
            energy_ratio: 1.0,
            needed: 1.0,
        }]
    }

    fn named(effect: &str, place: &str, probability: f64, parameters: &[(&str, f64, f64)]) -> Said {
        let size = |&(key, value, std): &(&str, f64, f64)| {
            let size = Size {
                value: Some(value),
                std: Some(std),
            };
            (key.to_owned(), size)
        };
        Said {
            verdict: Word::Named,
            effects: vec![Named {
                effect: effect.into(),
                places: vec![place.into()],
                probability: Some(probability),
                parameters: parameters.iter().map(size).collect(),
                masked: None,
            }],
            ..Said::default()
        }
    }

    #[test]
    fn prop_the_right_name_is_right_and_its_size_is_judged() {
        let (truth, weighed) = (truth(), weighed("valve-delay", true));
        let delay_s = truth.effects[0].parameters["delay_s"];
        let judged = |value: f64, std: f64| {
            let said = named(
                "valve-delay",
                "valve-command",
                0.99,
                &[("delay_s", value, std)],
            );
            judge(&truth, &weighed, Some(&said))
        };
        let good = judged(1.1 * delay_s, 0.0);
        assert!(good.right && good.named_first && good.complete && good.within_set);
        assert!(good.place_right && good.confidently_wrong.is_empty() && !good.false_alarm);
        assert!(good.sizes[0].covered && (good.sizes[0].relative - 0.1).abs() < 1e-9);
        assert!(!judged(1.2 * delay_s, 0.0).sizes[0].covered);
        assert!(judged(1.2 * delay_s, 0.11 * delay_s).sizes[0].covered);
        let alone = |size: f64, std: f64| judged(size, std).sizes[0].is_within_two_deviations();
        assert_eq!(alone(1.1 * delay_s, 0.01 * delay_s), Some(false));
        assert_eq!(alone(1.1 * delay_s, 0.06 * delay_s), Some(true));
    }

    #[test]
    fn prop_a_wrong_name_is_wrong_whatever_its_place() {
        let (truth, weighed) = (truth(), weighed("valve-delay", true));
        let said = named("slew-limit", "valve-command", 0.95, &[]);
        let judged = judge(&truth, &weighed, Some(&said));
        assert!(!judged.right && !judged.within_set && judged.place_right);
        assert_eq!(judged.confidently_wrong, ["slew-limit"]);
        let unsure = judge(
            &truth,
            &weighed,
            Some(&named("slew-limit", "valve-flow", 0.8, &[])),
        );
        assert!(unsure.confidently_wrong.is_empty() && !unsure.place_right);
    }

    #[test]
    fn prop_alternatives_count_for_an_ambiguous_verdict_only() {
        let (truth, weighed) = (truth(), weighed("valve-delay", true));
        let mut said = named("slew-limit", "valve-command", 0.5, &[]);
        said.alternatives = vec![vec!["slew-limit".into(), "valve-delay".into()]];
        assert!(!judge(&truth, &weighed, Some(&said)).within_set);
        said.verdict = Word::Ambiguous;
        let judged = judge(&truth, &weighed, Some(&said));
        assert!(judged.within_set && !judged.named_first && !judged.right);
    }

    #[test]
    fn prop_where_nothing_counts_a_claim_is_a_false_alarm() {
        let (truth, weighed) = (truth(), weighed("valve-delay", false));
        let nothing = Said::default();
        assert!(judge(&truth, &weighed, Some(&nothing)).right);
        let wrong = judge(
            &truth,
            &weighed,
            Some(&named("slew-limit", "valve-command", 0.4, &[])),
        );
        assert!(wrong.false_alarm && !wrong.right);
        let small = judge(
            &truth,
            &weighed,
            Some(&named("valve-delay", "valve-command", 0.4, &[])),
        );
        assert!(!small.false_alarm && small.named_immaterial && small.right);
        let vague = Said {
            verdict: Word::Unknown,
            ..Said::default()
        };
        assert!(judge(&truth, &weighed, Some(&vague)).false_alarm);
    }

    #[test]
    fn prop_the_nameless_is_right_as_unknown_at_its_place() {
        let request = Request::new(3, Kind::OffList).with_effect("cable-drag");
        let truth = request.unwrap().truth();
        let weighed = weighed("cable-drag", true);
        let at = |place: &str| Said {
            verdict: Word::Unknown,
            unknown_term: Some(UnknownTerm {
                place: place.into(),
                of: Vec::new(),
                equation: None,
            }),
            located: vec![Located {
                place: "chamber-a".into(),
                share: Some(0.9),
            }],
            ..Said::default()
        };
        assert!(judge(&truth, &weighed, Some(&at("force-balance"))).right);
        assert!(!judge(&truth, &weighed, Some(&at("valve-flow"))).right);
        let forced = named("constant-force", "force-balance", 0.99, &[]);
        let judged = judge(&truth, &weighed, Some(&forced));
        assert!(!judged.right && judged.place_right && judged.confidently_wrong.len() == 1);
    }

    #[test]
    fn prop_a_tool_that_failed_is_right_in_nothing() {
        for material in [true, false] {
            let judged = judge(&truth(), &weighed("valve-delay", material), None);
            assert!(!judged.right && !judged.false_alarm && !judged.place_right);
        }
    }

    #[test]
    fn prop_a_pair_is_complete_with_both_names() {
        let mut truth = truth();
        let mut second = truth.effects[0].clone();
        second.name = "piston-leakage".into();
        truth.effects.push(second);
        let mut both = weighed("valve-delay", true);
        both.extend(weighed("piston-leakage", true));
        let mut said = named("piston-leakage", "chamber-a", 0.9, &[]);
        let half = judge(&truth, &both, Some(&said));
        assert!(half.named_first && !half.complete);
        said.effects
            .extend(named("valve-delay", "valve-command", 0.8, &[]).effects);
        assert!(judge(&truth, &both, Some(&said)).complete);
    }

    #[test]
    fn prop_held_out_errors_are_told_worse_signal_by_signal() {
        let figures = |a: f64, b: f64| FitFigures {
            held_out: BTreeMap::from([("p_a".into(), Some(a)), ("p_b".into(), Some(b))]),
            ..FitFigures::default()
        };
        let mut said = named("valve-delay", "valve-command", 0.99, &[]);
        said.fit.as_given = figures(0.4, 0.4);
        said.fit.refitted = figures(0.2, 0.2);
        said.fit.improved = figures(0.05, 0.203);
        let proof = judge(&truth(), &weighed("valve-delay", true), Some(&said)).held_out;
        let proof = proof.unwrap();
        assert!(!proof.worse && proof.improved < proof.refitted && proof.noise_floor.is_none());
        said.fit.improved = figures(0.05, 0.21);
        let proof = judge(&truth(), &weighed("valve-delay", true), Some(&said)).held_out;
        assert!(proof.unwrap().worse);
    }
}
