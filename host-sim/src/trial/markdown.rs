//! The scorecard's main tables as Markdown, for the book.

use super::book::Scorecard;
use super::on_chip::Tried;
use super::run::CaseResult;
use super::score::Row;
use std::fmt::Write as _;

/// Marks, classes and concealments.
pub fn tables(card: &Scorecard) -> String {
    let mut text = String::from(
        "| mark | to reach | reached | Wilson's interval of 95 % | kept |\n|---|---|---|---|---|\n",
    );
    for mark in &card.score.marks {
        let way = if mark.at_least { "at least" } else { "at most" };
        let kept = mark
            .kept
            .map_or("no case", |kept| if kept { "yes" } else { "**no**" });
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {way} {:.0} % | {} | {} | {kept} |",
            mark.title,
            100.0 * mark.mark,
            mark.reached,
            mark.reached.interval_in_words()
        );
    }
    if !card.others.is_empty() {
        beside(&mut text, card);
    }
    rows(&mut text, "what was missing", &card.score.classes);
    rows(&mut text, "how it was concealed", &card.score.concealments);
    on_chip(&mut text, &card.cases);
    text
}

/// What the found effects did to the control of the true plant.
fn on_chip(text: &mut String, cases: &[CaseResult]) {
    let _ = writeln!(
        text,
        "\n| back onto the chip | found | rms mm: as given | refitted | improved | outcome |\n|---|---|---|---|---|---|"
    );
    let rms = |tried: &Tried| match tried {
        Tried::Driven(tracking) if tracking.fault_s > 0.0 => "fault".to_owned(),
        Tried::Driven(tracking) => format!("{:.3}", 1e3 * tracking.rms_m),
        Tried::Refused(_) => "–".to_owned(),
    };
    for case in cases {
        let (Some(tried), Some(said)) = (&case.on_chip, &case.said) else {
            continue;
        };
        let found: Vec<&str> = said.named().iter().map(|one| one.effect.as_str()).collect();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            case.planned.folder(),
            found.join(", "),
            rms(&tried.given),
            rms(&tried.refitted),
            rms(&tried.improved),
            tried.remark(),
        );
    }
}

fn beside(text: &mut String, card: &Scorecard) {
    let names: Vec<&str> = card.others.keys().map(String::as_str).collect();
    let _ = writeln!(
        text,
        "\n| the same cases | pneuma | {} |",
        names.join(" | ")
    );
    let _ = writeln!(text, "|---|---|{}", "---|".repeat(names.len()));
    for mark in &card.score.marks {
        let theirs = card.others.values().map(|score| {
            let same = score.marks.iter().find(|other| other.title == mark.title);
            same.map(|other| other.reached.to_string())
                .unwrap_or_default()
        });
        let theirs: Vec<String> = theirs.collect();
        let _ = writeln!(
            text,
            "| {} | {} | {} |",
            mark.title,
            mark.reached,
            theirs.join(" | ")
        );
    }
}

fn rows(text: &mut String, what: &str, rows: &[Row]) {
    let _ = writeln!(
        text,
        "\n| {what} | cases | named first | within the set | place | unknown | false alarms | confident, wrong | \
         size error | sizes covered | within two deviations alone | held out: improved/refitted | floor/refitted | \
         worse | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for row in rows {
        let number = |value: Option<f64>, decimals: usize| {
            value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
        };
        let percent = row
            .size_error
            .map_or_else(|| "–".to_owned(), |e| format!("{:.1} %", 100.0 * e));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {percent} | {} | {} | {} | {} | {} | {} |",
            row.title,
            row.cases,
            row.named_first,
            row.within_set,
            row.place,
            row.unknown,
            row.false_alarms,
            row.confidently_wrong,
            row.covered,
            row.within_two_deviations,
            number(row.improved_over_refitted, 3),
            number(row.floor_over_refitted, 3),
            row.worse,
            number(row.seconds, 1),
        );
    }
}
