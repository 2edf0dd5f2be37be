//! Columns out of several tables, on the rows of one of them.
//!
//! Tables whose rows are at the same instants are one table. Else the rows are those of the table
//! whose columns may not be moved, or of the longest one. A command holds its last value; what a
//! column says lies on straight lines between its rows; outside of its span it says nothing.
//! Pressures may not be moved: between two rows of a valve's chamber anything may have happened, and
//! what a filter left out nobody knows.
//!
//! All tables have to tell time in one way: by the column that the rig names, in one unit, or by
//! the file's own clock. A table that tells none stands beside the only one that does, row by row,
//! if it has as many rows.

use crate::Problem;
use crate::asked::{Between, Wanted};
use crate::groups::{Cells, Column, Group};
use crate::text::Text;

/// Instants of a table's rows, as they are written and as numbers.
#[derive(Clone)]
struct Instants {
    column: Column,
    numbers: Vec<f64>,
}

/// The columns that are asked for, each out of its table (`sources`), on one time.
pub(crate) fn text(
    groups: &[Group],
    sources: &[usize],
    time: &str,
    wanted: &[Wanted<'_>],
) -> Result<Text, Problem> {
    let (instants, by_clock) = all_instants(groups, sources, time)?;
    let of = |group: usize| &instants[sources.iter().position(|at| *at == group).unwrap_or(0)];
    let base = base(groups, sources, wanted, &|one, other| {
        of(one).numbers == of(other).numbers
    })?;
    let rows = of(base);
    let mut columns = vec![rows.column.clone()];
    let mut moved: Vec<(usize, Between, Vec<&str>)> = Vec::new();
    for ((one, source), own) in wanted.iter().zip(sources).zip(&instants) {
        let group = &groups[*source];
        let Some(place) = group.find(one.name) else {
            continue;
        };
        let column = &group.columns[place];
        let stays = own.numbers == rows.numbers;
        let cells = if stays {
            column.cells.clone()
        } else {
            let values = column.cells.reals();
            Cells::Reals(drawn(&rows.numbers, &own.numbers, &values, one.between))
        };
        if !stays {
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
    let mut remarks = remarks(groups, base, &moved);
    let clock = groups[base].clock.as_ref().filter(|_| by_clock);
    remarks.extend(clock.map(|clock| format!("the time of all tables is {}, in s", clock.says)));
    Ok(Text::of_columns(columns, remarks))
}

fn remarks(groups: &[Group], base: usize, moved: &[(usize, Between, Vec<&str>)]) -> Vec<String> {
    let rows = &groups[base];
    let of_base = format!(
        "the rows are those of table \"{}\" ({})",
        rows.name,
        rows.rows()
    );
    let of_moved = moved.iter().map(|(source, between, names)| {
        let how = match between {
            Between::Held => "hold their last value",
            _ => "lie on straight lines between their rows",
        };
        let (group, names) = (&groups[*source], names.join(", "));
        format!(
            "of table \"{}\" ({} rows) {names}: {how}",
            group.name,
            group.rows()
        )
    });
    std::iter::once(of_base).chain(of_moved).collect()
}

/// The table whose rows are those of the recording; `are_alike` where two have the same instants.
fn base(
    groups: &[Group],
    sources: &[usize],
    wanted: &[Wanted<'_>],
    are_alike: &dyn Fn(usize, usize) -> bool,
) -> Result<usize, Problem> {
    let pairs = wanted.iter().zip(sources);
    let mut fixed = pairs.filter(|(one, _)| one.between == Between::Nothing);
    let Some((first, place)) = fixed.next() else {
        let longest = sources.iter().max_by_key(|at| groups[**at].rows());
        return Ok(longest.copied().unwrap_or_default());
    };
    let Some((other, at)) = fixed.find(|(_, other)| !are_alike(*place, **other)) else {
        return Ok(*place);
    };
    let shown = |at: usize| format!("table \"{}\" ({} rows)", groups[at].name, groups[at].rows());
    Err(Problem::new(
        format!(
            "\"{}\" stands in {}, \"{}\" in {} with other instants",
            first.name,
            shown(*place),
            other.name,
            shown(*at)
        ),
        "pressures sampled together: nobody knows what a pressure did between its rows; log them in one group",
    ))
}

/// The instants of each source, told in one way, and whether that is the file's clock.
fn all_instants(
    groups: &[Group],
    sources: &[usize],
    time: &str,
) -> Result<(Vec<Instants>, bool), Problem> {
    let told = |by: &dyn Fn(&Group) -> Option<Column>| -> Option<Vec<Column>> {
        sources.iter().map(|at| by(&groups[*at])).collect()
    };
    let by_column = told(&|group| named(group, time));
    let by_clock = told(&|group| clocked(group, time)).filter(|_| by_column.is_none());
    let is_by_clock = by_clock.is_some();
    let columns = match by_column.or(by_clock) {
        Some(columns) => columns,
        None => vec![the_only(groups, sources, time)?; sources.len()],
    };
    if columns.iter().any(|column| column.unit != columns[0].unit) {
        return Err(Problem::new(
            format!("the times \"{time}\" of its tables have different units"),
            "one unit of time in all tables",
        ));
    }
    let pairs = columns.into_iter().zip(sources);
    let instants: Result<Vec<Instants>, Problem> = pairs
        .map(|(column, at)| rising(column, &groups[*at]))
        .collect();
    Ok((instants?, is_by_clock))
}

/// The column that a table's time is.
fn named(group: &Group, time: &str) -> Option<Column> {
    let column = &group.columns[group.find(time)?];
    Some(Column {
        name: time.into(),
        ..column.clone()
    })
}

/// A table's clock as a column.
fn clocked(group: &Group, time: &str) -> Option<Column> {
    let clock = group.clock.as_ref()?;
    let column = Column::new(time, Cells::Reals(clock.seconds.clone()));
    Some(column.with_facts(Some("s".into()), None))
}

/// The time of the only table that tells it, where all others have as many rows.
fn the_only(groups: &[Group], sources: &[usize], time: &str) -> Result<Column, Problem> {
    let told: Vec<(&Group, Column)> = groups
        .iter()
        .filter_map(|group| Some((group, named(group, time).or_else(|| clocked(group, time))?)))
        .collect();
    let lacking = sources.iter().map(|at| &groups[*at]);
    let lacking = lacking.filter(|group| named(group, time).is_none() && group.clock.is_none());
    match &told[..] {
        [(owner, column)] if sources.iter().all(|at| groups[*at].rows() == owner.rows()) => {
            Ok(column.clone())
        }
        _ => {
            let tables = lacking.map(|group| format!("\"{}\" ({} rows)", group.name, group.rows()));
            let tables: Vec<String> = tables.collect();
            let problem = match tables.is_empty() {
                true => "its tables tell time in different ways".into(),
                false => format!("the time \"{time}\" is not in table {}", tables.join(", ")),
            };
            Err(Problem::new(
                problem,
                "all columns in one table, or a time in each",
            ))
        }
    }
}

fn rising(column: Column, group: &Group) -> Result<Instants, Problem> {
    let numbers = column.cells.reals();
    let rises = numbers.is_sorted() && numbers.iter().all(|one| one.is_finite());
    if rises && !numbers.is_empty() {
        return Ok(Instants { column, numbers });
    }
    Err(Problem::new(
        format!(
            "the time of table \"{}\" is no number that rises from row to row",
            group.name
        ),
        "tables of several rates with one clock of numbers",
    ))
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
        // But tables of the same instants are one.
        let together = [group("one", 10, &["p_a"]), group("two", 10, &["p_b"])];
        assert!(text(&together, &[0, 1], "t", &pressures).is_ok());
        // The rows are those of the pressure, be they the fewest.
        let few = wanted(&[("u", Between::Held), ("p_b", Between::Nothing)]);
        assert_eq!(base(&groups, &[0, 1], &few, &|_, _| false), Ok(1));
        let none = wanted(&[("u", Between::Held), ("x", Between::Line)]);
        assert_eq!(base(&groups, &[0, 1], &none, &|_, _| false), Ok(0));
    }

    #[test]
    fn prop_tables_tell_time_in_one_way() {
        let wish = wanted(&[("x", Between::Line), ("u", Between::Held)]);
        let timed = |unit: &str| {
            let mut timed = group("timed", 10, &["t", "x"]);
            timed.clock = None;
            timed.columns[0].unit = Some(unit.into());
            timed
        };
        let mut other = timed("s");
        other.columns[1].name = "u".into();
        assert!(text(&[timed("s"), other.clone()], &[0, 1], "t", &wish).is_ok());
        let units = text(&[timed("ms"), other], &[0, 1], "t", &wish).err();
        assert!(units.is_some_and(|cause| cause.problem.contains("different units")));
        let clock = group("clock", 12, &["u"]);
        let ways = text(&[timed("s"), clock], &[0, 1], "t", &wish).err();
        assert!(ways.is_some_and(|cause| cause.problem.contains("different ways")));
        let mut bare = group("bare", 10, &["u"]);
        bare.clock = None;
        assert!(text(&[timed("s"), bare], &[0, 1], "t", &wish).is_ok());
        let mut short = group("short", 9, &["u"]);
        short.clock = None;
        let lacks = text(&[timed("s"), short], &[0, 1], "t", &wish).err();
        assert!(lacks.is_some_and(|cause| cause.problem.contains("\"short\" (9 rows)")));
    }
}
