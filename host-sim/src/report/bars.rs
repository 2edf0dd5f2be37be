//! Horizontal bars with error bars, as a table that needs no script.
//!
//! Long names stay readable, every value is printed beside its bar, and a
//! reader who hears the page hears a table.

use super::chart::Role;
use super::escape;
use super::number;

#[derive(Debug, Clone)]
struct Group {
    name: String,
    role: Role,
    values: Vec<(f64, Option<f64>)>,
}

/// Values of named categories, one bar for every group.
#[derive(Debug, Clone)]
pub struct BarChart {
    title: String,
    note: String,
    axis: String,
    digits: usize,
    categories: Vec<String>,
    groups: Vec<Group>,
}

impl BarChart {
    /// Bars for these categories, top to bottom.
    pub fn new<Name: Into<String>>(
        title: impl Into<String>,
        categories: impl IntoIterator<Item = Name>,
    ) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            axis: String::new(),
            digits: 3,
            categories: categories.into_iter().map(Into::into).collect(),
            groups: Vec::new(),
        }
    }

    /// Name and unit of what the bars measure.
    pub fn axis(mut self, label: &str, unit: &str) -> Self {
        self.axis = match unit {
            "" => label.to_owned(),
            unit => format!("{label} ({unit})"),
        };
        self
    }

    /// Significant digits of the largest printed value (three unless told);
    /// all others get as many decimals, so that they line up.
    pub fn digits(mut self, digits: usize) -> Self {
        self.digits = digits;
        self
    }

    /// Adds a bar to every category. What is missing or not finite gets none.
    pub fn bars(
        mut self,
        name: impl Into<String>,
        role: Role,
        values: impl IntoIterator<Item = f64>,
    ) -> Self {
        let name = name.into();
        let values = values.into_iter().map(|value| (value, None)).collect();
        self.groups.push(Group { name, role, values });
        self
    }

    /// Adds a bar with an error bar (value, deviation to either side).
    pub fn bars_with_errors(
        mut self,
        name: impl Into<String>,
        role: Role,
        values: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let name = name.into();
        let values = values
            .into_iter()
            .map(|(value, error)| (value, Some(error)))
            .collect();
        self.groups.push(Group { name, role, values });
        self
    }

    /// A sentence below the chart.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.note = text.into();
        self
    }

    /// The axis: zero and every bar with its error.
    fn scale(&self) -> Scale {
        let ends = self
            .groups
            .iter()
            .flat_map(|group| &group.values)
            .flat_map(|(value, error)| {
                let error = error.filter(|error| error.is_finite()).unwrap_or(0.0).abs();
                [value - error, value + error]
            });
        let finite = ends.filter(|end| end.is_finite());
        let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(low, high), end| {
            (low.min(end), high.max(end))
        });
        let high = if high > low { high } else { low + 1.0 };
        Scale { low, high }
    }

    pub(super) fn to_html(&self) -> String {
        let scale = self.scale();
        let label = escape::html(&format!("{}: {}", self.title, self.axis));
        let mut html = format!("<figure class=\"bars\" aria-label=\"{label}\">\n");
        html.push_str(&format!(
            "<figcaption>{}</figcaption>\n",
            escape::prose(&self.title)
        ));
        if self.groups.len() > 1 {
            html.push_str(&self.legend());
        }
        html.push_str("<table>\n");
        for (position, category) in self.categories.iter().enumerate() {
            html.push_str(&self.category_html(position, category, scale));
        }
        html.push_str(&scale.to_html());
        html.push_str("</table>\n");
        html.push_str(&format!(
            "<p class=\"axis\">{}</p>\n",
            escape::prose(&self.axis)
        ));
        if !self.note.is_empty() {
            html.push_str(&format!(
                "<p class=\"note\">{}</p>\n",
                escape::prose(&self.note)
            ));
        }
        html.push_str("</figure>\n");
        html
    }

    fn legend(&self) -> String {
        let entries: String = self
            .groups
            .iter()
            .map(|group| {
                let class = group.role.class();
                let name = escape::prose(&group.name);
                format!("<li class=\"{class}\"><i class=\"swatch\"></i>{name}</li>")
            })
            .collect();
        format!("<ul class=\"legend\">{entries}</ul>\n")
    }

    fn category_html(&self, position: usize, category: &str, scale: Scale) -> String {
        let mut html = String::from("<tbody>\n");
        for (index, group) in self.groups.iter().enumerate() {
            html.push_str("<tr>");
            if index == 0 {
                let rows = self.groups.len();
                let name = escape::prose(category);
                html.push_str(&format!("<th scope=\"row\" rowspan=\"{rows}\">{name}</th>"));
            }
            let missing = (f64::NAN, None);
            let (value, error) = group.values.get(position).copied().unwrap_or(missing);
            let bar = scale.bar_html(value, error, group.role);
            let text = self.value_text(value, error);
            html.push_str(&format!(
                "<td>{bar}</td><td class=\"number\">{text}</td></tr>\n"
            ));
        }
        html.push_str("</tbody>\n");
        html
    }

    fn value_text(&self, value: f64, error: Option<f64>) -> String {
        let decimals = self.decimals();
        let text = number::fixed(value, decimals);
        match error.filter(|error| error.is_finite() && value.is_finite()) {
            Some(error) => format!("{text} ± {}", number::fixed(error, decimals)),
            None => text,
        }
    }

    fn decimals(&self) -> usize {
        let values = self.groups.iter().flat_map(|group| &group.values);
        let largest = values
            .map(|(value, _)| value.abs())
            .filter(|value| value.is_finite() && *value > 0.0)
            .fold(f64::NAN, f64::max);
        // Casting what is not a number gives zero.
        let magnitude = largest.log10().floor() as i64;
        let digits = i64::try_from(self.digits).unwrap_or(i64::MAX);
        usize::try_from(digits - 1 - magnitude).unwrap_or(0)
    }
}

