//! The acceptance sheet: one page with rig, verdict, scores before and after, and the errors over time.

use super::score::{Run, Score};
use super::steps::Progress;
use crate::report::{Cell, Chart, Page, Role, Series, Table, number};

/// The runs of a score, before and after.
pub struct Runs {
    /// With the rig file as it was; none where it could not be run.
    pub before: Option<Run>,
    /// With the improved one.
    pub after: Run,
}

/// A figure of a score: its name, and where it stands.
type Figure = (&'static str, fn(&Score) -> f64);

/// What is shown, mm.
const FIGURES: [Figure; 3] = [
    ("at rest after a move", |score| score.at_rest_mm),
    ("in the sine", |score| score.in_sine_mm),
    ("in the sine, rms", |score| score.in_sine_rms_mm),
];

/// The page.
pub fn sheet(rig: &str, date: &str, progress: &Progress, runs: &Runs) -> Page {
    let mut page = Page::new(format!("Acceptance: {rig}"));
    let (before, Some(after)) = (progress.before, progress.after) else {
        return page;
    };
    let was = before.map_or("the run could not be made".to_owned(), |before| {
        let [rest, sine] = [before.at_rest_mm, before.in_sine_mm].map(said);
        format!("it was {rest} and {sine} mm")
    });
    page.lead(format!(
        "The load stands within {} mm of its place after a move and follows a sine within {} mm; before the diagnosis {was}.",
        said(after.at_rest_mm),
        said(after.in_sine_mm),
    ));
    for (label, of) in FIGURES {
        let note = before.map_or("before: not run".to_owned(), |before| {
            format!("before: {} mm", said(of(&before)))
        });
        page.tile(label, said(of(&after)), "mm", note);
    }
    page.opening(|section| section.chart(errors(runs)));
    page.section("What was found", |section| {
        let verdict = progress.verdict.as_deref().unwrap_or("no verdict");
        section.callout(verdict);
        section.text(
            "Details: `diagnosis.html` beside this sheet; the numbers are in `improved.toml`.",
        );
    });
    page.section("Scores", |section| {
        section.text("Measured position less reference. At rest: the last second of each move; in the sine its first period is left out.");
        section.table(table(before.as_ref(), &after));
    });
    page.section("Board and axis", |section| {
        let firmware = progress.firmware.as_deref().unwrap_or("firmware unknown");
        section.list(&[
            format!("rig file: {rig}"),
            format!("board: {firmware}"),
            format!("date: {date}"),
        ]);
    });
    page
}

fn said(value_mm: f64) -> String {
    number::significant(value_mm, 2)
}

fn table(before: Option<&Score>, after: &Score) -> Table {
    let mut table = Table::new(["largest error, mm", "rig file", "improved"]);
    for (name, of) in FIGURES {
        let was = before.map_or_else(|| Cell::from("-"), |one| Cell::significant(of(one), 2));
        table = table.row([Cell::from(name), was, Cell::significant(of(after), 2)]);
    }
    table
}

/// Errors over time; at a move's begin the reference is already where the load is to go.
fn errors(runs: &Runs) -> Chart {
    let beyond_mm = 1.0;
    let series =
        |name: &str, role: Role, run: &Run| Series::columns(name, role, &run.time_s, &run.error_mm);
    let mut chart = Chart::new("Error over the score run")
        .x_axis("time", "s")
        .y_axis("measured less reference", "mm")
        .y_range(-beyond_mm, beyond_mm);
    if let Some(before) = &runs.before {
        chart = chart.series(series("rig file", Role::Given, before));
    }
    chart
        .series(series("improved", Role::Improved, &runs.after))
        .note("While a move is under way its end is the reference: the error begins with the whole way.")
}
