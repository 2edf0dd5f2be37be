//! The report of a fleet: which axes changed, since when, in which physics.

use super::change::Shape;
use super::plan::{AxisPlan, Night};
use super::series::Axis;
use super::store::{Outcome, Store};
use super::summary::{Changed, Found, Summary, night_for_verdict};
use super::watched::watched;
use super::work::Verdict;
use crate::report::{Cell, Chart, Page, Role, Section, Series, Table, number};

/// Axes shown with a chart.
const MOST_SHOWN: usize = 20;

/// The page.
pub fn page(summary: &Summary<'_>, store: &Store) -> Page {
    let mut page = Page::new("Fleet");
    page.lead(lead(summary));
    tiles(&mut page, summary);
    if !summary.groups.is_empty() {
        page.section("Groups that changed as a whole", |section| {
            section.text("What the middle axis of a group does is none of a single axis; sizes are in units of what matters on an axis.");
            for group in &summary.groups {
                section.text(format!("{}: {}.", group.name, of_group(&group.found[0])));
                section.chart(chart(&group.name, &group.found[0]));
            }
        });
    }
    if !summary.changed.is_empty() {
        page.section("To look at first", |section| {
            ranking(section, summary, store)
        });
        let shown = summary.changed.iter().take(MOST_SHOWN);
        for (axis, changed) in shown {
            page.section(axis.plan.name.clone(), |section| {
                of_axis(section, axis, changed, store)
            });
        }
    }
    if all(summary).any(|axis| !axis.faults.is_empty()) {
        page.section("Faults in recordings", |section| faults(section, summary));
    }
    if !summary.slightly.is_empty() {
        page.folded_section("Changes too small to matter", |section| {
            let small = summary.slightly.iter();
            let line = |(axis, one): &(Axis<'_>, Changed)| {
                format!("{}: {}", axis.plan.name, sentence(axis.plan, &one.found[0]))
            };
            section.list(small.map(line).collect::<Vec<String>>());
        });
    }
    page.folded_section("Axes without a change", |section| {
        let names = summary.steady.iter().map(|axis| axis.plan.name.clone());
        section.list(names.collect::<Vec<String>>());
    });
    page
}

fn tiles(page: &mut Page, summary: &Summary<'_>) {
    let faulty = all(summary).filter(|axis| !axis.faults.is_empty()).count();
    let open: usize = all(summary).map(|axis| axis.open).sum();
    let nights: usize = all(summary).map(|axis| axis.plan.nights.len()).sum();
    page.tile(
        "axes",
        all(summary).count().to_string(),
        "",
        format!("{nights} nights"),
    );
    page.tile(
        "changed",
        summary.changed.len().to_string(),
        "",
        material(summary),
    );
    page.tile(
        "with faults in recordings",
        faulty.to_string(),
        "axes",
        String::new(),
    );
    if open > 0 {
        page.tile(
            "not worked on yet",
            open.to_string(),
            "nights",
            "run pneuma fleet run".to_owned(),
        );
    }
}

fn all<'s, 'p>(summary: &'s Summary<'p>) -> impl Iterator<Item = &'s Axis<'p>> {
    let changed = summary.changed.iter().chain(&summary.slightly);
    changed.map(|(axis, _)| axis).chain(&summary.steady)
}

fn material(summary: &Summary<'_>) -> String {
    let matter = summary
        .changed
        .iter()
        .filter(|(_, one)| one.found[0].share() >= 1.0);
    format!("{} by more than matters", matter.count())
}

fn lead(summary: &Summary<'_>) -> String {
    let Some((axis, changed)) = summary.changed.first() else {
        return "No axis has changed by what matters.".into();
    };
    let first = &changed.found[0];
    format!("{} first: {}.", axis.plan.name, sentence(axis.plan, first))
}

/// A change in words: what, by how much, since when, seen when.
pub fn sentence(plan: &AxisPlan, found: &Found) -> String {
    let change = &found.change;
    let how = match (change.shape, change.size > 0.0) {
        (Shape::Step, true) => "rose at once by",
        (Shape::Step, false) => "fell at once by",
        (Shape::Ramp, true) => "has been rising, so far by",
        (Shape::Ramp, false) => "has been falling, so far by",
    };
    let until = found.days_until_it_matters().map_or(String::new(), |days| {
        format!(
            ", and matters in {} days if it goes on so",
            number::significant(days, 2)
        )
    });
    format!(
        "{} {how} {} after {} ({} to {}), seen on {}{until}",
        found.title(),
        size(found),
        on(plan, change.onset_day),
        on(plan, change.onset_days[0]),
        on(plan, change.onset_days[1]),
        on(plan, change.seen_day),
    )
}

fn of_group(found: &Found) -> String {
    format!(
        "{} of all axes is off by {} of the size that matters since day {}",
        found.title(),
        number::significant(found.change.size, 2),
        number::significant(found.change.onset_day, 3)
    )
}

