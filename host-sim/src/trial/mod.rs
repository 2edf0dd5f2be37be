//! The trial on concealed data: rigs drawn by a generator that shares no code
//! with the model, their truths sealed, diagnosed from files, opened and judged,
//! everything published, misses included.
//!
//! | file | what |
//! |---|---|
//! | `plan` | which cases, balanced over what may be missing and how it is concealed |
//! | `digest` | seeds, salts and hashes |
//! | `seal` | the hash of a truth before, the truth after |
//! | `refit` | the honest refit of ordinary numbers: what any effect must beat |
//! | `masking` | that refit put into the rig file, and how much it hides |
//! | `materiality` | truth by ablation |
//! | `said` | what a tool said |
//! | `judge` | the rules |
//! | `run` | one case from plan to judgement |
//! | `on_chip` | the firmware's control of the true plant, before and after |
//! | `rate` | how often out of how many, with its interval |
//! | `others` | other tools' verdicts on the same cases |
//! | `score` | all cases summed up, held against the marks |
//! | `book` | the scorecard's file: kept valid after every case, gone on with later |
//! | `page`, `markdown` | the scorecard for people |

pub mod book;
mod digest;
pub mod drawn_axis;
pub mod equation;
pub mod judge;
pub mod markdown;
pub mod masking;
pub mod materiality;
pub mod on_chip;
pub mod others;
pub mod page;
pub mod plan;
pub mod rate;
pub mod refit;
pub mod run;
pub mod said;
pub mod score;
pub mod seal;

pub use book::Scorecard;
pub use plan::{Setting, plan};
pub use run::{CaseResult, TrialError, run, seal};
