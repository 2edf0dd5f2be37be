//! Line charts, spectra, phase portraits and histograms, alone or stacked.
//!
//! A chart becomes a figure element with its data as JSON beside it;
//! `assets/report.js` draws it. Every chart is a [`ChartStack`] of one panel.
//!
//! Long columns are packed: 24 bits a value over the column's range, as base64. So a recording
//! stands in the page with all its rows, the script thins what it draws to the pixels at hand,
//! and zooming in brings the rows themselves.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use super::decimate::{self, BandPoint, Point};
use super::escape;
use super::number::Rounding;

/// Points kept per series unless [`Chart::detail`] says otherwise.
const DEFAULT_DETAIL: usize = 40_000;

/// From this many values on a column is packed; short ones stay readable.
const LEAST_PACKED: usize = 600;
/// The largest packed number; the one above it is a gap.
const PACKED_MOST: u32 = 0x00FF_FFFE;
const PACKED_GAP: u32 = PACKED_MOST + 1;
/// Steps of x that differ by less than this part of a step are one step.
const EVEN_STEP: f64 = 1e-3;

/// Digits of the y range written into the page, see [`Rounding::for_range`].
const Y_DIGITS: i32 = 5;
/// One more for x: the samples of a long recording must stay distinct.
const X_DIGITS: i32 = 6;

/// What a curve stands for; the style sheet gives every role its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// What was measured.
    Recorded,
    /// The model as it was handed in.
    Given,
    /// The same model with its ordinary parameters refitted.
    Refitted,
    /// The model with what was missing.
    Improved,
    /// The noise floor and other limits of knowledge.
    Noise,
    /// What the reader's eye shall be led to.
    Mark,
}

impl Role {
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Recorded => "role-recorded",
            Self::Given => "role-given",
            Self::Refitted => "role-refitted",
            Self::Improved => "role-improved",
            Self::Noise => "role-noise",
            Self::Mark => "role-mark",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Shape {
    Line,
    Step,
    Dots,
    Bars,
}

/// A named curve.
#[derive(Debug, Clone)]
pub struct Series {
    name: String,
    role: Role,
    shape: Shape,
    dashed: bool,
    points: Vec<Point>,
}

impl Series {
    /// A line through points (x, y). A y that is not finite makes a gap; a
    /// point without a place, its x not finite, is left out.
    pub fn new(
        name: impl Into<String>,
        role: Role,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            name: name.into(),
            role,
            shape: Shape::Line,
            dashed: false,
            points: points
                .into_iter()
                .filter(|point| point.0.is_finite())
                .collect(),
        }
    }

    /// A line through two columns; the longer one is cut.
    pub fn columns(name: impl Into<String>, role: Role, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, role, x.iter().copied().zip(y.iter().copied()))
    }

    /// A histogram of samples in bins of equal width, as density (its area is
    /// one), so that a probability density can be drawn over it.
    ///
    /// Samples that are not finite are left out.
    pub fn histogram(name: impl Into<String>, role: Role, samples: &[f64], bins: usize) -> Self {
        let mut histogram = Self::new(name, role, density(samples, bins));
        histogram.shape = Shape::Bars;
        histogram
    }

    /// Holds every value until the next: commands and quantised signals.
    pub fn step(mut self) -> Self {
        self.shape = Shape::Step;
        self
    }

    /// Dots instead of a line.
    pub fn dots(mut self) -> Self {
        self.shape = Shape::Dots;
        self
    }

    /// A dashed line.
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }
}

