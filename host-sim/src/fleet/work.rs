//! One job: the fit of an axis as it was, of one night, or a verdict on its latest one.

use super::manifest::LEAST_REFERENCE;
use super::plan::{AxisPlan, Night};
use super::watched::{MISFIT, WATCHED, Watched};
use crate::laws::{Law, Track};
use crate::recording::Recording;
use crate::rehearsal::Rehearsals;
use crate::rig::Rig;
use crate::text::one_line;
use diagnosis::diagnose::diagnose;
use diagnosis::identify::{FreeRequest, LawFit, LawTask, fit_law, free_parameters, improved_rig};
use diagnosis::imprecise::with_built_in_priors;
use diagnosis::inspect::inspect;
use serde::{Deserialize, Serialize};

/// An axis as it was: the numbers that all its nights have in common.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Reference {
    /// The axis.
    pub axis: String,
    /// SHA-256 of rig file and recordings.
    pub inputs: Vec<String>,
    /// The program.
    pub program: String,
    /// The rig file with the numbers fitted to the reference nights.
    pub rig: String,
    /// The quantities that are followed, by key.
    pub watched: Vec<String>,
}

/// What a night says.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct NightResult {
    /// The axis.
    pub axis: String,
    /// SHA-256 of the recording.
    pub inputs: Vec<String>,
    /// The program.
    pub program: String,
    /// The watched quantities, and the misfits.
    pub estimates: Vec<Estimate>,
    /// What is wrong with the recording, a sentence each.
    pub faults: Vec<String>,
}

/// A quantity of a night.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Estimate {
    /// Its key.
    pub key: String,
    /// Its value, in the key's unit.
    pub value: f64,
    /// One standard deviation; none where the night leaves it open.
    pub standard_deviation: Option<f64>,
}

/// A verdict on the latest night of an axis.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Verdict {
    /// The axis.
    pub axis: String,
    /// SHA-256 of the recording.
    pub inputs: Vec<String>,
    /// The program.
    pub program: String,
    /// In a sentence.
    pub sentence: String,
    /// The effects named, the surest first.
    pub effects: Vec<String>,
}

/// This program, as results say it.
fn program() -> String {
    format!("pneuma {}", env!("CARGO_PKG_VERSION"))
}

/// Fits an axis to its reference nights. The error is one line.
pub fn reference(axis: &AxisPlan) -> Result<Reference, String> {
    axis.rig.check()?;
    let given = Rig::read(&axis.rig.path).map_err(|error| error.to_string())?;
    let rig = with_built_in_priors(&given);
    let laws = Law::of(&rig, &|signal| rig.signals.contains(signal));
    let recordings = sound(&rig, read(&rig, &axis.nights[..axis.reference])?)?;
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let free = free_parameters(&rig, &laws, &tracks, &[])?;
    let tasks = laws.iter().zip(free).map(|(&law, free)| LawTask {
        law,
        given: &given,
        rig: &rig,
        train: &tracks,
        held_out: &[],
        free,
    });
    let fits = tasks
        .filter(|task| !task.free.is_empty())
        .map(|task| fit_law(&task, &|_| ()));
    let fits: Vec<LawFit> = fits.collect::<Result<_, String>>()?;
    let (fitted, _) = improved_rig(&given, &fits);
    let text = fitted.to_toml();
    Rig::parse(&text, "the fitted rig").map_err(|error| error.to_string())?;
    let nights = axis.nights[..axis.reference].iter();
    let inputs = nights.map(|night| night.recording.sha256.clone());
    Ok(Reference {
        axis: axis.name.clone(),
        inputs: std::iter::once(axis.rig.sha256.clone())
            .chain(inputs)
            .collect(),
        program: program(),
        watched: shown_by(&exact(&fitted), &laws, &tracks),
        rig: text,
    })
}

/// Those without faults: what a frozen gauge says is no reference.
fn sound(rig: &Rig, recordings: Vec<Recording>) -> Result<Vec<Recording>, String> {
    let all = recordings.len();
    let is_sound = |recording: &Recording| inspect(rig, recording).faults.is_empty();
    let sound: Vec<Recording> = recordings.into_iter().filter(is_sound).collect();
    if sound.len() < LEAST_REFERENCE {
        return Err(format!(
            "{} of the {all} reference recordings have no faults, expected at least {LEAST_REFERENCE}: pneuma inspect tells them",
            sound.len()
        ));
    }
    Ok(sound)
}

