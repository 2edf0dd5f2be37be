//! What a command that is given more often than it is recorded would leave.
//!
//! Between two rows the model holds the command of the first. A controller that runs faster
//! than the logger gave others, and they are lost: of its noise little shows in the pressures,
//! but a step that falls between two rows is late by a part of a row. How far commands may have
//! been off shows in what a row's command differs from the mean of its neighbours: of a step J
//! between two rows that is J/2 in both.

use super::bench::Bench;
use super::fitted::Fitted;
use crate::estimate::refit::Refit;
use crate::laws::{Law, Track};
use crate::recording::Recording;

/// Deviation of the held command over what a command differs from its neighbours' mean. A
/// logger half as fast as the controller holds J for half a row or not at all: J/sqrt(8) in
/// the mean square, which two rows that are off by 0.5 J/2 each come to. One that is much
/// slower comes to J/sqrt(3), and 0.82.
const LOST: f64 = 0.58;

/// The energy that lost commands would leave after a refit, over what a model misses above
/// the noise.
pub(crate) fn share(bench: &Bench<'_>, model: &Fitted) -> Option<f64> {
    let has_command = bench.law == Law::Chambers && bench.rig.valve.is_some();
    let missed = model.energy_above(&bench.noise);
    if !has_command || missed <= 0.0 {
        return None;
    }
    let recordings: Option<Vec<Recording>> = bench.tracks.iter().map(with_lost_commands).collect();
    let recordings = recordings?;
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let refit = Refit::new(bench, model, bench.noise.clone());
    let left = refit.left_of(&bench.predicted_on(model, &tracks));
    Some(bench.energy(&left) / missed)
}

/// A recording with commands as they may have been.
fn with_lost_commands(track: &Track<'_>) -> Option<Recording> {
    let command = track.recording.signal("u")?;
    let mut changed = track.recording.clone();
    let column = changed.signals.get_mut("u")?;
    for row in 1..command.len().saturating_sub(1) {
        let neighbours = 0.5 * (command[row - 1] + command[row + 1]);
        column[row] += LOST * sign(row) * (command[row] - neighbours);
    }
    Some(changed)
}

/// A sign by chance, the same in every run (Steele's mixing of a counter).
fn sign(row: usize) -> f64 {
    let mixed = (row as u64)
        .wrapping_add(1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    if (mixed ^ (mixed >> 27)) & (1 << 40) == 0 {
        -1.0
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::rig::Rig;
    use crate::search;
    use truth_plant::{Kind, Request, Strength};

    /// Every second row left out of recordings of an axis in which nothing is missing.
    #[test]
    fn prop_what_half_the_commands_leave_is_known_beforehand() {
        let (rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let halved: Vec<Recording> = recordings.iter().map(|one| one.thinned(2)).collect();
        let share = share_of(&rig, &halved);
        assert!((0.3..3.0).contains(&share), "{share}");
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn prop_lost_commands_do_not_explain_a_null_that_drifts() {
        let (rig, recordings) = drawn::off_list(1, Strength::Strong, "null-drift");
        let share = share_of(&rig, &recordings);
        assert!(share < 0.1, "{share}");
    }

    fn share_of(rig: &Rig, recordings: &[Recording]) -> f64 {
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let mut bench = Bench::new(Law::Chambers, rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        bench.learn_noise(&baseline, &[]);
        share(&bench, &baseline).unwrap()
    }
}
