//! When a pressure's gauge goes wrong within a recording: it leaps.
//!
//! Gas does not. From one row to the next a pressure changes by what valve and piston do, and so it
//! does before and after; a gauge that is off from some moment on takes one step that no row
//! near by repeats. That tells *when* better than what a model misses: windows that each begin
//! from what was measured show an offset only where it begins.
//!
//! Limits: an offset that creeps in leaps nowhere, nor does one of less than some seven times
//! the noise.

use crate::estimate::sensor_noise;
use crate::laws::{Track, white_noise};
use crate::model::Side;
use crate::rig::Rig;

/// Rows on either side that must not take such a step.
const NEAR: usize = 3;
/// A leap is larger than those by so many deviations of a step of two noisy rows: one row of
/// ten million by chance.
const LEAP_DEVIATIONS: f64 = 5.0;
/// More leaps than these in one recording are something else.
const MOST_LEAPS: usize = 8;

/// The effect that such a gauge is.
pub(crate) const OFFSET: &str = "pressure-sensor-offset";

/// The spans of each gauge that leaps.
pub(crate) fn of_gauges(rig: &Rig, tracks: &[Track<'_>]) -> Vec<Vec<Vec<(f64, f64)>>> {
    let sides = Side::BOTH.into_iter();
    sides
        .filter_map(|side| between(rig, tracks, side))
        .collect()
}

/// From each leap of a pressure to the next, by recording; `None` where it leaps in none.
fn between(rig: &Rig, tracks: &[Track<'_>], side: Side) -> Option<Vec<Vec<(f64, f64)>>> {
    let of_track = |track: &Track<'_>| {
        let pressure_pa = track.recording.signal(side.pressure_signal())?;
        let noise_pa = sensor_noise::declared(rig, side.pressure_signal());
        let noise_pa = noise_pa.unwrap_or_else(|| white_noise(pressure_pa));
        let leaps = leaps(pressure_pa, noise_pa);
        let at = |row: &usize| track.recording.time_s[*row];
        let span = |pair: &[usize]| (at(&pair[0]), pair.get(1).map_or(f64::INFINITY, at));
        Some(leaps.chunks(2).map(span).collect::<Vec<_>>())
    };
    let spans_s: Vec<Vec<(f64, f64)>> = tracks.iter().map(of_track).collect::<Option<_>>()?;
    spans_s
        .iter()
        .any(|spans_s| !spans_s.is_empty())
        .then_some(spans_s)
}

/// From which size on a leap is told from noise.
pub(crate) fn least_leap_pa(noise_pa: f64) -> f64 {
    LEAP_DEVIATIONS * std::f64::consts::SQRT_2 * noise_pa
}

/// The rows that a pressure has leapt to; none where it leaps too often.
fn leaps(pressure_pa: &[f64], noise_pa: f64) -> Vec<usize> {
    let steps: Vec<f64> = pressure_pa
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let least_pa = least_leap_pa(noise_pa);
    let is_leap = |step: &usize| {
        let near = steps.iter().enumerate();
        let near = near.skip(step.saturating_sub(NEAR)).take(2 * NEAR + 1);
        let others = near.filter(|(other, _)| other != step);
        let usual_pa = others.fold(0.0_f64, |most, (_, step)| most.max(*step));
        // A single wrong row steps there and back.
        steps[*step] - usual_pa > least_pa && usual_pa < 0.5 * steps[*step]
    };
    let inner = NEAR..steps.len().saturating_sub(NEAR);
    let found: Vec<usize> = inner.filter(is_leap).map(|step| step + 1).collect();
    if found.len() > MOST_LEAPS {
        return Vec::new();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::recording::Recording;
    use truth_plant::{Kind, Request};

    fn recorded(change: impl Fn(&mut [f64])) -> (Rig, Vec<Recording>) {
        let (rig, mut recordings) = drawn::read(&Request::new(1, Kind::Nothing).with_noise(1.0));
        for recording in &mut recordings {
            change(recording.signals.get_mut("p_a").unwrap());
        }
        (rig, recordings)
    }

    fn between_leaps(rig: &Rig, recordings: &[Recording]) -> Option<Vec<Vec<(f64, f64)>>> {
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        between(rig, &tracks, Side::A)
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_gas_does_not_leap() {
        for seed in 1..5 {
            let (rig, recordings) = drawn::read(&Request::new(seed, Kind::Nothing).with_noise(1.0));
            assert_eq!(between_leaps(&rig, &recordings), None, "seed {seed}");
        }
    }

    #[test]
    fn val_a_gauge_that_is_off_between_two_rows_is_so_to_the_row() {
        let (from, to) = (1000, 2500);
        let off = |pressure_pa: &mut [f64]| {
            pressure_pa[from..to].iter_mut().for_each(|pa| *pa -= 4e3);
        };
        let (rig, recordings) = recorded(off);
        let found = between_leaps(&rig, &recordings).unwrap();
        for (recording, spans_s) in recordings.iter().zip(found) {
            assert_eq!(spans_s, [(recording.time_s[from], recording.time_s[to])]);
        }
    }

    #[test]
    fn prop_a_single_wrong_row_is_no_leap() {
        let (rig, recordings) = recorded(|pressure_pa| pressure_pa[1500] += 2e4);
        assert_eq!(between_leaps(&rig, &recordings), None);
    }
}
