//! A simulation as a page: one sentence, key figures, plots, parameters.

use super::ensemble::Ensemble;
use super::{IntegrationError, Sample, Simulation};
use crate::model::Values;
use crate::report::{Cell, Chart, ChartStack, Page, Role, Section, Series, Table, number};
use crate::rig::{Rig, Valve, ValveTable};
use crate::scenario::Scenario;
use crate::text::file_name;

const PA_PER_BAR: f64 = 1e5;
const MM_PER_M: f64 = 1e3;
const UM_PER_M: f64 = 1e6;
const MM2_PER_M2: f64 = 1e6;
const COMMAND_HEIGHT_PX: u32 = 100;
const PANEL_HEIGHT_PX: u32 = 170;

/// The page of a simulation; the caller adds how it was made.
pub fn page(
    scenario: &Scenario,
    (simulation, runs): (&Simulation, Option<&Ensemble>),
    error: Option<&IntegrationError>,
) -> Page {
    let mut page = Page::new(title(scenario));
    page.lead(lead(scenario, simulation));
    tiles(&mut page, scenario, simulation, error);
    page.section("Signals", |section| {
        if let Some(note) = simulation.note() {
            section.callout(capitalised(&note));
        }
        section.text("The panels share zoom and cursor.");
        section.chart(plots(scenario, simulation));
    });
    if let Some(runs) = runs {
        page.section("Within the rig's uncertainty", |section| {
            section.text(format!(
                "{} runs with numbers drawn from their uncertainties; 90 of 100 lie in the band, the line is \
                 the middle one.",
                runs.runs
            ));
            section.chart(bands(runs));
        });
    }
    page.section("Parameters", |section| parameters(section, &scenario.rig));
    page
}

fn bands(runs: &Ensemble) -> ChartStack {
    let mut stack = ChartStack::new("Many runs");
    for band in &runs.bands {
        let (title, unit) = band.title;
        let rows = band.rows.iter().zip(&runs.time_s);
        let range = rows.map(|([low, _, high], time_s)| (*time_s, *low, *high));
        let middle: Vec<f64> = band.rows.iter().map(|[_, middle, _]| *middle).collect();
        let chart = Chart::new(title)
            .x_axis("time", "s")
            .y_axis(title, unit)
            .height(PANEL_HEIGHT_PX)
            .band("90 of 100 runs", Role::Given, range)
            .series(Series::columns(
                "middle",
                Role::Given,
                &runs.time_s,
                &middle,
            ));
        stack = stack.panel(chart);
    }
    stack
}

/// The file's name without its folders: the page is about the scenario.
fn title(scenario: &Scenario) -> String {
    let name = std::path::Path::new(&scenario.name).file_stem();
    let name = name.map_or(scenario.name.clone(), |stem| stem.to_string_lossy().into());
    format!("Simulation of {}", file_name(&name))
}

fn lead(scenario: &Scenario, simulation: &Simulation) -> String {
    let figures = simulation.key_figures();
    let (lowest_k, _) = figures.lowest_temperature_k;
    let ambient_k = Values::of(&scenario.rig).ambient().temperature_k;
    format!(
        "The carriage travels {} mm at up to {} m/s; the gas in chamber {} cools to {} K, {} K below ambient.",
        number::significant(MM_PER_M * figures.travel_m, 3),
        number::significant(figures.peak_speed_m_s.0, 3),
        figures.coldest.letter().to_uppercase(),
        number::fixed(lowest_k, 0),
        number::fixed(ambient_k - lowest_k, 0),
    )
}

fn tiles(
    page: &mut Page,
    scenario: &Scenario,
    simulation: &Simulation,
    error: Option<&IntegrationError>,
) {
    let figures = simulation.key_figures();
    let (speed_m_s, speed_at_s) = figures.peak_speed_m_s;
    let (lowest_k, lowest_at_s) = figures.lowest_temperature_k;
    let at = |time_s: f64| format!("at {} s", number::fixed(time_s, 3));
    page.tile(
        "peak speed",
        number::significant(speed_m_s, 3),
        "m/s",
        at(speed_at_s),
    );
    let ends = match (simulation.samples.first(), simulation.samples.last()) {
        (Some(first), Some(last)) => format!(
            "from {} to {} mm",
            number::fixed(MM_PER_M * first.position_m, 1),
            number::fixed(MM_PER_M * last.position_m, 1)
        ),
        _ => String::new(),
    };
    page.tile(
        "travel",
        number::fixed(MM_PER_M * figures.travel_m, 1),
        "mm",
        ends,
    );
    page.tile(
        "lowest gas temperature",
        number::fixed(lowest_k, 1),
        "K",
        format!(
            "chamber {}, {}",
            figures.coldest.letter().to_uppercase(),
            at(lowest_at_s)
        ),
    );
    let last_s = simulation.samples.last().map_or(0.0, |last| last.time_s);
    page.tile(
        "simulated",
        number::significant(last_s, 3),
        "s",
        format!("of {} s", scenario.duration_s),
    );
    if let Some(error) = error {
        page.tile(
            "integration error",
            number::significant(UM_PER_M * error.position_m, 2),
            "µm",
            format!(
                "and {} Pa, by a run at half the step of {} s",
                number::significant(error.pressure_pa, 2),
                scenario.step_s()
            ),
        );
    }
}

