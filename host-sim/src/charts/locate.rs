//! Where a model and recordings part, as charts: which variable the misfit goes
//! with, and how.

use crate::diagnose::locate::{Located, POSITION, VariableShare};
use crate::diagnose::unknown_term::Shape;
use crate::report::{BarChart, Chart, ChartStack, Role, Section, Series};
use crate::units::shown;

/// Variables drawn openly; the others are in a part that opens.
const OPEN_VARIABLES: usize = 2;
/// Height of a chart over a variable, CSS pixels.
const HEIGHT_PX: u32 = 190;

/// The findings on one signal: the phrase, what each variable explains, and the
/// residual over the variables that explain most.
pub fn located_misfit(section: &mut Section, located: &Located, role: Role) {
    section.text(sentence(located));
    if located.variables.is_empty() {
        return;
    }
    section.bars(shares(located, role));
    let named = open_variables(located);
    if !named.is_empty() {
        section.row(|row| {
            for variable in &named {
                row.chart(over_variable(located, variable, role));
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
        format!("`{}` over the other variables", located.signal),
        |details| {
            for pair in others.chunks(2) {
                details.row(|row| {
                    for variable in pair {
                        row.chart(over_variable(located, variable, role));
                    }
                });
            }
        },
    );
}

/// The variables to be seen at once. A pressure and its ratio to the supply's
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

fn sentence(located: &Located) -> String {
    let mut text = format!("`{}`: {}.", located.signal, located.when);
    if !located.intervals.is_empty() {
        text.push_str(&format!(
            " The shaded stretches hold {:.0} % of its squared error in {:.0} % of the time.",
            100.0 * located.interval_share,
            100.0 * located.interval_time
        ));
    }
    if located.quantity != located.signal {
        text.push_str(&format!(
            " Over state it is judged by the {} that its error stands for.",
            located.quantity
        ));
    }
    text
}

fn shares(located: &Located, role: Role) -> BarChart {
    let names = located.variables.iter().map(|variable| variable.name);
    let of = |pick: fn(&VariableShare) -> f64| located.variables.iter().map(pick);
    BarChart::new(
        format!("What the misfit of `{}` goes with", located.signal),
        names,
    )
    .axis("share of squared error", "%")
    .digits(2)
    .bars("its value", role, of(|variable| 100.0 * variable.of_value))
    .bars("its size", Role::Mark, of(|variable| 100.0 * variable.of_size))
    .note("Part of the squared error explained by the variable alone, in quantile bins, corrected for their number. Variables that go together share the credit, so the parts do not add up.")
}

/// Mean and spread of the residual in bins of a variable.
fn over_variable(located: &Located, variable: &VariableShare, role: Role) -> Chart {
    let title = format!(
        "`{}` over {}: {:.0} %",
        located.signal,
        variable.name,
        100.0 * variable.eta_squared
    );
    let quantity = format!("{}, predicted − recorded", located.quantity);
    binned(title, quantity, located.quantity_unit, variable, role)
}

/// Mean and spread of a quantity in bins of a variable.
fn binned(
    title: String,
    quantity: String,
    unit: &'static str,
    variable: &VariableShare,
    role: Role,
) -> Chart {
    let (x, y) = (shown(variable.unit), shown(unit));
    let bins = || variable.bins.iter();
    let at = |bin: &crate::diagnose::locate::Bin| bin.x * x.per_si;
    let band = bins().map(|bin| {
        let (mean, sd) = (bin.mean * y.per_si, bin.sd * y.per_si);
        (at(bin), mean - sd, mean + sd)
    });
    let means: Vec<(f64, f64)> = bins().map(|bin| (at(bin), bin.mean * y.per_si)).collect();
    Chart::new(title)
        .x_axis(variable.name, x.unit)
        .y_axis(quantity, y.unit)
        .height(HEIGHT_PX)
        .band("spread in the bin, ± sd", role, band)
        .series(Series::new("mean in the bin", role, means.clone()))
        .series(Series::new("bins", role, means).dots())
        .level(0.0, "")
}

/// What one input would have had to be off by to explain a law that no effect explains.
pub fn needed_input(section: &mut Section, input: &Located, role: Role) {
    let how = if input.quantity == POSITION {
        "in all rows together"
    } else {
        "in windows of a tenth of a second while the ordinary parameters are refitted"
    };
    section.text(format!(
        "No effect of the list explains this law. If the {} alone were not what the model takes it for, \
         {:.0} % of the misfit would be explained. What it would have to be off by, found {how}: {}.",
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
            let title = format!(
                "what the {} is off by, over {}",
                input.quantity, variable.name
            );
            let quantity = input.quantity.to_owned();
            row.chart(binned(title, quantity, input.quantity_unit, variable, role));
        }
    });
}

/// The table of what no law explains: variable, value and its deviation.
pub fn missing_term(section: &mut Section, shape: Shape, table: &[(f64, f64, f64)], left: f64) {
    let ((variable, variable_unit), (quantity, unit)) = (shape.variable(), shape.quantity());
    let shared = match shape {
        Shape::ForceOverPosition | Shape::ForceOverVelocity => {
            "A part that is proportional to the velocity, or constant, may as well belong to the declared friction"
        }
        Shape::ShiftOfOpenings => {
            "A part that is proportional to the opening may as well belong to the declared stretch of the openings, and a \
             command that is off looks like openings that are"
        }
        Shape::ErrorOfGauge(_) => "A constant part is an offset, a proportional one a gain",
    };
    section.text(format!(
        "No effect of the list explains this law, but its shape can be modelled: {}, \
         fitted with all ordinary parameters, leaves {:.0} % of the misfit in data that it was not fitted to. \
         The improved rig holds it as `{}`. {shared}: the band tells how free it is.",
        shape.phrase(),
        100.0 * left,
        shape.name(),
    ));
    let (x, y) = (shown(variable_unit), shown(unit));
    let band = table.iter().map(|&(at, value, deviation)| {
        let (low, high) = (value - deviation, value + deviation);
        (at * x.per_si, low * y.per_si, high * y.per_si)
    });
    let points: Vec<(f64, f64)> = table
        .iter()
        .map(|&(at, value, _)| (at * x.per_si, value * y.per_si))
        .collect();
    let chart = Chart::new(format!(
        "The {quantity} that is missing, over the {variable}"
    ))
    .x_axis(variable, x.unit)
    .y_axis(quantity, y.unit)
    .height(HEIGHT_PX)
    .band("± one deviation", Role::Improved, band)
    .series(Series::new("table", Role::Improved, points.clone()))
    .series(Series::new("knots", Role::Improved, points).dots())
    .level(0.0, "");
    section.chart(chart);
}
