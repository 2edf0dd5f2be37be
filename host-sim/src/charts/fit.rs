//! The page of `pneuma fit`.

use super::capitalised;
use super::prediction::{CLOSED_DETAIL, Curve, OPEN_DETAIL, prediction_stack, worst_recording};
use crate::identify::{BeforeAfter, FittedParameter, LawFit, Residuals, SignalError};
use crate::laws::Track;
use crate::report::{BarChart, Cell, Matrix, Page, Role, Section, Table, number};
use crate::rig::Rig;
use crate::units::shown;

/// Significant digits of a parameter.
const DIGITS: usize = 5;
/// From this many parameters on a matrix of correlations says more than a list.
const LEAST_MATRIX: usize = 2;

/// The page of a fit.
pub fn fit_page(rig: &Rig, fits: &[LawFit], train: &[Track<'_>], held_out: &[Track<'_>]) -> Page {
    let mut page = Page::new("Fit");
    page.lead(lead(fits, !held_out.is_empty()));
    for error in fits.iter().flat_map(|fit| &fit.errors) {
        tile(&mut page, error);
    }
    for fit in fits {
        let heading = capitalised(fit.law.title());
        page.section(heading, |section| {
            parameters(section, fit);
            errors(section, fit);
            plots(section, rig, fit, train, held_out);
        });
    }
    page
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
        let percent = 100.0 * (1.0 - after / before.max(f64::MIN_POSITIVE));
        if percent > 0.0 {
            better.push(format!("of `{}` by {percent:.0} %", error.signal));
        } else {
            worse.push(format!("of `{}`", error.signal));
        }
    }
    let which = if held { "held-out" } else { "training" };
    match (better.is_empty(), worse.is_empty()) {
        (true, _) => format!("The fit does not lower the {which} error."),
        (false, true) => format!("The fit lowers the {which} error {}.", better.join(", ")),
        (false, false) => format!(
            "The fit lowers the {which} error {}, but not that {}.",
            better.join(", "),
            worse.join(", ")
        ),
    }
}

fn tile(page: &mut Page, error: &SignalError) {
    let unit = shown(error.unit);
    let figure = |value: Option<f64>| {
        value.map_or_else(|| "–".into(), |v| number::significant(v * unit.per_si, 3))
    };
    let label = match error.held_out {
        Some(_) => format!("`{}`, held-out RMS error", error.signal),
        None => format!("`{}`, training RMS error", error.signal),
    };
    let (before, noise) = (figure(judged(error).before), figure(Some(error.noise)));
    page.tile(
        label,
        figure(judged(error).after),
        unit.unit,
        format!("was {before} as given; sensor noise {noise}"),
    );
}

fn parameters(section: &mut Section, fit: &LawFit) {
    let headings = ["parameter", "given", "fitted", "sd", "prior sd", ""];
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
        "{} iterations over {} rows; stopped: {}. About {:.0} rows in a row count as one for the standard deviations.",
        fit.iterations, fit.rows, fit.stopped, fit.correlated_rows
    ));
    for sentence in &fit.undetermined {
        section.callout(format!("{}.", capitalised(sentence)));
    }
    if fit.parameters.len() >= LEAST_MATRIX {
        section.details("Correlations of the estimates", |details| {
            details.matrix(correlations(fit));
        });
    }
}

fn parameter_row(parameter: &FittedParameter) -> [Cell; 6] {
    let figure = |value: Option<f64>, digits: usize| -> Cell {
        value.map(|value| Cell::significant(value, digits)).into()
    };
    [
        format!("`{}`", parameter.name).into(),
        figure(parameter.given, DIGITS),
        figure(Some(parameter.fitted), DIGITS),
        figure(parameter.standard_deviation, 2),
        figure(parameter.prior_standard_deviation, 2),
        parameter.note.clone().into(),
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

fn errors(section: &mut Section, fit: &LawFit) {
    let names: Vec<String> = fit
        .errors
        .iter()
        .flat_map(|error| {
            let held = error
                .held_out
                .map(|_| format!("{}, held-out", error.signal));
            std::iter::once(format!("{}, training", error.signal)).chain(held)
        })
        .collect();
    let of = |pick: fn(&BeforeAfter) -> Option<f64>| -> Vec<f64> {
        let pairs = fit.errors.iter().flat_map(|error| {
            let per_si = shown(error.unit).per_si;
            let held = error.held_out;
            let both = std::iter::once(error.train).chain(held);
            both.map(move |pair| pick(&pair).map_or(f64::NAN, |value| value * per_si))
        });
        pairs.collect()
    };
    let noise = fit.errors.iter().flat_map(|error| {
        let noise = error.noise * shown(error.unit).per_si;
        std::iter::repeat_n(noise, 1 + usize::from(error.held_out.is_some()))
    });
    let unit = fit
        .errors
        .first()
        .map_or("", |error| shown(error.unit).unit);
    section.bars(
        BarChart::new("RMS error of the prediction", names)
            .axis("RMS error", unit)
            .bars("as given", Role::Given, of(|pair| pair.before))
            .bars("fitted", Role::Refitted, of(|pair| pair.after))
            .bars("sensor noise", Role::Noise, noise)
            .note(format!("Predicted: {}.", fit.prediction)),
    );
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
            let stack = prediction_stack(fit.law, rig, track, recording, &curves, &[], detail);
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
