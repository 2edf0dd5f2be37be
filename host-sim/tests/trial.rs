//! The concealed trial: sums, file and comparison on verdicts made by hand.

#![expect(clippy::unwrap_used, reason = "helpers of tests, too")]

use host_sim::report::Provenance;
use host_sim::trial::equation::forms;
use host_sim::trial::judge::judge;
use host_sim::trial::materiality::{Materiality, weigh};
use host_sim::trial::others::other;
use host_sim::trial::plan::{Class, Planned};
use host_sim::trial::said::{Named, Said, SaidEquation, Size, UnknownTerm, Word};
use host_sim::trial::seal::Opened;
use host_sim::trial::{CaseResult, Scorecard, Setting, markdown, page, plan, seal};
use std::fs;
use std::path::PathBuf;
use truth_plant::{Kind, Nature, Request, Strength};

const SETTING: Setting = Setting {
    seed: 5,
    kind: None,
    nature: Nature::Laboratory,
};

/// The case of a plan as if the tool had said this of it; all effects count.
fn result(planned: &Planned, said: Option<Said>) -> CaseResult {
    let truth = planned.request().unwrap().truth();
    let opened = Opened::new(truth, SETTING.seed, planned.number);
    let materiality: Vec<Materiality> = opened
        .truth
        .effects
        .iter()
        .map(|effect| Materiality {
            effect: effect.name.clone(),
            material: planned.kind != Kind::Dirty && planned.kind != Kind::Unobservable,
            output: "chambers p_a 1".into(),
            energy_ratio: 2.0,
            needed: 1.1,
        })
        .collect();
    CaseResult {
        planned: planned.clone(),
        seal: opened.seal(),
        judgement: judge(&opened.truth, &materiality, said.as_ref()),
        failure: said.is_none().then(|| "failed".into()),
        opened,
        materiality,
        masking: None,
        on_chip: None,
        said,
        seconds: 1.5,
    }
}

/// What is true, said with certainty.
fn truth_said(planned: &Planned) -> Said {
    let truth = planned.request().unwrap().truth();
    let of_no_list = truth.effects.iter().find(|effect| !effect.on_list);
    if let Some(effect) = of_no_list {
        let numbers = forms(&effect.name).iter();
        let parameters = numbers.map(|name| ((*name).to_owned(), Size::default()));
        let equation = SaidEquation {
            parameters: parameters.collect(),
        };
        return Said {
            verdict: Word::Unknown,
            unknown_term: Some(UnknownTerm {
                place: effect.places[0].clone(),
                equation: Some(equation),
                ..UnknownTerm::default()
            }),
            ..Said::default()
        };
    }
    let named = truth.effects.iter().map(|effect| Named {
        effect: effect.name.clone(),
        places: effect.places.clone(),
        probability: Some(0.99),
        ..Named::default()
    });
    Said {
        verdict: if truth.effects.is_empty() {
            Word::NothingMissing
        } else {
            Word::Named
        },
        effects: named.collect(),
        ..Said::default()
    }
}

fn card(cases: usize, say: impl Fn(&Planned) -> Option<Said>) -> Scorecard {
    let planned = plan(SETTING, cases);
    let seals = planned.iter().map(|one| seal(SETTING, one).unwrap());
    let mut card = Scorecard::new(SETTING, seals.collect());
    for one in &planned {
        card.add(result(one, say(one)));
    }
    card
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pneuma-trial-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn prop_the_truth_keeps_every_mark() {
    let card = card(60, |planned| Some(truth_said(planned)));
    for mark in &card.score.marks {
        assert_eq!(mark.kept, Some(true), "{}: {}", mark.title, mark.reached);
    }
    let classes: usize = card.score.classes.iter().map(|row| row.cases).sum();
    assert_eq!(classes, 60);
    assert!(
        card.score
            .classes
            .iter()
            .all(|row| row.right.count == row.right.of)
    );
}

#[test]
fn prop_one_wrong_name_for_all_misses_every_mark() {
    let wrong: Said = serde_json::from_str(
        r#"{"verdict": "named",
            "effects": [{"effect": "no-such-effect", "places": ["nowhere"], "probability": 0.95}]}"#,
    )
    .unwrap();
    let card = card(60, |_| Some(wrong.clone()));
    for mark in &card.score.marks {
        assert_eq!(mark.kept, Some(false), "{}: {}", mark.title, mark.reached);
    }
    let bin = card
        .score
        .reliability
        .iter()
        .find(|bin| bin.from >= 0.9)
        .unwrap();
    assert_eq!((bin.right.count, bin.right.of), (0, 60));
}

