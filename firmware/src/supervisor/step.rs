//! What a check sees: a sample and the one before it.

use crate::codes::AdcCodes;
use model_core::controller::Measurements;

/// What the sensors show at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Number of the tick.
    pub tick: u32,
    /// The codes on the scales of the link.
    pub codes: &'a AdcCodes,
    /// What they mean.
    pub measured: &'a Measurements<f32>,
}

/// From one sample to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub(super) now: &'a Measurements<f32>,
    pub(super) before: &'a Measurements<f32>,
    pub(super) codes_now: &'a AdcCodes,
    pub(super) codes_before: &'a AdcCodes,
    /// Time between them, s.
    pub(super) elapsed_s: f32,
    /// No sample is missing between them.
    pub(super) is_next: bool,
    /// Number of the tick.
    pub(super) tick: u32,
    /// The spool while what arrived between them passed it, as far as known, V.
    pub(super) spool_v: f32,
}