/// The signals, one below the other.
fn plots(scenario: &Scenario, simulation: &Simulation) -> ChartStack {
    let stack = ChartStack::new("")
        .panel(command_panel(simulation))
        .panel(pressure_panel(simulation))
        .panel(panel("Carriage", "position", "mm").series(curve(
            simulation,
            "position",
            Role::Recorded,
            |sample| MM_PER_M * sample.position_m,
        )))
        .panel(panel("Carriage", "velocity", "m/s").series(curve(
            simulation,
            "velocity",
            Role::Recorded,
            |sample| sample.velocity_m_s,
        )))
        .panel(temperature_panel(scenario, simulation));
    match scenario.noise_seed {
        Some(_) => stack.note("Shown without the noise and quantisation of the recording."),
        None => stack,
    }
}

fn panel(title: &str, quantity: &str, unit: &str) -> Chart {
    Chart::new(title)
        .y_axis(quantity, unit)
        .height(PANEL_HEIGHT_PX)
}

fn curve(simulation: &Simulation, name: &str, role: Role, value: fn(&Sample) -> f64) -> Series {
    let points = simulation.samples.iter();
    Series::new(
        name,
        role,
        points.map(|sample| (sample.time_s, value(sample))),
    )
}

fn command_panel(simulation: &Simulation) -> Chart {
    let command = curve(simulation, "command", Role::Recorded, |sample| {
        sample.command_v
    });
    panel("Valve", "command", "V")
        .height(COMMAND_HEIGHT_PX)
        .series(command.step())
}

fn pressure_panel(simulation: &Simulation) -> Chart {
    let chambers = panel("Chambers", "pressure, absolute", "bar")
        .series(curve(simulation, "chamber A", Role::Improved, |sample| {
            sample.pressure_a_pa / PA_PER_BAR
        }))
        .series(curve(simulation, "chamber B", Role::Refitted, |sample| {
            sample.pressure_b_pa / PA_PER_BAR
        }));
    if !supply_is_near(simulation) {
        return chambers;
    }
    let supply = curve(simulation, "supply", Role::Noise, |sample| {
        sample.supply_pressure_pa / PA_PER_BAR
    });
    chambers.series(supply.dashed())
}

/// Whether the supply can be drawn without flattening the chambers' curves.
fn supply_is_near(simulation: &Simulation) -> bool {
    let pressures = || {
        let both = |sample: &Sample| [sample.pressure_a_pa, sample.pressure_b_pa];
        simulation.samples.iter().flat_map(both)
    };
    let highest = pressures().fold(f64::NEG_INFINITY, f64::max);
    let lowest = pressures().fold(f64::INFINITY, f64::min);
    let supply_pa = simulation
        .samples
        .first()
        .map(|sample| sample.supply_pressure_pa);
    supply_pa.is_some_and(|supply_pa| supply_pa - highest <= highest - lowest)
}

fn temperature_panel(scenario: &Scenario, simulation: &Simulation) -> Chart {
    let ambient_k = Values::of(&scenario.rig).ambient().temperature_k;
    panel("Gas", "temperature", "K")
        .x_axis("time", "s")
        .series(curve(simulation, "chamber A", Role::Improved, |sample| {
            sample.temperature_a_k
        }))
        .series(curve(simulation, "chamber B", Role::Refitted, |sample| {
            sample.temperature_b_k
        }))
        .level(ambient_k, "ambient")
}

// the rig

fn parameters(section: &mut Section, rig: &Rig) {
    if let Some(valve) = &rig.valve {
        section.chart(valve_chart(valve));
    }
    let table = Table::new(["parameter", "value", "declared deviation"]);
    let keys = rig.value_keys();
    let numbers = keys
        .iter()
        .filter(|key| ValveTable::from_key(key).is_none());
    section.table(numbers.fold(table, |table, key| {
        let deviation = rig
            .uncertainty_sd(key)
            .map(|value| number::significant(value, 2));
        table.row([
            format!("`{key}`").into(),
            rig.value(key)
                .map_or("–".into(), |value| as_typed(value).into()),
            deviation.map_or("–".into(), Cell::from),
        ])
    }));
}

/// A number as a person would type it: all its digits, and a power of ten
/// where it would begin with many noughts.
fn as_typed(value: f64) -> String {
    if value.abs() > 0.0 && value.abs() < 1e-3 {
        number::significant(value, 4)
    } else {
        format!("{value}")
    }
}

/// The areas as the model reads them: linear between the points.
fn valve_chart(valve: &Valve) -> Chart {
    let curve = |name: &str, role: Role, areas: &[f64]| {
        let pairs = valve.opening_v.iter().copied().zip(areas.iter());
        Series::new(
            name,
            role,
            pairs.map(|(opening, area)| (opening, MM2_PER_M2 * area)),
        )
    };
    Chart::new("Valve: area of a path over its opening")
        .x_axis("opening, distance of the command from the null", "V")
        .y_axis("area", "mm²")
        .height(PANEL_HEIGHT_PX)
        .series(curve("supply", Role::Recorded, &valve.supply_area_m2))
        .series(curve("exhaust", Role::Improved, &valve.exhaust_area_m2).dashed())
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    format!("{}{}.", first.unwrap_or_default(), letters.as_str())
}
