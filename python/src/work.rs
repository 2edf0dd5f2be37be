//! What the program's commands do, without files: results as the JSON that those write.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::Mutex;

use bench::Experiment;
use diagnosis::compare::{compare_law, headline};
use diagnosis::identify::{FreeRequest, LawFit, LawTask, fit_law, free_parameters, improved_rig};
use diagnosis::imprecise::with_built_in_priors;
use grey_box::laws::{Law, Track};
use grey_box::recording::Recording as Rows;
use grey_box::recording_set;
use host_sim::rehearsal::Rehearsals;
use host_sim::report::Provenance;
use host_sim::scenario::Scenario;
use pyo3::prelude::*;
use serde::Serialize;

use crate::errors::{of_rig, unusable};
use crate::recording::Recording;
use crate::rig::Rig;

fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string_pretty(value).map_err(unusable)
}

/// The recordings, which have every signal that the rig names: those of arrays may not.
fn rows(rig: &Rig, recordings: &[PyRef<'_, Recording>]) -> PyResult<Vec<Rows>> {
    let checked = recordings.iter().map(|one| {
        has_signals_of(rig, &one.inner)?;
        Ok(one.inner.clone())
    });
    checked.collect()
}

fn has_signals_of(rig: &Rig, recording: &Rows) -> PyResult<()> {
    let mut named = rig.inner.signals.by_name.keys();
    let lacking = named.find(|name| *name != "t" && recording.signal(name).is_none());
    lacking.map_or(Ok(()), |name| {
        let has: Vec<&str> = recording.signals.keys().map(String::as_str).collect();
        Err(unusable(format!(
            "{}: {name}: the rig's [signals] name it and the recording has {}, expected every signal of the rig",
            recording.name,
            has.join(", ")
        )))
    })
}

/// The laws that a rig describes and that its recordings drive.
fn laws(rig: &grey_box::rig::Rig) -> PyResult<Vec<Law>> {
    let laws = Law::of(rig, &|signal| rig.signals.contains(signal));
    if laws.is_empty() {
        return Err(unusable("the rig's signals drive no law that it describes"));
    }
    Ok(laws)
}

/// What a recording is worth: JSON, and the text that the program shows.
#[pyfunction]
pub fn inspect(py: Python<'_>, rig: &Rig, recording: &Recording) -> PyResult<(String, String)> {
    has_signals_of(rig, &recording.inner)?;
    let inspection = py.detach(|| diagnosis::inspect::inspect(&rig.inner, &recording.inner));
    Ok((json(&inspection)?, inspection.to_string()))
}

/// Where a rig as given and recordings part, law by law: JSON, and text.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    rig: &Rig,
    recordings: Vec<PyRef<'_, Recording>>,
) -> PyResult<(String, String)> {
    let (laws, recordings) = (laws(&rig.inner)?, rows(rig, &recordings)?);
    let compared = py.detach(|| {
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let each = laws
            .iter()
            .map(|law| compare_law(*law, &rig.inner, &tracks));
        each.collect::<Result<Vec<_>, _>>()
    });
    let compared = compared.map_err(unusable)?;
    let texts: Vec<String> = compared.iter().map(ToString::to_string).collect();
    let text = format!("{}\n{}", texts.join("\n"), headline(&rig.inner, &compared));
    Ok((json(&compared)?, text))
}

/// Numbers of a rig fitted to recordings: JSON of the laws, text, and the rig with them.
#[pyfunction]
pub fn fit(
    py: Python<'_>,
    rig: &Rig,
    train: Vec<PyRef<'_, Recording>>,
    held_out: Vec<PyRef<'_, Recording>>,
    free: Vec<String>,
) -> PyResult<(String, String, Rig)> {
    let requests = free.iter().map(|text| FreeRequest::parse(text));
    let requests = requests.collect::<Result<Vec<_>, _>>().map_err(unusable)?;
    let (given, train, held_out) = (&rig.inner, rows(rig, &train)?, rows(rig, &held_out)?);
    let fits = py.detach(|| fits(given, train, held_out, &requests));
    let fits = fits?;
    let texts: Vec<String> = fits.iter().map(ToString::to_string).collect();
    let (inner, _) = improved_rig(given, &fits);
    let name = rig.name.clone();
    Ok((json(&fits)?, texts.join("\n"), Rig { inner, name }))
}

fn fits(
    given: &grey_box::rig::Rig,
    train: Vec<Rows>,
    held_out: Vec<Rows>,
    requests: &[FreeRequest],
) -> PyResult<Vec<LawFit>> {
    let rig = if requests.is_empty() {
        with_built_in_priors(given)
    } else {
        given.clone()
    };
    let (train, held_out) = (
        recording_set::sorted(train),
        recording_set::sorted(held_out),
    );
    let tracks: Vec<Track<'_>> = train.iter().map(Track::new).collect();
    let held: Vec<Track<'_>> = held_out.iter().map(Track::new).collect();
    let laws = laws(&rig)?;
    let free = free_parameters(&rig, &laws, &tracks, requests).map_err(unusable)?;
    let tasks = laws
        .into_iter()
        .zip(free)
        .filter(|(_, free)| !free.is_empty());
    let fits = tasks.map(|(law, free)| {
        let task = LawTask {
            law,
            given,
            rig: &rig,
            train: &tracks,
            held_out: &held,
            free,
        };
        fit_law(&task, &|_| ()).map_err(unusable)
    });
    fits.collect()
}

