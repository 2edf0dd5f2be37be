//! The page of `pneuma compare`.

use super::capitalised;
use super::locate::{located_misfit, shade_intervals};
use super::prediction::{CLOSED_DETAIL, Curve, OPEN_DETAIL, prediction_stack, worst_recording};
use crate::compare::{LawComparison, SignalComparison};
use crate::laws::Track;
use crate::report::{Cell, Page, Role, Section, Table, number};
use crate::rig::Rig;
use crate::units::shown;

/// The page of a comparison.
pub fn compare_page(rig: &Rig, laws: &[LawComparison], tracks: &[Track<'_>]) -> Page {
    let mut page = Page::new("Simulation against recordings");
    page.lead(lead(laws));
    for signal in laws.iter().flat_map(|law| &law.signals) {
        tile(&mut page, signal);
    }
    for law in laws {
        page.section(capitalised(law.law.title()), |section| {
            section.text(format!("Predicted: {}.", law.prediction));
            section.table(table(law));
            over_time(section, rig, law, tracks);
            section.subheading("What it goes with");
            for signal in &law.signals {
                located_misfit(section, &signal.located, Role::Given);
            }
        });
    }
    page
}

/// The signal that is worst against its own spread, and how.
fn lead(laws: &[LawComparison]) -> String {
    let part = |signal: &SignalComparison| {
        signal.located.rms / signal.located.spread.max(f64::MIN_POSITIVE)
    };
    let signals = laws.iter().flat_map(|law| &law.signals);
    let Some(worst) = signals.max_by(|a, b| part(a).total_cmp(&part(b))) else {
        return String::new();
    };
    format!(
        "The prediction of `{}` is worst: off by {:.0} % of what the signal does. Its error: {}.",
        worst.located.signal,
        100.0 * part(worst),
        worst.located.when
    )
}

fn tile(page: &mut Page, signal: &SignalComparison) {
    let located = &signal.located;
    let unit = shown(located.unit);
    let figure = |value: f64| number::significant(value * unit.per_si, 3);
    page.tile(
        format!("`{}`, RMS error", located.signal),
        figure(located.rms),
        unit.unit,
        format!("sensor noise {}", figure(signal.noise)),
    );
}

fn table(law: &LawComparison) -> Table {
    let headings = [
        "signal",
        "RMS error",
        "mean error",
        "sensor noise",
        "signal sd",
        "unit",
        "share of the law's misfit",
    ];
    law.signals
        .iter()
        .fold(Table::new(headings), |table, signal| {
            let located = &signal.located;
            let unit = shown(located.unit);
            let figure = |value: f64| Cell::from(value * unit.per_si);
            table.row([
                format!("`{}`", located.signal).into(),
                figure(located.rms),
                figure(located.mean),
                figure(signal.noise),
                figure(located.spread),
                unit.unit.into(),
                format!("{:.0} %", 100.0 * located.share).into(),
            ])
        })
}

fn over_time(section: &mut Section, rig: &Rig, law: &LawComparison, tracks: &[Track<'_>]) {
    let located = law.located();
    let worst = worst_recording(&law.residuals);
    let curve = Curve {
        name: "as given",
        role: Role::Given,
        residuals: &law.residuals,
        shows_misfit: true,
    };
    let stack = |recording: usize, detail: usize| {
        let track = &tracks[recording];
        let stack = prediction_stack(law.law, rig, track, recording, &[curve], &[], detail);
        shade_intervals(stack, &located, &track.recording.name)
    };
    section.chart(stack(worst, OPEN_DETAIL));
    for recording in (0..tracks.len()).filter(|&one| one != worst) {
        let errors = law.signals.iter().filter_map(|signal| {
            let unit = shown(signal.located.unit);
            let (_, rms) = signal.by_recording.get(recording)?;
            let figure = number::significant(rms * unit.per_si, 3);
            Some(format!(
                "`{}` {figure} {}",
                signal.located.signal, unit.unit
            ))
        });
        let errors: Vec<String> = errors.collect();
        let name = &tracks[recording].recording.name;
        section.details(format!("{name}: {}", errors.join(", ")), |details| {
            details.chart(stack(recording, CLOSED_DETAIL));
        });
    }
}
