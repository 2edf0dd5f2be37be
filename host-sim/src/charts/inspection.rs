//! The page of `pneuma inspect`.

use super::prediction::{CLOSED_DETAIL, OPEN_DETAIL, signal_panel};
use crate::laws::Track;
use crate::recording::Recording;
use crate::report::{Cell, Chart, ChartStack, Page, Role, Section, Series, Table, number};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::inspect::{Fault, Inspection, SignalReport, Timing};
use std::path::Path;

/// Height of the panel of one signal, CSS pixels.
const HEIGHT_PX: u32 = 110;
/// Bins of the histogram of sample intervals.
const BINS: usize = 60;
/// Steps longer than this many median steps are gaps, and not in the histogram.
const GAP_STEPS: f64 = 5.0;
/// Steps that differ by less than this part of the median are the same.
const SAME_STEP: f64 = 1e-6;
/// Digits of figures.
const DIGITS: usize = 3;

/// The page of an inspection; `inspections` are those of `recordings`.
pub fn inspection_page(rig: &Rig, recordings: &[Recording], inspections: &[Inspection]) -> Page {
    let mut page = Page::new("Inspection of recordings");
    page.lead(lead(inspections));
    let sum = |of: fn(&Inspection) -> usize| inspections.iter().map(of).sum::<usize>();
    let duration_s: f64 = recordings.iter().map(Recording::duration_s).sum();
    let files = match inspections.len() {
        1 => "in one recording".into(),
        count => format!("in {count} recordings"),
    };
    page.tile("rows", sum(|one| one.rows).to_string(), "", files);
    page.tile(
        "recorded",
        number::significant(duration_s, 4),
        "s",
        rates(inspections),
    );
    page.tile(
        "faults",
        sum(|one| one.faults.len()).to_string(),
        "",
        "implausible channels",
    );
    page.tile(
        "gaps",
        sum(|one| one.timing.gap_count).to_string(),
        "",
        "steps longer than 5 median steps",
    );
    for (recording, inspection) in recordings.iter().zip(inspections) {
        page.section(short_name(&inspection.recording), |section| {
            section_of(section, rig, recording, inspection);
        });
    }
    page
}

