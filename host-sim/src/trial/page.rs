//! The scorecard as a page.

use super::book::Scorecard;
use super::judge::Expected;
use super::plan::Concealment;
use super::run::CaseResult;
use super::score::{Mark, Row, said_word, truth_word};
use crate::report::{Cell, Chart, Matrix, Page, Provenance, Role, Section, Series, Table};
use std::collections::BTreeSet;

/// The page.
pub fn page(card: &Scorecard, how: Provenance) -> Page {
    let mut page = Page::new("Concealed trial");
    page.lead(lead(card));
    for mark in &card.score.marks {
        page.tile(&mark.title, mark.reached.to_string(), "", mark_note(mark));
    }
    page.section("Marks", |section| section.table(marks(&card.score.marks)));
    if !card.others.is_empty() {
        page.section("Comparison with other tools", |section| {
            section.text("The same cases and the same rules.");
            section.table(beside(card));
        });
    }
    page.section("By omitted effect", |section| {
        section.text(HOW_COUNTED);
        rows(section, "class", &card.score.classes);
    });
    page.section("By concealment", |section| {
        section.text("Cases with effects of the list that count. Masked: the rig file holds numbers fitted to the affected recordings beforehand; the share is the part of the misfit energy that this fit hides.");
        rows(section, "concealment", &card.score.concealments);
    });
    page.section("By effect", |section| {
        section.text("Cases in which only this effect is omitted and counts.");
        rows(section, "effect", &card.score.effects);
    });
    page.section("Calibration of the stated probabilities", |section| {
        reliability(section, card)
    });
    page.section("Confusion matrix", |section| {
        section.matrix(confusion(card))
    });
    page.section("Control with the found effects", |section| {
        section.text("The control task of the firmware drives the true plant of every case whose effect was named correctly: moves of 10, 60 and 200 mm, sines at 0.5 and 1 Hz. Motion and noise are the same for three settings: the rig as given, refitted, and with the named effects.");
        section.table(on_chip(&card.cases));
    });
    page.section("Every case", |section| {
        section.text("Wrong verdicts are emphasised.");
        section.table(cases(&card.cases));
        section.details("Sentences of the verdicts", |section| {
            section.list(card.cases.iter().map(sentence));
        });
    });
    page.section("Seals", |section| {
        section.text("SHA-256 of salt, a zero byte, the truth as one line of JSON with its keys in order, and a zero byte; made before the tool ran on the first case. Salts and truths are in the scorecard's file.");
        let seals = card.seals.iter().enumerate();
        let lines = seals.map(|(number, seal)| format!("case-{number:04} {}", seal.sha256));
        section.code(lines.collect::<Vec<String>>().join("\n"));
    });
    page.provenance(how);
    page
}

const HOW_COUNTED: &str = "An effect counts if removing it from the plant changes the held-out misfit of a refitted model, and if its size is relevant in practice; if no effect counts, the right verdict is that nothing is missing. Intervals: Wilson, 95 %.";

fn lead(card: &Scorecard) -> String {
    let kept = card
        .score
        .marks
        .iter()
        .filter(|mark| mark.kept == Some(true))
        .count();
    let right = card
        .cases
        .iter()
        .filter(|case| case.judgement.right)
        .count();
    format!(
        "{right} of {} concealed cases judged right; {kept} of {} marks kept.",
        card.cases.len(),
        card.score.marks.len()
    )
}

fn mark_note(mark: &Mark) -> String {
    let way = if mark.at_least { "at least" } else { "at most" };
    format!("mark: {way} {:.0} %", 100.0 * mark.mark)
}

fn marks(marks: &[Mark]) -> Table {
    let table = Table::new(["what", "mark", "reached", "95 % interval", "kept"]);
    marks.iter().fold(table, |table, mark| {
        let interval = mark.reached.interval();
        let interval =
            interval.map(|(low, high)| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high));
        let cells: [Cell; 5] = [
            mark.title.clone().into(),
            mark_note(mark).into(),
            mark.reached.to_string().into(),
            interval.unwrap_or_default().into(),
            match mark.kept {
                Some(true) => "yes".into(),
                Some(false) => "no".into(),
                None => "no case".into(),
            },
        ];
        if mark.kept == Some(false) {
            table.emphasised_row(cells)
        } else {
            table.row(cells)
        }
    })
}

