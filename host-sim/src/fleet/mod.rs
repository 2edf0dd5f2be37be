//! A fleet of axes that record every night: which one changes, since when, in which physics.
//!
//! ```text
//! manifest -> plan -> jobs (reference, then nights, then verdicts) -> trends -> page
//! ```
//!
//! | file | what |
//! |---|---|
//! | `manifest` | which axes there are, their rigs and recordings |
//! | `plan` | the jobs, each named by what it works on |
//! | `watched` | the quantities that are followed, and from which change on each matters |
//! | `work` | one job: a fit of an axis as it was, of one night, or a verdict on the latest |
//! | `store` | results, one file a job: there whole or not at all |
//! | `series` | the results of an axis' nights by quantity, without what its whole group does |
//! | `change` | whether a series changed, since when and by how much |
//! | `summary` | what is said of each axis, the most pressing first |
//! | `table` | all estimates as one Parquet table |
//! | `page` | the report |
//! | `scheduler` | the same work for a scheduler that exists |
//!
//! The rig's numbers are common to all nights of an axis: they are fitted once, to the nights that are
//! its healthy reference. Of each later night only the watched quantities are fitted, from there. So a
//! night costs a second, and what changes slowly is seen over many nights long before one shows it.

pub mod change;
pub mod manifest;
pub mod page;
pub mod plan;
pub mod scheduler;
pub mod series;
pub mod store;
pub mod summary;
pub mod table;
pub mod watched;
pub mod work;
