//! Flow of the valve's paths, figures 4 to 7 of the paper.
//!
//! A point is a steady flow with the pressures on both sides of the path. It comes from a flow
//! meter at port A (`flow_a`), or from a vessel of known volume at that port, whose pressure says
//! the flow by its energy balance ([`crate::fixed_volume`]). Then
//!
//! * `shape.rs`: critical pressure ratio and slope of Cd(r), (2) of the paper, from points of one
//!   command at several pressure ratios;
//! * `areas.rs`: the area at every command, (1) of the paper, the leakage of closed paths, and the
//!   null by which the curves of both paths coincide (the paper's figure 4: "once shifted").
//!
//! One port shows both paths: fed on one side of the null, vented on the other.

mod areas;
mod points;
mod shape;

use grey_box::laws::Track;
use grey_box::model::Values;
use grey_box::rig::Rig;
use model_core::valve::FlowLaw;

use crate::flow_point::FlowPoint;
use crate::iso6358;
use crate::outcome::{Kind, Number, Outcome, Picture};

/// The outcome depends on numbers under these sections.
pub const DEPENDS_ON: &[&str] = &[
    "vessel.",
    "environment.",
    "gas.",
    "supply.",
    "chambers.heat_transfer",
];

/// Evaluates flow tests.
///
/// # Errors
/// If the recordings hold no steady flow, or the rig lacks what the points need.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let valve = rig
        .valve
        .as_ref()
        .ok_or("the rig file has no [valve]: null_V at least")?;
    let stated = stated_law(rig);
    let (mut points, mut stretches) = points::of(rig, tracks, [0.0; 2])?;
    let mut areas = areas::measure(&points, &stated, valve)?;
    let mut shape = None;
    // The law's shape is read from flows less what leaks, the leakage from areas by that law, and a
    // vessel's flows from a mass that leaks while it is shut in.
    for _ in 0..TURNS {
        shape = shape::measure(
            &areas.without_leakage(&points, &law_of(&shape, stated)),
            &stated,
        );
        (points, stretches) = points::of(rig, tracks, areas.leakages_m2())?;
        areas = areas::measure(&points, &law_of(&shape, stated), valve)?;
    }
    let law = law_of(&shape, stated);
    let areas = areas.with_shape_share(
        shape
            .as_ref()
            .map_or(0.0, |shape| shape.area_share(&points)),
    );
    let mut numbers = areas.numbers();
    let mut notes = areas.notes.clone();
    match &shape {
        Some(shape) => numbers.extend(shape.numbers()),
        None => notes.push(format!(
            "no command was held over several pressure ratios: the critical pressure ratio stays at {:.3}",
            stated.critical_pressure_ratio
        )),
    }
    numbers.extend(iso6358::numbers(
        &areas.largest_path(&areas.without_leakage(&points, &law)),
        &law,
    ));
    Ok(Outcome {
        title: "Valve flow",
        method: "Each steady flow says the area of the open path by the flow law (1), (2) of the paper. The critical \
                 pressure ratio comes from commands that were held over several pressure ratios, the null from the two \
                 branches: shifted by it, both paths open alike up to one factor.",
        numbers,
        areas: areas.table(),
        stretches,
        notes,
        pictures: pictures(rig, &points, &areas, &law),
    })
}

/// Shape and leakage are found in turns.
const TURNS: usize = 2;

fn law_of(shape: &Option<shape::Shape>, stated: FlowLaw<f64>) -> FlowLaw<f64> {
    shape.as_ref().map_or(stated, |shape| shape.law)
}

fn stated_law(rig: &Rig) -> FlowLaw<f64> {
    let values = Values::<f64>::of(rig);
    let stated = values.valve().and_then(Result::ok).map(|valve| valve.law);
    stated.unwrap_or(FlowLaw {
        critical_pressure_ratio: model_core::paper::CRITICAL_PRESSURE_RATIO,
        laminar_pressure_ratio: model_core::paper::LAMINAR_PRESSURE_RATIO,
        discharge_slope: model_core::paper::DISCHARGE_SLOPE,
        flow_coefficient: values.gas().flow_coefficient,
    })
}

fn pictures(
    rig: &Rig,
    points: &[FlowPoint],
    areas: &areas::Areas,
    law: &FlowLaw<f64>,
) -> Vec<Picture> {
    const MM2: f64 = 1e6;
    let mut curve = Picture::new(
        "Area of the paths over the opening",
        ("opening", "V"),
        ("area", "mm²"),
    );
    for (path, name) in ["supply", "exhaust"].iter().enumerate() {
        let kind = [Kind::Points, Kind::OtherPoints][path];
        let measured = areas
            .of_path(path)
            .iter()
            .map(|one| (one.0, MM2 * one.1))
            .collect();
        curve = curve.with(format!("{name}, measured"), kind, measured);
        let table = areas.table();
        let table = table
            .iter()
            .filter_map(|one| Some((one.opening_v, MM2 * one.area_m2[path]?)));
        curve = curve.with(format!("{name}, table"), Kind::Law, table.collect());
    }
    if let Some(Ok(given)) = Values::<f64>::of(rig).valve() {
        let (openings, supply) = (given.supply.openings_v(), given.supply.areas_m2());
        let line = openings
            .iter()
            .zip(supply)
            .map(|(opening, area)| (*opening, MM2 * area));
        curve = curve.with("supply, rig file", Kind::Given, line.collect());
    }
    let over_command = |one: &FlowPoint| (one.command_v, iso6358::flow_l_min(one.flow_kg_per_s));
    let mut flow = Picture::new(
        "Flow over the command",
        ("command", "V"),
        ("flow into port A", "l/min (ANR)"),
    );
    flow = flow.with(
        "measured",
        Kind::Points,
        points.iter().map(over_command).collect(),
    );
    let mut pictures = vec![curve, flow];
    pictures.extend(shape::picture(points, &|one| areas.area_at(one), law));
    pictures
}

/// `valve.null_V` and its like, with a deviation.
fn number(key: &str, (value, deviation): (f64, f64)) -> Number {
    Number::of_key(key, value, deviation)
}
