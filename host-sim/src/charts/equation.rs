//! A missing term as an equation: in words, and the course of each of its terms.

use crate::report::{Chart, Role, Section, Series};
use crate::rig::Rig;
use crate::signals::Reading;
use diagnosis::unlisted::equation::{Equation, Term};
use diagnosis::words::percent;

/// Height of a chart, CSS pixels.
const HEIGHT_PX: u32 = 190;

/// How the equation stands beside the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Standing {
    /// The improved rig holds it; so much of the misfit's amplitude is left in data that were not
    /// fitted.
    InTheRig(f64),
    /// It is said, and no rig holds it.
    Said,
}

/// The equation, and its terms one by one.
pub fn equation(section: &mut Section, rig: &Rig, equation: &Equation, standing: Standing) {
    let how = match standing {
        Standing::InTheRig(left) => format!(
            "Fitted with all ordinary parameters, it reduces the misfit to {:.0} % in data that were not fitted. \
             The improved rig contains it as `force-equation`.",
            100.0 * left
        ),
        Standing::Said => format!(
            "It explains {} of what is missing in data that it was not fitted to. \
             The improved rig does not contain it.",
            percent(equation.share)
        ),
    };
    section.text(format!(
        "No effect of the list explains this law, but a short equation does: {}. {how}{}",
        equation.text(),
        rivals(equation)
    ));
    section.row(|row| {
        for term in &equation.terms {
            row.chart(course(rig, equation, term));
        }
    });
}

fn rivals(equation: &Equation) -> String {
    if equation.rivals.is_empty() {
        return String::new();
    }
    format!(
        " As far as these recordings tell, the first term could as well be: {}.",
        equation.rivals.join("; ")
    )
}

fn course(rig: &Rig, equation: &Equation, term: &Term) -> Chart {
    let x = Reading::of_quantity(rig, term.variable_unit);
    let y = Reading::of_quantity(rig, equation.unit);
    let points: Vec<(f64, f64)> = term
        .course()
        .into_iter()
        .map(|(at, value)| (x.difference(at), y.difference(value)))
        .collect();
    let title = format!("Unmodelled {}, {}", equation.quantity, term.phrase());
    Chart::new(title)
        .x_axis(term.variable, x.unit.clone())
        .y_axis(equation.quantity, y.unit.clone())
        .height(HEIGHT_PX)
        .series(Series::new("term", Role::Improved, points))
        .level(0.0, "")
}