/// The keys that an axis' laws and signals show.
fn shown_by(rig: &Rig, laws: &[Law], tracks: &[Track<'_>]) -> Vec<String> {
    let is_shown = |one: &&Watched| {
        laws.iter().any(|&law| {
            let asked = [request(one)];
            one.of.is_of(law) && free_parameters(rig, &[law], &tracks[..1], &asked).is_ok()
        })
    };
    let shown = WATCHED.iter().filter(is_shown);
    shown.map(|one| one.key.to_owned()).collect()
}

fn request(one: &Watched) -> FreeRequest {
    FreeRequest {
        key: one.key.to_owned(),
        start: one.start,
        bounds: one.bounds,
    }
}

/// A rig whose numbers are no prior: a night is to say what it shows, not what was known.
fn exact(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    rig.uncertainty.clear();
    rig
}

/// Fits the watched quantities of a night. The error is one line.
pub fn night(axis: &AxisPlan, night: &Night, reference: &Reference) -> Result<NightResult, String> {
    let rig = Rig::parse(&reference.rig, &axis.name).map_err(|error| error.to_string())?;
    let rig = exact(&rig);
    let recordings = read(&rig, std::slice::from_ref(night))?;
    let inspection = inspect(&rig, &recordings[0]);
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let mut estimates = Vec::new();
    for law in Law::of(&rig, &|signal| rig.signals.contains(signal)) {
        let of_law = WATCHED.iter().filter(|one| one.of.is_of(law));
        let asked = of_law.filter(|one| reference.watched.iter().any(|key| key == one.key));
        let asked: Vec<FreeRequest> = asked.map(request).collect();
        if asked.is_empty() {
            continue;
        }
        let mut free = free_parameters(&rig, &[law], &tracks, &asked)?;
        let task = LawTask {
            law,
            given: &rig,
            rig: &rig,
            train: &tracks,
            held_out: &[],
            free: free.swap_remove(0),
        };
        let fit = fit_law(&task, &|_| ())?;
        estimates.extend(estimates_of(&fit));
    }
    Ok(NightResult {
        axis: axis.name.clone(),
        inputs: vec![night.recording.sha256.clone()],
        program: program(),
        estimates,
        faults: inspection
            .faults
            .into_iter()
            .map(|fault| fault.sentence)
            .collect(),
    })
}

/// The fitted numbers, and by how much each pressure is missed with them: the logarithm of the misfit
/// in units of the noise.
fn estimates_of(fit: &LawFit) -> Vec<Estimate> {
    let shared = fit.parameters.iter().filter(|one| one.shared);
    let numbers = shared.map(|one| Estimate {
        key: one.key.clone(),
        value: one.fitted,
        standard_deviation: one.standard_deviation,
    });
    // The position hangs on chance where the carriage sticks; its law's numbers say enough.
    let of_gas = fit.errors.iter().filter(|_| fit.law == Law::Chambers);
    let misfits = of_gas.filter_map(|error| {
        Some(Estimate {
            key: format!("{MISFIT}{}", error.signal),
            value: (error.train.after? / error.noise).ln(),
            standard_deviation: Some(0.0),
        })
    });
    numbers.chain(misfits).collect()
}

/// A verdict on a night, its last two fifths held out: from night to night the air is another one,
/// and a model has one supply. The error is one line.
pub fn verdict(axis: &AxisPlan, night: &Night, reference: &Reference) -> Result<Verdict, String> {
    const TRAINED_ON: f64 = 0.6;
    let rig = Rig::parse(&reference.rig, &axis.name).map_err(|error| error.to_string())?;
    let recording = read(&rig, std::slice::from_ref(night))?.swap_remove(0);
    let rows = (TRAINED_ON * recording.len() as f64) as usize;
    let train = vec![recording.part(0..rows)];
    let held_out = vec![recording.part(rows..recording.len())];
    let told = || Ok::<_, std::convert::Infallible>(held_out);
    let outcome = diagnose(&rig, train, told, &Rehearsals::all(), &|_| ());
    let diagnosis = outcome.unwrap_or_else(|never| match never {});
    let verdict = diagnosis.verdict;
    Ok(Verdict {
        axis: axis.name.clone(),
        inputs: vec![night.recording.sha256.clone()],
        program: program(),
        effects: verdict
            .effects
            .iter()
            .map(|one| one.effect.clone())
            .collect(),
        sentence: verdict.sentence,
    })
}

/// The recordings of nights, as they were when the plan was made.
fn read(rig: &Rig, nights: &[Night]) -> Result<Vec<Recording>, String> {
    let one = |night: &Night| {
        night.recording.check()?;
        let path = &night.recording.path;
        let recording = Recording::read(path, &rig.signals).map_err(|error| error.to_string())?;
        if recording.len() < LEAST_ROWS {
            let shown = one_line(&path.display().to_string());
            return Err(format!(
                "{shown}: holds {} rows, expected at least {LEAST_ROWS}",
                recording.len()
            ));
        }
        Ok(recording)
    };
    nights.iter().map(one).collect()
}

/// Fewer rows than this say nothing of any law.
const LEAST_ROWS: usize = 200;
