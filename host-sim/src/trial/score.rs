//! All cases summed up.

use super::equation::EquationJudgement;
use super::judge::{Expected, HeldOut, Judgement, SizeError};
use super::plan::Class;
use super::rate::Rate;
use super::run::CaseResult;
use super::said::Word;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One row of the scorecard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What its cases have in common.
    pub title: String,
    /// Number of cases.
    pub cases: usize,
    /// Right in the main point.
    pub right: Rate,
    /// Of the cases with something of the list missing: named right first.
    pub named_first: Rate,
    /// ... one that is missing is named or among the alternatives.
    pub within_set: Rate,
    /// ... every missing effect is named.
    pub complete: Rate,
    /// Of the cases with something missing: the place is right.
    pub place: Rate,
    /// Of the cases with nothing material missing: something is claimed.
    pub false_alarms: Rate,
    /// Of the cases with something nameless missing: unknown, with its place.
    pub unknown: Rate,
    /// Named wrong with a high probability.
    pub confidently_wrong: Rate,
    /// The tool failed.
    pub failed: Rate,
    /// Median relative size error of rightly named effects.
    pub size_error: Option<f64>,
    /// Sizes that are covered.
    pub covered: Rate,
    /// Sizes within two stated deviations, whatever part of the size that is.
    #[serde(default)]
    pub within_two_deviations: Rate,
    /// Median ratio of held-out errors, improved over refitted, where something
    /// is missing.
    pub improved_over_refitted: Option<f64>,
    /// Median ratio of held-out errors, noise floor over refitted.
    pub floor_over_refitted: Option<f64>,
    /// Some signal is predicted worse than by the refitted baseline.
    pub worse: Rate,
    /// Median time, s.
    pub seconds: Option<f64>,
}

/// A mark and what was reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// What is counted.
    pub title: String,
    /// The share to reach.
    pub mark: f64,
    /// At least or at most.
    pub at_least: bool,
    /// What was reached.
    pub reached: Rate,
    /// Whether the mark is kept; none without a case.
    pub kept: Option<bool>,
}

/// Stated probabilities from a bin against how often they were right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// From this probability on.
    pub from: f64,
    /// Below this one.
    pub to: f64,
    /// Mean of those stated.
    pub stated: f64,
    /// How often the effect was there.
    pub right: Rate,
}

/// How often something was taken for something.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    /// What was missing.
    pub truth: String,
    /// What was said.
    pub said: String,
    /// How often.
    pub count: usize,
}

/// The sums.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// The marks.
    pub marks: Vec<Mark>,
    /// By class.
    pub classes: Vec<Row>,
    /// By kind of concealment.
    pub concealments: Vec<Row>,
    /// By effect that was missing.
    pub effects: Vec<Row>,
    /// Stated probability against frequency.
    pub reliability: Vec<Bin>,
    /// What was taken for what.
    pub confusion: Vec<Confusion>,
}

/// The first effect that is missing, `nothing`, or `off-list`.
pub(super) fn truth_word(judgement: &Judgement) -> String {
    match &judgement.expected {
        Expected::NothingMissing => "nothing".into(),
        Expected::Named { effects } => effects.join(" + "),
        Expected::Unknown { .. } => "of no list".into(),
    }
}

/// The first effect that was named, or the verdict.
pub(super) fn said_word(case: &CaseResult) -> String {
    let Some(said) = &case.said else {
        return "failed".into();
    };
    match (said.verdict, said.named().first()) {
        (Word::Named | Word::Ambiguous, Some(first)) => first.effect.clone(),
        (word, _) => word.name().into(),
    }
}

impl Score {
    /// Sums up.
    pub fn of(cases: &[CaseResult]) -> Self {
        let all: Vec<&CaseResult> = cases.iter().collect();
        Self {
            marks: marks(&all)
                .into_iter()
                .chain(marks_of_equations(&all))
                .collect(),
            classes: Class::ALL
                .iter()
                .map(|class| {
                    Row::of(
                        class.title(),
                        &pick(&all, |case| case.planned.class() == *class),
                    )
                })
                .filter(|row| row.cases > 0)
                .collect(),
            concealments: concealments(&all),
            effects: effects(&all),
            reliability: reliability(&all),
            confusion: confusion(&all),
        }
    }
}

fn pick<'c>(cases: &[&'c CaseResult], keep: impl Fn(&CaseResult) -> bool) -> Vec<&'c CaseResult> {
    cases.iter().copied().filter(|case| keep(case)).collect()
}

fn expects_named(case: &CaseResult) -> bool {
    matches!(case.judgement.expected, Expected::Named { .. })
}

