//! How often chance alone explains as much as an effect does: a bootstrapped null.
//!
//! In each repetition nothing is missing but what the model with the effect leaves, taken in
//! blocks with signs drawn anew (a wild bootstrap: noise keeps its size and its colour within a
//! block, and tells nothing any more). The best of all effects then explains something by
//! chance; how often that is as much as the named one explains of the recordings is its p-value,
//! with the trying of so many effects counted in.
//!
//! Limits: effects are taken for straight lines at the points where their fits begin, and the
//! named one along its fitted change as well; moments chosen for an effect that comes and goes
//! are not drawn anew.

use crate::estimate::refit::difference;
use crate::estimate::{Bench, Columns, Fitted};
use crate::random::Noise;
use crate::search::prospect::{Directions, Prospects};
use rayon::prelude::*;

/// A p-value is no less than one over so many, and one.
const REPETITIONS: u64 = 99;
/// Blocks of a recording: a quarter of a second of six, much longer than noise remembers.
const BLOCKS: usize = 24;

/// The probability that the best effect beside the model `without` explains by chance as much
/// as the one does that `with` has more.
pub(crate) fn by_chance(bench: &Bench<'_>, without: &Fitted, with: &Fitted) -> f64 {
    let prospects = Prospects::new(bench, without);
    let blocks = Blocks::new(bench, with);
    let repetitions = blocks.signs();
    let along = |directions: &Directions| Explained {
        recorded: directions.energy(prospects.in_common(directions)),
        by_chance: blocks.explained(directions, &prospects, &repetitions),
    };
    let change = bench.predicted_on(with, bench.tracks);
    let fitted = Directions::new(&prospects.refit, vec![prospects.refit.left_of(&change)]);
    let fitted = fitted.map(|directions| along(&directions));
    let of_candidate = |candidate: usize| {
        let set = crate::estimate::fitted::with(&without.set, candidate);
        let directions = prospects.directions(&set, without)?;
        Some((candidate, along(&directions)))
    };
    let others = (0..bench.candidates.len()).into_par_iter();
    let others = others.filter(|candidate| !without.set.contains(candidate));
    let mut tried: Vec<(bool, Explained)> = others
        .filter_map(of_candidate)
        .map(|(candidate, explained)| (with.set.contains(&candidate), explained))
        .collect();
    tried.extend(fitted.map(|explained| (true, explained)));
    let of_named = tried.iter().filter(|(is_named, _)| *is_named);
    let found = of_named.map(|(_, one)| one.recorded).fold(0.0, f64::max);
    let most = |repetition: usize| {
        let all = tried.iter().map(|(_, one)| one.by_chance[repetition]);
        all.fold(0.0, f64::max)
    };
    let as_good = (0..repetitions.len()).filter(|&repetition| most(repetition) >= found);
    (1.0 + as_good.count() as f64) / (1.0 + repetitions.len() as f64)
}

/// Energy that an effect can explain, in units of what is missed.
struct Explained {
    recorded: f64,
    by_chance: Vec<f64>,
}

/// What a model leaves, cut into blocks: of rows, and each event for itself.
struct Blocks<'a> {
    bench: &'a Bench<'a>,
    /// By recording and output.
    left: Vec<Columns>,
    count: usize,
}

impl<'a> Blocks<'a> {
    fn new(bench: &'a Bench<'a>, model: &Fitted) -> Self {
        let predicted = bench.predicted_on(model, bench.tracks);
        let recorded = bench.recorded();
        let pairs = recorded.iter().zip(&predicted);
        let left = pairs.map(|(recorded, predicted)| difference(recorded, predicted));
        let mut blocks = Self {
            bench,
            left: left.collect(),
            count: 0,
        };
        blocks.count = blocks
            .numbered()
            .map(|(block, ..)| block + 1)
            .max()
            .unwrap_or(0);
        blocks
    }

