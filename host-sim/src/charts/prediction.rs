//! Recorded and predicted signals over time, with what drove the law.

use crate::identify::{Residuals, rms};
use crate::laws::{Law, Track};
use crate::report::{Chart, ChartStack, Role, Series};
use crate::rig::Rig;
use crate::units::{Shown, shown};

/// Height of a panel of inputs, CSS pixels: they are there for orientation.
const INPUT_HEIGHT_PX: u32 = 80;
/// Height of a panel of outputs.
const OUTPUT_HEIGHT_PX: u32 = 170;
/// Height of a panel of residuals.
const RESIDUAL_HEIGHT_PX: u32 = 110;

/// Half the width of the band of noise, in deviations.
const NOISE_BAND: f64 = 2.0;

/// Points of a curve in a chart that the reader sees at once.
pub const OPEN_DETAIL: usize = 4_000;
/// Points of a curve in a chart that the reader has to open.
pub const CLOSED_DETAIL: usize = 1_500;

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

/// The unit of a recorded signal for a chart.
pub(super) fn shown_signal(rig: &Rig, signal: &str) -> Shown {
    let recorded = rig.signals.get(signal).map(|one| one.unit.dimension());
    let dimension = crate::rig::signal_dimension(signal, recorded);
    shown(dimension.map_or("", |dimension| dimension.si_unit()))
}

/// One recording: each output with its predictions, their residuals (over the noise of the
/// outputs, where it is given), and the signals that drove the law. Panels share zoom and
/// cursor.
pub fn prediction_stack(
    law: Law,
    rig: &Rig,
    track: &Track<'_>,
    recording: usize,
    curves: &[Curve<'_>],
    noise: &[f64],
    detail: usize,
) -> ChartStack {
    let time_s = &track.recording.time_s;
    let mut stack = ChartStack::new(track.recording.name.clone());
    for (output, predicted) in law.outputs(rig).iter().enumerate() {
        let Some(recorded) = track.recording.signal(predicted.signal) else {
            continue;
        };
        let unit = shown(predicted.unit);
        let panel = Chart::new(predicted.signal)
            .y_axis(quantity(predicted.signal), unit.unit)
            .height(OUTPUT_HEIGHT_PX)
            .series(line("recorded", Role::Recorded, time_s, recorded, unit));
        let panels = curves.iter().filter_map(|curve| {
            let residual = curve.residuals.get(output)?.get(recording)?;
            Some((curve, residual))
        });
        let mut panel = panel;
        let mut misfit = misfit_panel(predicted.signal, unit);
        if let Some(noise) = noise.get(output) {
            misfit = with_noise(misfit, time_s, NOISE_BAND * noise * unit.per_si);
        }
        for (curve, residual) in panels {
            let whole: Vec<f64> = recorded.iter().zip(residual).map(|(r, e)| r + e).collect();
            panel = panel.series(line(curve.name, curve.role, time_s, &whole, unit));
            if curve.shows_misfit {
                misfit = misfit.series(line(curve.name, curve.role, time_s, residual, unit));
            }
        }
        stack = stack
            .panel(panel.detail(detail))
            .panel(misfit.detail(detail));
    }
    let inputs: Vec<Chart> = input_panels(law, rig, track);
    let last = inputs.len();
    for (place, input) in inputs.into_iter().enumerate() {
        let input = if place + 1 == last {
            input.x_axis("time", "s")
        } else {
            input
        };
        stack = stack.panel(input.detail(detail));
    }
    stack
}

/// A panel with the band in which noise alone would lie.
fn with_noise(panel: Chart, time_s: &[f64], half: f64) -> Chart {
    let ends = [time_s.first(), time_s.last()].into_iter().flatten();
    let band = ends.map(|&time_s| (time_s, -half, half));
    panel.band("± 2 noise", Role::Noise, band)
}

fn misfit_panel(signal: &str, unit: Shown) -> Chart {
    Chart::new(format!("{signal}: predicted − recorded"))
        .x_axis("time", "s")
        .y_axis("misfit", unit.unit)
        .height(RESIDUAL_HEIGHT_PX)
        .level(0.0, "")
}

pub(super) fn line(name: &str, role: Role, time_s: &[f64], values: &[f64], unit: Shown) -> Series {
    let points = time_s.iter().zip(values);
    let points = points.map(|(&time, &value)| (time, value * unit.per_si));
    Series::new(name, role, points)
}

/// The recorded signals that drive the law and are not predicted by it.
fn input_panels(law: Law, rig: &Rig, track: &Track<'_>) -> Vec<Chart> {
    let signals: &[&str] = match law {
        Law::Chambers => &["u", "x", "p_s"],
        Law::Carriage | Law::Balance => &["p_a", "p_b"],
        Law::Force => &["x", "p_a", "p_b"],
        Law::Actuator => &["u"],
    };
    let outputs = law.outputs(rig);
    let is_driver = |signal: &&&str| outputs.iter().all(|output| output.signal != **signal);
    signals
        .iter()
        .filter(is_driver)
        .filter_map(|signal| signal_panel(rig, track, signal))
        .map(|panel| panel.height(INPUT_HEIGHT_PX))
        .collect()
}

/// One recorded signal.
pub(super) fn signal_panel(rig: &Rig, track: &Track<'_>, signal: &str) -> Option<Chart> {
    let values = track.recording.signal(signal)?;
    let unit = shown_signal(rig, signal);
    let series = line(
        signal,
        Role::Recorded,
        &track.recording.time_s,
        values,
        unit,
    );
    let series = if signal == "u" { series.step() } else { series };
    let panel = Chart::new(signal)
        .x_axis("time", "s")
        .y_axis(quantity(signal), unit.unit);
    Some(panel.series(series))
}

/// What a signal measures, in a word.
pub(super) fn quantity(signal: &str) -> &'static str {
    match signal {
        "u" => "command",
        "x" => "position",
        "x_ref" => "reference",
        "v" => "velocity",
        "a" => "acceleration",
        "force" => "force",
        "T_a" | "T_b" => "temperature",
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