fn expects_unknown(case: &CaseResult) -> bool {
    matches!(case.judgement.expected, Expected::Unknown { .. })
}

fn expects_nothing(case: &CaseResult) -> bool {
    case.judgement.expected == Expected::NothingMissing
}

impl Row {
    fn of(title: &str, cases: &[&CaseResult]) -> Self {
        let over = |cases: &[&CaseResult], what: &dyn Fn(&Judgement) -> bool| {
            Rate::over(cases.iter().map(|case| what(&case.judgement)))
        };
        let named = pick(cases, expects_named);
        let missing = pick(cases, |case| !expects_nothing(case));
        let sizes: Vec<&SizeError> = cases
            .iter()
            .flat_map(|case| &case.judgement.sizes)
            .collect();
        let proofs: Vec<HeldOut> = missing
            .iter()
            .filter_map(|case| case.judgement.held_out)
            .collect();
        let ratio = |part: &dyn Fn(&HeldOut) -> Option<f64>| {
            median(
                proofs
                    .iter()
                    .filter_map(|proof| Some(part(proof)? / proof.refitted)),
            )
        };
        Self {
            title: title.into(),
            cases: cases.len(),
            right: over(cases, &|judgement| judgement.right),
            named_first: over(&named, &|judgement| judgement.named_first),
            within_set: over(&named, &|judgement| judgement.within_set),
            complete: over(&named, &|judgement| judgement.complete),
            place: over(&missing, &|judgement| judgement.place_right),
            false_alarms: over(&pick(cases, expects_nothing), &|judgement| {
                judgement.false_alarm
            }),
            unknown: over(&pick(cases, expects_unknown), &|judgement| judgement.right),
            confidently_wrong: over(cases, &|judgement| !judgement.confidently_wrong.is_empty()),
            failed: Rate::over(cases.iter().map(|case| case.failure.is_some())),
            size_error: median(sizes.iter().map(|size| size.relative)),
            covered: Rate::over(sizes.iter().map(|size| size.covered)),
            within_two_deviations: Rate::over(
                sizes
                    .iter()
                    .filter_map(|size| size.is_within_two_deviations()),
            ),
            improved_over_refitted: ratio(&|proof| Some(proof.improved)),
            floor_over_refitted: ratio(&|proof| proof.noise_floor),
            worse: Rate::over(
                cases
                    .iter()
                    .filter_map(|case| case.judgement.held_out)
                    .map(|proof| proof.worse),
            ),
            seconds: median(cases.iter().map(|case| case.seconds)),
        }
    }
}

fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut known: Vec<f64> = values
        .into_iter()
        .filter(|value| value.is_finite())
        .collect();
    known.sort_by(f64::total_cmp);
    let (low, high) = (known.len().checked_sub(1)? / 2, known.len() / 2);
    Some(0.5 * (known[low] + known[high]))
}

/// The marks that the tool has to keep.
fn marks(cases: &[&CaseResult]) -> Vec<Mark> {
    let in_classes =
        |classes: &[Class]| pick(cases, |case| classes.contains(&case.planned.class()));
    let plain = Row::of("", &in_classes(&[Class::Strong, Class::Medium]));
    let weak = Row::of("", &in_classes(&[Class::Weak]));
    let all = Row::of("", cases);
    vec![
        Mark::new(
            "strong and medium effects named right first",
            0.90,
            true,
            plain.named_first,
        ),
        Mark::new(
            "weak effects named right first",
            0.65,
            true,
            weak.named_first,
        ),
        Mark::new(
            "place right, wherever something is missing",
            0.95,
            true,
            all.place,
        ),
        Mark::new(
            "false alarms, wherever nothing material is",
            0.03,
            false,
            all.false_alarms,
        ),
        Mark::new(
            "effects of no list called unknown, with the place",
            0.75,
            true,
            all.unknown,
        ),
        Mark::new(
            "confident but wrong, over all cases",
            0.02,
            false,
            all.confidently_wrong,
        ),
    ]
}

/// The marks of the equations in the place of effects of no list.
fn marks_of_equations(cases: &[&CaseResult]) -> [Mark; 2] {
    let rate = |is_right: fn(&EquationJudgement) -> bool| {
        let judged = cases.iter().filter_map(|case| case.judgement.equation);
        Rate::over(judged.map(|equation| is_right(&equation)))
    };
    [
        Mark::new(
            "equations of effects of no list: the right variables",
            0.80,
            true,
            rate(|equation| equation.variables_right),
        ),
        Mark::new(
            "equations of effects of no list: the right form",
            0.60,
            true,
            rate(|equation| equation.form_right),
        ),
    ]
}

