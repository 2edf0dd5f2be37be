//! The paper on one page.

use std::fmt::Write;

use bench::{Kind, Picture};

use super::procedure::{Procedure, Response, Step};
use super::{Figure, LeftOut};
use crate::charts::chart;
use crate::report::{Cell, Page, Section, Table, number};

/// What a prediction by the procedure's rig is called.
const FROM_BENCH: &str = "predicted from the bench";

/// The page of figures and procedure.
pub fn page(figures: &[Figure], procedure: &Procedure) -> Page {
    let mut page = Page::new("Meng, Tao, Chen, Ban (2011), experiment by experiment");
    page.lead(lead(procedure));
    page.opening(|section| {
        if let Some(response) = procedure.responses.first() {
            section.chart(chart(&position(response, (FROM_BENCH, procedure.left_out.first()))));
        }
        section.text(
            "First the figures 2 to 14 of \"Modeling of a Pneumatic System for High-Accuracy Position Control\" by the \
             numbers of its text and this model, each with what the text says and what had to be assumed. No curve was \
             read off the paper. Then its procedure, on an axis of a plant that shares no law with the model: \
             experiments on a bench, a rig file, step responses predicted and measured, and what the procedure leaves out.",
        );
    });
    for figure in figures {
        let heading =
            format!("Figure {}: {}", figure.number, figure.title).replace("Figure (9)", "(9)");
        page.section(heading, |section| show(section, figure));
    }
    page.section("The procedure, on a virtual bench", |section| {
        experiments(section, procedure)
    });
    page.section("Step responses, predicted and measured", |section| {
        steps(section, procedure)
    });
    if !procedure.left_out.is_empty() {
        page.section("What the procedure leaves out", |section| {
            procedure
                .left_out
                .iter()
                .for_each(|one| show_left_out(section, one));
        });
    }
    page
}

fn lead(procedure: &Procedure) -> String {
    let mean = |responses: &[Response]| {
        let squares: f64 = responses.iter().map(|one| one.errors[0].powi(2)).sum();
        1e3 * (squares / responses.len().max(1) as f64).sqrt()
    };
    let mut lead = format!(
        "Bench experiments alone give a rig that predicts steps of 1 to 4 V to {} mm",
        number::significant(mean(&procedure.responses), 2)
    );
    if let Some(left_out) = procedure.left_out.first() {
        let _ = write!(
            lead,
            "; with what the diagnosis finds missing it is {} mm",
            number::significant(mean(&left_out.responses), 2)
        );
    }
    lead + "."
}

fn show_left_out(section: &mut Section, left_out: &LeftOut) {
    section.subheading(left_out.title);
    section.text(left_out.about);
    section.callout(&left_out.sentence);
    section.text("Found by `pneuma diagnose` in three recordings of this axis in motion, 8 s each, one of them held out.");
    if let Some(first) = left_out.before.first() {
        section.chart(chart(&position(
            first,
            ("predicted without it", Some(left_out)),
        )));
    }
    section.table(errors(&left_out.before, Some(&left_out.responses)));
}

fn show(section: &mut Section, figure: &Figure) {
    section.definitions([
        ("The text says", figure.says),
        ("Assumed here", figure.assumed),
    ]);
    for picture in &figure.pictures {
        section.chart(chart(picture));
    }
}

fn experiments(section: &mut Section, procedure: &Procedure) {
    section.text(format!(
        "The axis is drawn from seed {}; each experiment is evaluated by the command that is named. \"True\" is what was put in.",
        procedure.seed
    ));
    let mut table = Table::new(["command", "number", "measured", "±", "true", "unit"])
        .caption("Deviations are one standard deviation.");
    for step in &procedure.steps {
        for one in &step.outcome.numbers {
            let (value, deviation) = one.shown();
            table = table.row([
                Cell::from(format!("identify {}", step.command)),
                Cell::from(one.what.as_str()),
                Cell::from(value),
                Cell::from(deviation),
                Cell::from(truth(step, &one.key).map_or(String::new(), |true_value| {
                    number::significant(true_value * one.shown_in.1, 4)
                })),
                Cell::from(one.shown_unit()),
            ]);
        }
    }
    section.table(table);
    for step in &procedure.steps {
        section.subheading(format!(
            "identify {} ({} recordings)",
            step.command, step.recordings
        ));
        for picture in &step.outcome.pictures {
            section.chart(chart(picture));
        }
    }
}

