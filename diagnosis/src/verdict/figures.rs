//! How far each model is off, and the numbers of the rig before and after.

use super::{Figures, Fit, FitFigures, Parameter};
use crate::finding::proof::{Run, pooled};
use crate::finding::{Finding, Model, said};
use crate::recording::Recording;
use crate::rig::Rig;
use std::collections::BTreeMap;

/// Figures of every model, training and held out.
pub(super) fn fit(rig: &Rig, laws: &[Finding], train: &[Recording], held_out: &[Recording]) -> Fit {
    let figures = |model: Model| {
        let mut figures = FitFigures::default();
        for law in laws {
            let outputs = law.law.outputs(rig);
            for (index, output) in outputs.iter().enumerate() {
                let name = output.signal.to_owned();
                let trained = &law.train[model as usize];
                let held = law.held_out.get(model as usize);
                let none = Vec::new();
                let held = held.unwrap_or(&none);
                let error = |runs: &[Option<Run>],
                             pick: fn(&Run) -> &Vec<f64>,
                             recordings: &[Recording]| {
                    pooled(runs, recordings, |run| pick(run)[index])
                };
                let normal = |recordings: &[Recording]| spread(recordings, output.signal);
                let put = |figures: &mut Figures, value: Option<f64>, by: Option<f64>| {
                    if let (Some(value), Some(by)) = (value, by) {
                        figures.insert(name.clone(), value / by);
                    }
                };
                put(
                    &mut figures.train,
                    error(trained, |run| &run.horizon, train),
                    normal(train),
                );
                put(
                    &mut figures.held_out,
                    error(held, |run| &run.horizon, held_out),
                    normal(held_out),
                );
                put(
                    &mut figures.free_run_train,
                    error(trained, |run| &run.free_run, train),
                    Some(1.0),
                );
                put(
                    &mut figures.free_run_held_out,
                    error(held, |run| &run.free_run, held_out),
                    Some(1.0),
                );
            }
        }
        figures
    };
    Fit {
        as_given: figures(Model::Given),
        refitted: figures(Model::Refitted),
        improved: figures(Model::Improved),
        noise_floor: noise_floor(rig, laws, train, held_out),
    }
}

fn spread(recordings: &[Recording], signal: &str) -> Option<f64> {
    let all: Vec<f64> = recordings
        .iter()
        .filter_map(|recording| recording.signal(signal))
        .flatten()
        .copied()
        .collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / all.len().max(1) as f64;
    (variance > 0.0).then(|| variance.sqrt())
}

fn noise_floor(
    rig: &Rig,
    laws: &[Finding],
    train: &[Recording],
    held_out: &[Recording],
) -> FitFigures {
    let mut figures = FitFigures::default();
    for law in laws {
        for (output, &noise) in law.law.outputs(rig).iter().zip(&law.floor) {
            let name = output.signal.to_owned();
            if let Some(by) = spread(train, output.signal) {
                figures.train.insert(name.clone(), noise / by);
                figures.free_run_train.insert(name.clone(), noise);
            }
            if let Some(by) = spread(held_out, output.signal) {
                figures.held_out.insert(name.clone(), noise / by);
                figures.free_run_held_out.insert(name, noise);
            }
        }
    }
    figures
}

pub(super) fn parameters(rig: &Rig, laws: &[Finding]) -> BTreeMap<String, Parameter> {
    let mut all = BTreeMap::new();
    for law in laws {
        let (improved, times) = (law.for_the_rig(), said::times_the_noise(law));
        let (before, after) = (law.baseline.shared_values(), improved.shared_values());
        for key in before.keys().chain(after.keys()) {
            let index = improved.place(key);
            let parameter = Parameter {
                given: rig.value(key),
                refitted: before.get(key).copied(),
                improved: after.get(key).copied(),
                std: index
                    .and_then(|index| improved.standard_deviations[index])
                    .map(|std| std * times),
                at_bound: index.is_some_and(|index| improved.at_bound[index]),
            };
            all.insert(key.clone(), parameter);
        }
    }
    all
}