impl Mark {
    fn new(title: &str, mark: f64, at_least: bool, reached: Rate) -> Self {
        let kept = reached.share().map(|share| {
            if at_least {
                share >= mark
            } else {
                share <= mark
            }
        });
        Self {
            title: title.into(),
            mark,
            at_least,
            reached,
            kept,
        }
    }
}

/// Kinds of concealment, each over cases with one effect of the list.
fn concealments(cases: &[&CaseResult]) -> Vec<Row> {
    let named = pick(cases, expects_named);
    let hidden = [Class::Strong, Class::Medium, Class::Weak];
    let share = |case: &CaseResult| case.masking.map(|masking| masking.hidden_share);
    let present = |case: &CaseResult| {
        let onset = case.opened.truth.effects.first()?.onset.as_ref()?;
        Some(onset.present_share)
    };
    let near =
        |value: Option<f64>, wanted: f64| value.is_some_and(|value| (value - wanted).abs() < 1e-6);
    let noise =
        |case: &CaseResult| (case.planned.class() == Class::Noisy).then_some(case.planned.noise);
    let between = |low: f64, high: f64| {
        pick(&named, |case| {
            share(case).is_some_and(|share| share >= low && share < high)
        })
    };
    let rows = [
        (
            "label hidden only",
            pick(&named, |case| hidden.contains(&case.planned.class())),
        ),
        ("masked, under half hidden by the fit", between(0.0, 0.5)),
        ("masked, half to 90 % hidden", between(0.5, 0.9)),
        ("masked, 90 % hidden or more", between(0.9, 1.1)),
        (
            "noise three times the usual",
            pick(&named, |case| near(noise(case), 3.0)),
        ),
        (
            "noise ten times the usual",
            pick(&named, |case| near(noise(case), 10.0)),
        ),
        (
            "present half of the time",
            pick(&named, |case| near(present(case), 0.5)),
        ),
        (
            "present a fifth of the time",
            pick(&named, |case| near(present(case), 0.2)),
        ),
        (
            "present a twentieth of the time",
            pick(&named, |case| near(present(case), 0.05)),
        ),
    ];
    let rows = rows.into_iter().filter(|(_, cases)| !cases.is_empty());
    rows.map(|(title, cases)| Row::of(title, &cases)).collect()
}

/// By effect, over cases in which it alone is missing.
fn effects(cases: &[&CaseResult]) -> Vec<Row> {
    let mut by_effect: BTreeMap<String, Vec<&CaseResult>> = BTreeMap::new();
    for case in cases {
        let expected = &case.judgement.expected;
        if let Expected::Named { effects } | Expected::Unknown { effects } = expected
            && let [effect] = effects.as_slice()
        {
            by_effect.entry(effect.clone()).or_default().push(case);
        }
    }
    by_effect
        .into_iter()
        .map(|(effect, cases)| Row::of(&effect, &cases))
        .collect()
}

/// Edges of the bins of stated probabilities.
const EDGES: [f64; 9] = [0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0];

/// Every effect that a verdict gives a probability, true if it is there at all.
fn reliability(cases: &[&CaseResult]) -> Vec<Bin> {
    let mut stated: Vec<(f64, bool)> = Vec::new();
    for case in cases {
        let there = |name: &str| case.opened.truth.effects.iter().any(|one| one.name == name);
        if let Some(said) = &case.said {
            let pairs = said.probabilities().into_iter();
            stated.extend(pairs.map(|(effect, probability)| (probability, there(effect))));
        }
    }
    EDGES
        .windows(2)
        .filter_map(|edge| {
            let (from, to) = (edge[0], edge[1]);
            let last = to >= 1.0;
            let inside: Vec<&(f64, bool)> = stated
                .iter()
                .filter(|(p, _)| *p >= from && (*p < to || last))
                .collect();
            let mean = inside.iter().map(|(p, _)| p).sum::<f64>() / inside.len().max(1) as f64;
            (!inside.is_empty()).then(|| Bin {
                from,
                to,
                stated: mean,
                right: Rate::over(inside.iter().map(|(_, there)| *there)),
            })
        })
        .collect()
}

fn confusion(cases: &[&CaseResult]) -> Vec<Confusion> {
    let mut counts: BTreeMap<(String, String), usize> = BTreeMap::new();
    for case in cases {
        let pair = (truth_word(&case.judgement), said_word(case));
        *counts.entry(pair).or_default() += 1;
    }
    counts
        .into_iter()
        .map(|((truth, said), count)| Confusion { truth, said, count })
        .collect()
}
