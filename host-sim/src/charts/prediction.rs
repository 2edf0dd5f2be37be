//! Recorded and predicted signals over time, with what drove the law.

use crate::laws::{Law, Output, Track};
use crate::report::{Chart, ChartStack, Role, Series};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::identify::{Residuals, rms};

/// Height of a panel of inputs, CSS pixels: they are there for orientation.
const INPUT_HEIGHT_PX: u32 = 90;
/// Height of a panel of outputs.
const OUTPUT_HEIGHT_PX: u32 = 170;
/// Height of a panel of residuals.
const RESIDUAL_HEIGHT_PX: u32 = 120;

/// Half the width of the band of noise, in deviations.
const NOISE_BAND: f64 = 2.0;

/// Points of a curve in a chart that the reader sees at once.
pub const OPEN_DETAIL: usize = 30_000;
/// Points of a curve in a chart that the reader has to open.
pub const CLOSED_DETAIL: usize = 8_000;

/// Part of a recording that a chart opens on where the misfit is in one place.
const VIEW_PART: f64 = 0.1;
/// It is in one place if that part holds this many times its share of the squared error.
const CONCENTRATED: f64 = 1.1;
/// Places at which the view is tried, per width of it.
const VIEW_STEPS: usize = 4;

/// A prediction to be drawn: its residuals (predicted less recorded).
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its colour.
    pub role: Role,
    /// By output, recording and row.
    pub residuals: &'a Residuals,
    /// Whether its misfit is drawn: one much larger than the others would flatten them.
    pub shows_misfit: bool,
}

/// What of one law and one recording is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    /// The law.
    pub law: Law,
    /// Its rig.
    pub rig: &'a Rig,
    /// The recording.
    pub track: &'a Track<'a>,
    /// The recording's place among the residuals.
    pub recording: usize,
    /// The models.
    pub curves: &'a [Curve<'a>],
    /// Noise floor by output, SI; empty where none is drawn.
    pub floor: &'a [f64],
    /// Points of a curve.
    pub detail: usize,
}

impl Prediction<'_> {
    /// Each output with its predictions and their residuals, and the signals that drove the
    /// law. Panels share zoom and cursor; the chart opens where the misfit is.
    pub fn stack(&self) -> ChartStack {
        let mut panels = Vec::new();
        for (place, output) in self.law.outputs(self.rig).iter().enumerate() {
            panels.extend(self.output_panels(place, output));
        }
        panels.extend(input_panels(self.law, self.rig, self.track));
        self.stacked(panels)
    }

    /// One output with its predictions and their residuals.
    pub fn stack_of(&self, place: usize) -> ChartStack {
        let outputs = self.law.outputs(self.rig);
        let panels = outputs
            .get(place)
            .map(|output| self.output_panels(place, output));
        self.stacked(panels.unwrap_or_default())
    }

    fn stacked(&self, panels: Vec<Chart>) -> ChartStack {
        let recording = self.track.recording;
        let named = ChartStack::new(recording.name.clone());
        let stack = panels.into_iter().fold(named, |stack, panel| {
            stack.panel(panel.x_axis("time", "s").detail(self.detail))
        });
        let shown = self.curves.iter().find(|curve| curve.shows_misfit);
        let misfits = shown.map(|curve| self.misfits(curve)).unwrap_or_default();
        match opening_view(&recording.time_s, &misfits) {
            Some((from, to)) => stack.view(from, to),
            None => stack,
        }
    }

    /// The residuals of a curve in this recording, by output.
    fn misfits(&self, curve: &Curve<'_>) -> Vec<Vec<f64>> {
        let columns = curve.residuals.iter();
        columns
            .filter_map(|column| column.get(self.recording).cloned())
            .collect()
    }

    fn output_panels(&self, place: usize, output: &Output) -> Vec<Chart> {
        let recording = self.track.recording;
        let Some(recorded) = recording.signal(output.signal) else {
            return Vec::new();
        };
        let time_s = &recording.time_s;
        let reading = Reading::of_signal(self.rig, output.signal);
        let name = signals::titled(output.signal);
        let mut panel = axis(Chart::new(&name), output.signal, &reading)
            .height(OUTPUT_HEIGHT_PX)
            .series(line("recorded", Role::Recorded, time_s, recorded, &reading));
        let mut misfit = Chart::new(format!("{name}: predicted − recorded"))
            .y_axis("misfit", reading.unit.clone())
            .height(RESIDUAL_HEIGHT_PX)
            .level(0.0, "");
        let of_curve = |curve: &Curve<'_>| curve.residuals.get(place)?.get(self.recording).cloned();
        let floor = self.floor.get(place).copied();
        if let Some(floor) = floor.and_then(|floor| self.floor_below(floor, place)) {
            misfit = with_noise(misfit, time_s, NOISE_BAND * reading.difference(floor));
        }
        for curve in self.curves {
            let Some(residual) = of_curve(curve) else {
                continue;
            };
            let whole: Vec<f64> = recorded.iter().zip(&residual).map(|(r, e)| r + e).collect();
            panel = panel.series(line(curve.name, curve.role, time_s, &whole, &reading));
            if curve.shows_misfit {
                let points = time_s.iter().zip(&residual);
                let points = points.map(|(&time, &error)| (time, reading.difference(error)));
                misfit = misfit.series(Series::new(curve.name, curve.role, points));
            }
        }
        vec![panel, misfit]
    }

    /// The noise floor of an output if no model shown is below it in this recording.
    fn floor_below(&self, floor: f64, place: usize) -> Option<f64> {
        let errors = self.curves.iter().filter_map(|curve| {
            let column = curve.residuals.get(place)?.get(self.recording)?;
            Some(rms(std::slice::from_ref(column)))
        });
        let least = errors
            .filter(|error| error.is_finite())
            .fold(f64::NAN, f64::min);
        floor_to_draw(floor, least)
    }
}

