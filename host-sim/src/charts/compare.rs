//! The page of `pneuma compare`.

use super::locate::{located_misfit, shade_intervals};
use super::prediction::{
    CLOSED_DETAIL, Curve, OPEN_DETAIL, Prediction, floor_to_draw, worst_recording,
};
use super::residuals::fit_percent;
use super::{capitalised, test_residuals};
use crate::laws::Track;
use crate::report::{Cell, Page, Role, Section, Table, number};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::compare::{LawComparison, SignalComparison, headline};

/// The page of a comparison.
pub fn compare_page(rig: &Rig, laws: &[LawComparison], tracks: &[Track<'_>]) -> Page {
    let mut page = Page::new("Simulation against recordings");
    page.lead(headline(rig, laws));
    for signal in laws.iter().flat_map(|law| &law.signals) {
        tile(&mut page, rig, signal);
    }
    if let Some((law, place)) = worst(laws) {
        page.opening(|section| {
            let recording = worst_recording(&law.residuals);
            let curves = [curve(law)];
            let shown = prediction(rig, law, &tracks[recording], recording, &curves);
            section.chart(shown.stack_of(place));
        });
    }
    for law in laws {
        page.folded_section(capitalised(law.law.title()), |section| {
            section.text(format!("Prediction: {}.", law.prediction));
            section.table(table(rig, law));
            over_time(section, rig, law, tracks);
            section.subheading("Correlation of the misfit");
            for signal in &law.signals {
                located_misfit(section, rig, &signal.located, Role::Given);
            }
            section.subheading("Residual tests");
            let models = [("as given", Role::Given, &law.residuals)];
            test_residuals(section, law.law, rig, tracks, &models);
        });
    }
    page
}

/// The law and the place among its outputs of the signal furthest from its noise.
fn worst(laws: &[LawComparison]) -> Option<(&LawComparison, usize)> {
    let signals = laws.iter().flat_map(|law| {
        let places = law.signals.iter().enumerate();
        places.map(move |(place, signal)| (law, place, signal.over_noise()))
    });
    let worst = signals.max_by(|a, b| a.2.total_cmp(&b.2))?;
    Some((worst.0, worst.1))
}

fn curve(law: &LawComparison) -> Curve<'_> {
    Curve {
        name: "as given",
        role: Role::Given,
        residuals: &law.residuals,
        shows_misfit: true,
    }
}

fn prediction<'a>(
    rig: &'a Rig,
    law: &LawComparison,
    track: &'a Track<'a>,
    recording: usize,
    curves: &'a [Curve<'a>],
) -> Prediction<'a> {
    Prediction {
        law: law.law,
        rig,
        track,
        recording,
        curves,
        floor: &[],
        detail: OPEN_DETAIL,
    }
}

fn tile(page: &mut Page, rig: &Rig, signal: &SignalComparison) {
    let located = &signal.located;
    let reading = Reading::of_signal(rig, located.signal);
    let figure = |value: f64| number::significant(reading.difference(value), 3);
    let fit = fit_percent(located.rms, located.spread, signal.noise);
    let fit = fit.map_or_else(
        || "the signal is constant within its noise".into(),
        |fit| format!("fit {} %", number::fixed(fit, 1)),
    );
    let noise = floor_to_draw(signal.noise, located.rms).map_or_else(
        || "at the sensor noise".into(),
        |noise| {
            let times = number::significant(signal.over_noise(), 2);
            format!("{times} times the sensor noise of {}", figure(noise))
        },
    );
    page.tile(
        format!("{}, rms misfit", signals::titled(located.signal)),
        figure(located.rms),
        reading.unit.clone(),
        format!("{noise}; {fit}"),
    );
}

fn table(rig: &Rig, law: &LawComparison) -> Table {
    let headings = [
        "signal",
        "unit",
        "rms misfit",
        "mean misfit",
        "sensor noise",
        "misfit / noise",
        "standard deviation of the signal",
        "fit, %",
    ];
    let row = |table: Table, signal: &SignalComparison| {
        let located = &signal.located;
        let reading = Reading::of_signal(rig, located.signal);
        let figure = |value: f64| Cell::from(reading.difference(value));
        let fit = fit_percent(located.rms, located.spread, signal.noise);
        table.row([
            signals::titled(located.signal).into(),
            reading.unit.clone().into(),
            figure(located.rms),
            figure(located.mean),
            figure(signal.noise),
            Cell::significant(signal.over_noise(), 3),
            figure(located.spread),
            fit.map(|fit| Cell::number(fit, 1)).into(),
        ])
    };
    law.signals.iter().fold(Table::new(headings), row)
}

fn over_time(section: &mut Section, rig: &Rig, law: &LawComparison, tracks: &[Track<'_>]) {
    let located = law.located();
    let worst = worst_recording(&law.residuals);
    let curves = [curve(law)];
    let stack = |recording: usize, detail: usize| {
        let track = &tracks[recording];
        let shown = prediction(rig, law, track, recording, &curves);
        let stack = Prediction { detail, ..shown }.stack();
        shade_intervals(stack, &located, &track.recording.name)
    };
    section.chart(stack(worst, OPEN_DETAIL));
    for recording in (0..tracks.len()).filter(|&one| one != worst) {
        let errors = law.signals.iter().filter_map(|signal| {
            let reading = Reading::of_signal(rig, signal.located.signal);
            let (_, rms) = signal.by_recording.get(recording)?;
            let figure = number::significant(reading.difference(*rms), 3);
            let name = signals::spoken(signal.located.signal);
            Some(format!("{name} {figure} {}", reading.unit))
        });
        let errors: Vec<String> = errors.collect();
        let name = &tracks[recording].recording.name;
        section.details(format!("{name}: {}", errors.join(", ")), |details| {
            details.chart(stack(recording, CLOSED_DETAIL));
        });
    }
}