fn truth(step: &Step, key: &str) -> Option<f64> {
    let key = if key == "valve.spool_gain_m_V" {
        "spool_gain_m_V"
    } else {
        key
    };
    step.truth.get(key).copied()
}

fn steps(section: &mut Section, procedure: &Procedure) {
    section.text(
        "The valve is opened by 1 to 4 V towards -x, from rest at mid-stroke. The prediction starts at the measured \
         pressures and position and follows the command alone.",
    );
    for response in &procedure.responses {
        section.chart(chart(&position(
            response,
            (FROM_BENCH, procedure.left_out.first()),
        )));
        section.chart(chart(&pressures(response)));
    }
    section.table(errors(&procedure.responses, None));
}

fn position(response: &Response, (name, left_out): (&str, Option<&LeftOut>)) -> Picture {
    let course = |samples: &[crate::simulate::Sample]| -> Vec<(f64, f64)> {
        samples
            .iter()
            .map(|one| (one.time_s, 1e3 * one.position_m))
            .collect()
    };
    let measured = response.measured.signal("x").unwrap_or(&[]);
    let measured = response.measured.time_s.iter().zip(measured);
    let title = format!("Position after a step of {} V", response.opening_v);
    let mut picture = Picture::new(title, ("time", "s"), ("position", "mm"))
        .with(
            "measured",
            Kind::Recorded,
            measured.map(|(time, x)| (*time, 1e3 * x)).collect(),
        )
        .with(name, Kind::Given, course(&response.predicted.samples));
    let same = |one: &&Response| (one.opening_v - response.opening_v).abs() < 1e-9;
    if let Some(better) = left_out.and_then(|all| all.responses.iter().find(same)) {
        picture = picture.with(
            "with what was left out",
            Kind::Law,
            course(&better.predicted.samples),
        );
    }
    picture
}

fn pressures(response: &Response) -> Picture {
    let title = format!("Pressures after a step of {} V", response.opening_v);
    let mut picture = Picture::new(title, ("time", "s"), ("pressure, absolute", "bar"));
    for (name, signal) in [("A", "p_a"), ("B", "p_b")] {
        let measured = response.measured.signal(signal).unwrap_or(&[]);
        let measured = response.measured.time_s.iter().zip(measured);
        let of = |one: &crate::simulate::Sample| match signal {
            "p_a" => one.pressure_a_pa,
            _ => one.pressure_b_pa,
        };
        let predicted = response
            .predicted
            .samples
            .iter()
            .map(|one| (one.time_s, 1e-5 * of(one)));
        picture = picture
            .with(
                format!("{name}, measured"),
                Kind::Recorded,
                measured.map(|(time, p)| (*time, 1e-5 * p)).collect(),
            )
            .with(
                format!("{name}, predicted from the bench"),
                Kind::Given,
                predicted.collect(),
            );
    }
    picture
}

/// Root mean square differences of each step, before and after.
fn errors(responses: &[Response], after: Option<&[Response]>) -> Table {
    let mut table = Table::new([
        "opening, V",
        "position, mm",
        "velocity, mm/s",
        "pressure A, kPa",
        "pressure B, kPa",
    ])
    .caption(match after {
        None => "Root mean square of predicted less measured.",
        Some(_) => "Root mean square of predicted less measured: without it, and with it.",
    });
    let scales = [1e3, 1e3, 1e-3, 1e-3];
    for (place, response) in responses.iter().enumerate() {
        let cell = |signal: usize| {
            let shown =
                |one: &Response| number::significant(one.errors[signal] * scales[signal], 2);
            match after.and_then(|after| after.get(place)) {
                Some(after) => format!("{} → {}", shown(response), shown(after)),
                None => shown(response),
            }
        };
        let opening = number::fixed(response.opening_v, 0);
        table = table.row([opening, cell(0), cell(1), cell(2), cell(3)].map(Cell::from));
    }
    table
}