/// A noise floor is an estimate; one above the error of the best model is wrong for this
/// recording and is not drawn.
pub(super) fn floor_to_draw(floor: f64, least_error: f64) -> Option<f64> {
    (floor.is_finite() && floor <= least_error).then_some(floor)
}

/// The tenth of a recording that holds most of the squared error, each output in units of its
/// own; `None` where the error is spread evenly.
fn opening_view(time_s: &[f64], misfits: &[Vec<f64>]) -> Option<(f64, f64)> {
    let rows = time_s.len();
    let width = ((VIEW_PART * rows as f64) as usize).max(VIEW_STEPS);
    let mut sums = vec![0.0; rows + 1];
    for misfit in misfits.iter().filter(|misfit| misfit.len() == rows) {
        let square = |error: &f64| {
            if error.is_finite() {
                error * error
            } else {
                0.0
            }
        };
        let whole: f64 = misfit.iter().map(square).sum();
        let per_whole = 1.0 / whole.max(f64::MIN_POSITIVE);
        let mut sum = 0.0;
        for (row, error) in misfit.iter().enumerate() {
            sum += square(error) * per_whole;
            sums[row + 1] += sum;
        }
    }
    let whole = sums[rows];
    let held = |from: usize| (sums[from + width] - sums[from], from);
    let begins = (0..rows.checked_sub(width)? + 1).step_by(width / VIEW_STEPS);
    let (most, from) = begins.map(held).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let even = whole * width as f64 / rows as f64;
    (most > CONCENTRATED * even).then(|| (time_s[from], time_s[from + width - 1]))
}

/// A panel with the band in which noise alone would lie.
fn with_noise(panel: Chart, time_s: &[f64], half: f64) -> Chart {
    let ends = [time_s.first(), time_s.last()].into_iter().flatten();
    let band = ends.map(|&time_s| (time_s, -half, half));
    panel.band("noise floor, ± 2 sd", Role::Noise, band)
}

fn line(name: &str, role: Role, time_s: &[f64], values: &[f64], reading: &Reading) -> Series {
    let points = time_s.iter().zip(values);
    let points = points.map(|(&time, &value)| (time, reading.value(value)));
    Series::new(name, role, points)
}

