//! What a controller board does, without the board: the control task, its
//! supervision, the frames it speaks. The same code runs on the chip, in QEMU
//! and on the host; only the rooms of `board/`, which the chip's binary adds,
//! know registers.
//!
//! | room | responsibility |
//! |---|---|
//! | [`codes`] | converter codes to SI and back |
//! | [`control_task`] | one pure call a tick: sample in, command out |
//! | [`cost`] | what a tick costs, counted on the chip |
//! | [`experiment`] | a program that the board runs, and the envelope it keeps |
//! | [`fault`] | the fault list |
//! | [`frame`] | COBS frames with a CRC over a byte stream |
//! | [`link`] | the lock-step link between controller and plant |
//! | [`parts`] | converters on a serial bus, one file per part |
//! | [`settings`] | the rig's parameters: judged, kept, transferred |
//! | [`start`] | why a board started, and what it remembers from before |
//! | [`status`] | counters, the status report, what outlives a reset |
//! | [`supervisor`] | states, limits, checks |
//! | [`telemetry`] | what happens at every tick, streamed |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod codes;
pub mod control_task;
pub mod cost;
pub mod crash;
pub mod experiment;
pub mod fault;
pub mod frame;
pub mod link;
pub mod parts;
pub mod sensing;
pub mod settings;
pub mod start;
pub mod status;
pub mod supervisor;
pub mod telemetry;
pub mod tick;
