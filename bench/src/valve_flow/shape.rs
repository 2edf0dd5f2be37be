//! Critical pressure ratio and slope of the discharge coefficient, from flows of one command at
//! several pressure ratios.
//!
//! The area of each command is one unknown more and linear: for every trial of the two numbers it
//! follows in closed form (variable projection), so that they are searched alone.

use grey_box::fit::Parameter;
use model_core::valve::FlowLaw;

use super::number;
use crate::flow_point::{FlowPoint, by_command};
use crate::least_squares::{Solved, fitted};
use crate::outcome::{Kind, Number, Picture};

/// Points of one command and direction from which a ratio's law is read ...
const LEAST_POINTS: usize = 5;
/// ... and the ratios that they must span.
const LEAST_SPAN: f64 = 0.25;
/// Critical pressure ratios that are sought, and slopes of Cd: those of the rig file.
const RATIOS: (f64, f64) = (0.05, 0.8);
const SLOPES: (f64, f64) = (-0.1, 0.25);
/// How well the paper's slope of Cd(r) is known for another valve, one deviation: a guess that
/// keeps it where the points do not say it.
const SLOPE_DEVIATION: f64 = 0.05;

/// The law that the points show.
pub(super) struct Shape {
    pub(super) law: FlowLaw<f64>,
    solved: Solved,
}

impl Shape {
    /// What the deviations of both numbers do to an area, as a part of it: in the mean of the points.
    pub(super) fn area_share(&self, points: &[FlowPoint]) -> f64 {
        let with = |place: usize| {
            let mut numbers = self.solved.values.clone();
            numbers[place] += self.solved.deviations[place];
            FlowLaw {
                critical_pressure_ratio: numbers[0],
                discharge_slope: numbers[1],
                ..self.law
            }
        };
        let share = |law: &FlowLaw<f64>| {
            let of = |one: &FlowPoint| {
                let path = usize::from(!one.is_fed());
                one.per_area(law)[path] / one.per_area(&self.law)[path] - 1.0
            };
            points.iter().map(of).sum::<f64>() / points.len() as f64
        };
        share(&with(0)).hypot(share(&with(1)))
    }

    pub(super) fn numbers(&self) -> Vec<Number> {
        vec![
            number("valve.critical_pressure_ratio", self.solved.at(0)),
            number("valve.discharge_slope", self.solved.at(1)),
        ]
    }
}

fn spans_ratios(group: &[FlowPoint]) -> bool {
    let ratios = group.iter().map(FlowPoint::ratio);
    let highest = ratios.clone().fold(0.0, f64::max);
    let lowest = ratios.fold(1.0, f64::min);
    group.len() >= LEAST_POINTS && highest - lowest > LEAST_SPAN
}

/// The shape, where a command was held over several ratios.
pub(super) fn measure(points: &[FlowPoint], stated: &FlowLaw<f64>) -> Option<Shape> {
    let groups: Vec<Vec<FlowPoint>> = by_command(points)
        .into_iter()
        .filter(|one| spans_ratios(one))
        .collect();
    if groups.is_empty() {
        return None;
    }
    let law_of = |numbers: &[f64]| FlowLaw {
        critical_pressure_ratio: numbers[0],
        discharge_slope: numbers[1],
        ..*stated
    };
    let residuals = |numbers: &[f64]| -> Vec<f64> {
        let law = law_of(numbers);
        groups
            .iter()
            .flat_map(|group| off_law(group, &law))
            .collect()
    };
    let parameters = [
        Parameter::new(stated.critical_pressure_ratio).bounded(RATIOS.0, RATIOS.1),
        Parameter::new(stated.discharge_slope)
            .bounded(SLOPES.0, SLOPES.1)
            .with_scale(SLOPE_DEVIATION)
            .with_prior(stated.discharge_slope, SLOPE_DEVIATION),
    ];
    let solved = fitted(&parameters, &residuals).ok()?;
    Some(Shape {
        law: law_of(&solved.values),
        solved,
    })
}

/// What the best area of a group leaves, in deviations.
fn off_law(group: &[FlowPoint], law: &FlowLaw<f64>) -> Vec<f64> {
    let rows: Vec<(f64, f64)> = group
        .iter()
        .map(|one| {
            let per_area = one.per_area(law)[usize::from(!one.is_fed())];
            (
                per_area / one.deviation_kg_per_s,
                one.flow_kg_per_s.abs() / one.deviation_kg_per_s,
            )
        })
        .collect();
    let product: f64 = rows.iter().map(|(per_area, flow)| per_area * flow).sum();
    let square: f64 = rows.iter().map(|(per_area, _)| per_area * per_area).sum();
    let area_m2 = product / square.max(f64::MIN_POSITIVE);
    rows.iter()
        .map(|(per_area, flow)| flow - area_m2 * per_area)
        .collect()
}

/// Flow over the pressure ratio, relative to what the area passes choked: the paper's figure 7.
pub(super) fn picture(
    points: &[FlowPoint],
    area_at_m2: &dyn Fn(&FlowPoint) -> Option<f64>,
    law: &FlowLaw<f64>,
) -> Option<Picture> {
    let all: Vec<Vec<FlowPoint>> = by_command(points)
        .into_iter()
        .filter(|one| spans_ratios(one))
        .collect();
    let mut picture = Picture::new(
        "Flow over the pressure ratio",
        ("pressure behind over before the path", ""),
        ("flow per area and upstream pressure, of the choked one", ""),
    );
    for group in &all {
        let first = group[0];
        let area_m2 = area_at_m2(&first)?;
        let relative = |one: &FlowPoint, flow: f64| {
            let upstream = if one.is_fed() {
                (one.supply_pa, one.supply_k)
            } else {
                (one.port_pa, one.port_k)
            };
            flow / (area_m2 * law.flow_coefficient * upstream.0 / upstream.1.sqrt())
        };
        let name = format!(
            "{:.2} V, {}",
            first.command_v,
            if first.is_fed() { "supply" } else { "exhaust" }
        );
        let mut measured: Vec<(f64, f64)> = group
            .iter()
            .map(|one| (one.ratio(), relative(one, one.flow_kg_per_s.abs())))
            .collect();
        measured.sort_by(|a, b| a.0.total_cmp(&b.0));
        picture = picture.with(name, Kind::Points, measured);
    }
    let curve = (1..=100).map(|place| {
        let ratio = f64::from(place) / 100.0;
        let one = FlowPoint {
            command_v: 0.0,
            flow_kg_per_s: 1.0,
            deviation_kg_per_s: 1.0,
            supply_pa: 1e5,
            port_pa: ratio * 1e5,
            exhaust_pa: 1e5,
            supply_k: 1.0,
            port_k: 1.0,
        };
        (ratio, one.per_area(law)[0] / (law.flow_coefficient * 1e5))
    });
    (!all.is_empty()).then(|| picture.with("law: Cd(r) times psi(r)", Kind::Law, curve.collect()))
}