/// A verdict with what it stands on.
#[pyclass(frozen, module = "pneuma")]
pub struct Diagnosis {
    inner: diagnosis::diagnose::Diagnosis,
    given: Rig,
}

#[pymethods]
impl Diagnosis {
    /// The verdict, the very JSON of `pneuma diagnose --json`.
    #[getter]
    fn json(&self) -> PyResult<String> {
        json(&self.inner.verdict)
    }

    /// What the program shows: pairs of label and line.
    #[getter]
    fn lines(&self) -> Vec<(String, String)> {
        let lines = diagnosis::diagnose::summary::five_lines(&self.inner).into_iter();
        lines
            .map(|(label, line)| (label.to_string(), line.to_string()))
            .collect()
    }

    /// The rig with refitted numbers and named effects.
    #[getter]
    fn improved_rig(&self) -> Rig {
        Rig {
            inner: self.inner.improved_rig.clone(),
            name: self.given.name.clone(),
        }
    }

    /// The report, a page of HTML.
    fn report(&self, title: &str) -> String {
        let how = Provenance::new("pneuma.diagnose").fact("version", env!("CARGO_PKG_VERSION"));
        host_sim::charts::diagnosis_page(title, &self.given.inner, &self.inner, how).to_html()
    }
}

/// Says what physics a model lacks. `progress` is called with the name of each stage; Ctrl-C ends
/// the work at the next one.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    rig: &Rig,
    train: Vec<PyRef<'_, Recording>>,
    held_out: Vec<PyRef<'_, Recording>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Diagnosis> {
    let (given, train, held_out) = (rig.clone(), rows(rig, &train)?, rows(rig, &held_out)?);
    let stopped: Mutex<Option<PyErr>> = Mutex::new(None);
    let tell = |stage: &str| {
        let said = Python::attach(|py| {
            py.check_signals()?;
            if let Some(progress) = &progress {
                progress.call1(py, (stage,))?;
            }
            Ok::<_, PyErr>(())
        });
        if let Err(cause) = said {
            if let Ok(mut stopped) = stopped.lock() {
                stopped.get_or_insert(cause);
            }
            // The work knows no end but its own: it is unwound, without a word of a panic.
            resume_unwind(Box::new(()));
        }
    };
    let work = || {
        let held_out = || Ok::<_, std::convert::Infallible>(held_out);
        let Ok(diagnosis) =
            diagnosis::diagnose::diagnose(&given.inner, train, held_out, &Rehearsals::all(), &tell);
        diagnosis
    };
    let done = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    if let Some(cause) = stopped.into_inner().ok().flatten() {
        return Err(cause);
    }
    match done {
        Ok(inner) => Ok(Diagnosis { inner, given }),
        Err(panic) => resume_unwind(panic),
    }
}

/// Columns by name, and a note.
type Columns = (Vec<(String, Vec<f64>)>, Option<String>);

/// A scenario to a recording: columns by name, in the rig's units.
#[pyfunction]
pub fn simulate(py: Python<'_>, path: PathBuf) -> PyResult<Columns> {
    let scenario = Scenario::read(&path).map_err(of_rig)?;
    let simulation = py
        .detach(|| host_sim::simulate::simulate(&scenario))
        .map_err(of_rig)?;
    let table = host_sim::simulate::recorded(&scenario, &simulation).map_err(of_rig)?;
    let columns = table.names.into_iter().zip(table.columns).collect();
    Ok((columns, simulation.note()))
}

/// A bench experiment: JSON, text, and the rig with its numbers.
#[pyfunction]
pub fn identify(
    py: Python<'_>,
    part: &str,
    rig: &Rig,
    recordings: Vec<PyRef<'_, Recording>>,
) -> PyResult<(String, String, Rig)> {
    let experiment = Experiment::named(part).ok_or_else(|| {
        let names = Experiment::ALL.map(|(name, _)| name).join(", ");
        unusable(format!(
            "there is no experiment {part:?}, expected one of {names}"
        ))
    })?;
    let listed = rows(rig, &recordings)?;
    if experiment == Experiment::ValveFlow && !Experiment::is_of_bench(&rig.inner, &listed) {
        return valve_flow(py, rig, recordings);
    }
    let outcome = py.detach(|| {
        let tracks: Vec<Track<'_>> = listed.iter().map(Track::new).collect();
        experiment.evaluate(&rig.inner, &tracks)
    });
    let outcome = outcome.map_err(unusable)?;
    let inner = outcome.applied(&rig.inner);
    let name = rig.name.clone();
    Ok((json(&outcome)?, outcome.to_string(), Rig { inner, name }))
}

/// Null, areas and dead volumes of a valve and its axis: JSON, and text.
#[pyfunction]
pub fn valve_flow(
    py: Python<'_>,
    rig: &Rig,
    recordings: Vec<PyRef<'_, Recording>>,
) -> PyResult<(String, String, Rig)> {
    let recordings = rows(rig, &recordings)?;
    let measured = py.detach(|| {
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        diagnosis::valve_flow::measure(&rig.inner, &tracks)
    });
    let measured = measured.map_err(unusable)?;
    let inner = measured.applied(&rig.inner);
    let name = rig.name.clone();
    Ok((json(&measured)?, measured.to_string(), Rig { inner, name }))
}
