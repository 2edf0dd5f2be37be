//! A simulation as a page: one sentence, key figures, plots, parameters.

use super::{Sample, Simulation};
use crate::report::{Cell, Chart, ChartStack, Page, Role, Section, Series, Table, number};
use crate::rig::{Rig, Valve, ValveTable};
use crate::scenario::Scenario;
use crate::text::file_name;

const PA_PER_BAR: f64 = 1e5;
const MM_PER_M: f64 = 1e3;
const MM2_PER_M2: f64 = 1e6;
const COMMAND_HEIGHT_PX: u32 = 100;
const PANEL_HEIGHT_PX: u32 = 170;

/// The page of a simulation; the caller adds how it was made.
pub fn page(scenario: &Scenario, simulation: &Simulation) -> Page {
    let mut page = Page::new(title(scenario));
    page.lead(lead(scenario, simulation));
    tiles(&mut page, scenario, simulation);
    page.section("What happens", |section| {
        if let Some(note) = simulation.note() {
            section.callout(capitalised(&note));
        }
        section.chart(plots(scenario, simulation));
    });
    page.section("Parameters", |section| parameters(section, &scenario.rig));
    page
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
    let ambient_k = super::values(&scenario.rig).ambient().temperature_k;
    format!(
        "The carriage travels {} mm at up to {} m/s; the gas in chamber {} cools to {} K, {} K below ambient.",
        number::significant(MM_PER_M * figures.travel_m, 3),
        number::significant(figures.peak_speed_m_s.0, 3),
        figures.coldest.letter(),
        number::fixed(lowest_k, 0),
        number::fixed(ambient_k - lowest_k, 0),
    )
}

fn tiles(page: &mut Page, scenario: &Scenario, simulation: &Simulation) {
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
        format!("chamber {}, {}", figures.coldest.letter(), at(lowest_at_s)),
    );
    let last_s = simulation.samples.last().map_or(0.0, |last| last.time_s);
    page.tile(
        "simulated",
        number::significant(last_s, 3),
        "s",
        format!("of {} s", scenario.duration_s),
    );
}

/// The signals, one below the other.
fn plots(scenario: &Scenario, simulation: &Simulation) -> ChartStack {
    let curve = |name: &str, role: Role, value: &dyn Fn(&Sample) -> f64| {
        let points = simulation.samples.iter();
        Series::new(
            name,
            role,
            points.map(|sample| (sample.time_s, value(sample))),
        )
    };
    let panel = |title: &str, quantity: &str, unit: &str| {
        Chart::new(title)
            .y_axis(quantity, unit)
            .height(PANEL_HEIGHT_PX)
    };
    let command = panel("Command", "command", "V")
        .height(COMMAND_HEIGHT_PX)
        .series(curve("command", Role::Recorded, &|sample| sample.command_v).step());
    let bar = |pressure_pa: f64| pressure_pa / PA_PER_BAR;
    let pressures = panel("Pressures", "pressure, absolute", "bar")
        .series(curve("chamber a", Role::Improved, &|sample| {
            bar(sample.pressure_a_pa)
        }))
        .series(curve("chamber b", Role::Refitted, &|sample| {
            bar(sample.pressure_b_pa)
        }))
        .level(bar(supply_pa(simulation)), "supply");
    let position =
        panel("Position", "position", "mm").series(curve("position", Role::Recorded, &|sample| {
            MM_PER_M * sample.position_m
        }));
    let velocity =
        panel("Velocity", "velocity", "m/s").series(curve("velocity", Role::Recorded, &|sample| {
            sample.velocity_m_s
        }));
    let temperatures = panel("Gas temperatures", "temperature", "K")
        .x_axis("time", "s")
        .series(curve("chamber a", Role::Improved, &|sample| {
            sample.temperature_a_k
        }))
        .series(curve("chamber b", Role::Refitted, &|sample| {
            sample.temperature_b_k
        }))
        .level(
            super::values(&scenario.rig).ambient().temperature_k,
            "ambient",
        );
    let stack = ChartStack::new("All panels share zoom and cursor.")
        .panel(command)
        .panel(pressures)
        .panel(position)
        .panel(velocity)
        .panel(temperatures);
    match scenario.noise_seed {
        Some(_) => stack.note("Drawn without the noise and the quanta of the recording."),
        None => stack,
    }
}

fn supply_pa(simulation: &Simulation) -> f64 {
    let first = simulation.samples.first();
    first.map_or(f64::NAN, |sample| sample.supply_pressure_pa)
}

// the rig

fn parameters(section: &mut Section, rig: &Rig) {
    if let Some(valve) = &rig.valve {
        section.chart(valve_chart(valve));
    }
    let table = Table::new(["parameter", "value", "one standard deviation"]);
    let keys = rig.value_keys();
    let numbers = keys
        .iter()
        .filter(|key| ValveTable::from_key(key).is_none());
    section.table(numbers.fold(table, |table, key| {
        let shown = |value: f64| Cell::from(format!("{value}"));
        let deviation = rig
            .uncertainty_sd(key)
            .map(|value| number::significant(value, 2));
        table.row([
            format!("`{key}`").into(),
            rig.value(key).map_or("–".into(), shown),
            deviation.map_or("exact".into(), Cell::from),
        ])
    }));
}

/// Areas on a logarithmic axis: the leakage of the closed paths is a hundredth
/// of the open ones.
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
        .logarithmic_y()
        .height(PANEL_HEIGHT_PX)
        .series(curve("supply", Role::Recorded, &valve.supply_area_m2))
        .series(curve("exhaust", Role::Improved, &valve.exhaust_area_m2).dashed())
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    format!("{}{}.", first.unwrap_or_default(), letters.as_str())
}