#[derive(Debug, Clone, Copy)]
struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    fn percent(self, value: f64) -> f64 {
        100.0 * (value - self.low) / (self.high - self.low)
    }

    fn bar_html(self, value: f64, error: Option<f64>, role: Role) -> String {
        let mut html = format!("<div class=\"track {}\">", role.class());
        if value.is_finite() {
            html.push_str(&self.span("bar", value.min(0.0), value.max(0.0)));
        }
        if let Some(error) = error.filter(|error| error.is_finite() && value.is_finite()) {
            html.push_str(&self.span("whisker", value - error.abs(), value + error.abs()));
        }
        html.push_str(&format!(
            "<i class=\"zero\" style=\"left:{:.2}%\"></i>",
            self.percent(0.0)
        ));
        html.push_str("</div>");
        html
    }

    fn span(self, class: &str, from: f64, to: f64) -> String {
        let left = self.percent(from);
        let width = self.percent(to) - left;
        format!("<i class=\"{class}\" style=\"left:{left:.2}%;width:{width:.2}%\"></i>")
    }

    /// The row of tick labels; hidden from those who hear the values anyway.
    fn to_html(self) -> String {
        let ticks: String = number::ticks(self.low, self.high, 5)
            .into_iter()
            .map(|tick| {
                let text = tick_text(tick);
                format!(
                    "<span style=\"left:{:.2}%\">{text}</span>",
                    self.percent(tick)
                )
            })
            .collect();
        format!(
            "<tbody aria-hidden=\"true\"><tr><th></th><td><div class=\"ticks\">{ticks}</div></td>\
             <td></td></tr></tbody>\n"
        )
    }
}

fn tick_text(tick: f64) -> String {
    let text = number::significant(tick, 3);
    if text.contains('.') && !text.contains('×') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_bars_stay_on_their_track() {
        let chart = BarChart::new("t", ["a", "b", "c"]).bars_with_errors(
            "g",
            Role::Given,
            [(3.0, 1.0), (-1.0, 0.5), (f64::NAN, 1.0)],
        );
        let scale = chart.scale();
        assert!((scale.percent(scale.low)).abs() < 1e-9);
        assert!((scale.percent(4.0) - 100.0).abs() < 1e-9);
        assert_eq!(chart.to_html().matches("class=\"bar\"").count(), 2);
    }

    #[test]
    fn regress_no_values_no_harm() {
        let html = BarChart::new("t", ["a"])
            .bars("g", Role::Given, [])
            .to_html();
        assert!(html.contains('–') && !html.contains("NaN"));
    }
}
