//! A loop that swings: at a hold the command goes to and fro, wide open, without
//! an end.
//!
//! It does where the axis answers later than the controller knows: a pressure
//! sensor that lags, tubes that are not in the settings, gains that are too high.
//! A sound hold moves the command by millivolts, and what disturbs it by a few
//! swings that die away.
//!
//! The commonest cause is a gauge that lags: the observer takes its lag for an error of the model.
//! After some swings the observer therefore follows the pressures more slowly, which holds the
//! axis about lags of several ms; after some more the whole loop becomes slower, in steps, for
//! tubes and dead times that nobody stated; what still swings then is a fault.
//!
//! Limits: swings while the reference moves are not judged, and none that stay
//! within the share of the opening that counts here.

use crate::fault::{Fault, Finding};
use model_core::axis::Axis;
use model_core::reference::Reference;

/// A swing opens the valve by this share of its full opening either way: far beyond the
/// overlap, across which a sound hold may chatter.
const OPEN_SHARE: f32 = 0.5;
/// So many in a row calm the loop: 0.2 s of what a lag of 5 ms makes. A sound loop with twice its
/// payload rings for eight.
const SWINGS_TO_CALM: u8 = 12;
/// So many in a row do not die away: a loop that rings with a damping of 0.02 loses
/// nine tenths of its amplitude over 18 periods. They stop one that was calmed all it can be.
const SWINGS_TO_STOP: u8 = 40;
/// Steps of calming.
const CALMING_STEPS: u8 = 4;
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

/// What swings ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Asked {
    /// A calmer loop.
    Calm,
    /// A shut valve.
    Stop(Finding),
}

impl Swing {
    pub(super) fn new(axis: &Axis<f32>) -> Self {
        let openings_v = axis.valve.supply.openings_v();
        let full_v = openings_v.last().copied().unwrap_or(0.0);
        Self {
            open_v: OPEN_SHARE * full_v * axis.valve.supply.opening_stretch,
        }
    }

    /// Counts the swings of a command, `above_null_v` from the valve's null, at a hold of a loop
    /// that was calmed so many times.
    #[inline]
    pub(super) fn check(
        &self,
        state: &mut SwingState,
        reference: &Reference<f32>,
        above_null_v: f32,
        (dt_s, calmed): (f32, u8),
    ) -> Option<Asked> {
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
        let can_calm = calmed < CALMING_STEPS;
        if can_calm && state.count >= SWINGS_TO_CALM {
            state.count = 0;
            return Some(Asked::Calm);
        }
        let stops = state.count >= SWINGS_TO_STOP;
        stops.then(|| Asked::Stop(Fault::LoopSwings.at(0)))
    }
}
