//! Recordings with one more draw of their noise.

use std::collections::BTreeMap;

use crate::laws::{Motion, Track};
use crate::recording::Recording;

/// By signal what a law leaves of a recording: told by its model less recorded, SI; what is no
/// number was not told.
pub(crate) type Doubts = BTreeMap<String, Vec<f64>>;

/// Recordings with one more draw of noise, and the motion that they show: to find that takes as long
/// as to run a model over them.
#[derive(Clone, Default)]
pub(crate) struct Shaken {
    recordings: Vec<Recording>,
    motions: Vec<Option<Motion>>,
    /// As in [`Track::balanced_over`].
    balanced_over_s: Vec<f64>,
}

impl Shaken {
    /// Of recordings, by those that were not shaken.
    pub fn new(recordings: Vec<Recording>, still: &[Track<'_>]) -> Self {
        let motion = |recording: &Recording| Track::new(recording).motion;
        Self {
            motions: recordings.iter().map(motion).collect(),
            balanced_over_s: still.iter().map(Track::balanced_over_s).collect(),
            recordings,
        }
    }

    /// Ready to drive laws.
    pub fn tracks(&self) -> Vec<Track<'_>> {
        let recordings = self.recordings.iter().zip(&self.motions);
        let recordings = recordings.zip(&self.balanced_over_s);
        recordings
            .map(|((recording, motion), half_width_s)| {
                Track::with_motion(recording, motion.clone()).balanced_over(*half_width_s)
            })
            .collect()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.recordings.is_empty()
    }

    /// The same with one signal as it was recorded.
    pub fn but(&self, signal: &str, still: &[Track<'_>]) -> Self {
        let as_recorded = |(shaken, still): (&Recording, &Track<'_>)| {
            let mut mixed = shaken.clone();
            let columns = (
                mixed.signals.get_mut(signal),
                still.recording.signal(signal),
            );
            if let (Some(column), Some(recorded)) = columns {
                column.copy_from_slice(recorded);
            }
            mixed
        };
        let pairs = self.recordings.iter().zip(still);
        Self::new(pairs.map(as_recorded).collect(), still)
    }
}

/// What each model's own noise is made of; nothing where it has none but what the outputs have.
#[derive(Clone, Default)]
pub(crate) struct Draws {
    /// The recordings with one more draw of all their noise.
    pub(crate) of_all: Shaken,
    /// The same with that of the pressures alone ...
    pub(crate) of_pressures: Shaken,
    /// ... and the noise of each output without theirs, SI.
    pub(crate) beside_pressures: Vec<f64>,
}
