//! From findings to pages: the only module that knows both pneumatics and
//! [`crate::report`].
//!
//! * `prediction.rs`: recorded and predicted signals, residuals, what drove them
//! * `fit.rs`: the page of `pneuma fit`

mod fit;
mod prediction;

pub use fit::fit_page;
pub use prediction::{Curve, prediction_stack};
