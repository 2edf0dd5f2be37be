//! The page of `pneuma identify valve-flow`.

use crate::model::Values;
use crate::report::{Cell, Chart, Page, Role, Section, Series, Table, number};
use crate::rig::Rig;
use diagnosis::valve_flow::{Point, ValveFlow};

const MM2_PER_M2: f64 = 1e6;
/// Openings of the second picture, V: where paths begin to open.
const EDGE_UP_TO_V: f64 = 1.0;
const PATHS: [&str; 2] = ["supply", "exhaust"];

/// The page of a measured valve.
pub fn valve_flow_page(rig: &Rig, valve: &ValveFlow) -> Page {
    let mut page = Page::new("Valve flow");
    let full_mm2 = valve.points.last().map_or([0.0; 2], |last| last.area_m2);
    let [supply, exhaust] = full_mm2.map(|area_m2| number::significant(MM2_PER_M2 * area_m2, 3));
    page.lead(format!(
        "The valve's paths open to {supply} mm² from the supply and {exhaust} mm² to the exhaust \
         at the largest opening of the recordings."
    ));
    let tile = |value: f64, digits: usize| number::significant(value, digits);
    page.tile(
        "Null",
        tile(valve.null_v, 4),
        "V",
        "the command at which the valve is closed",
    );
    page.tile(
        "Critical pressure ratio",
        tile(valve.critical_pressure_ratio, 2),
        "",
        "common to all paths",
    );
    for (side, volume_m3) in ["A", "B"].iter().zip(valve.dead_volume_m3) {
        page.tile(
            format!("Dead volume {side}"),
            tile(1e6 * volume_m3, 3),
            "cm³",
            "with fittings and tube",
        );
    }
    page.opening(|section| section.chart(curves(rig, valve, f64::INFINITY)));
    page.section("Where the paths begin to open", |section| {
        section.chart(curves(rig, valve, EDGE_UP_TO_V));
    });
    page.folded_section("Table", |section| table(section, valve));
    page.folded_section("How it was measured", |section| section.text(
        "A chamber of known volume is a flow meter: what flows in is what its pressure, its volume and \
         its heat exchange account for. The areas follow from all recordings together by non-negative \
         least squares, beside the dead volumes and a leak past the piston. The band is two standard \
         deviations, from leaving out one tenth of the time after the other and from what heat, volumes \
         and motion leave in the balance."
    ));
    page
}

/// Both areas over the opening up to some opening.
fn curves(rig: &Rig, valve: &ValveFlow, up_to_v: f64) -> Chart {
    let mut chart = Chart::new("Area of the paths over the opening")
        .x_axis("opening", "V")
        .y_axis("area", "mm²");
    let shown: Vec<&Point> = valve
        .points
        .iter()
        .filter(|point| point.opening_v <= up_to_v)
        .collect();
    let roles = [Role::Improved, Role::Refitted];
    for (path, (name, role)) in PATHS.iter().zip(roles).enumerate() {
        let band = shown.iter().map(|point| {
            let (area, deviation) = (point.area_m2[path], 2.0 * point.deviation_m2[path]);
            (
                point.opening_v,
                MM2_PER_M2 * (area - deviation),
                MM2_PER_M2 * (area + deviation),
            )
        });
        let line = shown
            .iter()
            .map(|point| (point.opening_v, MM2_PER_M2 * point.area_m2[path]));
        chart = chart
            .band(format!("{name}, two sd"), role, band)
            .series(Series::new(format!("{name}, measured"), role, line));
    }
    let Some(Ok(given)) = Values::<f64>::of(rig).valve() else {
        return chart;
    };
    for (name, given) in PATHS.iter().zip([given.supply, given.exhaust]) {
        let area_mm2 =
            |point: &&Point| (point.opening_v, MM2_PER_M2 * given.area_m2(point.opening_v));
        let line = shown.iter().map(area_mm2);
        let name = format!("{name}, rig file");
        chart = chart.series(Series::new(name, Role::Given, line).dashed());
    }
    chart
}

fn table(section: &mut Section, valve: &ValveFlow) {
    let mut table = Table::new(["opening, V", "supply, mm²", "exhaust, mm²"])
        .caption("The points that the rig file gets: between them the areas are chords.");
    for point in valve.table() {
        let areas = [0, 1].map(|path| {
            Cell::with_deviation(
                MM2_PER_M2 * point.area_m2[path],
                MM2_PER_M2 * point.deviation_m2[path],
                4,
            )
        });
        let [supply, exhaust] = areas;
        table = table.row([Cell::number(point.opening_v, 3), supply, exhaust]);
    }
    section.table(table);
}
