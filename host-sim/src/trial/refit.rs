//! The honest refit: the ordinary numbers of a rig file fitted to recordings,
//! with no effect, and what the model then misses of the held-out ones.
//!
//! The laws are those of the rig with the loop cut at the recorded signals
//! (chambers driven by motion and command, forces on the carriage by pressures
//! and motion): no chaos of stick and slip makes two runs differ.

use crate::laws::{Law, Track};
use crate::recording::Recording;
use crate::rig::Rig;
use diagnosis::identify::{LawTask, fit_law, free_parameters, improved_rig, residuals_as_given};
use diagnosis::imprecise::with_built_in_priors;
use serde::{Deserialize, Serialize};
use truth_plant::Case;

/// A case as the tool sees it: rig and recordings read from their files' text.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The rig as given.
    pub rig: Rig,
    /// Training recordings.
    pub train: Vec<Recording>,
    /// Held-out recordings.
    pub held_out: Vec<Recording>,
}

impl Seen {
    /// Reads the texts of a case. The error is one line.
    pub fn of(case: &Case) -> Result<Self, String> {
        let rig = Rig::parse(&case.rig_toml, "rig.toml").map_err(|error| error.to_string())?;
        let read = |files: &[(String, String)]| -> Result<Vec<Recording>, String> {
            let one = |(name, text): &(String, String)| {
                let size = Some(text.len() as u64);
                Recording::read_from(text.as_bytes(), name, size, &rig.signals)
                    .map_err(|error| error.to_string())
            };
            files.iter().map(one).collect()
        };
        Ok(Self {
            train: read(&case.train)?,
            held_out: read(&case.held_out)?,
            rig,
        })
    }
}

/// What a model misses of one output of a law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Misfit {
    /// Law and output.
    pub output: String,
    /// Mean square of the residuals, SI squared.
    pub mean_square: f64,
    /// Residuals that the energy rests on as if they were independent.
    pub independent: f64,
}

/// A rig refitted.
#[derive(Clone, Debug)]
pub struct Refit {
    /// With the fitted numbers.
    pub rig: Rig,
    /// What it misses of the training recordings.
    pub train: Vec<Misfit>,
    /// What it misses of the held-out recordings.
    pub held_out: Vec<Misfit>,
}

/// Fits a rig to the training recordings of a case. The error is one line.
pub fn refit(seen: &Seen) -> Result<Refit, String> {
    let tracks: Vec<Track<'_>> = seen.train.iter().map(Track::new).collect();
    let known = with_built_in_priors(&seen.rig);
    let laws = laws(&known);
    let free = free_parameters(&known, &laws, &tracks, &[])?;
    let mut fits = Vec::new();
    for (law, free) in laws.into_iter().zip(free) {
        if free.is_empty() {
            continue;
        }
        let task = LawTask {
            law,
            given: &seen.rig,
            rig: &known,
            train: &tracks,
            held_out: &[],
            free,
        };
        fits.push(fit_law(&task, &|_| ())?);
    }
    let (rig, _) = improved_rig(&seen.rig, &fits);
    Ok(Refit {
        train: misfits(&rig, &seen.train)?,
        held_out: misfits(&rig, &seen.held_out)?,
        rig,
    })
}

/// The laws in the form that their parameters are estimated by.
fn laws(rig: &Rig) -> Vec<Law> {
    let has = |signal: &str| rig.signals.contains(signal);
    Law::of(rig, &has)
        .into_iter()
        .map(Law::searched_by)
        .collect()
}

/// What a rig with its numbers as they are misses of recordings; initial states
/// are estimated. The error is one line.
pub fn misfits(rig: &Rig, recordings: &[Recording]) -> Result<Vec<Misfit>, String> {
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let mut all = Vec::new();
    for law in laws(rig) {
        let residuals = residuals_as_given(law, rig, &tracks, &[])
            .ok_or_else(|| format!("{}: no finite prediction after the refit", law.title()))?;
        for (place, (columns, output)) in residuals.iter().zip(law.outputs(rig)).enumerate() {
            let finite = columns
                .iter()
                .flatten()
                .filter(|residual| residual.is_finite());
            let (square, count) = finite.fold((0.0, 0_usize), |(square, count), residual| {
                (square + residual * residual, count + 1)
            });
            all.push(Misfit {
                output: format!("{} {} {}", law.title(), output.signal, place + 1),
                mean_square: square / count.max(1) as f64,
                independent: count as f64 / correlated(columns),
            });
        }
    }
    Ok(all)
}

/// The longest lag that is looked at, rows.
const LONGEST_LAG: usize = 300;
/// Below this a correlation is noise.
const UNCORRELATED: f64 = 0.05;

/// How many residuals count as one for their energy: of a normal process the
/// energy of n varies by sqrt(2/n (1 + 2 sum rho^2)) (Bartlett 1946).
fn correlated(columns: &[Vec<f64>]) -> f64 {
    let correlation = |lag: usize| {
        let pairs = columns
            .iter()
            .flat_map(|column| column.iter().zip(column.iter().skip(lag)));
        let finite = pairs.filter(|(a, b)| a.is_finite() && b.is_finite());
        let (product, size) = finite.fold((0.0, 0.0), |(product, size), (a, b)| {
            (product + a * b, size + 0.5 * (a * a + b * b))
        });
        if size > 0.0 { product / size } else { 0.0 }
    };
    let squares: f64 = (1..LONGEST_LAG)
        .map(correlation)
        .take_while(|rho| *rho > UNCORRELATED)
        .map(|rho| rho * rho)
        .sum();
    1.0 + 2.0 * squares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Noise;

    #[test]
    fn val_correlated_residuals_count_for_fewer() {
        let mut noise = Noise::new(1, 1);
        let white: Vec<f64> = (0..20_000).map(|_| noise.normal()).collect();
        // x' = a x + e has rho = a^lag: 1 + 2 a^2 / (1 - a^2) in all.
        let mut state = 0.0;
        let autoregressive = white.iter().map(|e| {
            state = 0.9 * state + e;
            state
        });
        let sluggish: Vec<f64> = autoregressive.collect();
        let expected = 1.0 + 2.0 * 0.81 / 0.19;
        assert!((correlated(&[white]) - 1.0).abs() < 0.05);
        assert!((correlated(&[sluggish]) / expected - 1.0).abs() < 0.15);
        // Events with nothing between them stand alone.
        let events = [1.0, f64::NAN, f64::NAN, -2.0, f64::NAN, 1.0].to_vec();
        assert!((correlated(&[events]) - 1.0).abs() < 1e-12);
    }
}
