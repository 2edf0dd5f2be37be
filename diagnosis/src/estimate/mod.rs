//! Models of one law fitted to recordings: what may be free, what noise the outputs have, the
//! fit, and what counts as missed by it.
//!
//! [`Bench`] holds a law, a rig, recordings, and the noise of each output; [`Fitted`]
//! is a model with its numbers and their deviations. [`candidates`] lists the effects that may be
//! put into it, out of the declarations of `grey_box::effects`.

mod bench;
pub(crate) mod between_rows;
pub mod candidates;
pub(crate) mod correlation;
mod cross_validation;
pub(crate) mod draws;
mod edges;
pub(crate) mod fitted;
mod fitting;
pub(crate) mod fold_squares;
pub(crate) mod leaps;
pub(crate) mod misfit;
pub mod noise;
mod own_noise;
mod predictions;
pub(crate) mod refit;
mod scene;
pub(crate) mod sensor_noise;
pub(crate) mod sheet;
pub(crate) mod sliding;
pub(crate) mod swung;
pub(crate) mod wave;

pub use crate::fit::law_problem::Columns;
pub use bench::Bench;
pub use fitted::{Fitted, Set};
pub(crate) use fitting::STEPS_FROM_GIVEN;
