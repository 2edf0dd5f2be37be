//! Recordings in which nothing was written for a while.
//!
//! What a valve was commanded in a gap is not known, and with it neither is the state of the
//! gas after it: a recording with a gap is two recordings. A vessel or a drive whose inputs
//! are slow loses nothing by one, and is left whole.

use crate::recording::Recording;
use crate::rig::Rig;
use std::ops::Range;

/// A gap longer than this is too long for the command to be taken as held, s: a spool and a
/// chamber follow a step within some 20 ms.
const LONGEST_HOLD_S: f64 = 0.02;
/// ... and it is one only if it is that much longer than the usual step.
const STEPS: f64 = 5.0;
/// A part shorter than this says nothing of its own, s.
const SHORTEST_PART_S: f64 = 0.5;

/// The recordings in parts between gaps, and what is to be said of that.
pub(crate) fn parted(rig: &Rig, recordings: Vec<Recording>) -> (Vec<Recording>, Vec<String>) {
    if rig.valve.is_none() {
        return (recordings, Vec::new());
    }
    let (mut parts, mut notes) = (Vec::new(), Vec::new());
    for recording in recordings {
        let rows = rows_between_gaps(&recording.time_s);
        if rows.len() < 2 {
            parts.push(recording);
            continue;
        }
        notes.push(note(&recording, &rows));
        parts.extend(long_parts(&recording, &rows));
    }
    (parts, notes)
}

/// The parts that are long enough; the longest at least.
fn long_parts(recording: &Recording, rows: &[Range<usize>]) -> Vec<Recording> {
    let length_s =
        |rows: &Range<usize>| recording.time_s[rows.end - 1] - recording.time_s[rows.start];
    let longest_s = rows.iter().map(length_s).fold(0.0, f64::max);
    let long = rows
        .iter()
        .filter(|rows| length_s(rows) >= longest_s.min(SHORTEST_PART_S));
    long.map(|rows| {
        let mut part = recording.part(rows.clone());
        part.name = format!(
            "{} from {:.3} s",
            recording.name, recording.time_s[rows.start]
        );
        part
    })
    .collect()
}

fn note(recording: &Recording, rows: &[Range<usize>]) -> String {
    let gap = |pair: &[Range<usize>]| {
        let (last, next) = (pair[0].end - 1, pair[1].start);
        let time_s = &recording.time_s;
        format!("{:.3} to {:.3} s", time_s[last], time_s[next])
    };
    let gaps: Vec<String> = rows.windows(2).map(gap).collect();
    format!(
        "{}: gap in the recording from {}; the parts between the gaps are used as separate recordings, parts shorter than {SHORTEST_PART_S} s are not used",
        recording.name,
        gaps.join(", ")
    )
}

fn rows_between_gaps(time_s: &[f64]) -> Vec<Range<usize>> {
    let longest_s = LONGEST_HOLD_S.max(STEPS * crate::laws::median_step_s(time_s));
    let after_gap = |&row: &usize| time_s[row] - time_s[row - 1] > longest_s;
    let starts: Vec<usize> = (1..time_s.len()).filter(after_gap).collect();
    let from = std::iter::once(0).chain(starts.iter().copied());
    let to = starts.iter().copied().chain([time_s.len()]);
    from.zip(to).map(|(from, to)| from..to).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use truth_plant::{Kind, Request};

    fn without(recording: &Recording, hole: Range<usize>) -> Recording {
        let kept = |column: &[f64]| [&column[..hole.start], &column[hole.end..]].concat();
        let signals = recording.signals.iter();
        Recording::from_signals(
            "holed",
            kept(&recording.time_s),
            signals
                .map(|(name, column)| (name.clone(), kept(column)))
                .collect(),
        )
    }

    #[test]
    fn prop_a_recording_with_a_gap_is_two() {
        let (mut rig, recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let rows = recordings[0].len();
        let holed = without(&recordings[0], 1000..1300);
        let (parts, notes) = parted(&rig, vec![holed.clone(), recordings[1].clone()]);
        let lengths: Vec<usize> = parts.iter().map(Recording::len).collect();
        assert_eq!(lengths, [1000, rows - 1300, recordings[1].len()]);
        assert!(notes[0].contains("from 0.999 to 1.300 s"), "{notes:?}");
        assert_eq!(notes.len(), 1);
        rig.valve = None;
        assert_eq!(parted(&rig, vec![holed.clone()]).0[0].len(), holed.len());
    }
}
