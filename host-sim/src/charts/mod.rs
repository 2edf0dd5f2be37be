//! From findings to pages: the only module that knows both pneumatics and
//! [`crate::report`].
//!
//! * `prediction.rs`: recorded and predicted signals, residuals, what drove them
//! * `locate.rs`: where a misfit sits
//! * `diagnosis.rs`, `fit.rs`, `compare.rs`, `inspection.rs`, `closed_loop.rs`: the
//!   pages of the commands

mod closed_loop;
mod compare;
mod diagnosis;
mod fit;
mod inspection;
mod locate;
mod prediction;

pub use closed_loop::closed_loop_page;
pub use compare::compare_page;
pub use diagnosis::diagnosis_page;
pub use fit::fit_page;
pub use inspection::inspection_page;
pub use locate::{located_misfit, missing_term, needed_input, shade_intervals};
use prediction::worst_recording;
pub use prediction::{CLOSED_DETAIL, Curve, OPEN_DETAIL, prediction_stack};

/// The first letter made large.
fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters
        .next()
        .map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + characters.as_str()
}
