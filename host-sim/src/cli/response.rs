//! `pneuma response`: the frequency response of a recording beside the model's.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::CommandError;
use super::inputs::{bad_input, laws, names, provenance, read_recordings, read_rig, with_remarks};
use super::inputs::{say_remarks, spinner};
use super::outputs::{check_outputs, write_json, write_page};
use crate::laws::Track;
use crate::rig::Rig;
use crate::signals::Reading;
use crate::text::{Columns, plain};
use diagnosis::compare::{LawComparison, compare_law};
use diagnosis::response::{Point, Response, response, usual_window_s};

/// Show amplitude, phase and coherence from one signal to others, recorded and as the model has them.
///
/// The input has to be moved from outside, as by a chirp or by bursts of `pneuma board run`.
#[derive(Args, Clone, Debug)]
pub struct ResponseArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: PathBuf,
    /// The signal that moves.
    #[arg(long, default_value = "u", value_name = "SIGNAL")]
    pub from: String,
    /// A signal that follows, again and again; all that the model predicts if none is named.
    #[arg(long, value_name = "SIGNAL")]
    pub to: Vec<String>,
    /// Length of the windows that are averaged, s: the lowest frequency is twice its inverse.
    #[arg(long, value_name = "SECONDS")]
    pub window_s: Option<f64>,
    /// Write a page with plots.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write the numbers as JSON.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// The recordings, averaged.
    #[arg(value_name = "FILE[@FROM..TO]", required = true)]
    pub recordings: Vec<PathBuf>,
}

/// The JSON.
#[derive(Serialize)]
struct ResponseFile<'a> {
    format: &'static str,
    rig: String,
    recordings: Vec<&'a str>,
    responses: &'a [Response],
    remarks: &'a [String],
}

/// Significant digits of the table.
const DIGITS: usize = 3;
/// One line of the table for each half octave: three bands.
const BANDS_PER_LINE: usize = 3;

/// Runs the command, writing to `out`.
///
/// # Errors
/// If an input cannot be used or an output not be written.
pub fn run(arguments: &ResponseArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let inputs: Vec<&PathBuf> = std::iter::once(&arguments.rig)
        .chain(&arguments.recordings)
        .collect();
    let outputs: Vec<&PathBuf> = arguments.json.iter().chain(&arguments.report).collect();
    check_outputs(&inputs, &outputs)?;
    let rig = read_rig(&arguments.rig)?;
    let recordings = read_recordings(&arguments.recordings, &rig)?;
    let window_s = arguments
        .window_s
        .unwrap_or_else(|| usual_window_s(&recordings));
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let remarks = say_remarks(&rig, &recordings, out)?;
    let bar = spinner();
    bar.set_message("predicting");
    bar.tick();
    let compared: Result<Vec<LawComparison>, String> = laws(&rig)?
        .into_iter()
        .map(|law| compare_law(law, &rig, &tracks))
        .collect();
    bar.finish_and_clear();
    let compared = compared.map_err(bad_input)?;
    let followers = followers(arguments, &compared);
    let responses: Result<Vec<Response>, String> = followers
        .iter()
        .map(|to| response(&tracks, &compared, (&arguments.from, to), window_s))
        .collect();
    let mut responses = responses.map_err(bad_input)?;
    if arguments.to.is_empty() {
        // Signals that a law knows and leaves out.
        responses.retain(|one| !one.model.is_empty());
    }
    for one in &responses {
        write_response(&rig, one, out)?;
    }
    out.flush()?;
    if let Some(path) = &arguments.json {
        let content = ResponseFile {
            format: "response/1",
            rig: arguments.rig.display().to_string(),
            recordings: names(&recordings),
            responses: &responses,
            remarks: &remarks,
        };
        write_json(path, &content)?;
    }
    if let Some(path) = &arguments.report {
        let mut page = crate::charts::response_page(&rig, &responses);
        let files = std::iter::once(&arguments.rig).chain(&arguments.recordings);
        page.provenance(with_remarks(provenance(files), &remarks));
        write_page(path, &page)?;
    }
    Ok(())
}

/// One response as a table, in the units of the rig file.
fn write_response(rig: &Rig, response: &Response, out: &mut dyn Write) -> Result<(), CommandError> {
    let input = Reading::of_signal(rig, &response.input);
    let output = Reading::of_signal(rig, &response.output);
    let per_si = output.difference(1.0) / input.difference(1.0);
    let unit = format!("{}/{}", output.unit, input.unit);
    let (from, to, windows) = (&response.input, &response.output, response.windows);
    let window_s = plain(response.window_s, DIGITS);
    writeln!(
        out,
        "{from} to {to}, {unit}, {windows} windows of {window_s} s"
    )?;
    writeln!(out, "{}", table(response, per_si))?;
    Ok(())
}

/// The signals asked for, or all that a law predicts.
fn followers(arguments: &ResponseArguments, compared: &[LawComparison]) -> Vec<String> {
    if !arguments.to.is_empty() {
        return arguments.to.clone();
    }
    let predicted = compared.iter().flat_map(|law| &law.signals);
    let names = predicted.map(|signal| signal.located.signal);
    let is_recorded =
        |name: &&str| *name != arguments.from && crate::rig::signal_dimension(name, None).is_some();
    names.filter(is_recorded).map(str::to_owned).collect()
}

fn table(response: &Response, per_si: f64) -> String {
    let headings = [
        "Hz",
        "recorded",
        "+-",
        "phase",
        "coherence",
        "model",
        "phase",
        "model/recorded",
    ];
    let mut columns = Columns::new(2, &headings);
    let places = 0..response.recorded.len();
    for place in places.step_by(BANDS_PER_LINE) {
        let point = response.recorded[place];
        let seen = |point: &Point| point.is_seen;
        let recorded = Some(point).filter(seen);
        let model = response.model.get(place).copied().filter(seen);
        let magnitude = |point: Option<Point>| said(point.map(|one| one.magnitude * per_si));
        let phase = |point: Option<Point>| {
            let whole = point.map(|one| format!("{:.0}", one.phase_deg));
            whole.unwrap_or_else(|| "-".to_owned())
        };
        let deviation = recorded.map(|one| one.magnitude * per_si * one.relative_deviation);
        let ratio = recorded
            .zip(model)
            .map(|(one, other)| other.magnitude / one.magnitude);
        columns.row([
            plain(point.frequency_hz, DIGITS),
            magnitude(recorded),
            said(deviation),
            phase(recorded),
            format!("{:.2}", point.coherence),
            magnitude(model),
            phase(model),
            said(ratio),
        ]);
    }
    columns.to_string()
}

fn said(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| plain(value, DIGITS))
}
