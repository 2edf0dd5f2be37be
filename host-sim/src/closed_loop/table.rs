//! Scores as tables in Markdown: the controller beside the comparison.

use super::score::{Case, Measure, MeasuredCase, Score};
use std::fmt::Write as _;

/// Scores of the two controllers on one rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The rig's name.
    pub rig: String,
    /// The controller's.
    pub controller: Vec<Score>,
    /// The comparison's.
    pub comparison: Vec<Score>,
}

/// Median and worst of a figure over the seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The middle one.
    pub median: f64,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    /// Of a figure; `None` where no score has it.
    pub fn of(scores: &[Score], case: Case, measure: Measure) -> Option<Self> {
        let figures = scores.iter().filter_map(|score| score.get(case, measure));
        let mut figures: Vec<f64> = figures.collect();
        figures.sort_by(f64::total_cmp);
        Some(Self {
            median: *figures.get(figures.len() / 2)?,
            worst: *figures.last()?,
        })
    }

    /// Whether every seed kept a mark.
    pub fn holds(&self, mark: f64) -> bool {
        self.worst <= mark
    }
}

/// Cases and figures in the order of the cases.
fn figures(scores: &[Score]) -> Vec<(Case, Measure)> {
    let first = scores.first().into_iter().flat_map(|score| &score.cases);
    first
        .flat_map(|measured| {
            let measures = measured.measures.iter();
            measures.map(|(measure, _)| (measured.case, *measure))
        })
        .collect()
}

/// Every figure of one rig, both controllers side by side.
pub fn full_table(compared: &Compared) -> String {
    let mut text = String::from(
        "| case | figure | mark | median | worst | held | PID: median | worst | held |\n\
         |---|---|---:|---:|---:|---|---:|---:|---|\n",
    );
    for (case, measure) in figures(&compared.controller) {
        let unit = measure.unit();
        let mark = measure.mark(case);
        let shown_mark = mark.map_or(String::new(), |mark| unit.shown(mark));
        let _ = write!(text, "| {case} | {measure} | {shown_mark} |");
        for scores in [&compared.controller, &compared.comparison] {
            match Spread::of(scores, case, measure) {
                None => text.push_str(" | | |"),
                Some(spread) => {
                    let (median, worst) = (unit.shown(spread.median), unit.shown(spread.worst));
                    let held = mark.map_or("", |mark| word(spread.holds(mark)));
                    let _ = write!(text, " {median} | {worst} | {held} |");
                }
            }
        }
        text.push('\n');
    }
    text
}

fn word(holds: bool) -> &'static str {
    if holds { "yes" } else { "**no**" }
}

/// The worst of every marked figure, a row per rig and controller.
pub fn overview(all: &[Compared]) -> String {
    let Some(first) = all.first() else {
        return String::new();
    };
    let marked: Vec<(Case, Measure, f64)> = figures(&first.controller)
        .into_iter()
        .filter_map(|(case, measure)| Some((case, measure, measure.mark(case)?)))
        .collect();
    let mut text = String::from("| rig | controller |");
    for (case, measure, mark) in &marked {
        let _ = write!(
            text,
            " {case}: {measure} (mark {}) |",
            measure.unit().shown(*mark)
        );
    }
    let _ = write!(text, "\n|---|---|{}", "---:|".repeat(marked.len()));
    text.push('\n');
    for compared in all {
        for (name, scores) in [
            ("pneuma", &compared.controller),
            ("PID", &compared.comparison),
        ] {
            let _ = write!(text, "| {} | {name} |", compared.rig);
            for (case, measure, mark) in &marked {
                let cell = Spread::of(scores, *case, *measure).map_or(String::new(), |spread| {
                    let shown = measure.unit().shown(spread.worst);
                    if spread.holds(*mark) {
                        shown
                    } else {
                        format!("**{shown}**")
                    }
                });
                let _ = write!(text, " {cell} |");
            }
            text.push('\n');
        }
    }
    text
}

/// What else must be said of a rig's runs: end stops and false faults.
pub fn incidents(compared: &Compared) -> Option<String> {
    let count = |scores: &[Score], happened: fn(&MeasuredCase) -> bool| {
        let cases = scores.iter().flat_map(|score| &score.cases);
        cases.filter(|measured| happened(measured)).count()
    };
    let [stops, pid_stops, faults] = [
        count(&compared.controller, |measured| measured.hit_end_stop),
        count(&compared.comparison, |measured| measured.hit_end_stop),
        count(&compared.controller, |measured| measured.saw_fault),
    ];
    (stops + pid_stops + faults > 0).then(|| {
        format!(
            "{}: {stops} runs of the controller and {pid_stops} of the PID ran against an end \
             stop; the controller saw faults, where there were none, in {faults} runs.",
            compared.rig
        )
    })
}
