//! The page of `pneuma response`.

use crate::report::{Chart, ChartStack, Page, Role, Series};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::response::{Point, Response};

/// From here on a response is one: below, most of the output follows something else.
const PLAIN_COHERENCE: f64 = 0.5;

/// Whether all points are drawn, and what of them.
type Drawn<'a> = (bool, &'a dyn Fn(&Point) -> f64);

/// The page of frequency responses.
pub fn response_page(rig: &Rig, responses: &[Response]) -> Page {
    let mut page = Page::new("Frequency response");
    page.lead(lead(responses));
    for response in responses {
        page.section(title(response), |section| {
            section.chart(stack(rig, response))
        });
    }
    page
}

fn title(response: &Response) -> String {
    let from = signals::titled(&response.input);
    format!("{from} to {}", signals::spoken(&response.output))
}

/// Up to which frequency the first output follows.
fn lead(responses: &[Response]) -> String {
    let Some(first) = responses.first() else {
        return "No response was asked for.".to_owned();
    };
    let follows = |point: &&Point| point.coherence >= PLAIN_COHERENCE;
    match first.recorded.iter().rev().find(follows) {
        Some(highest) => format!(
            "{}: more than half of it follows up to {:.0} Hz.",
            title(first),
            highest.frequency_hz
        ),
        None => format!("{}: nowhere does half of it follow.", title(first)),
    }
}

fn stack(rig: &Rig, response: &Response) -> ChartStack {
    let input = Reading::of_signal(rig, &response.input);
    let output = Reading::of_signal(rig, &response.output);
    let per_si = output.difference(1.0) / input.difference(1.0);
    let unit = format!("{}/{}", output.unit, input.unit);
    let models = [
        ("recorded", Role::Recorded, &response.recorded),
        ("model", Role::Given, &response.model),
    ];
    // A response is drawn where one is seen; the coherence says where.
    let panel = |title: &str, axis: (&str, &str), (is_all, value): Drawn<'_>| {
        let mut chart = Chart::new(title)
            .x_axis("frequency", "Hz")
            .y_axis(axis.0, axis.1)
            .logarithmic_x();
        for (name, role, points) in models {
            let shown: Vec<&Point> = points
                .iter()
                .filter(|point| is_all || point.is_seen)
                .collect();
            let x: Vec<f64> = shown.iter().map(|point| point.frequency_hz).collect();
            let y: Vec<f64> = shown.iter().map(|point| value(point)).collect();
            if !x.is_empty() {
                chart = chart.series(Series::columns(name, role, &x, &y));
            }
        }
        chart
    };
    let gain = |point: &Point| point.magnitude * per_si;
    let amplitude = panel("Amplitude", ("amplitude", &unit), (false, &gain)).logarithmic_y();
    let phase = panel("Phase", ("phase", "deg"), (false, &|point| point.phase_deg));
    let coherence = panel(
        "Coherence",
        ("coherence", ""),
        (true, &|point| point.coherence),
    );
    ChartStack::new(title(response))
        .panel(amplitude)
        .panel(phase)
        .panel(coherence.y_range(0.0, 1.0))
        .note(format!(
            "{} windows of {:.2} s; the model's response is that of its prediction of the same recordings.",
            response.windows, response.window_s
        ))
}
