//! Where a model deviates from recordings, as charts: which variable the misfit
//! correlates with, and how.

use crate::report::{BarChart, Chart, ChartStack, Role, Section, Series};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::locate::{Located, POSITION, VariableShare};
use diagnosis::unlisted::unknown_term::Shape;

/// Variables drawn openly; the others are in a part that opens.
const OPEN_VARIABLES: usize = 2;
/// Height of a chart over a variable, CSS pixels.
const HEIGHT_PX: u32 = 190;

/// The findings on one signal: the phrase, what each variable explains, and the
/// residual over the variables that explain most.
pub fn located_misfit(section: &mut Section, rig: &Rig, located: &Located, role: Role) {
    section.text(sentence(located));
    if located.variables.is_empty() {
        return;
    }
    section.bars(shares(located, role));
    let named = open_variables(located);
    if !named.is_empty() {
        section.row(|row| {
            for variable in &named {
                row.chart(over_variable(rig, located, variable, role));
            }
        });
    }
    let others: Vec<&VariableShare> = located
        .variables
        .iter()
        .filter(|variable| !named.iter().any(|one| one.name == variable.name))
        .collect();
    if others.is_empty() {
        return;
    }
    section.details(
        format!("{} over the other variables", name_of(located)),
        |details| {
            for pair in others.chunks(2) {
                details.row(|row| {
                    for variable in pair {
                        row.chart(over_variable(rig, located, variable, role));
                    }
                });
            }
        },
    );
}

/// The variables shown at once. A pressure and its ratio to the supply's
/// say the same twice.
fn open_variables(located: &Located) -> Vec<&VariableShare> {
    let mut open: Vec<&VariableShare> = Vec::new();
    for variable in located.variables.iter().filter(|one| one.significant) {
        let twin = |one: &&VariableShare| {
            one.name.starts_with(variable.name) || variable.name.starts_with(one.name)
        };
        if open.len() < OPEN_VARIABLES && !open.iter().any(twin) {
            open.push(variable);
        }
    }
    open
}

/// Shades the stretches of largest misfit of one recording in all panels.
pub fn shade_intervals(stack: ChartStack, located: &[Located], recording: &str) -> ChartStack {
    let mut labelled = false;
    located
        .iter()
        .flat_map(|one| one.intervals.iter().map(move |interval| (one, interval)))
        .filter(|(_, interval)| interval.0 == recording)
        .fold(stack, |stack, (_, (_, from, to))| {
            let label = if labelled { "" } else { "largest misfit" };
            labelled = true;
            stack.interval(*from, *to, label)
        })
}

fn name_of(located: &Located) -> String {
    signals::titled(located.signal)
}

/// What was looked at over the variables.
fn quantity_of(located: &Located) -> &str {
    if located.quantity == located.signal {
        signals::spoken(located.signal)
    } else {
        located.quantity
    }
}

fn sentence(located: &Located) -> String {
    let mut text = format!("{}: {}.", name_of(located), located.when);
    if !located.intervals.is_empty() {
        text.push_str(&format!(
            " The shaded intervals hold {:.0} % of the squared error in {:.0} % of the time.",
            100.0 * located.interval_share,
            100.0 * located.interval_time
        ));
    }
    if located.quantity != located.signal {
        text.push_str(&format!(
            " For the state plots the error is converted to an error in {}.",
            located.quantity
        ));
    }
    text
}

fn shares(located: &Located, role: Role) -> BarChart {
    let names = located.variables.iter().map(|variable| variable.name);
    let of = |pick: fn(&VariableShare) -> f64| located.variables.iter().map(pick);
    BarChart::new(
        format!("{}: correlation of the misfit", name_of(located)),
        names,
    )
    .axis("share of squared error", "%")
    .digits(2)
    .bars("signed misfit", role, of(|variable| 100.0 * variable.of_value))
    .bars("magnitude of the misfit", Role::Mark, of(|variable| 100.0 * variable.of_size))
    .note("Share of the squared error that one variable alone explains (correlation ratio over quantile bins, corrected for their number). Correlated variables explain the same share, so the shares do not add up.")
}

/// Mean and spread of the residual in bins of a variable.
fn over_variable(rig: &Rig, located: &Located, variable: &VariableShare, role: Role) -> Chart {
    let title = format!(
        "{} over {}: {:.0} %",
        name_of(located),
        variable.name,
        100.0 * variable.eta_squared
    );
    let quantity = format!("{}, predicted − recorded", quantity_of(located));
    binned(rig, title, quantity, located.quantity_unit, variable, role)
}

