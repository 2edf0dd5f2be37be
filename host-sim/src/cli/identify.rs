//! `pneuma identify`: one part of an axis measured in recordings, with deviations.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::CommandError;
use super::inputs::{
    bad_input, names, provenance, read_recordings, read_rig, say_remarks, with_remarks,
};
use super::outputs::{check_outputs, write_json, write_page, write_text};
use crate::charts;
use crate::laws::Track;
use crate::recording::Recording;
use crate::recording_set;
use crate::rig::Rig;
use bench::{Experiment, Outcome};
use diagnosis::valve_flow::{self, ValveFlow};

/// Measure one part of the axis in recordings, as numbers of a rig file.
#[derive(Args, Clone, Debug)]
pub struct IdentifyArguments {
    #[command(subcommand)]
    part: Part,
}

#[derive(Clone, Debug, Subcommand)]
enum Part {
    /// Areas of the valve over its opening, null, critical pressure ratio, dead volumes.
    ///
    /// From the axis in motion (command, both pressures and position: the chambers are the flow
    /// meter), from a flow meter at port A (flow_a, p_a and the command held in steps), or from a
    /// vessel of known volume at that port, filled and emptied ([vessel], p_a and the command).
    ValveFlow(PartArguments),
    /// Null, gain, play, natural frequency, damping, rate limit and dead time of the spool.
    ///
    /// From command and spool displacement (signal spool): a slow triangle, and sines of several
    /// amplitudes and frequencies.
    Spool(PartArguments),
    /// Heat transfer and gas temperature by the stop method.
    ///
    /// From runs of a chamber with the piston at rest: charged or discharged for a while, shut at
    /// once, and left until the pressure has settled.
    HeatTransfer(PartArguments),
    /// Coulomb, static and viscous friction, Stribeck velocity, growth with pressure.
    ///
    /// From constant speeds in both directions, by a force sensor or by both pressures.
    Friction(PartArguments),
    /// Stiffness and damping of the bristles before break-away.
    ///
    /// From displacements of some micrometres and reversals, with the force.
    Presliding(PartArguments),
    /// Dead volumes of chambers that are shut, with the piston at several places.
    DeadVolume(PartArguments),
}

/// What every part needs.
#[derive(Args, Clone, Debug)]
pub struct PartArguments {
    /// The rig file: its signals, and what is known of the part.
    #[arg(long)]
    rig: PathBuf,
    /// Write the rig file with what was measured, its comments kept.
    #[arg(long)]
    improved_rig: Option<PathBuf>,
    /// Write the outcome as JSON, with the points of all pictures.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write a page with plots.
    #[arg(long)]
    report: Option<PathBuf>,
    /// The recordings; `run.csv@0..50` is the first half of one, `run.csv@2s..5s`
    /// what lies between two times.
    #[arg(value_name = "FILE[@FROM..TO]", required = true)]
    recordings: Vec<PathBuf>,
}

/// The JSON.
#[derive(Serialize)]
struct IdentifiedFile<'a, Content> {
    format: &'static str,
    rig: String,
    recordings: Vec<&'a str>,
    #[serde(flatten)]
    content: &'a Content,
    remarks: &'a [String],
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If the rig or a recording cannot be used, or an output not written.
pub fn run(arguments: &IdentifyArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let (experiment, arguments) = match &arguments.part {
        Part::ValveFlow(arguments) => (Experiment::ValveFlow, arguments),
        Part::Spool(arguments) => (Experiment::Spool, arguments),
        Part::HeatTransfer(arguments) => (Experiment::HeatTransfer, arguments),
        Part::Friction(arguments) => (Experiment::Friction, arguments),
        Part::Presliding(arguments) => (Experiment::Presliding, arguments),
        Part::DeadVolume(arguments) => (Experiment::DeadVolume, arguments),
    };
    arguments.check()?;
    let rig = read_rig(&arguments.rig)?;
    let recordings = recording_set::sorted(read_recordings(&arguments.recordings, &rig)?);
    let remarks = say_remarks(&rig, &recordings, out)?;
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    if experiment == Experiment::ValveFlow && !Experiment::is_of_bench(&rig, &recordings) {
        let valve = valve_flow::measure(&rig, &tracks).map_err(|why| {
            bad_input(format!(
                "{why} (a bench has flow_a of a flow meter, or a [vessel])"
            ))
        })?;
        return arguments.hand_over(&valve, "valve-flow/1", (&rig, &recordings, &remarks), out);
    }
    let outcome = experiment.evaluate(&rig, &tracks).map_err(bad_input)?;
    arguments.hand_over(&outcome, "identified/1", (&rig, &recordings, &remarks), out)
}

/// What was measured: to be said, put into a rig, and shown.
trait Identified: std::fmt::Display + Serialize {
    /// The rig with what was measured.
    fn in_rig(&self, rig: &Rig) -> Rig;
    /// A page with plots.
    fn page(&self, rig: &Rig) -> crate::report::Page;
    /// What of a rig file was measured, in a sentence's beginning.
    fn subject(&self, rig: &Rig) -> String;
}

impl Identified for ValveFlow {
    fn in_rig(&self, rig: &Rig) -> Rig {
        self.applied(rig)
    }

    fn page(&self, rig: &Rig) -> crate::report::Page {
        charts::valve_flow_page(rig, self)
    }

    fn subject(&self, _: &Rig) -> String {
        "[valve] and the dead volumes".into()
    }
}

impl Identified for Outcome {
    fn in_rig(&self, rig: &Rig) -> Rig {
        self.applied(rig)
    }

    fn page(&self, rig: &Rig) -> crate::report::Page {
        charts::bench_page(rig, self)
    }

    fn subject(&self, rig: &Rig) -> String {
        let areas = (!self.areas.is_empty()).then(|| "the areas of [valve]".to_owned());
        let keys = self.of_rig_file(rig).map(|number| number.key.clone());
        areas
            .into_iter()
            .chain(keys)
            .collect::<Vec<String>>()
            .join(", ")
    }
}

impl PartArguments {
    fn check(&self) -> Result<(), CommandError> {
        let inputs: Vec<&PathBuf> = std::iter::once(&self.rig).chain(&self.recordings).collect();
        let outputs = [&self.improved_rig, &self.json, &self.report];
        let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
        check_outputs(&inputs, &outputs)
    }

    /// Says and writes what was measured.
    fn hand_over(
        &self,
        found: &impl Identified,
        format: &'static str,
        (rig, recordings, remarks): (&Rig, &[Recording], &[String]),
        out: &mut dyn Write,
    ) -> Result<(), CommandError> {
        write!(out, "{found}")?;
        out.flush()?;
        if let Some(path) = &self.improved_rig {
            let edited = Rig::edited_file(&self.rig, &found.in_rig(rig)).map_err(bad_input)?;
            let source = format!(
                "# Measured by `pneuma identify` in {}: {}.\n",
                names(recordings).join(", "),
                found.subject(rig)
            );
            write_text(path, &(source + &edited))?;
        }
        if let Some(path) = &self.json {
            let content = IdentifiedFile {
                format,
                rig: self.rig.display().to_string(),
                recordings: names(recordings),
                content: found,
                remarks,
            };
            write_json(path, &content)?;
        }
        if let Some(path) = &self.report {
            let mut page = found.page(rig);
            let files = std::iter::once(&self.rig).chain(&self.recordings);
            page.provenance(with_remarks(provenance(files), remarks));
            write_page(path, &page)?;
        }
        Ok(())
    }
}