fn beside(card: &Scorecard) -> Table {
    let tools = card.others.keys().map(String::as_str);
    let table = Table::new(["what", "mark", "pneuma"].into_iter().chain(tools));
    card.score.marks.iter().fold(table, |table, mark| {
        let theirs = card.others.values().map(|score| {
            let same = score.marks.iter().find(|other| other.title == mark.title);
            Cell::from(
                same.map(|other| other.reached.to_string())
                    .unwrap_or_default(),
            )
        });
        let own: [Cell; 3] = [
            mark.title.clone().into(),
            mark_note(mark).into(),
            mark.reached.to_string().into(),
        ];
        table.row(own.into_iter().chain(theirs))
    })
}

fn rows(section: &mut Section, what: &str, rows: &[Row]) {
    let named = Table::new([
        what,
        "cases",
        "right",
        "named first",
        "within the set",
        "all named",
        "place",
        "unknown",
        "false alarms",
        "confident, wrong",
        "failed",
    ]);
    section.table(rows.iter().fold(named, |table, row| {
        table.row([
            row.title.clone().into(),
            row.cases.into(),
            row.right.to_string().into(),
            row.named_first.to_string().into(),
            row.within_set.to_string().into(),
            row.complete.to_string().into(),
            row.place.to_string().into(),
            row.unknown.to_string().into(),
            row.false_alarms.to_string().into(),
            row.confidently_wrong.to_string().into(),
            row.failed.to_string().into(),
        ])
    }));
    let sized = Table::new([
        what,
        "size error, median %",
        "sizes covered",
        "within two deviations alone",
        "held out: improved/refitted",
        "held out: floor/refitted",
        "worse than refitted",
        "s, median",
    ]);
    let percent =
        |value: Option<f64>| Cell::from(value.map(|value| Cell::number(100.0 * value, 1)));
    section.table(rows.iter().fold(sized, |table, row| {
        table.row([
            row.title.clone().into(),
            percent(row.size_error),
            row.covered.to_string().into(),
            row.within_two_deviations.to_string().into(),
            row.improved_over_refitted
                .map(|ratio| Cell::number(ratio, 3))
                .into(),
            row.floor_over_refitted
                .map(|ratio| Cell::number(ratio, 3))
                .into(),
            row.worse.to_string().into(),
            row.seconds.map(|seconds| Cell::number(seconds, 1)).into(),
        ])
    }));
}

fn reliability(section: &mut Section, card: &Scorecard) {
    let bins = &card.score.reliability;
    section.text("Every effect with a stated probability, compared with its presence in the plant. On the line the stated probability equals the frequency.");
    let points = bins
        .iter()
        .filter_map(|bin| Some((bin.stated, bin.right.share()?)));
    section.chart(
        Chart::new("Stated probability and frequency")
            .x_axis("stated probability", "1")
            .y_axis("frequency of presence", "1")
            .series(Series::new("ideal", Role::Noise, [(0.0, 0.0), (1.0, 1.0)]))
            .series(Series::new("reached", Role::Improved, points)),
    );
    let table = Table::new(["stated", "mean", "there", "95 % interval"]);
    section.table(bins.iter().fold(table, |table, bin| {
        let interval = bin.right.interval();
        let interval =
            interval.map(|(low, high)| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high));
        table.row([
            format!("{} to {}", bin.from, bin.to).into(),
            Cell::number(bin.stated, 3),
            bin.right.to_string().into(),
            interval.unwrap_or_default().into(),
        ])
    }));
}

fn confusion(card: &Scorecard) -> Matrix {
    let pairs = &card.score.confusion;
    let truths: BTreeSet<&str> = pairs.iter().map(|pair| pair.truth.as_str()).collect();
    let said: BTreeSet<&str> = pairs.iter().map(|pair| pair.said.as_str()).collect();
    let count = |truth: &str, said: &str| {
        let found = pairs
            .iter()
            .find(|pair| pair.truth == truth && pair.said == said);
        found.map_or(f64::NAN, |pair| pair.count as f64)
    };
    let cells = truths
        .iter()
        .map(|truth| said.iter().map(|said| count(truth, said)).collect())
        .collect();
    Matrix::new(
        "Cases: missing (rows), named first (columns)",
        truths.clone(),
        said.clone(),
        cells,
    )
    .decimals(0)
}

