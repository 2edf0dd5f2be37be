//! Heat and confusion matrices, as a table that needs no script.

use super::escape;
use super::number;

/// Shades darker than this, in percent, get light text.
const STRONG_PERCENT: f64 = 55.0;

/// A matrix of numbers whose cells are shaded by size: one colour above zero,
/// another below.
#[derive(Debug, Clone)]
pub struct Matrix {
    title: String,
    note: String,
    row_axis: String,
    column_axis: String,
    rows: Vec<String>,
    columns: Vec<String>,
    cells: Vec<Vec<f64>>,
    decimals: usize,
    full_shade: Option<f64>,
}

impl Matrix {
    /// A matrix with named rows and columns; `cells` are rows of numbers.
    /// Missing cells and what is not finite stay blank.
    pub fn new<Name: Into<String>>(
        title: impl Into<String>,
        rows: impl IntoIterator<Item = Name>,
        columns: impl IntoIterator<Item = Name>,
        cells: Vec<Vec<f64>>,
    ) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            row_axis: String::new(),
            column_axis: String::new(),
            rows: rows.into_iter().map(Into::into).collect(),
            columns: columns.into_iter().map(Into::into).collect(),
            cells,
            decimals: 2,
            full_shade: None,
        }
    }

    /// What rows and columns stand for: "missing in truth", "named".
    pub fn axes(mut self, rows: impl Into<String>, columns: impl Into<String>) -> Self {
        self.row_axis = rows.into();
        self.column_axis = columns.into();
        self
    }

    /// Decimals of the printed values (two unless told).
    pub fn decimals(mut self, decimals: usize) -> Self {
        self.decimals = decimals;
        self
    }

    /// The size that gets the full shade; the largest one unless told.
    pub fn full_shade(mut self, value: f64) -> Self {
        self.full_shade = Some(value);
        self
    }

    /// A sentence below the matrix.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.note = text.into();
        self
    }

    fn shade_unit(&self) -> f64 {
        let values = self
            .cells
            .iter()
            .flatten()
            .filter(|value| value.is_finite());
        let largest = values.fold(0.0_f64, |largest, value| largest.max(value.abs()));
        self.full_shade.unwrap_or(largest).abs()
    }

    pub(super) fn to_html(&self) -> String {
        let label = escape::html(&self.title);
        let mut html = format!("<figure class=\"matrix\" aria-label=\"{label}\">\n");
        html.push_str(&format!(
            "<figcaption>{}</figcaption>\n",
            escape::prose(&self.title)
        ));
        html.push_str("<div class=\"scroll\"><table>\n<thead>");
        html.push_str(&self.header_html());
        html.push_str("</thead>\n<tbody>\n");
        for (position, name) in self.rows.iter().enumerate() {
            let cells = self.cells.get(position).map_or(&[][..], Vec::as_slice);
            html.push_str(&self.row_html(name, cells));
        }
        html.push_str("</tbody></table></div>\n");
        if !self.note.is_empty() {
            html.push_str(&format!(
                "<p class=\"note\">{}</p>\n",
                escape::prose(&self.note)
            ));
        }
        html.push_str("</figure>\n");
        html
    }

    fn header_html(&self) -> String {
        let mut html = String::new();
        if !self.column_axis.is_empty() {
            let axis = escape::prose(&self.column_axis);
            let span = self.columns.len().max(1);
            html.push_str(&format!(
                "<tr><td></td><th colspan=\"{span}\">{axis} →</th></tr>\n"
            ));
        }
        let corner = match self.row_axis.as_str() {
            "" => String::new(),
            axis => format!("{} ↓", escape::prose(axis)),
        };
        html.push_str(&format!("<tr><th>{corner}</th>"));
        for name in &self.columns {
            let name = escape::prose(name);
            html.push_str(&format!("<th scope=\"col\"><span>{name}</span></th>"));
        }
        html.push_str("</tr>");
        html
    }

    fn row_html(&self, name: &str, cells: &[f64]) -> String {
        let unit = self.shade_unit();
        let mut html = format!("<tr><th scope=\"row\">{}</th>", escape::prose(name));
        for column in 0..self.columns.len() {
            let value = cells.get(column).copied().unwrap_or(f64::NAN);
            html.push_str(&self.cell_html(value, unit));
        }
        html.push_str("</tr>\n");
        html
    }

    fn cell_html(&self, value: f64, unit: f64) -> String {
        if !value.is_finite() {
            return "<td></td>".to_owned();
        }
        let percent = if unit > 0.0 {
            (100.0 * value.abs() / unit).min(100.0)
        } else {
            0.0
        };
        let sign = if value < 0.0 { "below" } else { "above" };
        let strength = if percent > STRONG_PERCENT {
            " strong"
        } else {
            ""
        };
        let text = number::fixed(value, self.decimals);
        // A sparse matrix reads easier when zeros step back.
        let is_zero = !text.contains(|character: char| ('1'..='9').contains(&character));
        let faint = if is_zero { " faint" } else { "" };
        format!("<td class=\"{sign}{strength}{faint}\" style=\"--shade:{percent:.0}%\">{text}</td>")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_shades_follow_size_and_sign() {
        let cells = vec![vec![1.0, -0.5], vec![f64::NAN]];
        let html = Matrix::new("m", ["a", "b"], ["c", "d"], cells).to_html();
        assert!(html.contains("class=\"above strong\" style=\"--shade:100%\">1.00"));
        assert!(html.contains("class=\"below\" style=\"--shade:50%\">−0.50"));
        assert_eq!(html.matches("<td></td>").count(), 2);
    }
}
