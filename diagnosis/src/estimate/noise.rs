//! The noise floor: what a perfect model would still miss.
//!
//! Two parts, added in energy: the noise of the predicted signal itself, and
//! what the noise of the recorded inputs does to the prediction. The second is
//! found by adding one more draw of that noise to the inputs: what it changes
//! has the energy of what the recorded draw has done. A position predicted over
//! a window from a noisy starting velocity is off by tenths of a millimetre
//! whatever the model; its sensor alone says micrometres.

use super::bench::Bench;
use super::fitted::Fitted;
use crate::estimate::draws::{Doubts, Shaken};
use crate::estimate::sensor_noise::declared;
use crate::fit::own_noise::same_rows;
use crate::laws::Track;
use crate::random::Noise;
use crate::recording::Recording;
use crate::rig::Rig;

/// Seed of the added draw: any; the energy of thousands of rows does not
/// depend on it.
const SEED: u64 = 1;

/// An event of the recorded draw is the one of the added draw that lies within so many rows:
/// noise shifts the row at which a carriage is seen to leave.
const EVENT_REACH: usize = 30;

/// The recordings with one more draw of the noise that their signals have; where something is
/// not understood of these, with that, by recording.
pub(crate) fn shaken(bench: &Bench<'_>, doubts: &[Doubts]) -> Shaken {
    let tracks = bench.tracks.iter().enumerate();
    let with_a_draw = |(number, track): (usize, &Track<'_>)| {
        with_a_draw(bench.rig, track.recording, number, doubts.get(number))
    };
    Shaken::new(tracks.map(with_a_draw).collect(), bench.tracks)
}

/// The noise floor of each output, that of the inputs included as a model carries it on: what it
/// predicts, by output and recording, of the recordings as they are and as they would be with
/// [one more draw](shaken).
pub(crate) fn floor(
    bench: &Bench<'_>,
    model: &Fitted,
    [still, moved]: [&[Vec<Vec<f64>>]; 2],
) -> Vec<f64> {
    let fitted = bench.rig.with_values(&model.shared_values());
    let own = bench.noise_of_outputs(&fitted);
    own.iter()
        .enumerate()
        .map(|(output, &own)| {
            let is_of_events = bench.is_of_events(output);
            let reach = if is_of_events { EVENT_REACH } else { 0 };
            let (mut sum, mut rows) = (0.0, 0_usize);
            for (still, moved) in still[output].iter().zip(&moved[output]) {
                for square in squared_changes(still, moved, reach) {
                    sum += square;
                    rows += 1;
                }
            }
            own.hypot((sum / rows.max(1) as f64).sqrt())
        })
        .collect()
}

/// Squared differences of what is finite in one column and in the same rows of another, within a
/// reach.
fn squared_changes(still: &[f64], moved: &[f64], reach: usize) -> Vec<f64> {
    let told = |column: &[f64]| -> Vec<usize> {
        let rows = column.iter().enumerate();
        let finite = rows.filter(|(_, value)| value.is_finite());
        finite.map(|(row, _)| row).collect()
    };
    let (rows, others) = (told(still), told(moved));
    let pairs = same_rows(&rows, &others, reach).into_iter();
    pairs
        .map(|(row, other)| (moved[others[other]] - still[rows[row]]).powi(2))
        .collect()
}

/// The recording with one more draw of every signal's declared noise; where a law that is
/// understood otherwise leaves more, with that, in which the recorded draw is.
fn with_a_draw(
    rig: &Rig,
    recording: &Recording,
    stream: usize,
    doubts: Option<&Doubts>,
) -> Recording {
    let mut shaken = recording.clone();
    for (place, (name, column)) in shaken.signals.iter_mut().enumerate() {
        let Some(noise) = declared(rig, name) else {
            continue;
        };
        let mut draw = Noise::new(SEED, (place + 100 * stream) as u64);
        let left = doubts.and_then(|doubts| doubts.get(name));
        for (row, value) in column.iter_mut().enumerate() {
            let drawn = noise * draw.normal();
            let left = left.map_or(f64::NAN, |left| left[row]);
            *value += if left.is_finite() { left } else { drawn };
        }
    }
    shaken
}
