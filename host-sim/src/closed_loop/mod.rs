//! Plant and controller taking turns.
//!
//! | file | what |
//! |---|---|
//! | `drive` | who answers a sample; the control task of the firmware, compiled for the host |
//! | `wire` | the link over a byte stream, both ends |
//! | `pid` | the comparison: a PID controller, as usual |
//! | `tune` | the search for its gains |
//! | `run` | a motion run through: its rows |
//! | `foreign` | a plant of another tool in the plant's place |
//! | `judge` | what a run came to, part by part |
//! | `record` | a run as a recording that the rig's signals read |
//! | `transcript` | what went over a link, and its replay |
//! | `score` | the cases with their marks, over many seeds |
//! | `table` | scores as tables |

mod drive;
mod figure;
mod foreign;
mod judge;
mod pid;
mod record;
mod run;
mod score;
pub mod table;
pub mod transcript;
mod tune;
mod wire;

pub use crate::knowledge::wrongly_known;
pub use drive::{Drive, DriveError, HostController, control_task, controller, wired_task};
pub use foreign::{FOREIGN_SIGNALS, ForeignPlant, Told};
pub use judge::{AFTER_MOVE_S, Judged, judge};
pub use pid::{PidController, PidGains};
pub use record::recorded;
pub use run::{Course, Driven, Row, Run, run};
pub use score::{Case, Factory, Measure, MeasuredCase, Score, ScoreError, run_case, score};
pub use tune::{retune_pid, tune_pid};
pub use wire::{RemoteController, Served, serve};