/// Left edges and densities, closed by the last right edge with density zero.
fn density(samples: &[f64], bins: usize) -> Vec<Point> {
    let finite: Vec<f64> = samples
        .iter()
        .copied()
        .filter(|sample| sample.is_finite())
        .collect();
    let low = finite.iter().copied().fold(f64::NAN, f64::min);
    let high = finite.iter().copied().fold(f64::NAN, f64::max);
    if finite.is_empty() || bins == 0 {
        return Vec::new();
    }
    // Equal samples get one bin around them.
    let (low, high) = if high > low {
        (low, high)
    } else {
        (low - 0.5, low + 0.5)
    };
    let width = (high - low) / bins as f64;
    let mut counts = vec![0_usize; bins];
    for sample in &finite {
        let bin = (((sample - low) / width) as usize).min(bins - 1);
        counts[bin] += 1;
    }
    let per_count = 1.0 / (finite.len() as f64 * width);
    let edge = |bin: usize| low + bin as f64 * width;
    let bars = counts.iter().enumerate();
    bars.map(|(bin, count)| (edge(bin), *count as f64 * per_count))
        .chain([(high, 0.0)])
        .collect()
}

#[derive(Debug, Clone, Default, Serialize)]
struct Axis {
    label: String,
    unit: String,
    logarithmic: bool,
}

#[derive(Debug, Clone)]
struct Band {
    name: String,
    role: Role,
    points: Vec<BandPoint>,
}

#[derive(Debug, Clone, Serialize)]
struct Interval {
    from: f64,
    to: f64,
    label: String,
}

#[derive(Debug, Clone, Serialize)]
struct Level {
    value: f64,
    label: String,
}

/// One pair of axes with its curves.
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    note: String,
    description: String,
    x: Axis,
    y: Axis,
    y_range: Option<(f64, f64)>,
    height_px: Option<u32>,
    detail: usize,
    series: Vec<Series>,
    bands: Vec<Band>,
    intervals: Vec<Interval>,
    levels: Vec<Level>,
}

impl Chart {
    /// An empty chart; in a stack the title names the panel.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            description: String::new(),
            x: Axis::default(),
            y: Axis::default(),
            y_range: None,
            height_px: None,
            detail: DEFAULT_DETAIL,
            series: Vec::new(),
            bands: Vec::new(),
            intervals: Vec::new(),
            levels: Vec::new(),
        }
    }

    /// Name and unit of the horizontal axis.
    pub fn x_axis(mut self, label: impl Into<String>, unit: impl Into<String>) -> Self {
        self.x.label = label.into();
        self.x.unit = unit.into();
        self
    }

    /// Name and unit of the vertical axis.
    pub fn y_axis(mut self, label: impl Into<String>, unit: impl Into<String>) -> Self {
        self.y.label = label.into();
        self.y.unit = unit.into();
        self
    }

    /// Makes the horizontal axis logarithmic; what is not positive is not shown.
    pub fn logarithmic_x(mut self) -> Self {
        self.x.logarithmic = true;
        self
    }

    /// Makes the vertical axis logarithmic; what is not positive is not shown.
    pub fn logarithmic_y(mut self) -> Self {
        self.y.logarithmic = true;
        self
    }

    /// Holds the vertical axis; else it follows what is in view. For curves
    /// that diverge and would flatten all others.
    pub fn y_range(mut self, low: f64, high: f64) -> Self {
        let usable = low.is_finite() && high.is_finite() && low < high;
        self.y_range = usable.then_some((low, high));
        self
    }

    /// Height of the drawing in CSS pixels.
    pub fn height(mut self, pixels: u32) -> Self {
        self.height_px = Some(pixels);
        self
    }

    /// How many points to keep of each series: all rows of a shorter one. A longer
    /// one is thinned, and its magnified view shows an envelope.
    pub fn detail(mut self, points: usize) -> Self {
        self.detail = points;
        self
    }

    /// Adds a curve; later ones are drawn over earlier ones.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a shaded band of points (x, lower, upper), drawn below the curves.
    pub fn band(
        mut self,
        name: impl Into<String>,
        role: Role,
        points: impl IntoIterator<Item = (f64, f64, f64)>,
    ) -> Self {
        self.bands.push(Band {
            name: name.into(),
            role,
            points: points
                .into_iter()
                .filter(|point| point.0.is_finite())
                .collect(),
        });
        self
    }

    /// Shades an interval of x.
    pub fn interval(mut self, from: f64, to: f64, label: impl Into<String>) -> Self {
        if from.is_finite() && to.is_finite() {
            let label = label.into();
            let (from, to) = (from.min(to), from.max(to));
            self.intervals.push(Interval { from, to, label });
        }
        self
    }

    /// Draws a horizontal line: a limit, a target.
    pub fn level(mut self, value: f64, label: impl Into<String>) -> Self {
        if value.is_finite() {
            let label = label.into();
            self.levels.push(Level { value, label });
        }
        self
    }

    /// A sentence below the chart.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.note = text.into();
        self
    }

    /// The description for a reader who cannot see the chart; without it title, axes and
    /// names of the curves.
    pub fn describe(mut self, text: impl Into<String>) -> Self {
        self.description = text.into();
        self
    }

    fn spoken(&self) -> String {
        if !self.description.is_empty() {
            return self.description.clone();
        }
        let bands = self.bands.iter().map(|band| band.name.as_str());
        let names: Vec<&str> = self
            .series
            .iter()
            .map(|series| series.name.as_str())
            .chain(bands)
            .collect();
        let axes = format!("{} over {}", with_unit(&self.y), with_unit(&self.x));
        format!("{}: {axes}. Curves: {}.", self.title, names.join(", "))
    }
}

