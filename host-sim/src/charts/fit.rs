//! The page of `pneuma fit`.

use super::parameters::{self, Moved};
use super::prediction::{
    CLOSED_DETAIL, Curve, OPEN_DETAIL, Prediction, floor_to_draw, worst_recording,
};
use super::residuals::{fit_percent, spread};
use super::{capitalised, test_residuals};
use crate::laws::Track;
use crate::report::{Cell, Matrix, Page, Role, Section, Table, number};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::identify::{BeforeAfter, FittedParameter, LawFit, Residuals, SignalError};
use diagnosis::words;

/// Significant digits of a parameter.
const DIGITS: usize = 5;
/// From this many parameters on a matrix of correlations says more than a list.
const LEAST_MATRIX: usize = 2;

/// The page of a fit.
pub fn fit_page(rig: &Rig, fits: &[LawFit], train: &[Track<'_>], held_out: &[Track<'_>]) -> Page {
    let mut page = Page::new("Fit");
    page.lead(lead(fits, !held_out.is_empty()));
    for error in fits.iter().flat_map(|fit| &fit.errors) {
        let tracks = if error.held_out.is_some() {
            held_out
        } else {
            train
        };
        tile(&mut page, rig, error, spread_of(tracks, error.signal));
    }
    if let Some(fit) = fits.first() {
        page.opening(|section| first_plot(section, rig, fit, train, held_out));
    }
    for fit in fits {
        let heading = capitalised(fit.law.title());
        page.folded_section(heading, |section| {
            parameters(section, fit);
            errors(section, rig, fit, [train, held_out]);
            plots(section, rig, fit, train, held_out);
            section.subheading("Residual tests");
            let (tracks, models) = if held_out.is_empty() {
                (
                    train,
                    models(&fit.residuals.train_before, &fit.residuals.train_after),
                )
            } else {
                (
                    held_out,
                    models(&fit.residuals.held_before, &fit.residuals.held_after),
                )
            };
            test_residuals(section, fit.law, rig, tracks, &models);
        });
    }
    page
}

fn models<'a>(
    before: &'a Option<Residuals>,
    after: &'a Option<Residuals>,
) -> Vec<(&'a str, Role, &'a Residuals)> {
    let curves = curves(before.as_ref(), after.as_ref()).into_iter();
    curves
        .map(|curve| (curve.name, curve.role, curve.residuals))
        .collect()
}

