//! What no effect of the list explains, as a table or an equation.

use super::{SaidEquation, UnknownTerm};
use crate::finding::Finding;
use crate::locate;
use crate::unlisted::equation::{Equation, Term};
use crate::unlisted::unknown_term::{self, Stand};
use crate::words;

/// A law whose misfit is material and unexplained: the missing term as a table
/// over the variable that explains most of it.
pub(super) fn unknown_term(laws: &[Finding]) -> Option<UnknownTerm> {
    let is_open = |law: &&Finding| law.is_unexplained() || law.is_surprised;
    let law = laws.iter().find(is_open)?;
    // An input that explains both chambers says more than either chamber.
    let by_share =
        |one: &&locate::Located, other: &&locate::Located| one.share.total_cmp(&other.share);
    let located = law.input.as_ref().or(law.located.iter().max_by(by_share))?;
    let ask =
        |input: &locate::Located| format!("requires another {}: {}", input.quantity, input.when);
    let Some(term) = &law.term else {
        let expression = law.input.as_ref().map_or(located.when.clone(), ask);
        return as_tabled(
            located,
            with_equation(expression, law),
            law.equation.as_ref(),
        );
    };
    let phrase = term.stand.phrase();
    let left = percent(1.0 - term.share);
    // An input that is left beside a table explains more.
    let (place, expression) = match &law.input {
        Some(input) => (
            input.place,
            format!(
                "{}; {phrase}, reduces it to {left} in data that were not fitted",
                ask(input)
            ),
        ),
        None => (
            term.stand.place(),
            format!(
                "is described by {phrase}, which reduces it to {left} in data that were not fitted"
            ),
        ),
    };
    let tabled = match &term.stand {
        Stand::Table(shape) => UnknownTerm {
            place: place.into(),
            of: vec![shape.variable().0.into()],
            expression,
            unit: shape.quantity().1.into(),
            table: unknown_term::table(*shape, &law.candidates[term.candidate], &law.improved),
            equation: None,
        },
        Stand::Equation(equation) => of_equation(equation, place, expression),
    };
    Some(tabled)
}

/// An expression, and the equation of a law.
fn with_equation(expression: String, law: &Finding) -> String {
    match &law.equation {
        None => expression,
        Some(equation) => format!(
            "{expression}; {} explains {} of it in data that were not fitted",
            equation.text(),
            words::percent(equation.share)
        ),
    }
}

/// What an equation describes; its table is the course of its first term.
fn of_equation(equation: &Equation, place: &str, expression: String) -> UnknownTerm {
    let course = equation.terms.first().map(Term::course);
    let points = course.into_iter().flatten();
    UnknownTerm {
        place: place.into(),
        of: equation
            .variables()
            .iter()
            .map(ToString::to_string)
            .collect(),
        expression,
        unit: equation.unit.into(),
        table: points.map(|(at, value)| (at, value, 0.0)).collect(),
        equation: Some(SaidEquation::of(equation)),
    }
}

/// What is located, as a table over the variable that explains most of it.
fn as_tabled(
    located: &locate::Located,
    expression: String,
    equation: Option<&Equation>,
) -> Option<UnknownTerm> {
    let variable = located.variables.first()?;
    Some(UnknownTerm {
        place: located.place.into(),
        of: vec![variable.name.into()],
        expression,
        unit: located.quantity_unit.into(),
        equation: equation.map(SaidEquation::of),
        table: variable
            .bins
            .iter()
            .map(|bin| (bin.x, bin.mean, bin.sd / (bin.count.max(1) as f64).sqrt()))
            .collect(),
    })
}

/// What the position says of the velocity.
pub(super) fn term_of_velocity(velocity: &locate::Located) -> Option<UnknownTerm> {
    as_tabled(
        velocity,
        format!("{}: {}", velocity.quantity, velocity.when),
        None,
    )
}

/// The same beside what the laws miss.
pub(super) fn velocity_note(velocity: &locate::Located) -> String {
    format!(
        "recorded velocity and position differ by {} m/s rms ({}); no law uses the velocity",
        words::digits(velocity.rms),
        velocity.when
    )
}

/// A part in per cent; one that is hardly there is not called nought.
fn percent(part: f64) -> String {
    if part < 0.01 {
        "less than 1 %".into()
    } else {
        format!("{:.0} %", 100.0 * part)
    }
}