fn with_unit(axis: &Axis) -> String {
    match (axis.label.as_str(), axis.unit.as_str()) {
        ("", unit) => unit.to_owned(),
        (label, "") => label.to_owned(),
        (label, unit) => format!("{label} in {unit}"),
    }
}

/// Charts one below the other that share the x axis, zoom and cursor.
#[derive(Debug, Clone)]
pub struct ChartStack {
    title: String,
    note: String,
    view: Option<(f64, f64)>,
    panels: Vec<Chart>,
}

impl ChartStack {
    /// An empty stack.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            view: None,
            panels: Vec::new(),
        }
    }

    /// Opens the chart on this part of the x axis; the reader can show all.
    pub fn view(mut self, from: f64, to: f64) -> Self {
        let usable = from.is_finite() && to.is_finite() && from < to;
        self.view = usable.then_some((from, to));
        self
    }

    /// Adds a chart below the others. The last one's x axis serves them all.
    pub fn panel(mut self, chart: Chart) -> Self {
        self.panels.push(chart);
        self
    }

    /// Shades an interval in all panels added so far; the top one is labelled.
    pub fn interval(mut self, from: f64, to: f64, label: &str) -> Self {
        let panels = std::mem::take(&mut self.panels).into_iter().enumerate();
        self.panels = panels
            .map(|(index, panel)| panel.interval(from, to, if index == 0 { label } else { "" }))
            .collect();
        self
    }

    /// A sentence below the stack.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.note = text.into();
        self
    }

    pub(super) fn to_html(&self) -> String {
        let mut html = format!(
            "<figure class=\"chart\" aria-label=\"{}\">\n",
            escape::html(&self.title)
        );
        if !self.title.is_empty() {
            let title = escape::prose(&self.title);
            html.push_str(&format!("<figcaption>{title}</figcaption>\n"));
        }
        let data = escape::json(&self.to_json());
        html.push_str("<div class=\"plot\"></div>\n");
        html.push_str(&format!(
            "<script type=\"application/json\">{data}</script>\n"
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

    /// The data the script draws. The panels' x axis is the last one's.
    fn to_json(&self) -> String {
        let x = self
            .panels
            .last()
            .map(|panel| panel.x.clone())
            .unwrap_or_default();
        let stacked = self.panels.len() > 1;
        let panels = self
            .panels
            .iter()
            .map(|panel| panel_data(panel, &x, stacked))
            .collect();
        // Only maps with keys other than strings could fail, and there are none.
        serde_json::to_string(&StackData {
            x,
            view: self.view,
            panels,
        })
        .unwrap_or_default()
    }
}

impl From<Chart> for ChartStack {
    fn from(chart: Chart) -> Self {
        Self {
            title: chart.title.clone(),
            note: chart.note.clone(),
            view: None,
            panels: vec![chart],
        }
    }
}

#[derive(Serialize)]
struct StackData {
    x: Axis,
    /// The part of x shown first; null for all of it.
    view: Option<(f64, f64)>,
    panels: Vec<PanelData>,
}

#[derive(Serialize)]
struct PanelData {
    title: String,
    spoken: String,
    y: Axis,
    y_range: Option<(f64, f64)>,
    height: u32,
    series: Vec<SeriesData>,
    bands: Vec<BandData>,
    intervals: Vec<Interval>,
    levels: Vec<Level>,
}

#[derive(Serialize)]
struct SeriesData {
    name: String,
    role: Role,
    shape: Shape,
    dashed: bool,
    /// Whether points were dropped: between those that stay nothing is known.
    thinned: bool,
    /// Whether x ascends; else the cursor looks for the nearest point.
    ordered: bool,
    x: Column,
    y: Column,
}

#[derive(Serialize)]
struct BandData {
    name: String,
    role: Role,
    x: Column,
    lower: Column,
    upper: Column,
}

/// Values of a series.
#[derive(Serialize, PartialEq)]
#[serde(untagged)]
enum Column {
    /// Those of an earlier series at this position.
    SameAs(usize),
    /// One by one.
    Values(Vec<Number>),
    /// From `first` on in equal steps.
    Even { first: f64, step: f64, count: usize },
    /// Base64 of 24 bits a value, most significant byte first: 0 is `low`,
    /// [`PACKED_MOST`] is `high`, [`PACKED_GAP`] a gap.
    Packed { low: f64, high: f64, packed: String },
}

impl Column {
    fn of(axis: &Axis, values: &[f64], digits: i32) -> Self {
        if axis.logarithmic || values.len() < LEAST_PACKED {
            return Self::Values(numbers(axis, values, digits));
        }
        even(values).unwrap_or_else(|| packed(values))
    }
}

/// A column in equal steps, as recordings have.
fn even(values: &[f64]) -> Option<Column> {
    let (&first, &last) = (values.first()?, values.last()?);
    let step = (last - first) / (values.len() - 1) as f64;
    let is_even = step > 0.0
        && values
            .iter()
            .enumerate()
            .all(|(place, value)| (value - first - step * place as f64).abs() <= EVEN_STEP * step);
    let count = values.len();
    is_even.then_some(Column::Even { first, step, count })
}

fn packed(values: &[f64]) -> Column {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    let per_unit = if high > low {
        f64::from(PACKED_MOST) / (high - low)
    } else {
        0.0
    };
    let bytes: Vec<u8> = values
        .iter()
        .map(|value| {
            if value.is_finite() {
                ((value - low) * per_unit).round() as u32
            } else {
                PACKED_GAP
            }
        })
        .flat_map(|number| {
            let [_, top, middle, bottom] = number.to_be_bytes();
            [top, middle, bottom]
        })
        .collect();
    let packed = STANDARD.encode(bytes);
    Column::Packed { low, high, packed }
}

/// A number written short: whole ones without a point, gaps as null.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let whole = self.0.fract().abs() < f64::MIN_POSITIVE && self.0.abs() < 1e15;
        if !self.0.is_finite() {
            serializer.serialize_unit()
        } else if whole {
            serializer.serialize_i64(self.0 as i64)
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

fn rounding(axis: &Axis, values: impl IntoIterator<Item = f64>, digits: i32) -> Rounding {
    if axis.logarithmic {
        Rounding::Significant(digits)
    } else {
        Rounding::for_range(values, digits)
    }
}

fn numbers(axis: &Axis, values: &[f64], digits: i32) -> Vec<Number> {
    let rounding = rounding(axis, values.iter().copied(), digits);
    values
        .iter()
        .map(|value| Number(rounding.apply(*value)))
        .collect()
}

fn panel_data(panel: &Chart, x: &Axis, stacked: bool) -> PanelData {
    let mut series: Vec<SeriesData> = Vec::new();
    for one in &panel.series {
        let data = series_data(one, panel, x, &series);
        series.push(data);
    }
    PanelData {
        title: if stacked {
            panel.title.clone()
        } else {
            String::new()
        },
        spoken: panel.spoken(),
        y: panel.y.clone(),
        y_range: panel.y_range,
        height: panel.height_px.unwrap_or(if stacked { 170 } else { 280 }),
        series,
        bands: panel
            .bands
            .iter()
            .map(|band| band_data(band, panel, x))
            .collect(),
        intervals: panel.intervals.clone(),
        levels: panel.levels.clone(),
    }
}

fn series_data(series: &Series, panel: &Chart, x: &Axis, before: &[SeriesData]) -> SeriesData {
    let is_step = series.shape == Shape::Step;
    let whole = if is_step && series.points.len() > panel.detail {
        decimate::changes(&series.points)
    } else {
        series.points.clone()
    };
    let points = decimate::series(&whole, panel.detail, x.logarithmic);
    let thinned = points.len() < whole.len();
    let (abscissae, ordinates): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    let column = Column::of(x, &abscissae, X_DIGITS);
    let same = before.iter().position(|other| other.x == column);
    SeriesData {
        name: series.name.clone(),
        role: series.role,
        // Steps between the points that stay would be none of the recording's.
        shape: if is_step && thinned {
            Shape::Line
        } else {
            series.shape
        },
        dashed: series.dashed,
        thinned,
        ordered: decimate::ascends(&abscissae),
        x: same.map_or(column, Column::SameAs),
        y: Column::of(&panel.y, &ordinates, Y_DIGITS),
    }
}

fn band_data(band: &Band, panel: &Chart, x: &Axis) -> BandData {
    let points = decimate::band(&band.points, panel.detail / 3, x.logarithmic);
    let column = |pick: fn(&BandPoint) -> f64| points.iter().map(pick).collect::<Vec<f64>>();
    BandData {
        name: band.name.clone(),
        role: band.role,
        x: Column::of(x, &column(|point| point.0), X_DIGITS),
        lower: Column::of(&panel.y, &column(|point| point.1), Y_DIGITS),
        upper: Column::of(&panel.y, &column(|point| point.2), Y_DIGITS),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(chart: Chart) -> serde_json::Value {
        serde_json::from_str(&ChartStack::from(chart).to_json()).unwrap()
    }

    #[test]
    fn regress_nothing_finite_breaks_nothing() {
        let chart = Chart::new("odd")
            .series(Series::new("empty", Role::Given, []))
            .series(Series::new(
                "nan",
                Role::Given,
                [(f64::NAN, 1.0), (1.0, f64::INFINITY)],
            ))
            .series(Series::histogram("none", Role::Noise, &[f64::NAN], 10))
            .band("band", Role::Noise, [(0.0, f64::NEG_INFINITY, f64::NAN)])
            .interval(f64::NAN, 1.0, "lost")
            .level(f64::INFINITY, "lost")
            .y_range(1.0, f64::NAN);
        let data = data(chart);
        let panel = &data["panels"][0];
        assert_eq!(panel["series"][1]["y"], serde_json::json!([null]));
        assert_eq!(panel["intervals"], serde_json::json!([]));
        assert_eq!(panel["levels"], serde_json::json!([]));
        assert!(panel["y_range"].is_null());
        let no_panel = ChartStack::new("no panel").to_json();
        assert!(no_panel.contains("\"panels\":[]"));
    }

    #[test]
    fn regress_a_shared_time_base_is_written_once() {
        let time: Vec<f64> = (0..100).map(|index| f64::from(index) * 0.01).collect();
        let chart = Chart::new("two")
            .series(Series::columns("a", Role::Recorded, &time, &time))
            .series(Series::columns("b", Role::Given, &time, &time));
        assert_eq!(data(chart)["panels"][0]["series"][1]["x"], 0);
    }

    /// Columns as the script unpacks them.
    fn unpacked(column: &serde_json::Value) -> Vec<f64> {
        let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
        if let Some(values) = column.as_array() {
            return values.iter().map(number).collect();
        }
        if let Some(count) = column["count"].as_u64() {
            let (first, step) = (number(&column["first"]), number(&column["step"]));
            return (0..count).map(|row| first + step * row as f64).collect();
        }
        let (low, high) = (number(&column["low"]), number(&column["high"]));
        let bytes = STANDARD.decode(column["packed"].as_str().unwrap()).unwrap();
        let value = |three: &[u8]| {
            let whole = u32::from_be_bytes([0, three[0], three[1], three[2]]);
            if whole == PACKED_GAP {
                f64::NAN
            } else {
                low + (high - low) * f64::from(whole) / f64::from(PACKED_MOST)
            }
        };
        bytes.chunks(3).map(value).collect()
    }

    #[test]
    fn prop_every_row_of_a_recording_is_in_the_page() {
        let time: Vec<f64> = (0..9_000).map(|row| f64::from(row) * 1e-3).collect();
        let mut values: Vec<f64> = time.iter().map(|t| 4e5 + 1e5 * (9.0 * t).sin()).collect();
        values[77] = f64::NAN;
        for jitter_s in [0.0, 3e-4] {
            let time: Vec<f64> = time
                .iter()
                .map(|t| t + jitter_s * (1e4 * t).sin())
                .collect();
            let series = Series::columns("p", Role::Recorded, &time, &values);
            let data = data(Chart::new("all").series(series));
            let series = &data["panels"][0]["series"][0];
            assert_eq!(series["thinned"], false);
            let (x, y) = (unpacked(&series["x"]), unpacked(&series["y"]));
            assert_eq!((x.len(), y.len()), (time.len(), values.len()));
            for row in 0..time.len() {
                assert!((x[row] - time[row]).abs() < 2e-6);
                let is_same = (y[row] - values[row]).abs() < 0.01;
                assert!(is_same || (y[row].is_nan() && row == 77), "{row}");
            }
        }
    }

    /// A command of 300 000 rows was drawn in steps between every hundredth of them.
    #[test]
    fn prop_a_command_is_drawn_in_steps_only_where_every_change_of_it_is_there() {
        let shape = |change_every: i32| {
            let points = (0..300_000).map(|row| {
                let level = f64::from((row / change_every) % 7);
                (f64::from(row) * 1e-3, level)
            });
            let series = Series::new("u", Role::Recorded, points).step();
            let data = data(Chart::new("command").detail(5_000).series(series));
            let series = data["panels"][0]["series"][0].clone();
            (
                series["shape"].as_str().unwrap().to_owned(),
                unpacked(&series["y"]),
            )
        };
        let (kept, levels) = shape(1_000);
        assert_eq!(kept, "step");
        // Each change, and the last row.
        assert_eq!(levels.len(), 301);
        let (thinned, levels) = shape(1);
        assert_eq!(thinned, "line");
        assert!(levels.len() <= 5_000);
    }

    #[test]
    fn regress_a_histogram_has_area_one() {
        let samples: Vec<f64> = (0..1_000)
            .map(|index| (f64::from(index) * 0.1).sin())
            .collect();
        let bars = density(&samples, 17);
        let area: f64 = bars
            .windows(2)
            .map(|pair| (pair[1].0 - pair[0].0) * pair[0].1)
            .sum();
        assert!((area - 1.0).abs() < 1e-9);
        assert_eq!(density(&[2.0, 2.0], 4).len(), 5);
    }

    /// A row costs four characters; of a very long recording the budget of points is kept, of
    /// which the times are no longer even.
    #[test]
    fn regress_long_recordings_become_small() {
        for (rows, most) in [(40_000, 165_000), (400_000, 330_000)] {
            let points = (0..rows).map(|index| {
                let time = f64::from(index) * 1e-3;
                (
                    time,
                    400_000.0 + 1e5 * time.sin() + 1e3 * (time * 977.0).cos(),
                )
            });
            let chart = Chart::new("long").series(Series::new("p", Role::Recorded, points));
            let bytes = ChartStack::from(chart).to_json().len();
            assert!(bytes < most, "{bytes}");
        }
    }
}
