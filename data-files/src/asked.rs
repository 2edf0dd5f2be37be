//! The columns that are asked for.

/// What stands between two rows of a column, on the rows of another table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Nothing that is known: the column is not moved.
    Nothing,
    /// The value before.
    Held,
    /// A straight line.
    Line,
}

/// A column that is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'w> {
    /// Its name.
    pub name: &'w str,
    /// What stands between its rows.
    pub between: Between,
}
