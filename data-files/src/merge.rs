//! Columns out of tables of different rates, on the rows of one of them.
//!
//! The rows are those of the table whose columns may not be moved, or of the longest one. A command
//! holds its last value; what a column says lies on straight lines between its rows; outside of its
//! span it says nothing. Pressures may not be moved: between two rows of a valve's chamber anything
//! may have happened, and what a filter left out nobody knows.

use crate::Problem;
use crate::asked::{Between, Wanted};
use crate::groups::{Cells, Column, Group};
use crate::text::Text;

/// The columns that are asked for, each out of its table (`sources`), on one time.
pub(crate) fn text(
    groups: &[Group],
    sources: &[usize],
    time: &str,
    wanted: &[Wanted<'_>],
) -> Result<Text, Problem> {
    let base = base(groups, sources, wanted)?;
    let rows_s = instants(&groups[base], time)?;
    let mut stamps = Column::new(time, Cells::Reals(rows_s.clone()));
    stamps.unit = unit_of_time(&groups[base], time);
    let mut columns = vec![stamps];
    let mut moved: Vec<(usize, Between, Vec<&str>)> = Vec::new();
    for (one, source) in wanted.iter().zip(sources) {
        let group = &groups[*source];
        let Some(place) = group.find(one.name) else {
            continue;
        };
        let column = &group.columns[place];
        let cells = if *source == base {
            column.cells.clone()
        } else {
            let own_s = instants(group, time)?;
            Cells::Reals(drawn(&rows_s, &own_s, &column.cells.reals(), one.between))
        };
        if *source != base {
            let same =
                |row: &&mut (usize, Between, Vec<&str>)| row.0 == *source && row.1 == one.between;
            match moved.iter_mut().find(same) {
                Some((_, _, names)) => names.push(one.name),
                None => moved.push((*source, one.between, vec![one.name])),
            }
        }
        columns.push(Column {
            name: one.name.into(),
            cells,
            ..column.clone()
        });
    }
    let rows = &groups[base];
    let mut remarks = vec![format!(
        "the rows are those of table \"{}\" ({})",
        rows.name,
        rows.rows()
    )];
    remarks.extend(moved.iter().map(|(source, between, names)| {
        let how = match between {
            Between::Held => "hold their last value",
            _ => "lie on straight lines between their rows",
        };
        let group = &groups[*source];
        format!(
            "of table \"{}\" ({} rows) {}: {how}",
            group.name,
            group.rows(),
            names.join(", ")
        )
    }));
    Ok(Text::of_columns(columns, remarks))
}

/// The table whose rows are those of the recording.
fn base(groups: &[Group], sources: &[usize], wanted: &[Wanted<'_>]) -> Result<usize, Problem> {
    let mut fixed = wanted
        .iter()
        .zip(sources)
        .filter(|(one, _)| one.between == Between::Nothing);
    let Some((first, place)) = fixed.next() else {
        let longest = sources.iter().max_by_key(|at| groups[**at].rows());
        return Ok(longest.copied().unwrap_or_default());
    };
    match fixed.find(|(_, other)| *other != place) {
        None => Ok(*place),
        Some((other, at)) => Err(Problem::new(
            format!(
                "\"{}\" stands in table \"{}\" ({} rows), \"{}\" in \"{}\" ({} rows)",
                first.name,
                groups[*place].name,
                groups[*place].rows(),
                other.name,
                groups[*at].name,
                groups[*at].rows()
            ),
            "pressures sampled together: nobody knows what a pressure did between its rows; log them in one group",
        )),
    }
}

/// Instants of a table's rows: the column of that name, or its clock.
fn instants(group: &Group, time: &str) -> Result<Vec<f64>, Problem> {
    let instants = match (group.find(time), &group.clock) {
        (Some(place), _) => group.columns[place].cells.reals(),
        (None, Some(clock)) => clock.seconds.clone(),
        (None, None) => Vec::new(),
    };
    let rises = instants.is_sorted() && instants.iter().all(|one| one.is_finite());
    if rises && !instants.is_empty() {
        return Ok(instants);
    }
    Err(Problem::new(
        format!(
            "the time of table \"{}\" does not rise from row to row",
            group.name
        ),
        "tables of several rates with one clock",
    ))
}

fn unit_of_time(group: &Group, time: &str) -> Option<String> {
    match group.find(time) {
        Some(place) => group.columns[place].unit.clone(),
        None => Some("s".into()),
    }
}

/// What a column says at the instants of other rows, NaN outside of its span.
fn drawn(rows_s: &[f64], own_s: &[f64], values: &[f64], between: Between) -> Vec<f64> {
    let at = |instant: &f64| {
        let after = own_s.partition_point(|own| own <= instant);
        let before = after.checked_sub(1)?;
        if own_s[before] >= *instant || between == Between::Held {
            // Nobody knows how long the last value held: for one more step.
            let is_past = after == own_s.len() && *instant > own_s[before] + last_step(own_s);
            return (!is_past).then(|| values[before]);
        }
        let (from, to) = (own_s[before], *own_s.get(after)?);
        let share = (instant - from) / (to - from);
        Some(values[before] + share * (values[after] - values[before]))
    };
    rows_s
        .iter()
        .map(|instant| at(instant).unwrap_or(f64::NAN))
        .collect()
}

fn last_step(own_s: &[f64]) -> f64 {
    match own_s {
        [.., before, last] => last - before,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_between_rows_a_command_holds_and_a_position_goes_straight() {
        let rows = [-0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.5];
        let own = [0.0, 1.0, 2.0];
        let values = [10.0, 20.0, 0.0];
        let nan = f64::NAN;
        let expected = [nan, 10.0, 10.0, 20.0, 20.0, 0.0, 0.0, nan];
        let held = drawn(&rows, &own, &values, Between::Held);
        assert_eq!(format!("{held:?}"), format!("{expected:?}"));
        let expected = [nan, 10.0, 15.0, 20.0, 10.0, 0.0, nan, nan];
        let lines = drawn(&rows, &own, &values, Between::Line);
        assert_eq!(format!("{lines:?}"), format!("{expected:?}"));
    }

    fn group(name: &str, rows: usize, columns: &[&str]) -> Group {
        let ramp = |end: usize| (0..end).map(|row| row as f64);
        let column = |column: &&str| Column::new(*column, Cells::Reals(ramp(rows).collect()));
        Group {
            name: name.into(),
            separator: '/',
            columns: columns.iter().map(column).collect(),
            clock: Some(crate::groups::Clock {
                seconds: ramp(rows).map(|row| row / rows as f64).collect(),
                says: String::new(),
            }),
        }
    }

    fn wanted<'w>(names: &[(&'w str, Between)]) -> Vec<Wanted<'w>> {
        let all = names.iter();
        all.map(|(name, between)| Wanted {
            name,
            between: *between,
        })
        .collect()
    }

    #[test]
    fn prop_pressures_are_never_moved() {
        let groups = [
            group("fast", 100, &["p_a", "u"]),
            group("slow", 10, &["p_b", "x"]),
        ];
        let pressures = wanted(&[("p_a", Between::Nothing), ("p_b", Between::Nothing)]);
        let refused = text(&groups, &[0, 1], "t", &pressures).err();
        assert!(refused.is_some_and(|cause| cause.problem.contains("\"fast\" (100 rows)")));
        // The rows are those of the pressure, be they the fewest.
        let few = wanted(&[("u", Between::Held), ("p_b", Between::Nothing)]);
        assert_eq!(base(&groups, &[0, 1], &few), Ok(1));
        let none = wanted(&[("u", Between::Held), ("x", Between::Line)]);
        assert_eq!(base(&groups, &[0, 1], &none), Ok(0));
    }
}
