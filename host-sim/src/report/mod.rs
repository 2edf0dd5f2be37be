//! Self-contained HTML reports with interactive charts.
//!
//! This module knows nothing of pneumatics: it turns a title, sentences, key
//! figures, charts and tables into one HTML file that opens anywhere, needs no
//! network, follows the reader's light or dark setting and prints.
//!
//! ```
//! use host_sim::report::{Chart, Page, Role, Series, Table};
//!
//! let mut page = Page::new("Axis 3");
//! page.lead("The tube between valve and cylinder is missing from the model.");
//! page.tile("held-out error", "1.72", "psi", "was 6.9 refitted");
//! page.section("Where", |section| {
//!     section.text("The misfit sits in `p_a`, in the first second.");
//!     section.chart(
//!         Chart::new("Chamber A")
//!             .x_axis("time", "s")
//!             .y_axis("pressure", "kPa")
//!             .series(Series::new("recorded", Role::Recorded, [(0.0, 1.0), (1.0, 2.0)]))
//!             .interval(0.2, 0.6, "misfit"),
//!     );
//!     section.table(Table::new(["signal", "error"]).row(["p_a".into(), 0.081.into()]));
//! });
//! let html = page.to_html();
//! assert!(html.starts_with("<!doctype html>"));
//! ```
//!
//! # Why an own renderer
//!
//! The `plotly` crate (0.14.1) was the candidate. Its embedded script alone
//! puts 4.65 MB into every page, and its colours are set chart by chart in
//! script, so that light, dark and paper would each need a restyling of every
//! chart. What these reports need is smaller: `assets/report.js` draws SVG
//! whose colours are CSS variables, so that the style sheet alone decides about
//! light, dark and paper. Bar charts and matrices are plain HTML tables styled
//! as charts and need no script.
//!
//! # What keeps a page harmless
//!
//! Every text passes [`escape::html`] or, inside a script element,
//! [`escape::json`]; the script writes text only through `textContent`; and a
//! content security policy in the page forbids every load from anywhere.
//!
//! # What keeps it small
//!
//! Series longer than the chart's point budget are thinned by
//! [`decimate::series`], which keeps every bucket's extremes; numbers are
//! rounded to a hundred-thousandth of the range they span (see
//! [`number::Rounding`]). The same input gives the same bytes.

mod bars;
mod chart;
pub mod decimate;
pub mod escape;
mod matrix;
mod page;
mod table;

#[cfg(test)]
mod tests;

pub use bars::BarChart;
pub use chart::{Chart, ChartStack, Role, Series};
pub use grey_box::number;
pub use matrix::Matrix;
pub use page::{Page, Provenance, Section};
pub use table::{Cell, Table};