/// Mean and spread of a quantity in bins of a variable.
fn binned(
    rig: &Rig,
    title: String,
    quantity: String,
    unit: &'static str,
    variable: &VariableShare,
    role: Role,
) -> Chart {
    let x = variable_reading(rig, variable);
    let y = Reading::of_quantity(rig, unit);
    let bins = || variable.bins.iter();
    let at = |bin: &diagnosis::locate::Bin| x.value(bin.x);
    let band = bins().map(|bin| {
        let (mean, sd) = (y.difference(bin.mean), y.difference(bin.sd));
        (at(bin), mean - sd, mean + sd)
    });
    let means: Vec<(f64, f64)> = bins()
        .map(|bin| (at(bin), y.difference(bin.mean)))
        .collect();
    Chart::new(title)
        .x_axis(variable.name, x.unit.clone())
        .y_axis(quantity, y.unit.clone())
        .height(HEIGHT_PX)
        .band("± 1 sd in the bin", role, band)
        .series(Series::new("mean in the bin", role, means.clone()))
        .series(Series::new("bins", role, means).dots())
        .level(0.0, "")
}

/// Pressures that a misfit is shown over have the zero of the recorded ones.
fn variable_reading(rig: &Rig, variable: &VariableShare) -> Reading {
    match variable.name {
        "pressure" | "chamber A pressure" => Reading::of_signal(rig, "p_a"),
        "chamber B pressure" => Reading::of_signal(rig, "p_b"),
        _ => Reading::of_quantity(rig, variable.unit),
    }
}

/// What one input would have had to be off by to explain a law that no effect explains.
pub fn needed_input(section: &mut Section, rig: &Rig, input: &Located, role: Role) {
    let how = if input.quantity == POSITION {
        "from all rows together"
    } else {
        "in windows of 0.1 s, with the ordinary parameters refitted"
    };
    section.text(format!(
        "No effect of the list explains this law. An error in the {} alone would explain {:.0} % of the misfit. \
         The error needed, estimated {how}: {}.",
        input.quantity,
        100.0 * input.share,
        input.when
    ));
    let named = open_variables(input);
    if named.is_empty() {
        return;
    }
    section.row(|row| {
        for variable in &named {
            let title = format!("Error of the {} over {}", input.quantity, variable.name);
            let quantity = input.quantity.to_owned();
            let unit = input.quantity_unit;
            row.chart(binned(rig, title, quantity, unit, variable, role));
        }
    });
}

/// The table of what no law explains: variable, value and its deviation.
pub fn missing_term(
    section: &mut Section,
    rig: &Rig,
    shape: Shape,
    table: &[(f64, f64, f64)],
    residual: f64,
) {
    let ((variable, variable_unit), (quantity, unit)) = (shape.variable(), shape.quantity());
    let shared = match shape {
        Shape::ForceOverPosition | Shape::ForceOverVelocity => {
            "A part proportional to the velocity, and a constant part, are equivalent to the declared friction"
        }
        Shape::ShiftOfOpenings => {
            "A part proportional to the opening is equivalent to the declared scale of the openings, and an error of the \
             command to an error of the openings"
        }
        Shape::ErrorOfGauge(_) => "A constant part is an offset, a proportional part a gain error",
    };
    section.text(format!(
        "No effect of the list explains this law, but a table does: {}, fitted with all ordinary parameters, \
         reduces the misfit to {:.0} % in data that were not fitted. \
         The improved rig contains it as `{}`. {shared}; the band shows the uncertainty.",
        shape.phrase(),
        100.0 * residual,
        shape.name(),
    ));
    let x = Reading::of_quantity(rig, variable_unit);
    let y = Reading::of_quantity(rig, unit);
    let band = table.iter().map(|&(at, value, deviation)| {
        let (low, high) = (value - deviation, value + deviation);
        (x.difference(at), y.difference(low), y.difference(high))
    });
    let points: Vec<(f64, f64)> = table
        .iter()
        .map(|&(at, value, _)| (x.difference(at), y.difference(value)))
        .collect();
    let chart = Chart::new(format!("Unmodelled {quantity} over the {variable}"))
        .x_axis(variable, x.unit.clone())
        .y_axis(quantity, y.unit.clone())
        .height(HEIGHT_PX)
        .band("± 1 sd", Role::Improved, band)
        .series(Series::new("table", Role::Improved, points.clone()))
        .series(Series::new("knots", Role::Improved, points).dots())
        .level(0.0, "");
    section.chart(chart);
}