fn short_name(path: &str) -> String {
    let name = Path::new(path).file_name();
    name.map_or_else(
        || path.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

fn lead(inspections: &[Inspection]) -> String {
    let faulty: Vec<String> = inspections
        .iter()
        .filter(|inspection| !inspection.faults.is_empty())
        .map(|inspection| short_name(&inspection.recording))
        .collect();
    if faulty.is_empty() {
        return "No channel shows a fault.".into();
    }
    format!("Implausible channels in {}.", faulty.join(", "))
}

fn rates(inspections: &[Inspection]) -> String {
    let rates = inspections.iter().map(|one| one.timing.rate_hz);
    let low = rates.clone().fold(f64::INFINITY, f64::min);
    let high = rates.fold(0.0, f64::max);
    let (low, high) = (number::significant(low, 4), number::significant(high, 4));
    if low == high {
        format!("at {low} Hz")
    } else {
        format!("at {low} to {high} Hz")
    }
}

fn section_of(section: &mut Section, rig: &Rig, recording: &Recording, inspection: &Inspection) {
    for fault in &inspection.faults {
        section.callout(format!("Fault: {}", fault.sentence));
    }
    let excitation = inspection.excitation.parts();
    if !excitation.is_empty() {
        section.text(format!("Excitation: {}.", excitation.join(", ")));
    }
    if !inspection.notes.is_empty() {
        section.list(&inspection.notes);
    }
    section.chart(signals(rig, recording, inspection));
    section.table(noise_table(rig, inspection));
    intervals(section, recording, &inspection.timing);
    if !inspection.unused_columns.is_empty() {
        let columns = inspection.unused_columns.join(", ");
        section.text(format!(
            "Columns without a signal in the rig file: {columns}."
        ));
    }
}

/// All signals, the faults shaded in the panel that they concern, gaps in all.
fn signals(rig: &Rig, recording: &Recording, inspection: &Inspection) -> ChartStack {
    let track = Track::still(recording);
    let many = recording.signals.len() > 4;
    let detail = if many { CLOSED_DETAIL } else { OPEN_DETAIL };
    let mut stack = ChartStack::new("");
    for name in recording.signals.keys() {
        let Some(panel) = signal_panel(rig, &track, name) else {
            continue;
        };
        let faults = inspection.faults.iter().filter(|one| one.signal == *name);
        let panel = faults.fold(panel.height(HEIGHT_PX).detail(detail), shaded);
        stack = stack.panel(panel);
    }
    let gaps = inspection.timing.gaps.iter();
    gaps.fold(stack, |stack, gap| {
        stack.interval(gap.from_s, gap.from_s + gap.length_s, "gap")
    })
}

fn shaded(panel: Chart, fault: &Fault) -> Chart {
    let kind = serde_json::to_value(fault.kind).ok();
    let kind = kind.as_ref().and_then(|kind| kind.as_str());
    panel.interval(fault.from_s, fault.to_s, kind.unwrap_or("fault"))
}

fn noise_table(rig: &Rig, inspection: &Inspection) -> Table {
    let headings = [
        "signal",
        "unit",
        "minimum",
        "maximum",
        "noise",
        "declared noise",
        "quantum",
        "declared quantum",
        "longest constant run, rows",
    ];
    let table = Table::new(headings)
        .caption("Noise (standard deviation) and quantum, measured and declared in the rig file");
    inspection
        .signals
        .iter()
        .fold(table, |table, signal| table.row(noise_row(rig, signal)))
}

fn noise_row(rig: &Rig, signal: &SignalReport) -> [Cell; 9] {
    let reading = Reading::of_signal(rig, &signal.name);
    let figure = |value: f64| Cell::significant(reading.difference(value), DIGITS);
    let optional = |value: Option<f64>| -> Cell { value.map(figure).into() };
    let noise = if signal.noise_visible {
        figure(signal.noise)
    } else {
        let most = signal.noise.max(0.5 * signal.quantum.unwrap_or(0.0));
        Cell::below(reading.difference(most), DIGITS)
    };
    [
        signals::titled(&signal.name).into(),
        format!("{}{}", reading.unit, reading.reference(&signal.name)).into(),
        Cell::significant(reading.value(signal.minimum), 5),
        Cell::significant(reading.value(signal.maximum), 5),
        noise,
        optional(signal.declared_noise),
        optional(signal.quantum),
        optional(signal.declared_resolution),
        signal.longest_run_rows.into(),
    ]
}

/// The steps between rows: a histogram where they differ, a sentence where not.
fn intervals(section: &mut Section, recording: &Recording, timing: &Timing) {
    let median_s = timing.median_step_s;
    let milliseconds = |step_s: f64| number::significant(step_s * 1e3, 4);
    let steps_ms: Vec<f64> = recording
        .time_s
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step_s| *step_s <= GAP_STEPS * median_s)
        .map(|step_s| step_s * 1e3)
        .collect();
    let same = |step_ms: &f64| (step_ms - median_s * 1e3).abs() <= SAME_STEP * median_s * 1e3;
    if steps_ms.iter().all(same) {
        let gaps = match timing.gap_count {
            0 => String::new(),
            1 => " but for one gap".into(),
            count => format!(" but for {count} gaps"),
        };
        section.text(format!(
            "All steps between rows are {} ms long{gaps}.",
            milliseconds(median_s)
        ));
        return;
    }
    let mut note = format!(
        "Steps from {} to {} ms, median {} ms, jitter {} ms.",
        milliseconds(timing.shortest_step_s),
        milliseconds(timing.longest_step_s),
        milliseconds(median_s),
        milliseconds(timing.jitter_s)
    );
    if timing.gap_count > 0 {
        note.push_str(&format!(
            " Gaps not in the histogram: {}.",
            timing.gap_count
        ));
    }
    section.chart(
        Chart::new("Sample intervals")
            .x_axis("step between rows", "ms")
            .y_axis("density", "1/ms")
            .height(HEIGHT_PX)
            .series(Series::histogram("steps", Role::Recorded, &steps_ms, BINS))
            .note(note),
    );
}