fn on_chip(all: &[CaseResult]) -> Table {
    let table = Table::new([
        "case",
        "effects",
        "rms mm: given",
        "refitted",
        "improved",
        "worst mm: given",
        "refitted",
        "improved",
        "command V/s: refitted",
        "improved",
        "outcome",
    ]);
    let driven = all
        .iter()
        .filter_map(|case| Some((case, case.on_chip.as_ref()?)));
    driven.fold(table, |table, (case, tried)| {
        let three = [&tried.given, &tried.refitted, &tried.improved].map(|tried| tried.tracking());
        let mm =
            |metres: Option<f64>| Cell::from(metres.map(|metres| Cell::number(1e3 * metres, 3)));
        let rms = three.map(|one| mm(one.map(|one| one.rms_m)));
        let worst = three.map(|one| mm(one.map(|one| one.worst_m)));
        let activity = [three[1], three[2]]
            .map(|one| Cell::from(one.map(|one| Cell::number(one.activity_v_per_s, 1))));
        let names: [Cell; 2] = [
            case.planned.folder().into(),
            truth_word(&case.judgement).into(),
        ];
        let outcome: Cell = tried.remark().into();
        let figures = names.into_iter().chain(rms).chain(worst).chain(activity);
        table.row(figures.chain([outcome]))
    })
}

fn cases(all: &[CaseResult]) -> Table {
    let table = Table::new([
        "case",
        "class",
        "drawn",
        "counts",
        "concealed",
        "said",
        "place said",
        "p",
        "right",
        "s",
    ]);
    all.iter().fold(table, |table, case| {
        let cells = case_cells(case);
        if case.judgement.right {
            table.row(cells)
        } else {
            table.emphasised_row(cells)
        }
    })
}

fn case_cells(case: &CaseResult) -> [Cell; 10] {
    let truth = &case.opened.truth;
    let drawn: Vec<String> = truth
        .effects
        .iter()
        .map(|effect| {
            format!(
                "{} ({:?}, {})",
                effect.name,
                effect.strength,
                effect.places.join(", ")
            )
        })
        .collect();
    let said = case.said.as_ref();
    let names: Vec<&str> = said
        .iter()
        .flat_map(|said| said.named())
        .map(|one| one.effect.as_str())
        .collect();
    let names = if names.is_empty() {
        said_word(case)
    } else {
        names.join(", ")
    };
    let places = said
        .map(|said| said.places().join(", "))
        .unwrap_or_default();
    let probability = said.and_then(|said| said.named().first()?.probability);
    [
        case.planned.folder().into(),
        case.planned.class().title().into(),
        drawn.join("; ").into(),
        counts(case).into(),
        concealed(case).into(),
        names.into(),
        places.into(),
        probability.map(|p| Cell::number(p, 2)).into(),
        if case.judgement.right {
            "yes".into()
        } else {
            "no".into()
        },
        Cell::number(case.seconds, 1),
    ]
}

fn counts(case: &CaseResult) -> String {
    match &case.judgement.expected {
        Expected::NothingMissing => "nothing".into(),
        _ => truth_word(&case.judgement),
    }
}

fn concealed(case: &CaseResult) -> String {
    let onset = case
        .opened
        .truth
        .effects
        .first()
        .and_then(|effect| effect.onset.as_ref());
    match (case.planned.concealment, &case.masking, onset) {
        (Concealment::Masked, Some(masking), _) => {
            format!("masked, {:.0} % hidden", 100.0 * masking.hidden_share)
        }
        (Concealment::Masked, None, _) => "label: the fit to mask it gave no rig".into(),
        (Concealment::Noisy(multiplier), ..) => format!("noise x{multiplier}"),
        (_, _, Some(onset)) => format!("present {:.0} %", 100.0 * onset.present_share),
        _ => "label".into(),
    }
}

fn sentence(case: &CaseResult) -> String {
    let said = case.said.as_ref().map(|said| said.sentence.as_str());
    let words = said.or(case.failure.as_deref()).unwrap_or_default();
    format!("{}: {words}", case.planned.folder())
}
