//! A loop that swings: at a hold the command goes to and fro, wide open, without
//! an end.
//!
//! It does where the axis answers later than the controller knows: a pressure
//! sensor that lags, tubes that are not in the settings, gains that are too high.
//! A sound hold moves the command by millivolts, and what disturbs it by a few
//! swings that die away.
//!
//! Limits: swings while the reference moves are not judged, and none that stay
//! within the share of the opening that counts here.

use crate::fault::{Fault, Finding};
use model_core::axis::Axis;
use model_core::reference::Reference;

/// A swing opens the valve by this share of its full opening either way: far beyond the
/// overlap, across which a sound hold may chatter.
const OPEN_SHARE: f32 = 0.5;
/// So many swings in a row do not die away: a loop that rings with a damping of 0.02 loses
/// nine tenths of its amplitude over 18 periods.
const SWINGS: u8 = 40;
/// A swing that comes later than this belongs to another disturbance, s: the slowest loop of
/// such an axis turns in a third of it.
const APART_S: f32 = 0.5;

/// Limits of a loop that swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Swing {
    open_v: f32,
}

/// The swings so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SwingState {
    count: u8,
    is_above: bool,
    since_s: f32,
}

impl Swing {
    pub(super) fn new(axis: &Axis<f32>) -> Self {
        let openings_v = axis.valve.supply.openings_v();
        let full_v = openings_v.last().copied().unwrap_or(0.0);
        Self {
            open_v: OPEN_SHARE * full_v * axis.valve.supply.opening_stretch,
        }
    }

    /// Counts the swings of a command, `above_null_v` from the valve's null, at a hold.
    #[inline]
    pub(super) fn check(
        &self,
        state: &mut SwingState,
        reference: &Reference<f32>,
        above_null_v: f32,
        dt_s: f32,
    ) -> Option<Finding> {
        let moves = reference.velocity_m_per_s.abs() > 0.0;
        state.since_s += dt_s;
        if moves || state.since_s > APART_S {
            *state = SwingState {
                is_above: state.is_above,
                ..SwingState::default()
            };
        }
        let is_swing = above_null_v.abs() > self.open_v && (above_null_v > 0.0) != state.is_above;
        if !moves && is_swing {
            state.is_above = !state.is_above;
            state.since_s = 0.0;
            state.count = state.count.saturating_add(1);
        }
        (state.count >= SWINGS).then(|| Fault::LoopSwings.at(0))
    }
}
