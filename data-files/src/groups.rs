//! Tables of columns, as files hold them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The cells of a column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Cells {
    /// Numbers; NaN where there is none.
    Reals(Vec<f64>),
    /// Whole numbers, exactly: instants in nanoseconds have more digits than a real.
    Wholes(Vec<i64>),
    /// Text; empty where there is none.
    Texts(Vec<String>),
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Reals(cells) => cells.len(),
            Self::Wholes(cells) => cells.len(),
            Self::Texts(cells) => cells.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cells as numbers, NaN for what is none.
    pub fn reals(&self) -> Vec<f64> {
        match self {
            Self::Reals(cells) => cells.clone(),
            Self::Wholes(cells) => cells.iter().map(|cell| *cell as f64).collect(),
            Self::Texts(cells) => {
                let number = |cell: &String| cell.parse().unwrap_or(f64::NAN);
                cells.iter().map(number).collect()
            }
        }
    }
}

/// A column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Its name in its table.
    pub name: String,
    /// Its unit, where the file states one.
    pub unit: Option<String>,
    /// What the file says of it.
    pub description: Option<String>,
    /// Its values.
    pub cells: Cells,
}

impl Column {
    /// A column of which no more is known.
    pub fn new(name: impl Into<String>, cells: Cells) -> Self {
        Self {
            name: name.into(),
            unit: None,
            description: None,
            cells,
        }
    }

    /// The same with what a file says of it; blank text says nothing.
    pub fn with_facts(self, unit: Option<String>, description: Option<String>) -> Self {
        let told = |text: Option<String>| text.filter(|text| !text.trim().is_empty());
        Self {
            unit: told(unit),
            description: told(description),
            ..self
        }
    }
}

/// Instants that a file keeps beside its columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// Instants of the rows, s.
    pub seconds: Vec<f64>,
    /// What they are.
    pub says: String,
}

/// A table: columns of one length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Group {
    /// Its name in the file; empty for the only one.
    pub name: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Instants of its rows beside the columns.
    pub clock: Option<Clock>,
}

impl Group {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// The place of a column of this name, or of this name behind that of the table, with a point
    /// or a slash between them.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        let own = self.columns.iter().position(|one| one.name.trim() == name);
        own.or_else(|| {
            let full = |column: &Column| slashed(&format!("{}/{}", self.name, column.name.trim()));
            let name = slashed(name);
            self.columns.iter().position(|one| full(one) == name)
        })
    }
}

fn slashed(name: &str) -> String {
    name.replace('.', "/")
}

/// Tables of one name get a number behind it, so that each can be named.
pub(crate) fn told_apart(mut groups: Vec<Group>) -> Vec<Group> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for group in &mut groups {
        let times = seen.entry(group.name.clone()).or_insert(0);
        *times += 1;
        if *times > 1 {
            group.name = format!("{}#{times}", group.name);
        }
    }
    groups
}

/// Columns of different lengths as tables of one length each, in the order of the file.
pub(crate) fn by_length(name: &str, columns: Vec<Column>) -> Vec<Group> {
    let mut places: BTreeMap<usize, usize> = BTreeMap::new();
    let mut groups: Vec<Group> = Vec::new();
    for column in columns {
        let place = *places.entry(column.cells.len()).or_insert_with(|| {
            groups.push(Group {
                name: name.into(),
                columns: Vec::new(),
                clock: None,
            });
            groups.len() - 1
        });
        groups[place].columns.push(column);
    }
    groups
}

/// The columns of a matrix that lies row by row.
pub(crate) fn columns_of_rows(values: &[f64], columns: usize) -> Vec<Vec<f64>> {
    let column = |first: usize| values.iter().skip(first).step_by(columns).copied();
    (0..columns).map(|first| column(first).collect()).collect()
}

/// The columns `name(:,1)`, `name(:,2)`, ... of a matrix that lies column by column, as MATLAB's do.
pub(crate) fn columns_of_matlab(name: &str, values: &[f64], rows: usize) -> Vec<Column> {
    let column = |(place, column): (usize, &[f64])| {
        let name = format!("{name}(:,{})", place + 1);
        Column::new(name, Cells::Reals(column.to_vec()))
    };
    values.chunks(rows.max(1)).enumerate().map(column).collect()
}

/// A name below a path, which may be empty.
pub(crate) fn below(path: &str, separator: char, name: &str) -> String {
    if path.is_empty() {
        name.into()
    } else {
        format!("{path}{separator}{name}")
    }
}
