//! Plant and controller taking turns.
//!
//! | file | what |
//! |---|---|
//! | `drive` | who answers a sample: the control task here, or one at the end of a byte stream |
//! | `run` | a motion run through: the rows, and how they are judged |
//! | `knowledge` | what an engineer knows of a rig: its parameters, wrong within their uncertainty |
//! | `score` | the cases with their marks, over many seeds |

mod drive;
mod knowledge;
mod run;
mod score;

pub use drive::{Drive, DriveError, HostController, control_task, controller};
pub use knowledge::wrongly_known;
pub use run::{Course, Row, Run, run};
pub use score::{Case, Factory, Measure, MeasuredCase, Score, ScoreError, run_case, score};