#[test]
fn prop_silence_is_right_only_where_nothing_counts() {
    let card = card(60, |_| Some(Said::default()));
    for row in &card.score.classes {
        let quiet = [
            Class::Nothing,
            Class::Parameters,
            Class::Immaterial,
            Class::Unobservable,
        ];
        let expected = quiet.iter().any(|class| class.title() == row.title);
        let count = if expected { row.cases } else { 0 };
        assert_eq!(row.right.count, count, "{}", row.title);
        assert_eq!(row.place.count, 0);
    }
}

#[test]
fn prop_failures_are_counted_and_right_in_nothing() {
    let card = card(20, |_| None);
    assert!(
        card.score
            .classes
            .iter()
            .all(|row| row.right.count == 0 && row.failed.count == row.cases)
    );
}

#[test]
fn prop_a_scorecard_is_gone_on_with_only_in_its_own_trial() {
    let folder = folder("book");
    let path = folder.join("scorecard.json");
    let written = card(12, |planned| Some(truth_said(planned)));
    written.write(&path).unwrap();
    assert_eq!(Scorecard::read(&path, SETTING).unwrap(), written);
    let another = Setting {
        seed: 6,
        kind: None,
        nature: Nature::Laboratory,
    };
    let message = Scorecard::read(&path, another).unwrap_err().to_string();
    assert!(message.contains("seed 5"), "{message}");
    fs::write(&path, "{").unwrap();
    assert!(Scorecard::read(&path, SETTING).is_err());
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn prop_opened_truths_fit_the_seals_made_beforehand() {
    for planned in plan(SETTING, 30) {
        let sealed = seal(SETTING, &planned).unwrap();
        let drawn = planned.request().unwrap().truth();
        let opened = Opened::new(drawn, SETTING.seed, planned.number);
        opened.check(&sealed).unwrap();
        let elsewhere = Opened::new(opened.truth.clone(), SETTING.seed, planned.number + 1);
        assert!(elsewhere.check(&sealed).is_err());
    }
}

#[test]
fn prop_other_tools_are_judged_by_the_same_rules() {
    let root = folder("others");
    let card = card(12, |planned| Some(truth_said(planned)));
    for case in &card.cases[..11] {
        let folder = root.join(case.planned.folder());
        fs::create_dir_all(&folder).unwrap();
        let text = serde_json::to_string(case.said.as_ref().unwrap()).unwrap();
        fs::write(folder.join("twin.json"), text).unwrap();
    }
    let score = other(&card.cases, &root, "twin").unwrap();
    let right: usize = score.classes.iter().map(|row| row.right.count).sum();
    assert_eq!(right, 11);
    assert!(other(&card.cases, &root, "nobody").is_err());
    fs::remove_dir_all(&root).unwrap();
}

#[test]
fn regress_page_and_tables_show_marks_and_misses() {
    let card = card(25, |planned| {
        (planned.number != 3).then(|| truth_said(planned))
    });
    let html = page::page(&card, Provenance::new("pneuma trial")).to_html();
    assert!(html.contains("case-0003") && html.contains("Confident") | html.contains("confident"));
    assert!(html.contains(&card.seals[7].sha256));
    let text = markdown::tables(&card);
    assert!(text.contains("| strong and medium effects named right first | at least 90 % |"));
    let widths: Vec<usize> = text
        .lines()
        .filter(|line| line.starts_with("| what was") || line.starts_with("| one strong"))
        .map(|line| line.matches('|').count())
        .collect();
    assert!(widths.len() == 2 && widths[0] == widths[1], "{widths:?}");
}

fn weighed(kind: Kind, effect: &str, strength: Strength) -> Materiality {
    let request = Request::new(31, kind)
        .with_noise(1.0)
        .with_strength(strength);
    let weighed = weigh(&request.with_effect(effect).unwrap().draw());
    assert!(weighed.clean.is_some());
    weighed.materiality[0].clone()
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_ablation_tells_what_counts() {
    let strong = weighed(Kind::Single, "valve-delay", Strength::Strong);
    assert!(strong.material && strong.energy_ratio > 10.0, "{strong:?}");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_ablation_tells_what_does_not_count() {
    let small = weighed(Kind::Single, "valve-delay", Strength::Immaterial);
    assert!(!small.material && small.energy_ratio < 10.0, "{small:?}");
    // Slow motion about the middle never asks for a fast spool.
    let hidden = weighed(Kind::Unobservable, "slew-limit", Strength::Medium);
    assert!(!hidden.material, "{hidden:?}");
}
