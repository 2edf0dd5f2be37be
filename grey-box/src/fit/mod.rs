//! Fitting parameters to data.
//!
//! - [`normal_equations`]: what a problem adds its rows to
//! - [`free_parameter`]: a number of a rig that a fit moves
//! - [`law_problem`]: a law driven by recordings as such a problem
//! - [`both_ways`]: a recording with an effect and without it
//! - [`own_noise`]: such a problem in units of the noise that each model makes of its inputs
//! - [`presence`]: an effect that is there for a part of the time
//! - [`levenberg_marquardt`]: bounded least squares with priors
//! - [`compass`]: a search by values, where residuals are not smooth
//! - [`uncertainty`]: what the data say about the parameters, and what they leave open

pub mod both_ways;
pub mod compass;
pub mod free_parameter;
pub mod law_problem;
pub mod levenberg_marquardt;
pub mod normal_equations;
pub mod own_noise;
pub mod presence;
pub mod uncertainty;

pub use levenberg_marquardt::{
    Fit, FitError, LeastSquares, NoiseVariance, Options, Parameter, Prior, Reason, solve,
};
pub use normal_equations::{NormalEquations, ResidualSums, RowWeighting};
pub use presence::Presence;