    /// Of everything that is left: its block, recording, output and row.
    fn numbered(&self) -> impl Iterator<Item = (usize, usize, usize, usize)> + '_ {
        let mut event = BLOCKS * self.left.len();
        let columns = self
            .left
            .iter()
            .enumerate()
            .flat_map(|(recording, columns)| {
                let outputs = columns.iter().enumerate();
                outputs.map(move |(output, column)| (recording, output, column))
            });
        let rows = columns.flat_map(|(recording, output, column)| {
            let told = column
                .iter()
                .enumerate()
                .filter(|(_, left)| left.is_finite());
            let count = column.len();
            told.map(move |(row, _)| (recording, output, row, count))
        });
        rows.map(move |(recording, output, row, count)| {
            let block = if self.bench.is_of_events(output) {
                event += 1;
                event - 1
            } else {
                BLOCKS * recording + row * BLOCKS / count
            };
            (block, recording, output, row)
        })
    }

    /// Of every repetition, the sign of each block.
    fn signs(&self) -> Vec<Vec<f64>> {
        let draw = |repetition: u64| {
            let mut noise = Noise::new(repetition, 0);
            (0..self.count).map(|_| noise.normal().signum()).collect()
        };
        (0..REPETITIONS).map(draw).collect()
    }

    /// Energy of each repetition that lies along these directions.
    fn explained(
        &self,
        directions: &Directions,
        prospects: &Prospects<'_>,
        repetitions: &[Vec<f64>],
    ) -> Vec<f64> {
        let changes = directions.changes.iter();
        let in_common: Vec<Vec<f64>> = changes
            .map(|change| self.in_common(change, prospects))
            .collect();
        let of_signs = |signs: &Vec<f64>| {
            let summed = in_common
                .iter()
                .map(|blocks| blocks.iter().zip(signs).map(|(one, sign)| one * sign).sum());
            directions.energy(summed.collect())
        };
        repetitions.iter().map(of_signs).collect()
    }

    /// What a change has in common with each block.
    fn in_common(&self, change: &[Columns], prospects: &Prospects<'_>) -> Vec<f64> {
        let mut blocks = vec![0.0; self.count];
        for (block, recording, output, row) in self.numbered() {
            let product = change[recording][output][row] * self.left[recording][output][row];
            if product.is_finite() {
                blocks[block] += product * prospects.refit.weight(output);
            }
        }
        blocks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::laws::{Law, Track};
    use crate::recording::Recording;
    use crate::search;
    use crate::search::prospect;
    use crate::thresholds::CHANCE_ALONE;
    use truth_plant::{Kind, Request, Strength};

    /// The recordings are the model's own, with white noise: of twenty p-values one is to be
    /// below a twentieth, of six hardly two.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_where_nothing_is_missing_chance_does_as_well() {
        let (rig, recordings) = drawn::read(&Request::new(2, Kind::Nothing));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Chambers, &rig, &tracks);
        let predicted = bench.predicted_on(&baseline, bench.tracks);
        let outputs = bench.law.outputs(&rig);
        let of_seed = |seed: u64| {
            let drawn = recordings.iter().zip(&predicted).enumerate();
            let drawn = drawn.map(|(number, (recording, columns))| {
                let mut drawn = recording.clone();
                for (place, (output, column)) in outputs.iter().zip(columns).enumerate() {
                    let mut noise = Noise::new(seed, (10 * number + place) as u64);
                    let noisy = column
                        .iter()
                        .map(|p| p + bench.noise[place] * noise.normal());
                    drawn.signals.insert(output.signal.into(), noisy.collect());
                }
                drawn
            });
            let drawn: Vec<Recording> = drawn.collect();
            let tracks: Vec<Track<'_>> = drawn.iter().map(Track::new).collect();
            let (bench, baseline) = drawn::searched(Law::Chambers, &rig, &tracks);
            let singles: Vec<(Vec<usize>, &Fitted)> = (0..bench.candidates.len())
                .map(|one| (vec![one], &baseline))
                .collect();
            let least = |one: &Fitted| one.energy_above(&bench.noise);
            let promising = prospect::order(&bench, &baseline, &singles, &least)[0];
            let best = bench.fit(&[promising], Some(&baseline)).unwrap();
            by_chance(&bench, &baseline, &best)
        };
        let values: Vec<f64> = (1..=6).map(of_seed).collect();
        println!("{values:?}");
        let low = values.iter().filter(|&&p| p <= CHANCE_ALONE).count();
        assert!(low <= 1, "{values:?}");
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_chance_does_not_do_what_an_effect_does() {
        let weak = Strength::Weak;
        let (rig, recordings) = drawn::of_kind(Kind::Single, 3, weak, "piston-leakage");
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Chambers, &rig, &tracks);
        let found = search::search(&bench, &baseline, &|_| ()).improved;
        assert!(by_chance(&bench, &baseline, &found) < 0.02);
    }
}
