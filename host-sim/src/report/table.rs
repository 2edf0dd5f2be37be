//! Tables whose numbers line up.

use super::escape;
use super::number;

/// One cell: text, or a number that aligns right.
#[derive(Debug, Clone)]
pub struct Cell {
    text: String,
    numeric: bool,
}

impl Cell {
    /// A number with so many decimals; a column of equal decimals lines up at
    /// the point.
    pub fn number(value: f64, decimals: usize) -> Self {
        Self {
            text: number::fixed(value, decimals),
            numeric: true,
        }
    }

    /// A number with so many significant digits.
    pub fn significant(value: f64, digits: usize) -> Self {
        Self {
            text: number::significant(value, digits),
            numeric: true,
        }
    }

    /// A number that is only known to be smaller than this: `< 0.0123`.
    pub fn below(value: f64, digits: usize) -> Self {
        Self {
            text: format!("< {}", number::significant(value, digits)),
            numeric: true,
        }
    }

    /// A value and its standard deviation: `1.93 ± 0.06`.
    pub fn with_deviation(value: f64, deviation: f64, decimals: usize) -> Self {
        let value = number::fixed(value, decimals);
        let deviation = number::fixed(deviation, decimals);
        Self {
            text: format!("{value} ± {deviation}"),
            numeric: true,
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self {
            text,
            numeric: false,
        }
    }
}

/// Four significant digits; [`Cell::number`] says how many decimals.
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self {
            text: number::significant(value, 4),
            numeric: true,
        }
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self {
            text: count.to_string(),
            numeric: true,
        }
    }
}

/// What an absent number shows: a dash.
impl<Content: Into<Cell>> From<Option<Content>> for Cell {
    fn from(content: Option<Content>) -> Self {
        content.map_or_else(|| Self::from(f64::NAN), Into::into)
    }
}

#[derive(Debug, Clone)]
struct Row {
    cells: Vec<Cell>,
    emphasised: bool,
}

/// A table with a header row; columns of numbers align right.
#[derive(Debug, Clone)]
pub struct Table {
    caption: String,
    columns: Vec<String>,
    rows: Vec<Row>,
}

impl Table {
    /// A table with these column headings (write units there).
    pub fn new<Heading: Into<String>>(columns: impl IntoIterator<Item = Heading>) -> Self {
        Self {
            caption: String::new(),
            columns: columns.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// A sentence above the table.
    pub fn caption(mut self, text: impl Into<String>) -> Self {
        self.caption = text.into();
        self
    }

    /// Adds a row; missing cells stay empty, surplus ones are dropped.
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.push(cells, false);
        self
    }

    /// Adds a row that stands out: the result among the alternatives.
    pub fn emphasised_row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.push(cells, true);
        self
    }

    fn push(&mut self, cells: impl IntoIterator<Item = Cell>, emphasised: bool) {
        let mut cells: Vec<Cell> = cells.into_iter().collect();
        cells.resize(self.columns.len(), Cell::from(""));
        self.rows.push(Row { cells, emphasised });
    }

    /// A column aligns right when it holds a number and no text but dashes.
    fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self
            .rows
            .iter()
            .filter_map(|row| row.cells.get(column))
            .peekable();
        let blank = |cell: &Cell| cell.text.is_empty() || cell.text == "–";
        cells.clone().any(|cell| cell.numeric) && cells.all(|cell| cell.numeric || blank(cell))
    }

    pub(super) fn to_html(&self) -> String {
        let classes: Vec<&str> = (0..self.columns.len())
            .map(|column| {
                if self.is_numeric(column) {
                    " class=\"number\""
                } else {
                    ""
                }
            })
            .collect();
        let mut html = String::from("<div class=\"scroll\"><table>\n");
        if !self.caption.is_empty() {
            html.push_str(&format!(
                "<caption>{}</caption>\n",
                escape::prose(&self.caption)
            ));
        }
        html.push_str("<thead><tr>");
        for (heading, class) in self.columns.iter().zip(&classes) {
            html.push_str(&format!(
                "<th scope=\"col\"{class}>{}</th>",
                escape::prose(heading)
            ));
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            html.push_str(&row_html(row, &classes));
        }
        html.push_str("</tbody></table></div>\n");
        html
    }
}

fn row_html(row: &Row, classes: &[&str]) -> String {
    let mut html = String::from(if row.emphasised {
        "<tr class=\"emphasised\">"
    } else {
        "<tr>"
    });
    for (position, (cell, class)) in row.cells.iter().zip(classes).enumerate() {
        let text = escape::prose(&cell.text);
        // The first cell names the row, unless it is a mere number.
        if position == 0 && !cell.numeric {
            html.push_str(&format!("<th scope=\"row\"{class}>{text}</th>"));
        } else {
            html.push_str(&format!("<td{class}>{text}</td>"));
        }
    }
    html.push_str("</tr>\n");
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_columns_of_numbers_align_right() {
        let table = Table::new(["a", "b", "c"])
            .row(["x".into(), 1.5.into(), "1".into()])
            .row(["y".into(), None::<f64>.into(), 2.0.into()]);
        assert!(!table.is_numeric(0) && table.is_numeric(1) && !table.is_numeric(2));
        assert!(table.to_html().contains("<td class=\"number\">1.500</td>"));
    }

    #[test]
    fn regress_ragged_rows_fit_the_header() {
        let table = Table::new(["a", "b"])
            .row(["x".into()])
            .row(["1", "2", "3"].map(Cell::from));
        let html = table.to_html();
        assert_eq!(html.matches("<td").count(), 2);
        assert!(!html.contains('3'));
    }
}
