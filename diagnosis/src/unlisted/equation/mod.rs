//! A short equation for what no effect with a name explains.
//!
//! What is missing at one place of the axis (a force, a shift of the command, a supply pressure) is
//! known there in samples, as far as the ordinary parameters cannot take it up. Sought is the
//! equation of fewest terms, each a form over one variable, that explains it:
//!
//! ```text
//! y = sum over terms of  sum over k of  c_k g_k(z; s)  + what the ordinary parameters take up
//! ```
//!
//! The coefficients c are linear; each form has at most one number s of its own (a pitch, a
//! frequency, a path), which is scanned and then refined. Of sets with as many terms the one with
//! the least Bayesian information criterion counts, with as many independent samples as what it
//! leaves allows (Schwarz 1978; autocorrelation as in `fitted`). A further term stays where it takes
//! away half of what those before it leave above the noise. A form within `thresholds::FORMS_AS_WELL` of the best
//! is a rival and is said.
//!
//! Limits: forms of one variable each; a product of two variables is none of them.

mod forms;
mod search;
mod term;
mod text;

pub use forms::{Form, Variable};
pub use search::{Missing, best, without};
pub use term::Term;

/// What is missing, as an equation.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation {
    /// What it gives, and its unit.
    pub quantity: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Its terms, the one that explains most first.
    pub terms: Vec<Term>,
    /// Part of the energy above the noise that it explains of samples that it was not fitted to.
    pub share: f64,
    /// Forms that would do as well as its first term.
    pub rivals: Vec<String>,
}
