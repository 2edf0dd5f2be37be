//! Which table of a file, and which of its columns.
//!
//! A column is asked for by its name, or by `table/name` or `table.name`. One table that has all of them is
//! taken; where several have, or none alone has, the rules of [`crate::merge`] hold or the file is refused.

use crate::Problem;
use crate::asked::Wanted;
use crate::groups::{Cells, Column, Group};
use crate::merge;
use crate::text::Text;

const EVERY: &str = "every column of the rig";

/// The tables' columns that are asked for as one text; without names, the only table.
pub(crate) fn text(
    groups: Vec<Group>,
    time: Option<&str>,
    wanted: &[Wanted<'_>],
) -> Result<Text, Problem> {
    let groups: Vec<Group> = groups.into_iter().filter(|one| one.rows() > 0).collect();
    if groups.is_empty() {
        return Err(Problem::new("holds no column of numbers", "a recording"));
    }
    let all = |group: &Group| {
        let has_time = time.is_none_or(|name| has_time(group, name));
        has_time && wanted.iter().all(|one| group.find(one.name).is_some())
    };
    let example = wanted.first().map_or("x", |one| one.name);
    let complete: Vec<usize> = (0..groups.len()).filter(|at| all(&groups[*at])).collect();
    let Some(place) = the_only(&groups, &complete, (EVERY, example))? else {
        return apart(groups, time, wanted);
    };
    let (columns, remarks) = named(groups, place, time, wanted);
    Ok(Text::of_columns(columns, remarks))
}

/// The only one of the places, `None` where there is none.
fn the_only(
    groups: &[Group],
    places: &[usize],
    (what, example): (&str, &str),
) -> Result<Option<usize>, Problem> {
    if places.len() < 2 {
        return Ok(places.first().copied());
    }
    let shown = |at: &usize| format!("\"{}\" ({} rows)", groups[*at].name, groups[*at].rows());
    let shown: Vec<String> = places.iter().take(5).map(shown).collect();
    let last = places.last().map_or("", |at| &groups[*at].name);
    Err(Problem::new(
        format!("several tables hold {what}: {}", shown.join(", ")),
        format!("the table in the name of each column, such as \"{last}/{example}\""),
    ))
}

/// Columns that no table has all of: out of several, or, where one is nowhere, the fullest table,
/// so that its names can be said.
fn apart(groups: Vec<Group>, time: Option<&str>, wanted: &[Wanted<'_>]) -> Result<Text, Problem> {
    let mut sources = Vec::new();
    for one in wanted {
        let has = |at: &usize| groups[*at].find(one.name).is_some();
        let places: Vec<usize> = (0..groups.len()).filter(has).collect();
        let what = format!("a column \"{}\"", one.name);
        sources.extend(the_only(&groups, &places, (&what, one.name))?);
    }
    let has_time = |name: &str| groups.iter().any(|group| has_time(group, name));
    if let Some(time) = time.filter(|name| sources.len() == wanted.len() && has_time(name)) {
        return merge::text(&groups, &sources, time, wanted);
    }
    let found = |group: &Group| {
        wanted
            .iter()
            .filter(|one| group.find(one.name).is_some())
            .count()
    };
    let fullest = (0..groups.len()).max_by_key(|at| (found(&groups[*at]), groups[*at].rows()));
    let (columns, _) = named(groups, fullest.unwrap_or_default(), time, wanted);
    Ok(columns.into())
}

fn has_time(group: &Group, name: &str) -> bool {
    group.clock.is_some() || group.find(name).is_some()
}

/// The columns of a table under the names that are asked for, with its clock where no column is
/// the time.
fn named(
    mut groups: Vec<Group>,
    place: usize,
    time: Option<&str>,
    wanted: &[Wanted<'_>],
) -> (Vec<Column>, Vec<String>) {
    let mut remarks = Vec::new();
    if groups.len() > 1 {
        let others = groups.len() - 1;
        let name = &groups[place].name;
        remarks.push(format!("table \"{name}\" is read, {others} others are not"));
    }
    let mut group = groups.swap_remove(place);
    let names = time.into_iter().chain(wanted.iter().map(|one| one.name));
    for name in names {
        if let Some(at) = group.find(name) {
            group.columns[at].name = name.into();
        }
    }
    let clocked = time.filter(|name| group.find(name).is_none());
    if let (Some(name), Some(clock)) = (clocked, group.clock.take()) {
        remarks.push(format!(
            "the time is {}, in s: no column is named \"{name}\"",
            clock.says
        ));
        let mut column = Column::new(name, Cells::Reals(clock.seconds));
        column.unit = Some("s".into());
        group.columns.insert(0, column);
    }
    (group.columns, remarks)
}