/// The date of a day, or its number.
fn on(plan: &AxisPlan, day: f64) -> String {
    let same = |night: &&Night| (night.day - day).abs() < 0.5;
    let date = plan
        .nights
        .iter()
        .find(same)
        .and_then(|night| night.date.clone());
    date.unwrap_or_else(|| format!("day {}", number::significant(day, 3)))
}

fn size(found: &Found) -> String {
    let change = &found.change;
    let Some(known) = watched(&found.series.key) else {
        // The logarithm of a misfit.
        let more = change.size.abs().exp_m1();
        return format!("{} %", number::significant(100.0 * more, 2));
    };
    let said = |value: f64| number::significant(value.abs() * known.per_si, 2);
    let (size, deviation) = (said(change.size), said(change.standard_deviation));
    format!("{size} ± {deviation} {}", known.unit)
        .trim_end()
        .to_owned()
}

fn ranking(section: &mut Section, summary: &Summary<'_>, store: &Store) {
    section.text(
        "The most pressing first: by the size of the change over the size from which it matters.",
    );
    let mut table = Table::new([
        "axis",
        "what changed",
        "physics",
        "by",
        "of what matters",
        "since",
        "seen",
        "verdict on the latest night",
    ]);
    for (axis, changed) in &summary.changed {
        let found = &changed.found[0];
        let row = [
            Cell::from(axis.plan.name.as_str()),
            Cell::from(found.title().as_str()),
            Cell::from(found.physics()),
            Cell::from(size(found).as_str()),
            Cell::significant(found.share(), 2),
            Cell::from(on(axis.plan, found.change.onset_day).as_str()),
            Cell::from(on(axis.plan, found.change.seen_day).as_str()),
            Cell::from(verdict(axis, store).as_str()),
        ];
        table = if found.share() >= 1.0 {
            table.emphasised_row(row)
        } else {
            table.row(row)
        };
    }
    section.table(table);
}

fn verdict(axis: &Axis<'_>, store: &Store) -> String {
    let job = night_for_verdict(axis).map(|(_, job)| job);
    match job.and_then(|job| store.read::<Verdict>(&job)) {
        None => "not made yet".into(),
        Some(Outcome::Failed(why)) => why,
        Some(Outcome::Done(verdict)) => verdict.sentence,
    }
}

fn of_axis(section: &mut Section, axis: &Axis<'_>, changed: &Changed, store: &Store) {
    let first = &changed.found[0];
    section.callout(sentence(axis.plan, first));
    section.chart(chart(&first.title(), first));
    section.text(format!(
        "Verdict on the latest night: {}",
        verdict(axis, store)
    ));
    if let Some((night, _)) = night_for_verdict(axis) {
        let path = night.recording.path.to_string_lossy().into_owned();
        section.text(format!("The recording to look at: `{path}`"));
    }
    if changed.found.len() > 1 {
        section.details("Also changed, perhaps as a consequence", |section| {
            let others = changed.found[1..]
                .iter()
                .map(|found| sentence(axis.plan, found));
            section.list(others.collect::<Vec<String>>());
        });
    }
}

fn chart(title: &str, found: &Found) -> Chart {
    // A group's is in units of what matters.
    let known = watched(&found.series.key).filter(|_| !found.is_of_group());
    let per_si = known.map_or(1.0, |one| one.per_si);
    let unit = known.map_or(
        if found.is_of_group() {
            "sizes that matter"
        } else {
            "logarithm"
        },
        |one| one.unit,
    );
    let points = &found.series.points;
    let nights = points.iter().map(|one| (one.day, one.value * per_si));
    let change = &found.change;
    let with = |day: f64| {
        let last = points.last().map_or(change.onset_day + 1.0, |one| one.day);
        let share = match change.shape {
            Shape::Step => f64::from(day > change.onset_day),
            Shape::Ramp => ((day - change.onset_day) / (last - change.onset_day)).max(0.0),
        };
        (day, per_si * (change.was + share * change.size))
    };
    let line = points.iter().map(|one| with(one.day));
    Chart::new(title.to_owned())
        .x_axis("days since the first night", "d")
        .y_axis(found.title(), unit)
        .series(Series::new("each night", Role::Recorded, nights).dots())
        .series(Series::new("change", Role::Improved, line))
        .level(
            per_si * (change.was + found.series.matters.copysign(change.size)),
            "matters from here on",
        )
        .interval(change.onset_days[0], change.onset_days[1], "onset")
}

fn faults(section: &mut Section, summary: &Summary<'_>) {
    let mut table = Table::new(["axis", "nights with a fault", "the first", "what"]);
    for axis in all(summary).filter(|axis| !axis.faults.is_empty()) {
        let (place, sentences) = &axis.faults[0];
        let night = &axis.plan.nights[*place];
        let what = sentences.first().map_or("", String::as_str);
        table = table.row([
            Cell::from(axis.plan.name.as_str()),
            Cell::from(axis.faults.len()),
            Cell::from(on(axis.plan, night.day).as_str()),
            Cell::from(what),
        ]);
    }
    section.table(table);
}