/// The vertical axis of a signal: what it measures, from where it counts, its unit.
fn axis(panel: Chart, signal: &str, reading: &Reading) -> Chart {
    let quantity = format!("{}{}", quantity(signal), reading.reference(signal));
    panel.y_axis(quantity, reading.unit.clone())
}

/// The signals that drive a law.
pub(super) fn drivers(law: Law) -> &'static [&'static str] {
    match law {
        Law::Chambers => &["u", "x", "p_s"],
        Law::Carriage | Law::Balance => &["p_a", "p_b"],
        Law::Force => &["x", "p_a", "p_b"],
        Law::Actuator | Law::Spool => &["u"],
        Law::ValveFlow => &["u", "p_s", "p_a", "p_b"],
    }
}

/// The recorded signals that drive the law and are not predicted by it.
fn input_panels(law: Law, rig: &Rig, track: &Track<'_>) -> Vec<Chart> {
    let outputs = law.outputs(rig);
    let is_driver = |signal: &&&str| outputs.iter().all(|output| output.signal != **signal);
    drivers(law)
        .iter()
        .filter(is_driver)
        .filter_map(|signal| signal_panel(rig, track, signal))
        .map(|panel| panel.height(INPUT_HEIGHT_PX))
        .collect()
}

/// One recorded signal.
pub(super) fn signal_panel(rig: &Rig, track: &Track<'_>, signal: &str) -> Option<Chart> {
    let values = track.recording.signal(signal)?;
    let reading = Reading::of_signal(rig, signal);
    let time_s = &track.recording.time_s;
    let series = line("recorded", Role::Recorded, time_s, values, &reading);
    let series = if signal == "u" { series.step() } else { series };
    let panel = Chart::new(signals::titled(signal)).x_axis("time", "s");
    Some(axis(panel, signal, &reading).series(series))
}

/// What a signal measures, in a word.
fn quantity(signal: &str) -> &'static str {
    match signal {
        "u" => "command",
        "x" | "x_ref" => "position",
        "v" => "velocity",
        "a" => "acceleration",
        "force" => "force",
        signal if signal.starts_with("temperature") => "temperature",
        signal if signal.starts_with("flow") => "mass flow",
        signal if signal.starts_with("p_") => "pressure",
        _ => "value",
    }
}

/// The recording whose outputs are predicted worst, each output against its
/// own error over all recordings.
pub(super) fn worst_recording(residuals: &Residuals) -> usize {
    let count = residuals.first().map_or(0, Vec::len);
    let badness = |recording: usize| -> f64 {
        let outputs = residuals.iter();
        outputs
            .map(|columns| {
                let whole = rms(columns).max(f64::MIN_POSITIVE);
                rms(&columns[recording..=recording]) / whole
            })
            .sum()
    };
    (0..count)
        .max_by(|&a, &b| badness(a).total_cmp(&badness(b)))
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_chart_opens_on_the_misfit_wherever_it_is() {
        let time_s: Vec<f64> = (0..2_000).map(|row| f64::from(row) * 0.01).collect();
        for place in [0, 300, 950, 1_850] {
            let burst = |row: usize| (place..place + 100).contains(&row);
            let misfit = |row: usize| if burst(row) { 5.0 } else { 0.1 };
            let misfit: Vec<f64> = (0..2_000).map(misfit).collect();
            let (from, to) = opening_view(&time_s, &[misfit]).unwrap();
            let (begin, end) = (time_s[place], time_s[place + 99]);
            assert!(from <= begin + 0.1 && to >= end - 0.1, "{from} {to}");
            assert!(to - from < 2.1);
        }
        let even: Vec<f64> = (0..2_000).map(|row| f64::from(row % 7)).collect();
        assert_eq!(opening_view(&time_s, &[even]), None);
        assert_eq!(opening_view(&[], &[]), None);
    }

    #[test]
    fn prop_a_noise_floor_above_the_error_is_not_drawn() {
        assert_eq!(floor_to_draw(1.0, 1.5), Some(1.0));
        assert_eq!(floor_to_draw(1.0, 0.99), None);
        assert_eq!(floor_to_draw(f64::NAN, 1.0), None);
        assert_eq!(floor_to_draw(1.0, f64::NAN), None);
    }
}
