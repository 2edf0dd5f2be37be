//! From findings to pages: the only module that knows both pneumatics and
//! [`crate::report`].
//!
//! * `prediction.rs`: recorded and predicted signals, residuals, what drove them
//! * `locate.rs`: where a misfit sits
//! * `equation.rs`: what is missing, as an equation
//! * `residuals.rs`: whether a residual is noise
//! * `parameters.rs`: parameters from prior to posterior
//! * `verdict.rs`, `fit.rs`, `compare.rs`, `inspection.rs`, `closed_loop.rs`, `valve_flow.rs`,
//!   `response.rs`,
//!   `bench.rs`: the
//!   pages of the commands
//!
//! The first screen of a page holds its sentence, the sizes, the proof and one plot; all
//! else is folded.

mod bench;
mod closed_loop;
mod compare;
mod equation;
mod fit;
mod inspection;
mod locate;
mod parameters;
mod prediction;
mod residuals;
mod response;
mod valve_flow;
mod verdict;

pub use bench::{bench_page, chart};
pub use closed_loop::closed_loop_page;
pub use compare::compare_page;
pub use fit::fit_page;
pub use inspection::inspection_page;
pub use response::response_page;
pub use valve_flow::valve_flow_page;
pub use verdict::diagnosis_page;

use crate::laws::{Law, Track, median_step_s};
use crate::report::{Cell, Role, Section, Table};
use crate::rig::Rig;
use crate::signals;
use diagnosis::identify::Residuals;
use prediction::worst_recording;
use residuals::Tested;

/// The first letter made large.
fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters
        .next()
        .map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + characters.as_str()
}

/// Tests of the residuals of each output, in the recording that is predicted worst by the
/// first model: a table, and the correlations as charts.
fn test_residuals(
    section: &mut Section,
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    models: &[(&str, Role, &Residuals)],
) {
    let Some((_, _, first)) = models.first() else {
        return;
    };
    let recording = worst_recording(first);
    let Some(track) = tracks.get(recording) else {
        return;
    };
    section.text(format!(
        "Recording {}. Of a white residual 5 % of the lags lie outside of the 95 % band. A cross-correlation outside of its band at a positive lag: the model does not describe how that input acts on the signal.",
        track.recording.name
    ));
    let outputs = law.outputs(rig);
    let drivers = prediction::drivers(law).iter();
    let drivers = drivers.filter(|signal| outputs.iter().all(|one| one.signal != **signal));
    let recorded = drivers.filter_map(|signal| {
        let values = track.recording.signal(signal)?;
        Some((signals::spoken(signal), values))
    });
    let inputs: Vec<(&str, &[f64])> = recorded.collect();
    let headings = models
        .iter()
        .map(|(name, ..)| format!("lags outside of the band, {name}, %"));
    let mut table = Table::new(std::iter::once("signal".to_owned()).chain(headings));
    let names: Vec<String> = outputs
        .iter()
        .map(|output| signals::titled(output.signal))
        .collect();
    let residuals_of = |place: usize| -> Vec<(&str, Role, Vec<f64>)> {
        let of_model = models.iter().filter_map(|(name, role, residuals)| {
            let values = residuals.get(place)?.get(recording)?.clone();
            (!values.is_empty()).then_some((*name, *role, values))
        });
        of_model.collect()
    };
    let all: Vec<Vec<(&str, Role, Vec<f64>)>> = (0..outputs.len()).map(residuals_of).collect();
    let tested = || {
        names.iter().zip(&all).map(|(name, residuals)| Tested {
            name,
            residuals,
            inputs: &inputs,
            step_s: median_step_s(&track.recording.time_s),
        })
    };
    for one in tested() {
        let outside = one.outside().into_iter();
        let cells = outside
            .map(|part| part.map_or(Cell::from("–"), |part| Cell::number(100.0 * part, 0)));
        table = table.row(std::iter::once(Cell::from(one.name)).chain(cells));
    }
    section.table(table);
    tested().for_each(|one| one.show(section));
}