/// The signal with the largest error after the fit beside its noise, in the recording that
/// shows it, held out where there is one.
fn first_plot(
    section: &mut Section,
    rig: &Rig,
    fit: &LawFit,
    train: &[Track<'_>],
    held_out: &[Track<'_>],
) {
    let residuals = &fit.residuals;
    let (tracks, before, after) = if held_out.is_empty() {
        (train, &residuals.train_before, &residuals.train_after)
    } else {
        (held_out, &residuals.held_before, &residuals.held_after)
    };
    let recording = after.as_ref().map_or(0, worst_recording);
    let over_noise = |error: &SignalError| judged(error).after.unwrap_or(0.0) / error.noise;
    let places = fit.errors.iter().enumerate();
    let worst = places.max_by(|a, b| over_noise(a.1).total_cmp(&over_noise(b.1)));
    let (Some(track), Some((place, _))) = (tracks.get(recording), worst) else {
        return;
    };
    let curves = curves(before.as_ref(), after.as_ref());
    let shown = Prediction {
        law: fit.law,
        rig,
        track,
        recording,
        curves: &curves,
        floor: &[],
        detail: OPEN_DETAIL,
    };
    section.chart(shown.stack_of(place));
}

/// The errors that matter most: of held-out recordings where there are any.
fn judged(error: &SignalError) -> BeforeAfter {
    error.held_out.unwrap_or(error.train)
}

fn lead(fits: &[LawFit], held: bool) -> String {
    let errors = fits.iter().flat_map(|fit| &fit.errors);
    let (mut better, mut worse) = (Vec::new(), Vec::new());
    for error in errors {
        let (Some(before), Some(after)) = (judged(error).before, judged(error).after) else {
            continue;
        };
        let part = 1.0 - after / before.max(f64::MIN_POSITIVE);
        if part > 0.0 {
            let name = signals::spoken(error.signal);
            better.push(format!("of the {name} by {}", words::percent(part)));
        } else {
            worse.push(format!("of the {}", signals::spoken(error.signal)));
        }
    }
    let which = if held { "held-out" } else { "training" };
    match (better.is_empty(), worse.is_empty()) {
        (true, _) => format!("The fit does not reduce the {which} error."),
        (false, true) => format!("The fit reduces the {which} error {}.", better.join(", ")),
        (false, false) => format!(
            "The fit reduces the {which} error {}, but not the error {}.",
            better.join(", "),
            worse.join(", ")
        ),
    }
}

fn spread_of(tracks: &[Track<'_>], signal: &str) -> f64 {
    spread(tracks.iter().map(|track| track.recording), signal)
}

fn tile(page: &mut Page, rig: &Rig, error: &SignalError, spread: f64) {
    let reading = Reading::of_signal(rig, error.signal);
    let figure = |value: Option<f64>| {
        value.map_or_else(
            || "–".into(),
            |value| number::significant(reading.difference(value), 3),
        )
    };
    let name = signals::titled(error.signal);
    let label = match error.held_out {
        Some(_) => format!("{name}, held-out rms error"),
        None => format!("{name}, training rms error"),
    };
    let (before, after) = (judged(error).before, judged(error).after);
    let fit = fit_percent(after.unwrap_or(f64::NAN), spread, error.noise);
    let notes = [
        Some(format!("{} as given", figure(before))),
        floor_to_draw(error.noise, after.unwrap_or(f64::NAN))
            .map(|noise| format!("sensor noise {}", figure(Some(noise)))),
        fit.map(|fit| format!("fit {} %", number::fixed(fit, 1))),
    ];
    let notes: Vec<String> = notes.into_iter().flatten().collect();
    page.tile(label, figure(after), reading.unit.clone(), notes.join("; "));
}

fn parameters(section: &mut Section, fit: &LawFit) {
    let headings = [
        "parameter",
        "given",
        "fitted",
        "standard deviation",
        "prior standard deviation",
        "",
    ];
    let table = fit
        .parameters
        .iter()
        .fold(Table::new(headings), |table, parameter| {
            let row = parameter_row(parameter);
            if parameter.at_bound {
                table.emphasised_row(row)
            } else {
                table.row(row)
            }
        });
    section.table(table);
    section.text(format!(
        "{} iterations over {} rows; stopped: {}. The residuals are correlated: for the standard deviations about {:.0} successive rows count as one.",
        fit.iterations, fit.rows, fit.stopped, fit.correlated_rows
    ));
    for sentence in &fit.undetermined {
        section.callout(format!("{}.", capitalised(sentence)));
    }
    if let Some(chart) = parameters::prior_to_posterior(&moved(fit)) {
        section.bars(chart);
    }
    if fit.parameters.len() >= LEAST_MATRIX {
        section.details("Correlations of the estimates", |details| {
            details.matrix(correlations(fit));
        });
    }
}

/// The parameters that had a prior.
fn moved(fit: &LawFit) -> Vec<Moved> {
    let moved = |one: &FittedParameter| {
        Some(Moved {
            key: one.name.clone(),
            given: one.given?,
            prior_sd: one.prior_standard_deviation?,
            fitted: one.fitted,
            fitted_sd: one.standard_deviation,
        })
    };
    fit.parameters.iter().filter_map(moved).collect()
}

/// The note without what the parameter's label says already.
fn remark(note: &str) -> &str {
    let rest = note.strip_prefix("scale factor of the table");
    rest.map_or(note, |rest| rest.trim_start_matches("; "))
}

fn parameter_row(parameter: &FittedParameter) -> [Cell; 6] {
    let figure = |value: Option<f64>, digits: usize| -> Cell {
        value.map(|value| Cell::significant(value, digits)).into()
    };
    [
        parameters::label(&parameter.name).into(),
        figure(parameter.given, DIGITS),
        figure(Some(parameter.fitted), DIGITS),
        figure(parameter.standard_deviation, 2),
        figure(parameter.prior_standard_deviation, 2),
        remark(&parameter.note).into(),
    ]
}

fn correlations(fit: &LawFit) -> Matrix {
    let short = |name: &str| match name.split_once('.') {
        Some((_, rest)) => rest.to_owned(),
        None => name.to_owned(),
    };
    let names: Vec<String> = fit.parameters.iter().map(|one| short(&one.name)).collect();
    let cells = fit
        .correlation_matrix
        .iter()
        .map(|row| row.iter().map(|cell| cell.unwrap_or(f64::NAN)).collect())
        .collect();
    Matrix::new("Correlations", names.clone(), names, cells).full_shade(1.0)
}

/// The errors of each signal in its unit; tracks are those of training, then held out.
fn errors(section: &mut Section, rig: &Rig, fit: &LawFit, tracks: [&[Track<'_>]; 2]) {
    let headings = [
        "rms error",
        "unit",
        "as given",
        "fitted",
        "sensor noise",
        "fit, %",
    ];
    let mut table = Table::new(headings);
    for error in &fit.errors {
        let reading = Reading::of_signal(rig, error.signal);
        let name = signals::titled(error.signal);
        let pairs = [
            ("training", Some(error.train)),
            ("held-out", error.held_out),
        ];
        for ((which, pair), tracks) in pairs.into_iter().zip(tracks) {
            let Some(pair) = pair else { continue };
            let spread = spread_of(tracks, error.signal);
            let figure = |value: Option<f64>| Cell::from(value.map(|one| reading.difference(one)));
            let after = pair.after.unwrap_or(f64::NAN);
            let fit = fit_percent(after, spread, error.noise);
            table = table.row([
                format!("{name}, {which}").into(),
                reading.unit.clone().into(),
                figure(pair.before),
                figure(pair.after),
                figure(floor_to_draw(error.noise, after)),
                fit.map(|fit| Cell::number(fit, 1)).into(),
            ]);
        }
    }
    section.table(table);
    section.text(format!("Prediction: {}.", fit.prediction));
}

fn plots(
    section: &mut Section,
    rig: &Rig,
    fit: &LawFit,
    train: &[Track<'_>],
    held_out: &[Track<'_>],
) {
    let residuals = &fit.residuals;
    let sets = [
        (
            "Held-out",
            held_out,
            &residuals.held_before,
            &residuals.held_after,
        ),
        (
            "Training",
            train,
            &residuals.train_before,
            &residuals.train_after,
        ),
    ];
    let mut opened = false;
    for (name, tracks, before, after) in sets {
        let worst = after.as_ref().map_or(0, worst_recording);
        let order = (0..tracks.len()).filter(|&one| one == worst);
        let others = (0..tracks.len()).filter(|&one| one != worst);
        for recording in order.chain(others) {
            let curves = curves(before.as_ref(), after.as_ref());
            let detail = if opened { CLOSED_DETAIL } else { OPEN_DETAIL };
            let track = &tracks[recording];
            let shown = Prediction {
                law: fit.law,
                rig,
                track,
                recording,
                curves: &curves,
                floor: &[],
                detail,
            };
            let stack = shown.stack();
            if opened {
                let file = &tracks[recording].recording.name;
                section.details(format!("{name} recording {file}"), |details| {
                    details.chart(stack);
                });
            } else {
                section.subheading(format!("{name} recording with the largest error"));
                section.chart(stack);
                opened = true;
            }
        }
    }
}

fn curves<'a>(before: Option<&'a Residuals>, after: Option<&'a Residuals>) -> Vec<Curve<'a>> {
    let named = [
        ("as given", Role::Given, before),
        ("fitted", Role::Refitted, after),
    ];
    let curve = |(name, role, residuals): (&'static str, Role, Option<&'a Residuals>)| {
        residuals.map(|residuals| Curve {
            name,
            role,
            residuals,
            shows_misfit: true,
        })
    };
    named.into_iter().filter_map(curve).collect()
}
