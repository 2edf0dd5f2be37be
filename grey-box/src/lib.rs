//! The grey box: a rig's file, its recordings, the laws that these drive, and the fit of
//! the laws' numbers to them.
//!
//! From below:
//!
//! - [`text`], [`number`], [`units`], [`random`]: words, figures and units for people; noise that
//!   repeats
//! - [`rig`], [`signals`], [`side`], [`law`]: what is known of an axis
//! - [`effects`]: which physics may be added, one declaration each
//! - [`recording`], [`recording_set`]: tables of measured signals
//! - [`model`], [`gauge`], [`lag`]: a rig's numbers as the laws of `model-core`
//! - [`laws`]: the laws driven by recorded signals, with what they leave
//! - [`fit`]: least squares with priors, derivatives from dual numbers

pub mod effects;
pub mod fit;
pub mod gauge;
pub mod lag;
pub mod law;
pub mod laws;
pub mod model;
pub mod number;
pub mod random;
pub mod recording;
pub mod recording_set;
pub mod rig;
pub mod side;
pub mod signals;
pub mod text;
pub mod units;
