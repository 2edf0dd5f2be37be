//! The page of an experiment on a bench: numbers, the law beside the points, what was used.

use ::bench::{Curve, Kind, Outcome, Picture};

use crate::report::{Cell, Chart, Page, Role, Section, Series, Table, number};
use crate::rig::Rig;

/// The colours of a family of curves, in turn, and those of a family of points.
const FAMILY: [Role; 6] = [
    Role::Improved,
    Role::Refitted,
    Role::Mark,
    Role::Noise,
    Role::Recorded,
    Role::Given,
];
const OF_POINTS: [Role; 4] = [Role::Recorded, Role::Mark, Role::Refitted, Role::Noise];
/// Numbers that the first sentence has.
const SAID: usize = 2;
/// Numbers that are shown large.
const TILES: usize = 4;

/// The page of an outcome.
pub fn bench_page(rig: &Rig, outcome: &Outcome) -> Page {
    let mut page = Page::new(outcome.title);
    page.lead(found(outcome));
    for one in outcome.numbers.iter().take(TILES) {
        let (value, deviation) = one.shown();
        let unit = one.shown_unit();
        page.tile(&one.what, value, unit, format!("± {deviation}"));
    }
    if let Some((first, others)) = outcome.pictures.split_first() {
        page.opening(|section| section.chart(chart(first)));
        page.section("Further pictures", |section| {
            others
                .iter()
                .for_each(|picture| section.chart(chart(picture)));
        });
    }
    page.section("Numbers", |section| {
        section.table(numbers(rig, outcome));
        if !outcome.notes.is_empty() {
            section.subheading("Notes");
            section.list(&outcome.notes);
        }
    });
    page.folded_section("How it was measured", |section| {
        section.text(outcome.method)
    });
    page.folded_section("What was used of the recordings", |section| {
        used(section, outcome)
    });
    page
}

/// The first numbers in a sentence.
fn found(outcome: &Outcome) -> String {
    let said = outcome.numbers.iter().take(SAID).map(|one| {
        let (value, deviation) = one.shown();
        let unit = one.shown_unit();
        format!("{}: {value} ± {deviation} {unit}", one.what)
            .trim_end()
            .to_owned()
    });
    said.collect::<Vec<String>>().join("; ") + "."
}

/// One picture of an experiment.
pub fn chart(picture: &Picture) -> Chart {
    let mut chart = Chart::new(&picture.title)
        .x_axis(&picture.x.name, &picture.x.unit)
        .y_axis(&picture.y.name, &picture.y.unit);
    if picture.x.unit == "Hz" {
        chart = chart.logarithmic_x();
    }
    let mut laws = FAMILY.iter().cycle();
    let mut points = OF_POINTS.iter().cycle();
    for curve in &picture.curves {
        let role = match curve.kind {
            Kind::Law => laws.next(),
            Kind::Points => points.next(),
            _ => None,
        };
        chart = chart.series(series(curve, role.copied()));
    }
    chart
}

fn series(curve: &Curve, role: Option<Role>) -> Series {
    let points = curve.points.iter().copied();
    match curve.kind {
        Kind::Points => Series::new(&curve.name, role.unwrap_or(Role::Recorded), points).dots(),
        Kind::OtherPoints => Series::new(&curve.name, Role::Mark, points).dots(),
        Kind::Recorded => Series::new(&curve.name, Role::Recorded, points),
        Kind::Law => Series::new(&curve.name, role.unwrap_or(Role::Improved), points),
        Kind::Given => Series::new(&curve.name, Role::Given, points).dashed(),
    }
}

fn numbers(rig: &Rig, outcome: &Outcome) -> Table {
    let mut table = Table::new(["number", "key of the rig file", "measured", "±", "unit", "rig file"])
        .caption("Deviations are one standard deviation: of the points, and of the stated uncertainties that enter.");
    let in_file: Vec<&str> = outcome
        .of_rig_file(rig)
        .map(|one| one.key.as_str())
        .collect();
    for one in &outcome.numbers {
        let (value, deviation) = one.shown();
        let key = if in_file.contains(&one.key.as_str()) {
            one.key.as_str()
        } else {
            ""
        };
        let was = rig
            .value(&one.key)
            .map(|was| number::significant(was * one.shown_in.1, 4));
        table = table.row([
            Cell::from(one.what.as_str()),
            Cell::from(key),
            Cell::from(value.as_str()),
            Cell::from(deviation.as_str()),
            Cell::from(one.shown_unit()),
            Cell::from(was.unwrap_or_default().as_str()),
        ]);
    }
    table
}

fn used(section: &mut Section, outcome: &Outcome) {
    let mut table = Table::new(["recording", "from, s", "to, s", "what"]);
    for one in &outcome.stretches {
        table = table.row([
            Cell::from(one.recording.as_str()),
            Cell::number(one.from_s, 3),
            Cell::number(one.to_s, 3),
            Cell::from(one.what.as_str()),
        ]);
    }
    section.table(table);
}
